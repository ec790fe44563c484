"""Folds of signers, labellers on unseen signers, and raters side by side."""

import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.models import LabelledTake
from mimique.models.evaluation.labeller_comparison import (
    check_classes,
    deal_signers,
    is_network,
    kind_of,
    train_labeller,
)
from mimique.models.labellers import LABELLERS, stack_takes
from mimique.models.scores.bootstrap import bootstrap_interval
from mimique.models.scores.rater_scores import MERGING, PER_FRAME, PERSON, TEMPORAL, Rater, count_classes, score_raters
from mimique.models.scores.segment_metrics import pool_f1, segmental_f1

RATE = 50.0


def perform(signer, seed, labels=("neutral", "joy", "neutral", "anger", "neutral")):
    """A take of 1 s a label; each label is one axis, with noise."""
    rng = np.random.default_rng(seed)
    poses = {"neutral": np.zeros(3), "joy": np.eye(3)[0], "anger": np.eye(3)[1], "fear": np.eye(3)[2]}
    weights = np.repeat([poses[label] for label in labels], 50, axis=0) + 0.05 * rng.normal(size=(50 * len(labels), 3))
    rows = [(50 * k, 50 * k + 50, label) for k, label in enumerate(labels)]
    table = pd.DataFrame(rows, columns=["onset", "offset", "label"])
    return LabelledTake(f"{signer}_{seed}", signer, "IE", RATE, table, weights)


def test_signers_are_dealt_evenly_and_each_once():
    names = [f"s{k}" for k in range(7)] * 3
    folds = deal_signers(names, 3, np.random.default_rng(0))
    assert sorted(signer for fold in folds for signer in fold) == sorted(set(names))
    assert sorted(map(len, folds)) == [2, 2, 3]
    assert folds == deal_signers(names[::-1], 3, np.random.default_rng(0))
    assert folds != deal_signers(names, 3, np.random.default_rng(1))
    with pytest.raises(InputError, match=r"at least two signers, but all are of s0"):
        deal_signers(["s0"], 2, np.random.default_rng(0))
    with pytest.raises(InputError, match="number of signers, 7, but got 8"):
        deal_signers(names, 8, np.random.default_rng(0))


def test_every_labeller_has_a_kind():
    kinds = {name: kind_of(name) for name in LABELLERS}
    assert set(kinds.values()) == {PER_FRAME, MERGING, TEMPORAL}
    networks = [name for name in LABELLERS if is_network(name)]
    assert {"lstm", "gru", "tcn"} <= set(networks)
    assert {kinds[name] for name in networks} == {TEMPORAL}
    assert sum(kind == MERGING for kind in kinds.values()) == 2
    with pytest.raises(InputError, match="labeller: expected one of"):
        kind_of("oracle")


def test_a_labeller_refuses_signers_whom_it_learned_from():
    frames = stack_takes([perform(signer, seed) for seed, signer in enumerate(("a", "b", "c"))])
    train = frames.signers != "c"
    linear = next(name for name in LABELLERS if kind_of(name) == MERGING and "linear" in name)
    labeller, predict = train_labeller(frames, linear, train, seed=0)
    assert (predict(~train) == frames.y[~train]).mean() > 0.9
    assert set(labeller.takes_) == {"a_0", "b_1"}
    with pytest.raises(InputError, match="expected all frames of a take on one side"):
        predict(frames.signers != "a")


def test_classes_that_only_the_tested_show_are_told():
    frames = stack_takes([perform("a", 0), perform("b", 1, ("neutral", "fear", "joy"))])
    train = frames.signers == "a"
    assert "'fear' is tested, but nobody else shows it" in check_classes(frames, train, ~train, "signers b")
    assert check_classes(frames, ~train, ~train, "signers b") == ""
    with pytest.raises(InputError, match="expected labelled frames to test on"):
        check_classes(frames, train, train & ~train, "signers b")
    with pytest.raises(InputError, match="at least two classes to learn from the others, but got only 'neutral'"):
        check_classes(frames, frames.y == "neutral", ~train, "signers b")


@pytest.fixture(scope="module")
def scored():
    """Two signers with four takes; a person, a perfect sequence labeller, and a merged one with planted mistakes."""
    reference, person, merged, perfect, signers = {}, {}, {}, {}, {}
    for k in range(4):
        name = f"t{k}"
        labels = np.array(["neutral"] * 60 + ["joy"] * 60 + ["transition"] * 10 + ["anger"] * 60, dtype=object)
        reference[name], perfect[name], signers[name] = labels, labels.copy(), "ab"[k % 2]
        merged[name] = np.where(labels == "joy", "anger", labels) if k < 2 else labels.copy()
        person[name] = np.concatenate([labels[:1].repeat(3), labels[:-3]])
    raters = [Rater("A2", PERSON, person), Rater("m", MERGING, merged), Rater("t", TEMPORAL, perfect)]
    found = score_raters(reference, raters, signers, RATE, rng=np.random.default_rng(0), n_draws=200)
    return found, reference, merged


def test_raters_of_the_same_takes_stand_in_one_table(scored):
    found, reference, merged = scored
    table = found.table().set_index("rater")
    assert list(table.index) == ["A2", "m", "t"]
    assert (table["n_takes"] == 4).all()
    assert (table["n_frames"] == 4 * 190).all()
    assert table.loc["t", ["accuracy", "f1_50", "kappa", "alpha", "border_f1_1", "f1_50_low"]].tolist() == [1] * 6
    assert table.loc["A2", ["border_f1_2", "border_f1_5", "offset_ms"]].tolist() == [0, 1, 60]
    slow = pool_f1(segmental_f1(reference[take], merged[take], 0.5) for take in reference).f1
    assert table.loc["m", "f1_50"] == pytest.approx(slow)
    assert table.loc["m", "accuracy"] == pytest.approx(1 - 2 * 60 / 760)
    assert table["majority"].tolist() == pytest.approx([60 / 190] * 3)
    assert (table["chance"] == 1 / 4).all()


def test_the_difference_is_paired_over_takes(scored):
    found, reference, merged = scored
    row = found.differences().iloc[0]
    assert (row["rater"], row["against"]) == ("t", "m")
    each = [segmental_f1(reference[take], merged[take], 0.5) for take in reference]
    draws = np.random.default_rng(0).spawn(3)[0]
    slow = bootstrap_interval(each, lambda some: 1 - pool_f1(some).f1, draws, n=200)
    assert (row["difference"], row["difference_low"], row["difference_high"]) == pytest.approx(tuple(slow))
    assert np.isnan(row["difference_signers_low"])  # two signers say nothing about others


def test_planted_mistakes_are_listed_and_parts_add_up(scored):
    found, _, _ = scored
    first = found.mistakes().query("rater == 'm'").iloc[0]
    assert (first["reference"], first["answer"], first["share"]) == ("joy", "anger", 0.5)
    assert found.mistakes().query("rater == 't'").empty
    whole = found.by_part(dict.fromkeys(found.takes, "IE"), "protocol").set_index("rater")
    assert whole["f1_50"].tolist() == found.table()["f1_50"].tolist()
    parts = found.by_part(dict(zip(found.takes, ("x", "x", "y", "y"), strict=True)), "part")
    assert parts.query("rater == 'm' and of == 'y'")["accuracy"].tolist() == [1]


def test_raters_must_have_answered_every_take(scored):
    _, reference, merged = scored
    signers = dict.fromkeys(reference, "a")
    with pytest.raises(InputError, match="m has none of t0"):
        score_raters(reference, [Rater("m", MERGING, {})], signers, RATE, rng=np.random.default_rng(0))
    twice = [Rater("m", MERGING, merged)] * 2
    with pytest.raises(InputError, match="each name once"):
        score_raters(reference, twice, signers, RATE, rng=np.random.default_rng(0))
    with pytest.raises(InputError, match="at least one rater and one take"):
        score_raters({}, twice, signers, RATE, rng=np.random.default_rng(0))


def test_classes_are_counted_by_signer_take_segment_and_second():
    gapped = np.array(["joy"] * 50 + [None] * 50 + ["joy"] * 25 + ["fear"] * 25, dtype=object)
    table = count_classes({"t": gapped, "u": gapped[:50]}, {"t": "a", "u": "b"}, RATE).set_index("label")
    assert table.loc["joy"].tolist() == [2, 2, 3, 2.5, 2.5 / 3]
    assert table.loc["fear"].tolist() == [1, 1, 1, 0.5, 0.5 / 3]
