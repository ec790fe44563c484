"""Labellers in time as models of a corpus: trained, stored, used, shown, derived again; and interrupted."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.models.labellers import LABELLERS, has_torch
from mimique.models.stored_models import SegmentModel, TakeModel
from mimique.workbench.cli import run
from mimique.workbench.pipeline.labelling import label, label_take
from mimique.workbench.pipeline.regenerating import Regenerator
from mimique.workbench.pipeline.training import load_model, train
from mimique.workbench.scratch import Scratch

RATE, SHAPES = 50.0, [f"shape{k}" for k in range(6)]
POSES = dict(zip(("neutral", "joy", "fear"), np.vstack([np.zeros(6), np.eye(6)[:2]]), strict=True))
ORDER = ("neutral", "joy", "fear", "joy", "neutral", "fear", "neutral")


def perform(seed):
    """Each affect for a second and 0.4 s between; weights with noise, and the tier."""
    rng, rows, parts, frame = np.random.default_rng(seed), [], [], 0
    for k, name in enumerate(ORDER):
        if k:
            s = (np.arange(20)[:, None] + 0.5) / 20
            parts.append(POSES[ORDER[k - 1]] + s * s * (3 - 2 * s) * (POSES[name] - POSES[ORDER[k - 1]]))
            rows.append((frame, frame + 20, ORDER[k - 1][0].upper() + name[0].upper()))
            frame += 20
        parts.append(np.repeat(POSES[name][None], 50, axis=0))
        rows.append((frame, frame + 50, name))
        frame += 50
    weights = np.concatenate(parts) + 0.03 * rng.normal(size=(frame, 6))
    return weights, pd.DataFrame(rows, columns=["onset", "offset", "label"])


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """Three signers with two training takes and one to test on; the take of a fourth is not annotated."""
    path = tmp_path_factory.mktemp("labellers") / "corpus"
    corpus = Corpus.create(path)
    with corpus.transaction("Make", author="lead") as edit:
        for place, signer in enumerate(("s1", "s2", "s3", "new")):
            for number, protocol in enumerate(("IE", "SE", "EU") if signer != "new" else ("EU",)):
                weights, tier = perform(10 * place + number)
                take = f"{signer}_{protocol}"
                points = np.zeros((len(weights), 2, 3))
                edit.put_take(take, make_take(points, ["M1", "M2"], RATE, signer=signer, protocol=protocol))
                edit.put_weights(take, weights, shapes=SHAPES, solve="known")
                if signer != "new":
                    edit.put_tier(take, "affect", tier, author="A1")
    return path


@pytest.fixture
def corpus(base, tmp_path):
    return Corpus.open(shutil.copytree(base, tmp_path / "corpus"))


@pytest.fixture
def quick_tcn(monkeypatch):
    """Make the network small: its training is what is tested, not its answers."""
    make, small = LABELLERS["tcn"], {"max_epochs": 12, "n_hidden": 24, "n_layers": 3, "learning_rate": 0.01}
    monkeypatch.setitem(LABELLERS, "tcn", lambda rng, **own: make(rng, **{**small, **own}))


def frames_of(tier):
    return np.concatenate([np.full(r.offset - r.onset, r.label, dtype=object) for r in tier.itertuples()])


def test_one_model_for_signers_to_come(corpus, capsys):
    words = [str(corpus.path), "--classifier", "forest-merging", "--all-signers", "--author", "lead", "--json"]
    assert run(["train", *words]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert (row["model"], row["outcome"], row["takes"]) == ("all-signers-forest-merging", "trained", 6)
    assert row["accuracy"] > 0.8
    assert row["calibration"] in ("temperature", "isotonic")
    # No tier of segments is needed, and the take of the signer that nobody knows is labelled too.
    assert run(["label", str(corpus.path), "--author", "lead", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == 10
    corpus.refresh()
    tier = corpus.tier("new_EU", "affect", author="all-signers-forest-merging")
    truth = perform(30)[1]
    assert tier["label"].tolist() == truth["label"].tolist()
    assert np.abs(tier["onset"] - truth["onset"]).max() < 0.3 * RATE
    assert tier["confidence"].between(0.3, 1).all()
    assert set(tier["origin"]) == {"model"}
    assert (tier["from_label"] != tier["to_label"]).sum() == 6
    # Again: nothing to do.
    assert run(["train", *words]) == 0
    assert json.loads(capsys.readouterr().out)[0]["outcome"] == "unchanged"
    assert set(label(corpus)["outcome"]) == {"unchanged"}
    assert run(["model", "show", str(corpus.path), "all-signers-forest-merging"]) == 0
    card = capsys.readouterr().out
    assert "random forest of frames" in card
    assert "F1@50" in card
    assert "of signers held out in turn (3 folds)" in card
    assert "expected calibration error" in card
    # And both come out the same, bit for bit, when they are derived again.
    again = Regenerator(corpus)
    assert again("models/all-signers-forest-merging") is None
    assert again("takes/new_EU/tiers/all-signers-forest-merging/affect") is None


@pytest.mark.parametrize("name", ["linear-merging", "tcn", "1-nn"])
def test_each_kind_is_stored_and_derived_again(corpus, name, quick_tcn):
    if name == "tcn" and not has_torch():
        pytest.skip("PyTorch is not installed")
    before = corpus.snapshot
    table = train(corpus, classifier=name, cross_signers=True, signers=["s1"], author="lead")
    assert table["model"].tolist() == [f"without-s1-{name}"]
    assert corpus.snapshot != before
    facts = corpus.model_metadata(f"without-s1-{name}")
    assert facts["held_out_signer"] == "s1"
    assert facts["calibration"]["held_out"] == "signers"
    assert facts["calibration"]["tested"]["n_segments"] > 0
    model, _ = load_model(corpus, f"without-s1-{name}")
    if name == "1-nn":
        assert isinstance(model, SegmentModel)
        segments = corpus.tier("s1_EU", "affect", author="A1")
        weights = corpus.weights("s1_EU")["weights"].values
        scores = model.segment_probabilities(weights, segments)
        np.testing.assert_allclose(scores.sum(axis=1), 1)
        raw = SegmentModel(model.classifier)
        assert model.label(weights, segments)["label"].tolist() == raw.label(weights, segments)["label"].tolist()
    else:
        assert isinstance(model, TakeModel)
        tier = label_take(corpus, "s1_EU", model)
        assert (frames_of(tier) == frames_of(corpus.tier("s1_EU", "affect", author="A1"))).mean() > 0.6
    assert Regenerator(corpus)(f"models/without-s1-{name}") is None


def test_one_signer_calibrates_by_takes_or_says_why_not(corpus):
    every = ["IE", "SE", "EU"]
    table = train(corpus, classifier="forest-merging", signers=["s1"], protocols=every, author="lead")
    facts = corpus.model_metadata("s1-forest-merging")["calibration"]
    assert facts["held_out"] == "takes"
    assert facts["n_segments"] >= 20
    assert table["calibration"].tolist() == [facts["method"]]
    with_one = train(corpus, classifier="1-nn", signers=["s1"], protocols=["IE"], author="lead")
    assert with_one["calibration"].tolist() == ["none: there is one take only"]


def test_other_rate_other_shapes_and_bad_words_are_refused(corpus, capsys):
    train(corpus, classifier="linear-merging", all_signers=True, author="lead")
    weights, _ = perform(0)
    with corpus.transaction("Add", author="lead") as edit:
        for take, rate, shapes in (("fast", 100.0, SHAPES), ("other", RATE, [*SHAPES[1:], SHAPES[0]])):
            points = np.zeros((len(weights), 2, 3))
            edit.put_take(take, make_take(points, ["M1", "M2"], rate, signer="s9", protocol="EU"))
            edit.put_weights(take, weights, shapes=shapes, solve="known")
        edit.put_take("bare", make_take(points, ["M1", "M2"], RATE, signer="s9", protocol="EU"))
    before = Corpus.open(corpus.path).snapshot
    path = str(corpus.path)
    for words, told in (
        (["label", path, "--take", "fast"], "expected 50 frames per second"),
        (["label", path, "--take", "other"], "their order differs"),
        (["label", path, "--take", "bare"], "has no weights yet; run: mimique solve CORPUS --take bare"),
        (["label", path, "--take", "nobody"], "nobody"),
        (["train", path, "--classifier", "oracle"], "expected one of 1-nn"),
        (["train", path, "--all-signers", "--cross-signers"], "choose one"),
        (["train", path, "--all-signers", "--signer", "s1"], "leave out --signer"),
    ):
        assert run(words) == 2
        error = capsys.readouterr().err
        assert told in error
        assert error.count("\n") == 1
    assert Corpus.open(corpus.path).snapshot == before


@pytest.mark.skipif(not has_torch(), reason="PyTorch is not installed")
def test_an_interrupted_training_goes_on(corpus, monkeypatch, quick_tcn):
    whole = Corpus.open(shutil.copytree(corpus.path, corpus.path.parent / "whole"))
    train(whole, classifier="tcn", cross_signers=True, signers=["s2"], author="lead")
    before, scratch = corpus.snapshot, corpus.path.parent / "corpus.scratch"
    count, put = [], Scratch.put

    def stop(self, key, arrays):
        put(self, key, arrays)
        count.append(key)
        if len(count) in (5, 20):  # after an epoch of the whole; in the middle of a fold
            raise KeyboardInterrupt

    monkeypatch.setattr(Scratch, "put", stop)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            train(corpus, classifier="tcn", cross_signers=True, signers=["s2"], author="lead")
        assert Corpus.open(corpus.path).snapshot == before
        assert any(scratch.iterdir())
    train(corpus, classifier="tcn", cross_signers=True, signers=["s2"], author="lead")
    assert not scratch.exists()
    epochs = [key for key in count if key.endswith("-epochs")]
    assert len(epochs) <= 4 * 12  # the whole and three folds: no epoch twice
    for name, values in whole.model("without-s2-tcn")[0].items():
        np.testing.assert_array_equal(corpus.model("without-s2-tcn")[0][name], values)


def test_a_model_that_is_damaged_is_told(corpus):
    train(corpus, classifier="linear-merging", all_signers=True, author="lead")
    name = "all-signers-linear-merging"
    arrays, facts = corpus.model(name)
    with corpus.transaction("Spoil", author="lead") as edit:
        edit.put_model(name, {k: v for k, v in arrays.items() if k != "linear.coef"}, facts)
    with pytest.raises(InputError, match=f"model '{name}': .* train again"):
        load_model(corpus, name)
