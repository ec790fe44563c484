import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.confidence.calibration import Calibrator, calibrate, predict_out_of_group, segment_probabilities
from sklearn.linear_model import LogisticRegression

CLASSES = ("a", "b", "c")


def draw(rng: np.random.Generator, n: int = 4000, temperature: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Labels drawn from known probabilities, and those probabilities made too bold or too modest."""
    true = rng.dirichlet(np.ones(3), n)
    labels = np.array(CLASSES, dtype=object)[(rng.random((n, 1)) > true.cumsum(axis=1)).sum(axis=1)]
    distorted = true**temperature
    return distorted / distorted.sum(axis=1, keepdims=True), labels


@pytest.mark.parametrize("truth", [0.4, 1.0, 2.5])
def test_temperature_that_distorted_the_probabilities_is_found(truth: float, rng: np.random.Generator) -> None:
    p, labels = draw(rng, temperature=truth)
    found = calibrate(p, labels, classes=CLASSES, method="temperature")
    assert found.temperature == pytest.approx(truth, rel=0.08)
    undistorted = p ** (1 / truth)
    expected = undistorted / undistorted.sum(axis=1, keepdims=True)
    assert np.abs(found.apply(p) - expected).mean() < 0.01  # the floor of 1e-4 shows where p was below it


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(0.1, 10))
def test_temperature_keeps_the_order_of_the_classes(seed: int, temperature: float) -> None:
    p = np.random.default_rng(seed).dirichlet([0.7, 0.7, 0.7], 30)
    after = Calibrator("temperature", CLASSES, temperature).apply(p)
    assert np.allclose(after.sum(axis=1), 1)
    above = p > 2e-4  # below, all are raised to one floor
    rows = above.all(axis=1)
    assert np.array_equal(np.argsort(after[rows], axis=1), np.argsort(p[rows], axis=1))
    assert np.array_equal(after.argmax(axis=1), p.argmax(axis=1))


def test_isotonic_curves_rise_and_undo_a_distortion(rng: np.random.Generator) -> None:
    p, labels = draw(rng, temperature=3.0)
    found = calibrate(p, labels, classes=CLASSES, method="isotonic")
    for curve in found.curves:
        assert (np.diff(curve[:, 0]) > 0).all()
        assert (np.diff(curve[:, 1]) >= 0).all()
        assert curve[:, 1].min() > 0
        assert curve[:, 1].max() < 1
    fresh, truth = draw(np.random.default_rng(3), temperature=3.0)
    after = found.apply(fresh)
    assert np.allclose(after.sum(axis=1), 1)
    right = truth[:, None] == np.array(CLASSES, dtype=object)
    assert ((after - right) ** 2).mean() < ((fresh - right) ** 2).mean() - 0.005


def test_the_better_method_is_chosen_by_groups_left_out(rng: np.random.Generator) -> None:
    p, labels = draw(rng, n=1500, temperature=2.0)
    groups = np.repeat(["s1", "s2", "s3"], 500)
    found = calibrate(p, labels, groups, classes=CLASSES)
    assert found.method == "temperature"  # the true one, with one number to learn
    assert found.scores["temperature"] < found.scores["isotonic"]


def test_rows_without_label_or_probabilities_are_left_out(rng: np.random.Generator) -> None:
    p, labels = draw(rng, n=500, temperature=2.0)
    spoilt, unknown = p.copy(), labels.copy()
    spoilt[400:450] = np.nan
    unknown[450:] = None
    a = calibrate(spoilt, unknown, classes=CLASSES, method="temperature")
    b = calibrate(p[:400], labels[:400], classes=CLASSES, method="temperature")
    assert a.temperature == pytest.approx(b.temperature)
    assert np.isnan(a.apply(spoilt)[400:450]).all()


@pytest.mark.parametrize("method", ["temperature", "isotonic"])
def test_a_stored_calibrator_is_the_same(method: str, rng: np.random.Generator) -> None:
    p, labels = draw(rng, n=300)
    found = calibrate(p, labels, classes=CLASSES, method=method)  # type: ignore[arg-type]
    again = Calibrator.from_arrays(*found.to_arrays())
    assert np.array_equal(again.apply(p), found.apply(p))
    with pytest.raises(InputError, match="not there"):
        Calibrator.from_arrays({}, {"method": "isotonic", "classes": ["a", "b"], "temperature": 1.0})


def test_out_of_group_predictions_have_not_seen_the_group(rng: np.random.Generator) -> None:
    X = rng.normal(size=(60, 2))
    y = np.where(X[:, 0] > 0, "a", "b")
    groups = np.repeat(["g1", "g2", "g3"], 20)
    found = predict_out_of_group(LogisticRegression(), X, y, groups, classes=CLASSES)
    for group in set(groups):
        out = groups == group
        fitted = LogisticRegression().fit(X[~out], y[~out])
        assert np.allclose(found[out][:, :2], fitted.predict_proba(X[out]))
    assert (found[:, 2] == 0).all()
    with pytest.raises(InputError, match="at least two"):
        predict_out_of_group(LogisticRegression(), X, y, ["g"] * 60, classes=CLASSES)


def test_segments_pool_their_frames() -> None:
    p = np.array([[0.8, 0.2], [0.6, 0.4], [np.nan, np.nan], [0.1, 0.9], [np.nan, np.nan]])
    table = pd.DataFrame({"onset": [0, 2, 4], "offset": [2, 4, 5]})
    assert np.allclose(segment_probabilities(p, table)[:2], [[0.7, 0.3], [0.1, 0.9]])
    assert np.isnan(segment_probabilities(p, table)[2]).all()
    a, b = np.sqrt(0.48), np.sqrt(0.08)
    assert np.allclose(segment_probabilities(p, table, pooling="log")[0], [a / (a + b), b / (a + b)])
    with pytest.raises(InputError, match="row 0"):
        segment_probabilities(p, pd.DataFrame({"onset": [3], "offset": [9]}))


def test_what_cannot_be_calibrated_is_refused() -> None:
    p = np.full((4, 2), 0.5)
    for wrong, words in (
        ({"labels": ["a", "b", "x", "a"]}, "expected one of a, b"),
        ({"labels": [None] * 4}, "none has both"),
        ({"labels": list("abab"), "method": "best"}, "signer of each"),
        ({"labels": list("abab"), "method": "best", "groups": ["s"] * 4}, "at least two signers"),
        ({"labels": list("abab"), "method": "platt"}, "expected one of best"),
        ({"labels": list("aba")}, "one per row"),
    ):
        options = {"method": "temperature", **wrong}
        with pytest.raises(InputError, match=words):
            calibrate(p, classes=("a", "b"), **options)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="row 1"):
        calibrate([[0.5, 0.5], [0.9, 0.9]], ["a", "b"], classes=("a", "b"), method="temperature")
