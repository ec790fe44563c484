"""Segments of a take from labels of frames: transitions have two sides that differ."""

import numpy as np
import pandas as pd
from mimique.models.confidence.calibration import Calibrator
from mimique.models.labellers import LABELLERS, TRANSITION
from mimique.models.labellers.take_tiers import find_take_segments, name_open_transitions

CLASSES = ["fear", "joy", TRANSITION]
T = TRANSITION


def named(labels, fear=0.1):
    names = np.array([None if label == "-" else label for label in labels], dtype=object)
    scores = np.tile([fear, 0.3, 0.7 - fear], (len(names), 1))
    return name_open_transitions(names, scores, CLASSES).tolist()


def test_open_transitions():
    assert named(["joy", T, T, "fear"]) == ["joy", T, T, "fear"]
    assert named(["joy", T, "joy"]) == ["joy"] * 3  # back to the same: part of the expression
    assert named([T, T, "fear"]) == ["joy", "joy", "fear"]  # from where, nobody knows: joy is likelier than fear
    assert named([T, T, "fear"], fear=0.4) == ["fear"] * 3
    assert named(["fear", T, "-", "joy"]) == ["fear", "joy", None, "joy"]
    assert named([T]) == ["joy"]
    assert named(["-", "-"]) == [None, None]


def test_a_take_whole(monkeypatch):
    rng = np.random.default_rng(0)
    y = np.repeat(["neutral", T, "joy", T, "neutral", T, "joy"] * 4, 40).astype(object)
    X = 0.05 * rng.standard_normal((len(y), 2)) + np.array([[(v == "joy") * 2.0, (v == T) * 2.0] for v in y])
    labeller = LABELLERS["linear-merging"](rng, rate=50.0).fit(X, y, np.repeat(["a", "b"], len(y) // 2))
    X[:10] = np.nan
    segments, probabilities = find_take_segments(labeller, X)
    assert segments["onset"][0] == 10
    moving = segments["kind"] == "transition"
    pairs = set(zip(segments["from_label"][moving], segments["to_label"][moving], strict=True))
    assert pairs == {("neutral", "joy"), ("joy", "neutral")}
    assert (segments["offset"].to_numpy()[:-1] == segments["onset"].to_numpy()[1:]).all()
    place = {str(name): column for column, name in enumerate(labeller.classes_)}
    expected = [probabilities[row, place[label]] for row, label in enumerate(segments["label"])]
    np.testing.assert_array_equal(segments["confidence"], expected)
    # A calibrator changes how sure, not what.
    flat = Calibrator("temperature", tuple(place), 10.0)
    calmer, _ = find_take_segments(labeller, X, flat)
    pd.testing.assert_frame_equal(calmer.drop(columns="confidence"), segments.drop(columns="confidence"))
    assert (calmer["confidence"] < segments["confidence"]).all()
