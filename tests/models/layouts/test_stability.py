"""How alike two layouts are, and how symmetric one is."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.models.layouts import compare_layouts, compute_jaccard, measure_asymmetry


def test_jaccard_by_vertex():
    assert compute_jaccard([1, 2, 3], [3, 2, 9, 7]) == pytest.approx(2 / 5)
    assert compute_jaccard([4], [4]) == 1.0


@given(st.integers(0, 10_000), st.integers(1, 5), st.integers(1, 5))
@settings(max_examples=40, deadline=None)
def test_near_matches_agree_with_trying_all(seed, n, m):
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 30, (n + m, 3)) * [1, 1, 0]
    a, b = np.arange(n), np.arange(n, n + m)
    close = np.linalg.norm(points[a][:, None] - points[b], axis=2) <= 10.0
    if n > m:
        close = close.T
    best = max(sum(close[i, j] for i, j in enumerate(order)) for order in permutations(range(max(n, m)), min(n, m)))
    assert compute_jaccard(a, b, points) == pytest.approx(best / (n + m - best))
    assert compute_jaccard(a, b, points) == compute_jaccard(b, a, points)


def test_one_marker_is_no_partner_of_two():
    points = np.array([[0.0, 0, 0], [3, 0, 0], [-3, 0, 0]])
    assert compute_jaccard([0], [1, 2], points) == pytest.approx(1 / 2)


def test_bad_layouts_and_lone_ones():
    with pytest.raises(InputError, match="each once"):
        compute_jaccard([1, 1], [2])
    assert np.isnan(compare_layouts([[1, 2]], np.zeros((3, 3)))).all()


def test_asymmetry_in_closed_form():
    pair = np.array([[-20.0, 5, 1], [20, 5, 1], [0, 30, 2]])
    assert measure_asymmetry(pair) == 0.0
    assert measure_asymmetry(pair + [7.0, 0, 0], middle=7.0) == pytest.approx(0.0)
    moved = pair.copy()
    moved[0, 1] += 4.0  # each of the two is now 4 mm from the other's image
    assert measure_asymmetry(moved) == pytest.approx(8 / 3)
    with pytest.raises(InputError, match="at least one"):
        measure_asymmetry(np.empty((0, 3)))
