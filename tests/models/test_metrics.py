import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models import metrics
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching
from sklearn import metrics as oracle


def test_module_is_where_the_package_says() -> None:
    import mimique.models

    assert mimique.models.metrics is metrics


def test_rmse_as_printed_divides_by_frames_only(rng: np.random.Generator) -> None:
    truth, found = rng.normal(size=(2, 7, 4, 3))
    total = sum(((found[n, p] - truth[n, p]) ** 2).sum() for n in range(7) for p in range(4))
    assert metrics.rmse_as_printed(found, truth) == pytest.approx(np.sqrt(total / 7))
    assert metrics.rmse_per_point(found, truth) == pytest.approx(np.sqrt(total / 28))
    assert metrics.rmse_per_point(found, truth) == pytest.approx(metrics.rmse_as_printed(found, truth) / np.sqrt(4))


def test_rmse_per_point_of_a_known_shift_with_gaps() -> None:
    truth = np.zeros((5, 3, 3))
    found = truth + np.array([3.0, 0.0, 4.0])
    found[2, 1, 0] = np.nan
    assert metrics.rmse_per_point(found, truth) == pytest.approx(5)
    assert np.isnan(metrics.rmse_per_point(np.full_like(truth, np.nan), truth))
    with pytest.raises(InputError, match="finite"):
        metrics.rmse_as_printed(found, truth)
    with pytest.raises(InputError, match="at least one point"):
        metrics.rmse_per_point(truth[:0], truth[:0])


letters = st.lists(st.tuples(st.sampled_from("NADF"), st.sampled_from("NADFJ"), st.floats(0.1, 5)), min_size=1)


@settings(max_examples=60, deadline=None)
@given(letters)
def test_label_scores_are_scikit_learns(items: list) -> None:
    reference, given_, weights = (np.array(column) for column in zip(*items, strict=True))
    for w in (None, weights):
        found = metrics.score_labels(reference, given_, weights=w)
        options = {"sample_weight": w}
        assert found.accuracy == pytest.approx(oracle.accuracy_score(reference, given_, **options))
        recall = oracle.recall_score(
            reference, given_, average="macro", labels=sorted(set(reference)), zero_division=0, **options
        )
        assert found.balanced_accuracy == pytest.approx(recall)
        f1 = oracle.f1_score(reference, given_, average="macro", zero_division=0, **options)
        assert found.macro_f1 == pytest.approx(f1)
        best = max(oracle.accuracy_score(reference, np.full_like(reference, c), **options) for c in set(reference))
        assert found.majority == pytest.approx(best)
        assert found.n_items == len(items)


def test_confusion_has_references_in_rows() -> None:
    found = metrics.score_labels(["a", "a", "b"], ["b", "a", "b"], classes=["b", "a", "c"])
    assert found.confusion.loc["a"].tolist() == [1, 1, 0]
    assert found.confusion.loc["b"].tolist() == [1, 0, 0]


def test_nothing_to_score_is_nan() -> None:
    found = metrics.score_labels([], [], classes=["a"])
    assert np.isnan([found.accuracy, found.balanced_accuracy, found.macro_f1, found.majority]).all()
    assert found.n_items == 0


def test_kappa() -> None:
    # Worked example: 20 + 15 agreements of 50, marginals 25/25 and 30/20, so κ = (0.7 − 0.5) / (1 − 0.5).
    first = ["y"] * 25 + ["n"] * 25
    second = ["y"] * 20 + ["n"] * 5 + ["y"] * 10 + ["n"] * 15
    assert metrics.cohen_kappa(first, second) == pytest.approx(0.4)
    assert np.isnan(metrics.cohen_kappa(["y", "y"], ["y", "y"]))


borders = st.lists(st.integers(0, 60), max_size=12)


@settings(max_examples=80, deadline=None)
@given(borders, borders, st.integers(0, 8))
def test_matching_is_as_large_as_any(found: list, reference: list, tolerance: int) -> None:
    pairs = metrics.match_boundaries(found, reference, tolerance)
    a, b = np.sort(found), np.sort(reference)
    assert len(set(pairs[:, 0])) == len(set(pairs[:, 1])) == len(pairs)
    assert all(abs(a[i] - b[j]) <= tolerance for i, j in pairs)
    near = np.abs(np.subtract.outer(a, b)) <= tolerance if len(a) and len(b) else np.zeros((1, 1), bool)
    assert len(pairs) == (maximum_bipartite_matching(csr_array(near)) >= 0).sum()


def test_boundary_scores() -> None:
    found = metrics.score_boundaries([10, 52, 53, 90], [12, 50, 70], tolerance=3)
    assert (found.n_found, found.n_reference, found.n_matched) == (4, 3, 2)
    assert found.precision == pytest.approx(0.5)
    assert found.recall == pytest.approx(2 / 3)
    assert found.f1 == pytest.approx(4 / 7)
    assert found.mean_offset == pytest.approx(0)
    assert found.mean_distance == pytest.approx(2)
    empty = metrics.score_boundaries([], [], tolerance=1)
    assert np.isnan([empty.precision, empty.recall, empty.f1, empty.mean_offset]).all()


def test_bad_input() -> None:
    with pytest.raises(InputError, match="one per reference"):
        metrics.score_labels(["a"], ["a", "b"])
    with pytest.raises(InputError, match="expected one of b, but got a"):
        metrics.score_labels(["a"], ["b"], classes=["b"])
    with pytest.raises(InputError, match="tolerance"):
        metrics.match_boundaries([1], [1], -1)
    with pytest.raises(InputError, match="weights"):
        metrics.score_labels(["a"], ["a"], weights=[-1])
