"""Labellers on unseen signers as a user meets them: tables, readings apart, interrupted runs, refusals."""

import json
import shutil
import sys
import types
from contextlib import contextmanager

import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.models.evaluation.labeller_comparison import kind_of
from mimique.models.labellers import LABELLERS
from mimique.models.scores.rater_scores import MERGING, PERSON
from mimique.workbench.cli import run
from mimique.workbench.pipeline import evaluating_labellers
from mimique.workbench.pipeline.evaluating_labellers import evaluate_labellers
from mimique.workbench.progress import Reporter

RATE, SHAPES = 50.0, [f"shape{k}" for k in range(4)]
POSES = dict(zip(("neutral", "joy", "fear"), np.vstack([np.zeros(4), np.eye(4)[:2]]), strict=True))
LINEAR = [name for name in LABELLERS if "linear" in name]
MERGED = next(name for name in LINEAR if kind_of(name) == MERGING)


def perform(labels, seed):
    """A second of each affect and 0.4 s between; weights with noise, and the tier."""
    rng, rows, parts, frame = np.random.default_rng(seed), [], [], 0
    for k, label in enumerate(labels):
        if k:
            s = (np.arange(20)[:, None] + 0.5) / 20
            parts.append(POSES[labels[k - 1]] + s * (POSES[label] - POSES[labels[k - 1]]))
            rows.append((frame, frame + 20, labels[k - 1][0].upper() + label[0].upper()))
            frame += 20
        parts.append(np.repeat(POSES[label][None], 50, axis=0))
        rows.append((frame, frame + 50, label))
        frame += 50
    weights = np.concatenate(parts) + 0.03 * rng.normal(size=(frame, 4))
    return weights, pd.DataFrame(rows, columns=["onset", "offset", "label"])


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """Four signers with two takes; A2 labelled every EU take with borders 3 frames late."""
    path = tmp_path_factory.mktemp("labellers") / "corpus"
    corpus = Corpus.create(path)
    with corpus.transaction("Make", author="lead") as edit:
        for number in range(4):
            for protocol, labels in {"IE": ["neutral", "joy", "neutral"], "EU": ["joy", "fear", "neutral"]}.items():
                weights, tier = perform(labels, 10 * number + len(protocol))
                take = f"s{number}_{protocol}"
                points = np.zeros((len(weights), 2, 3))
                facts = {"signer": f"s{number}", "protocol": protocol, "simulated": "yes"}
                edit.put_take(take, make_take(points, ["M1", "M2"], RATE, **facts))
                edit.put_weights(take, weights, shapes=SHAPES, solve="known")
                edit.put_tier(take, "affect", tier, author="A1")
                if protocol == "EU":
                    late = tier.assign(onset=tier["onset"] + 3, offset=tier["offset"] + 3)
                    late.loc[0, "onset"], late.loc[len(late) - 1, "offset"] = 0, len(weights)
                    edit.put_tier(take, "affect", late, author="A2")
    return path


@pytest.fixture
def corpus(base, tmp_path):
    """A copy that a test may change."""
    return Corpus.open(shutil.copytree(base, tmp_path / "corpus"))


def evaluate(corpus, **more):
    return evaluate_labellers(corpus, **{"labellers": LINEAR, "n_folds": 2, "n_draws": 50, **more})


def test_machines_on_all_takes_and_the_person_on_hers(base):
    found = evaluate(Corpus.open(base))
    frames = found.tables["frames"].set_index(["takes", "rater"])
    assert (frames["reading"] == "from scratch").all()
    assert frames["n_takes"].to_dict() == {
        **{("all", name): 8 for name in LINEAR},
        **{("those of A2", name): 4 for name in ("A2", *LINEAR)},
    }
    assert frames.loc[("those of A2", "A2"), "kind"] == PERSON
    assert (frames.loc["all", "accuracy"] > 0.8).all()
    borders = found.tables["borders"].query("rater == 'A2'").set_index("within_frames")
    assert borders["f1"].to_dict() == {1: 0, 2: 0, 5: 1, 10: 1}
    segments = found.tables["segments"].query("rater == 'A2'")
    assert segments["offset_ms"].tolist() == [60]
    classes = found.tables["classes"].set_index("label")
    assert classes.loc["fear", ["n_signers", "n_segments", "seconds"]].tolist() == [4, 4, 4]
    assert classes.loc["transition", "n_segments"] == 16
    assert set(found.answers[MERGED]) == {f"s{k}_{protocol}" for k in range(4) for protocol in ("IE", "EU")}
    assert not Corpus.open(base).path.with_name("corpus.scratch").exists()


def test_test_takes_only_have_the_person_in_the_same_set(base):
    found = evaluate(Corpus.open(base), test_protocols=["EU"], labellers=[MERGED])
    frames = found.tables["frames"]
    assert frames[["takes", "rater", "n_takes"]].to_numpy().tolist() == [["all", "A2", 4], ["all", MERGED, 4]]


def test_proposals_are_never_mixed_with_readings_from_scratch(corpus):
    tier = corpus.tier("s0_EU", "affect", author="A2")
    with corpus.transaction("Review", author="lead") as edit:
        edit.put_tier("s0_EU", "affect", tier.assign(origin="model", status="reviewed").iloc[:1], author="A2")
        own = corpus.tier("s1_IE", "affect", author="A1")
        edit.put_tier("s1_IE", "affect", own.assign(origin=["model"] + ["human"] * (len(own) - 1)), author="A1")
    # Whose whole tier is a model's counts as no person's, so one segment of a person's stays.
    with corpus.transaction("Review", author="lead") as edit:
        origins = ["model"] + ["human"] * (len(tier) - 1)
        edit.put_tier("s0_EU", "affect", tier.assign(origin=origins, status="reviewed"), author="A2")
    found = evaluate(corpus, annotator="A1")
    sets = found.tables["frames"].groupby(["reading", "takes"])["n_takes"].first().to_dict()
    assert sets == {
        ("from scratch", "all"): 7,
        ("with proposals", "all"): 1,
        ("from scratch", "those of A2"): 3,
        ("with proposals", "those of A2"): 1,
    }
    assert any("scored apart: s1_IE" in note for note in found.notes)


class Interrupted(Reporter):
    """Ends the run as Ctrl-C does, after so many steps."""

    def __init__(self, steps):
        self.left = steps

    @contextmanager
    def stage(self, title, total, unit=""):
        yield self.finish

    def finish(self, name, amount=1):
        self.left -= 1
        if not self.left:
            raise KeyboardInterrupt


def test_an_interrupted_run_goes_on_where_it_was(corpus, monkeypatch):
    whole = evaluate(corpus)
    with pytest.raises(KeyboardInterrupt):
        evaluate(corpus, reporter=Interrupted(3))
    trained = []
    train = evaluating_labellers.train_labeller

    def counted(frames, name, *rest, **more):
        trained.append(name)
        return train(frames, name, *rest, **more)

    monkeypatch.setattr(evaluating_labellers, "train_labeller", counted)
    again = evaluate(corpus)
    assert trained == LINEAR[-1:]  # one of the four folds was left
    for title in ("frames", "segments", "borders", "parts"):
        pd.testing.assert_frame_equal(whole.tables[title], again.tables[title])
    assert not corpus.path.with_name("corpus.scratch").exists()
    # Another tier is another question: nothing that was kept may answer it.
    with pytest.raises(KeyboardInterrupt):
        evaluate(corpus, reporter=Interrupted(3))
    tier = corpus.tier("s0_IE", "affect", author="A1")
    with corpus.transaction("Relabel", author="A1") as edit:
        edit.put_tier("s0_IE", "affect", tier.iloc[:-1], author="A1")
    trained.clear()
    evaluate(Corpus.open(corpus.path), annotator="A1")
    assert len(trained) == 4


def test_several_trainings_share_their_folds(base):
    first, second = (evaluate(Corpus.open(base), training_seed=seed, labellers=[MERGED]) for seed in (1, 2))
    assert set(first.answers[MERGED]) == set(second.answers[MERGED])


def refused(capsys, *words):
    """Run a command that must be refused in one line; return the line."""
    capsys.readouterr()
    code = run([str(word) for word in words])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.err.count("\n") == 1
    assert "Traceback" not in captured.err
    return captured.err


def test_the_command_prints_json_and_writes_tables(base, tmp_path, capsys):
    out = tmp_path / "scores.csv"
    words = [
        "evaluate",
        str(base),
        "--protocol",
        "labellers",
        "--classifiers",
        MERGED,
        "--folds",
        "2",
        "--out",
        str(out),
    ]
    assert run([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["protocol"], found["annotator"], found["simulated"]) == ("labellers", "A1", True)
    row = found["tables"]["segments"][0]
    assert row["f1_50_low"] <= row["f1_50"] <= row["f1_50_high"]
    table = pd.read_csv(tmp_path / "scores_frames.csv")
    assert table["simulated"].all()
    assert run(words) == 0
    text = capsys.readouterr().out
    assert "simulated signers: these numbers say how the methods work" in text
    assert "labellers: segments (simulated); reference: A1" in text
    assert f"{row['f1_50']:.3f} [{row['f1_50_low']:.3f}, {row['f1_50_high']:.3f}]" in text


def test_what_cannot_be_evaluated_is_one_clear_line(base, corpus, capsys):
    command = ["evaluate", base, "--protocol"]
    assert "--protocol: expected one of reverdy2019," in refused(capsys, *command, "thesis")
    assert "--folds goes with --protocol labellers or confidence or segmentation, not" in refused(
        capsys, *command, "reverdy2019", "--folds", "3"
    )
    assert "labeller: expected one of" in refused(capsys, *command, "labellers", "--classifiers", "oracle")
    assert "at least two signers, but all are of s1" in refused(capsys, *command, "labellers", "--signer", "s1")
    assert "--folds: expected at least 2, but got 1" in refused(capsys, *command, "labellers", "--folds", 1)
    assert "has labelled no take of the protocols XX" in refused(
        capsys, *command, "labellers", "--train", "XX", "--test", "XX", "--lenient"
    )
    with corpus.transaction("Relabel", author="lead") as edit:
        tier = corpus.tier("s0_IE", "affect", author="A1")
        edit.put_tier("s0_IE", "affect", tier.assign(label=tier["label"].replace("joy", "anger")), author="A1")
    words = ("evaluate", corpus.path, "--protocol", "labellers", "--classifiers", MERGED, "--folds", 4)
    assert "'anger' is tested, but nobody else shows it" in refused(capsys, *words)
    assert run([str(word) for word in (*words, "--lenient")]) == 0


def test_other_protocols_are_called_with_what_they_know(base, tmp_path, capsys, monkeypatch):
    asked = {}

    def answer(corpus, *, annotator=None, signers=None, seed=0, reporter=None, **own):
        asked.update(annotator=annotator, signers=signers, seed=seed, reporter=reporter, **own)
        table = pd.DataFrame({"method": ["energies"], "f1": [0.5], "f1_low": [0.25], "f1_high": [np.nan], "n": [7]})
        return types.SimpleNamespace(tables={"borders": table}, notes=("a word",))

    name = "mimique.workbench.pipeline.evaluating_segmentation"
    fake = types.ModuleType(name)
    fake.evaluate_segmentation = answer
    monkeypatch.setitem(sys.modules, name, fake)
    words = ["evaluate", str(base), "--protocol", "segmentation", "--signer", "s1", "--seed", "4"]
    assert run(words) == 0
    text = capsys.readouterr().out
    assert asked.pop("reporter") is not None
    assert asked == {"annotator": None, "signers": ["s1"], "seed": 4}
    assert run([*words, "--folds", "3", "--classifiers", "tcn"]) == 0
    assert (asked["n_folds"], asked["labellers"]) == (3, ("tcn",))
    capsys.readouterr()
    assert "energies 0.500 7" in " ".join(text.split())
    assert "note: a word" in text
    assert "--train goes with" in refused(capsys, *words, "--train", "IE")


def test_a_network_without_torch_is_refused_by_name_and_left_out_otherwise(base, monkeypatch):
    monkeypatch.setattr(evaluating_labellers, "has_torch", lambda: False)
    names, notes = evaluating_labellers._choose_labellers(None)
    assert "tcn" not in names
    assert MERGED in names
    assert "tcn" in notes[0]
    with pytest.raises(InputError, match="tcn: needs PyTorch"):
        evaluate(Corpus.open(base), labellers=["tcn", MERGED])
