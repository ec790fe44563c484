import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.scores import calibration_metrics as metrics
from sklearn import metrics as oracle
from sklearn.calibration import calibration_curve

CLASSES = ["A", "D", "N"]


@st.composite
def forecasts(draw: st.DrawFn) -> tuple[np.ndarray, list]:
    n = draw(st.integers(1, 30))
    counts = draw(st.lists(st.tuples(*[st.integers(0, 9)] * 3), min_size=n, max_size=n))
    rows = np.array(counts, dtype=float)
    rows[rows.sum(axis=1) == 0] = 1
    return rows / rows.sum(axis=1, keepdims=True), draw(st.lists(st.sampled_from(CLASSES), min_size=n, max_size=n))


@settings(max_examples=80)
@given(forecasts())
def test_proper_scores_are_scikit_learns(given_: tuple) -> None:
    probabilities, labels = given_
    brier = oracle.brier_score_loss(labels, probabilities, labels=CLASSES, scale_by_half=False)
    assert metrics.brier_score(probabilities, labels, CLASSES) == pytest.approx(brier)
    loss = oracle.log_loss(labels, probabilities, labels=CLASSES)
    assert metrics.log_loss(probabilities, labels, CLASSES) == pytest.approx(loss, abs=1e-12)


def slow_ece(probabilities: np.ndarray, labels: list, n_bins: int) -> float:
    """Guo et al. 2017, equation 3, one bin and one item at a time."""
    total = 0.0
    for k in range(n_bins):
        inside = [
            (max(row), CLASSES[int(np.argmax(row))] == label)
            for row, label in zip(probabilities, labels, strict=True)
            if k / n_bins < max(row) <= (k + 1) / n_bins or (k == n_bins - 1 and max(row) > 1)
        ]
        if inside:
            confidence, right = (np.mean(column) for column in zip(*inside, strict=True))
            total += len(inside) / len(labels) * abs(right - confidence)
    return total


@settings(max_examples=80)
@given(forecasts(), st.sampled_from([1, 2, 4, 8, 16]))  # powers of two: both versions' edges are exact
def test_calibration_error_is_that_of_the_definition(given_: tuple, n_bins: int) -> None:
    probabilities, labels = given_
    found = metrics.expected_calibration_error(probabilities, labels, CLASSES, n_bins=n_bins)
    assert found == pytest.approx(slow_ece(probabilities, labels, n_bins))
    assert 0 <= found <= 1


@settings(max_examples=50)
@given(forecasts(), st.integers(1, 20))
def test_reliability_table_is_scikit_learns_curve(given_: tuple, n_bins: int) -> None:
    probabilities, labels = given_
    table = metrics.reliability_table(probabilities, labels, CLASSES, n_bins=n_bins)
    right = np.array(CLASSES)[probabilities.argmax(axis=1)] == np.array(labels)
    accuracy, confidence = calibration_curve(right, probabilities.max(axis=1).clip(0, 1), n_bins=n_bins)
    filled = table[table["n"] > 0]
    np.testing.assert_allclose(filled["accuracy"], accuracy)
    np.testing.assert_allclose(filled["confidence"], confidence)
    assert table["n"].sum() == len(labels)
    assert table[table["n"] == 0]["accuracy"].isna().all()


def test_by_hand() -> None:
    probabilities = [[0.8, 0.2], [0.8, 0.2], [0.6, 0.4], [0.6, 0.4]]
    labels = ["a", "a", "b", "b"]
    # Half the items are sure by 0.8 and all right, half by 0.6 and all wrong.
    assert metrics.expected_calibration_error(probabilities, labels, ["a", "b"]) == pytest.approx(0.1 + 0.3)
    assert metrics.brier_score(probabilities, labels, ["a", "b"]) == pytest.approx((0.08 + 0.72) / 2)
    loss = -(np.log(0.8) + np.log(0.4)) / 2
    assert metrics.log_loss(probabilities, labels, ["a", "b"]) == pytest.approx(loss)


def test_true_probabilities_are_calibrated_and_best(rng: np.random.Generator) -> None:
    true = rng.dirichlet([1, 1, 1], size=40_000)
    labels = np.array(CLASSES)[(rng.random((len(true), 1)) > true.cumsum(axis=1)).sum(axis=1)]
    assert metrics.expected_calibration_error(true, labels, CLASSES) < 0.015
    sharper = true**3 / (true**3).sum(axis=1, keepdims=True)
    assert metrics.expected_calibration_error(sharper, labels, CLASSES) > 0.1
    for score in (metrics.brier_score, metrics.log_loss):
        assert score(true, labels, CLASSES) < score(sharper, labels, CLASSES)


@settings(max_examples=30)
@given(forecasts(), st.permutations(range(3)))
def test_names_and_order_of_the_classes_do_not_matter(given_: tuple, order: list) -> None:
    probabilities, labels = given_
    rename = dict(zip(CLASSES, ("x", "y", "z"), strict=True))
    other = probabilities[:, order], [rename[label] for label in labels], [rename[CLASSES[i]] for i in order]
    for score in (metrics.brier_score, metrics.log_loss):
        assert score(*other) == pytest.approx(score(probabilities, labels, CLASSES))


def test_limits() -> None:
    sure = np.eye(3)
    assert metrics.expected_calibration_error(sure, CLASSES, CLASSES) == 0
    assert metrics.brier_score(sure, CLASSES, CLASSES) == 0
    assert metrics.log_loss(sure, CLASSES, CLASSES) == pytest.approx(0, abs=1e-12)
    wrong = ["D", "N", "A"]
    assert metrics.expected_calibration_error(sure, wrong, CLASSES) == 1
    assert metrics.brier_score(sure, wrong, CLASSES) == 2
    assert metrics.log_loss(sure, wrong, CLASSES) == pytest.approx(36.04, abs=0.01)
    even = np.full((3, 3), 1 / 3)
    assert metrics.brier_score(even, CLASSES, CLASSES) == pytest.approx(2 / 3)
    assert metrics.log_loss(even, CLASSES, CLASSES) == pytest.approx(np.log(3))
    # One class only, always sure of it.
    assert metrics.log_loss([[1.0]], ["N"], ["N"]) == pytest.approx(0, abs=1e-12)


def test_items_without_a_label_are_left_out() -> None:
    rows = [[0.9, 0.1], [0.5, 0.5]]
    assert metrics.brier_score(rows, ["a", None], ["a", "b"]) == metrics.brier_score(rows[:1], ["a"], ["a", "b"])
    for score in (metrics.brier_score, metrics.log_loss, metrics.expected_calibration_error):
        assert np.isnan(score(rows, [None, None], ["a", "b"]))
        assert np.isnan(score(np.zeros((0, 2)), [], ["a", "b"]))


def test_bad_input() -> None:
    with pytest.raises(InputError, match="entry at \\(0, 1\\) is nan"):
        metrics.log_loss([[0.5, np.nan]], ["a"], ["a", "b"])
    with pytest.raises(InputError, match=r"row 1 has least 0\.7 and sum 1\.4"):
        metrics.brier_score([[0.5, 0.5], [0.7, 0.7]], ["a", "b"], ["a", "b"])
    with pytest.raises(InputError, match=r"row 0 has least -0\.5"):
        metrics.brier_score([[1.5, -0.5]], ["a"], ["a", "b"])
    with pytest.raises(InputError, match="expected a, b, but got c"):
        metrics.brier_score([[0.5, 0.5]], ["c"], ["a", "b"])
    with pytest.raises(InputError, match=r"expected shape \(any, 2\)"):
        metrics.brier_score([[0.5, 0.5, 0.0]], ["a"], ["a", "b"])
    with pytest.raises(InputError, match="one per row of the probabilities \\(1\\), but got 2"):
        metrics.log_loss([[0.5, 0.5]], ["a", "b"], ["a", "b"])
    with pytest.raises(InputError, match="n_bins"):
        metrics.reliability_table([[0.5, 0.5]], ["a"], ["a", "b"], n_bins=0)
    with pytest.raises(InputError, match="label of each column"):
        metrics.log_loss(np.zeros((1, 0)), ["a"], [])
