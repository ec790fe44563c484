"""Mistakes in labels, the review queue and the study of confidence, on a small corpus of easy faces."""

import json

import numpy as np
import pandas as pd
import pytest
from mimique import InputError, NotFoundError
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.workbench.commands import reviewing
from mimique.workbench.pipeline.checking_labels import check_labels
from mimique.workbench.pipeline.evaluating_confidence import evaluate_confidence
from mimique.workbench.pipeline.queueing import COLUMNS, queue_for_review

RATE, SHAPES = 50.0, [f"shape{k}" for k in range(6)]
AFFECTS = ("neutral", "joy", "fear", "anger")
CODES = {"neutral": "N", "joy": "J", "fear": "F", "anger": "A"}
POSES = dict(zip(AFFECTS, np.vstack([np.zeros(6), np.eye(6)[:3]]), strict=True))


def perform(rng):
    """Affects in turn with neutral, a second each and 0.4 s between."""
    order = ["neutral"]
    for name in rng.permutation(AFFECTS[1:]):
        order += [str(name), "neutral"]
    rows, parts, frame = [], [], 0
    for k, name in enumerate(order):
        if k:
            s = (np.arange(20)[:, None] + 0.5) / 20
            parts.append(POSES[order[k - 1]] + s * (POSES[name] - POSES[order[k - 1]]))
            rows.append((frame, frame + 20, CODES[order[k - 1]] + CODES[name]))
            frame += 20
        parts.append(np.repeat(POSES[name][None], 50, axis=0))
        rows.append((frame, frame + 50, name))
        frame += 50
    weights = np.concatenate(parts) + 0.05 * rng.standard_normal((frame, 6))
    return weights, pd.DataFrame(rows, columns=["onset", "offset", "label"])


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """Four signers with two takes each; A1 took a joy for fear once; a model that is no more proposed labels of s1."""
    made = Corpus.create(tmp_path_factory.mktemp("confidence") / "corpus")
    rng = np.random.default_rng(4)
    with made.transaction("Make", author="lead") as edit:
        for signer in ("s1", "s2", "s3", "s4"):
            for protocol in ("IE", "EU"):
                weights, tier = perform(rng)
                name = f"{signer}_{protocol}"
                points = np.zeros((len(weights), 2, 3))
                edit.put_take(name, make_take(points, ["M1", "M2"], RATE, signer=signer, protocol=protocol))
                edit.put_weights(name, weights, shapes=SHAPES, solve="known")
                if name == "s2_IE":
                    swapped = tier["label"] == "joy"
                    tier = tier.assign(
                        label=tier["label"].mask(swapped, "fear").replace({"NJ": "NF", "JN": "FN"}).astype(str)
                    )
                edit.put_tier(name, "affect", tier, author="A1")
    return made


def test_a_swapped_label_is_found_and_told(corpus):
    found = check_labels(corpus, temporal=False)
    assert found.annotator == "A1"
    assert found.second == 0
    swapped = found.findings[found.findings["problem"] == "swapped label"]
    assert swapped[["take", "label", "suggestion"]].values.tolist() == [["s2_IE", "fear", "joy"]]
    assert "models of other takes" in swapped["reason"].iloc[0]
    assert not len(check_labels(corpus, takes=["s1_IE"], temporal=False).findings)


def test_what_cannot_be_checked_is_refused(corpus):
    with pytest.raises(NotFoundError, match="nobody"):
        check_labels(corpus, takes=["nobody"], temporal=False)
    with pytest.raises(InputError, match="least score"):
        check_labels(corpus, least_score=2.0)


def test_takes_without_weights_are_checked_by_their_tier(tmp_path):
    made = Corpus.create(tmp_path / "corpus")
    weights, tier = perform(np.random.default_rng(1))
    tier.loc[0, "offset"] -= 10
    with made.transaction("Make", author="lead") as edit:
        edit.put_take("t", make_take(np.zeros((len(weights), 2, 3)), ["M1", "M2"], RATE, signer="s", protocol="IE"))
        edit.put_tier("t", "affect", tier, author="A1")
    found = check_labels(made, temporal=False)
    assert any("no weights" in note for note in found.notes)
    assert found.findings[["problem", "onset", "offset"]].values.tolist()[0] == ["missing segment", 40, 50]


def test_queue_puts_the_doubtful_first(corpus, tmp_path, monkeypatch):
    import typer
    from typer.testing import CliRunner

    table = pd.DataFrame({"onset": [0, 70, 140], "offset": [50, 120, 190], "label": ["neutral", "joy", "fear"]})
    table = table.assign(confidence=[0.99, 0.4, 0.8], origin="model", status="proposed")
    made = Corpus.create(tmp_path / "corpus")
    weights, _ = perform(np.random.default_rng(1))
    with made.transaction("Make", author="lead") as edit:
        edit.put_take("t", make_take(np.zeros((len(weights), 2, 3)), ["M1", "M2"], RATE, signer="s", protocol="IE"))
        edit.put_tier("t", "affect", table, author="old")
        edit.put_model("old", {"nothing": np.zeros(1)}, {"classifier": "1-nn"})
    with pytest.warns(UserWarning, match="the confidences of its tiers stand for it"):
        queue = queue_for_review(made)
    assert queue.columns.tolist() == COLUMNS
    assert queue["label"].tolist() == ["joy", "fear", "neutral"]
    assert queue["gain"].is_monotonic_decreasing
    assert queue["confidence"].tolist() == pytest.approx([0.4, 0.8, 0.99])
    with pytest.warns(UserWarning, match="confidences"):
        assert len(queue_for_review(made, limit=1)) == 1
    with pytest.raises(NotFoundError, match="no model"):
        queue_for_review(corpus)
    with pytest.raises(InputError, match="limit"):
        queue_for_review(made, limit=0)
    app = typer.Typer()
    app.callback()(lambda: None)
    reviewing.register(app)
    with pytest.warns(UserWarning, match="confidences"):
        said = CliRunner().invoke(app, ["queue", str(tmp_path / "corpus"), "--json", "--limit", "2"])
    assert [row["label"] for row in json.loads(said.stdout)] == ["joy", "fear"]


def test_confidence_is_measured_with_a_diagram(corpus, tmp_path):
    found = evaluate_confidence(corpus, temporal=False, n_folds=2, n_inner=2, n_plantings=1, seed=1)
    assert set(found.tables) == {
        "calibration", "calibration_signers", "reliability", "queue", "mistakes", "mistakes_protocols", "shifts",
    }  # fmt: skip
    scores = found.tables["calibration"].set_index("segmentation")
    assert scores.loc["manual", "n"] == 8 * 7
    assert scores.loc["manual", "accuracy"] > 0.9
    assert found.tables["calibration_signers"].groupby("segmentation")["n"].sum()["manual"] == 8 * 7
    assert found.tables["mistakes"].iloc[-1]["problem"] == "all"
    found.plot_reliability(tmp_path / "diagram.png")
    assert (tmp_path / "diagram.png").read_bytes().startswith(b"\x89PNG")
