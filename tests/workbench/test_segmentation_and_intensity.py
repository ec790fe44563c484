"""Segmenting with chosen settings, and the evaluations of borders and of intensities, on a corpus of three signers."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from mimique import InputError, NotFoundError
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.models.scores.agreement import cohen_kappa, mean_absolute_error
from mimique.models.scores.segmentation_scores import prepare_reference, score_cut
from mimique.workbench.cli import run
from mimique.workbench.pipeline.evaluating_intensity import evaluate_intensity
from mimique.workbench.pipeline.evaluating_segmentation import evaluate_segmentation
from mimique.workbench.pipeline.labelled_takes import read_labelled_takes
from mimique.workbench.pipeline.segmenting import segment, segment_again

RATE, N_SHAPES = 100.0, 12
DEGREES = {"1": 0.4, "2": 0.7, "3": 1.05}
SMALL_GRID = {"threshold": (7.0, 14.0), "flank": (0.5, 0.8)}


def perform(rng, degrees, gain):
    """Hold degrees of one expression for a second, with neutral and 0.4 s of movement between."""
    pose = gain * rng.uniform(0.2, 1.0, N_SHAPES)
    heights = [0.0] + [h for degree in degrees for h in (DEGREES[degree], 0.0)]
    parts, rows, seen, frame = [], [], [], 0
    for k, height in enumerate(heights):
        label = "joy" if height else "neutral"
        parts.append(np.full(100, height))
        rows.append((frame, frame + 100, label))
        if height:
            seen.append((frame, frame + 100, degrees[k // 2]))
        frame += 100
        if k + 1 < len(heights):
            s = (np.arange(40) + 0.5) / 40
            parts.append(height + s * s * (3 - 2 * s) * (heights[k + 1] - height))
            rows.append((frame, frame + 40, "JN" if height else "NJ"))
            frame += 40
    weights = np.concatenate(parts)[:, None] * pose + 0.01 * rng.normal(size=(frame, N_SHAPES))
    columns = ["onset", "offset", "label"]
    return weights, pd.DataFrame(rows, columns=columns), pd.DataFrame(seen, columns=columns)


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    path, rng = tmp_path_factory.mktemp("cuts") / "corpus", np.random.default_rng(5)
    corpus = Corpus.create(path)
    with corpus.transaction("Make", author="lead") as edit:
        for signer, gain in (("s1", 1.0), ("s2", 0.7), ("s3", 1.3)):
            for number, degrees in enumerate(("123", "312")):
                take = f"{signer}_IGE_{number}"
                weights, tier, seen = perform(rng, degrees, gain)
                points = np.zeros((len(weights), 2, 3))
                facts = {"signer": signer, "protocol": "IGE"}
                edit.put_take(take, make_take(points, ["M1", "M2"], RATE, **facts))
                edit.put_weights(take, weights, shapes=[f"shape{k}" for k in range(N_SHAPES)], solve="known")
                edit.put_tier(take, "affect", tier, author="A1")
                edit.put_tier(take, "intensity_seen", seen, author="A1")
                edit.put_tier(take, "intensity_asked", seen, author="protocol")
                if number == 0:
                    moved = tier.assign(onset=tier["onset"].replace(0, -8) + 8, offset=(tier["offset"] + 8))
                    moved["offset"] = moved["offset"].clip(upper=len(weights))
                    edit.put_tier(take, "affect", moved, author="A2")
                    edit.put_tier(take, "intensity_seen", seen.assign(label=["1", "1", "3"]), author="A2")
    return path


@pytest.fixture
def corpus(base, tmp_path):
    return Corpus.open(shutil.copytree(base, tmp_path / "corpus"))


def test_tuned_settings_are_stored_and_give_the_tier_again(corpus, capsys) -> None:
    assert run(["segment", str(corpus.path), "--tune", "--json"]) == 0
    out = capsys.readouterr()
    assert {row["outcome"] for row in json.loads(out.out)} == {"segmented"}
    assert "chosen by the borders of A1 in 6 takes: window" in out.err
    fresh = Corpus.open(corpus.path)
    found = fresh.history()["command"].iloc[0]
    assert found == "segment"
    parameters = fresh.provenance("s1_IGE_0", "tier", "segments", "mimique")["parameters"]
    assert {"window", "threshold", "tau", "directness", "flank", "restlessness", "solve"} <= set(parameters)
    tier = fresh.tier("s1_IGE_0", "segments", author="mimique")
    again = segment_again(fresh, "s1_IGE_0", parameters)
    pd.testing.assert_frame_equal(tier[["onset", "offset", "label"]], again[["onset", "offset", "label"]])
    assert (tier["label"] == "transition").sum() == 6
    assert run(["segment", str(corpus.path), "--tune", "--json"]) == 0
    assert {row["outcome"] for row in json.loads(capsys.readouterr().out)} == {"unchanged"}


def test_steps_without_all_parameters_are_those_of_fixed_numbers(corpus) -> None:
    old = segment_again(
        corpus, "s1_IGE_0", {"threshold": 10.0, "borders": "flanks", "solve": "known", "restlessness": 0.3}
    )
    whole = {"window": 0.25, "tau": 0.05, "directness": 0.3, "flank": 0.8, "min_duration": 0.1, "borders": "flanks"}
    new = segment_again(corpus, "s1_IGE_0", {**whole, "threshold": 10.0, "solve": "known", "restlessness": 0.3})
    pd.testing.assert_frame_equal(old, new)
    other = segment_again(
        corpus, "s1_IGE_0", {**whole, "flank": 0.4, "threshold": 10.0, "solve": "known", "restlessness": 0.3}
    )
    assert not other["onset"].equals(new["onset"])


def test_what_cannot_be_tuned_is_refused(corpus, capsys) -> None:
    assert run(["segment", str(corpus.path), "--tune", "--threshold", "9"]) == 2
    assert "leave one out" in capsys.readouterr().err
    with pytest.raises(NotFoundError, match="nobody"):
        segment(corpus, tune=True, annotator="nobody")
    assert len(corpus.history()) == 2


def test_borders_of_people_and_machines_side_by_side(corpus) -> None:
    found = evaluate_segmentation(corpus, labellers=(), grid=SMALL_GRID, n_draws=50)
    table = found.tables["borders"]
    assert table["takes"].unique().tolist() == ["all", "those of A2"]
    person = table[table["cut"] == "A2 (person)"].iloc[0]
    assert person["n_takes"] == 3
    assert (person["within_5_f1"], person["within_10_f1"]) == (0.0, 1.0)  # every border is 8 frames late
    assert (person["late_ms"], person["away_ms"]) == pytest.approx((80, 80))
    tuned = table[(table["cut"] == "energies, tuned") & (table["takes"] == "all")].iloc[0]
    assert tuned["within_10_f1"] == 1.0
    assert tuned["within_10_f1_low"] == 1.0
    by_chance = table[(table["cut"] == "at random, as many") & (table["takes"] == "all")].iloc[0]
    assert by_chance["within_10_f1"] < 0.6
    assert by_chance["n_borders"] == tuned["n_borders"]
    takes = {take.name: take for take in read_labelled_takes(corpus, "A1")}
    counts = [
        score_cut(prepare_reference(takes[name]), cut, RATE) for name, cut in found.cuts["energies, default"].items()
    ]
    row = table[(table["cut"] == "energies, default") & (table["takes"] == "all")].iloc[0]
    right, total = sum(c["matched_2"] for c in counts), sum(c["borders"] + c["reference_borders"] for c in counts)
    assert row["within_2_f1"] == pytest.approx(2 * right / total)
    assert set(found.tables["settings"]["signers"].str.split(", ").explode()) == {"s1", "s2", "s3"}


def test_given_answers_of_labellers_are_cut_where_their_labels_change(corpus) -> None:
    takes = read_labelled_takes(corpus, "A1")
    answers = {
        "oracle": {
            t.name: np.concatenate([[row.label] * (row.offset - row.onset) for row in t.segments.itertuples()])
            for t in takes
        }
    }
    found = evaluate_segmentation(corpus, answers=answers, grid={}, n_draws=20)
    row = found.tables["borders"].set_index(["takes", "cut"]).loc["all", "oracle"]
    assert row["within_1_f1"] == 1.0


def test_without_ruptures_a_note_says_so(corpus, monkeypatch) -> None:
    monkeypatch.setattr("mimique.workbench.pipeline.evaluating_segmentation.has_ruptures", lambda: False)
    found = evaluate_segmentation(corpus, labellers=(), grid={}, n_draws=20)
    assert any("ruptures is not installed" in note for note in found.notes)
    assert not found.tables["borders"]["cut"].str.contains("ruptures").any()


def test_intensities_of_unseen_signers(corpus) -> None:
    found = evaluate_intensity(corpus, n_draws=200)
    scores = found.tables["scores"].set_index(["segments", "rater"])
    machine = scores.loc["all", "machine, cumulative logits"]
    assert machine["kappa_quadratic"] > 0.9
    assert machine["n_segments"] == 18
    constant = scores.loc["all", "best constant of the others"]
    assert (constant["kappa_quadratic"], constant["mae"]) == pytest.approx((0.0, 2 / 3))
    assert scores.loc["all", "asked for"]["mae"] == 0
    person = scores.loc["those of A2 (person)", "A2 (person)"]
    truth, given = [1, 2, 3] * 3, [1, 1, 3] * 3
    assert person["mae"] == pytest.approx(mean_absolute_error(truth, given))
    for weights in ("linear", "quadratic"):
        assert person[f"kappa_{weights}"] == pytest.approx(
            cohen_kappa(truth, given, weights=weights, classes=[0, 1, 2, 3])
        )
    assert found.tables["degrees"].set_index("rater").loc["reference"].tolist() == [0, 6, 6, 6]
    assert found.annotator == "A1"


def test_a_signers_degrees_teach_nothing_about_that_signer(corpus) -> None:
    before = evaluate_intensity(corpus, n_draws=1).answers
    with corpus.transaction("Turn the degrees of s1 round") as edit:
        for number in (0, 1):
            tier = corpus.tier(f"s1_IGE_{number}", "intensity_seen", author="A1")
            turned = tier.assign(label=tier["label"].map({"1": "3", "2": "2", "3": "1"}))
            edit.put_tier(f"s1_IGE_{number}", "intensity_seen", turned, author="A1")
    after = evaluate_intensity(Corpus.open(corpus.path), n_draws=1).answers
    own = before["signer"] == "s1"
    assert before["machine, cumulative logits"][own].tolist() == after["machine, cumulative logits"][own].tolist()
    assert before["reference"][own].tolist() != after["reference"][own].tolist()


def test_intensities_that_cannot_be_scored(corpus) -> None:
    with pytest.raises(InputError, match="at least two signers"):
        evaluate_intensity(corpus, signers=["s1"])
    with corpus.transaction("A word for a degree") as edit:
        tier = corpus.tier("s1_IGE_0", "intensity_seen", author="A1")
        edit.put_tier("s1_IGE_0", "intensity_seen", tier.assign(label="much"), author="A1")
    with pytest.raises(InputError, match="expected the degrees 0, 1, 2, 3, but got 'much' at frame"):
        evaluate_intensity(Corpus.open(corpus.path))
