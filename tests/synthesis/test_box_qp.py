import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.synthesis.box_qp import BoxQP
from scipy.optimize import lsq_linear


def problem(seed, n, f, ridge):
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(n + 5, n)) * rng.uniform(0.05, 3, n)
    B[:, 0] = -B[:, 1] + 0.01 * B[:, 0]  # Two shapes that nearly cancel each other.
    d = rng.normal(0, 2, (f, n)) @ B.T + rng.normal(0, 1, (f, n + 5))
    return B, d, B.T @ B + ridge * np.eye(n)


def kkt_gap(H, g, c, lower, upper):
    """Largest change of a projected gradient step, as a part of the step from zero."""
    return np.abs(np.clip(c - (c @ H - g) / np.diag(H), lower, upper) - c).max() / max(1, np.abs(g / np.diag(H)).max())


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 10**6), st.integers(2, 60), st.sampled_from([1e-8, 1e-3, 1.0]), st.sampled_from([(0, 1), (-2, 0.5)])
)
def test_optimality_conditions_hold(seed, n, ridge, box):
    B, d, H = problem(seed, n, 40, ridge)
    g = d @ B
    c = BoxQP(H, *box).solve(g)
    assert c.min() >= box[0] and c.max() <= box[1]
    assert kkt_gap(H, g, c, *box) < 1e-8


def test_agrees_with_scipys_active_set_method():
    B, d, H = problem(0, 30, 12, 1e-3)
    rows = np.vstack([B, np.sqrt(1e-3) * np.eye(30)])
    expected = [lsq_linear(rows, np.r_[x, np.zeros(30)], (0, 1), method="bvls", tol=1e-14).x for x in d]
    np.testing.assert_allclose(BoxQP(H).solve(d @ B), expected, atol=1e-8)


def test_frames_do_not_depend_on_their_neighbours():
    B, d, H = problem(1, 20, 1300, 1e-2)
    program = BoxQP(H)
    whole = program.solve(d @ B)
    order = np.random.default_rng(0).permutation(1300)
    np.testing.assert_allclose(program.solve((d @ B)[order]), whole[order], atol=1e-10)
    np.testing.assert_allclose(program.solve((d @ B)[:1]), whole[:1], atol=1e-10)
    assert program.solve(np.empty((0, 20))).shape == (0, 20)


@pytest.mark.parametrize("ridge", [0.0, 1e-3])
def test_the_last_stage_alone_reaches_the_same_minimum(ridge):
    B, d, H = problem(2, 25, 60, ridge + 1e-6)
    program = BoxQP(H)
    g = d @ B
    slow = program._finish(g * program._scale, np.zeros_like(g)) * program._scale
    np.testing.assert_allclose(slow, program.solve(g), atol=1e-7)
