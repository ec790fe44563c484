"""The fast updates against the definition, written out anew."""

import itertools

import numpy as np
import pytest
from mimique.models.layouts.constraints import Places
from mimique.models.layouts.faces import bend_displacements
from mimique.models.layouts.greedy import choose_greedily, value_of
from mimique.models.layouts.pivoted_qr import choose_by_qr
from mimique.models.layouts.reconstruction import Reconstruction
from mimique.models.layouts.swaps import improve_by_swaps
from scipy.linalg import qr


@pytest.fixture
def problem(rng):
    basis, weights = rng.normal(size=(14, 3, 6)), rng.uniform(size=(25, 6))
    skin = rng.normal(size=(40, 6))
    seen = basis @ weights.T + rng.normal(0, 0.3, (14, 3, 25))
    root = rng.normal(size=(6, 6))
    return Reconstruction(basis, seen, weights, root @ root.T + 0.1 * np.eye(6), skin.T @ skin / 40, 0.5)


@pytest.fixture
def places(rng):
    n = np.arange(14)
    return Places(n, rng.normal(0, 50, (14, 3)), n[:, None], np.zeros((0, 2), int), n[:0], 0.0)


def slow_error(problem, chosen):
    """``J`` by its definition: the estimate of each frame by least squares, the noise by its covariance."""
    rows = np.concatenate([problem.basis[v] for v in chosen]) if len(chosen) else np.zeros((0, 6))
    shown = np.concatenate([problem.seen[v] for v in chosen]) if len(chosen) else np.zeros((0, 25))
    root = np.linalg.cholesky(problem.precision).T
    stacked = np.vstack([rows, root])
    gain = np.linalg.pinv(stacked)[:, : len(rows)]
    estimate = gain @ shown
    away = estimate.T - problem.weights
    known = np.mean([a @ problem.metric @ a for a in away])
    return known + problem.noise**2 * np.trace(problem.metric @ gain @ gain.T)


@pytest.mark.parametrize("chosen", [[], [3], [0, 5, 9, 11]])
def test_error_by_its_definition(problem, chosen):
    state = problem.state(np.array(chosen, dtype=int))
    assert state.error() == pytest.approx(slow_error(problem, chosen), rel=1e-9)


@pytest.mark.parametrize("size", [1, 2])
def test_errors_after_a_change(problem, size):
    chosen = [0, 5, 9, 11]
    state = problem.state(np.array(chosen))
    more = np.array(list(itertools.combinations([1, 2, 7, 13], size)))
    expected = [slow_error(problem, [*chosen, *unit]) for unit in more]
    np.testing.assert_allclose(state.errors_with(more), expected, rtol=1e-9)
    less = np.array(list(itertools.combinations(chosen, size)))
    expected = [slow_error(problem, [c for c in chosen if c not in unit]) for unit in less]
    np.testing.assert_allclose(state.errors_without(less), expected, rtol=1e-8)


def test_noise_part_by_simulation(problem, rng):
    """Markers with random noise err by what the second term says."""
    chosen = np.array([2, 4, 8])
    quiet = Reconstruction(problem.basis, problem.seen, problem.weights, problem.precision, problem.metric, 0.0)
    errors = []
    for _ in range(400):
        shaken = problem.seen + rng.normal(0, 0.5, problem.seen.shape)
        errors.append(slow_error(Reconstruction(quiet.basis, shaken, *_rest(quiet)), chosen))
    assert np.mean(errors) == pytest.approx(problem.state(chosen).error(), rel=0.02)


def _rest(p):
    return p.weights, p.precision, p.metric, p.noise


@pytest.mark.parametrize("loss", [0.0, 0.5])
def test_swaps_reach_what_no_single_swap_improves(problem, places, loss):
    def value(chosen):
        lost = np.mean([slow_error(problem, [c for c in chosen if c != j]) for j in chosen])
        return (1 - loss) * slow_error(problem, chosen) + loss * lost

    first = choose_greedily(problem, places, 4, loss)
    units = improve_by_swaps(problem, places, first, 20, loss)
    chosen = [c for unit in units for c in unit]
    assert value_of(problem.state(np.array(chosen)), chosen, loss) == pytest.approx(value(chosen), rel=1e-8)
    assert value(chosen) <= value([c for unit in first for c in unit]) + 1e-12
    for i, other in itertools.product(range(4), np.setdiff1d(np.arange(14), chosen)):
        assert value([*chosen[:i], *chosen[i + 1 :], other]) >= value(chosen) * (1 - 2e-6)


def test_greedy_takes_the_best_next(problem, places):
    order = [unit[0] for unit in choose_greedily(problem, places, 4)]
    for k in range(4):
        rest = np.setdiff1d(np.arange(14), order[:k])
        assert order[k] == min(rest, key=lambda v: slow_error(problem, [*order[:k], v]))


def test_block_qr_is_lapacks_where_a_block_has_one_row(rng, places):
    """Vertices that move along one axis only: blocks are rows, and LAPACK's pivoted QR is the oracle."""
    basis = np.zeros((14, 3, 6))
    basis[:, 1] = rng.normal(size=(14, 6))
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T
    order = [unit[0] for unit in choose_by_qr(basis, covariance, 1e-5, places, 6)]
    pivots = qr((basis[:, 1] @ np.linalg.cholesky(covariance)).T, mode="r", pivoting=True)[1]
    np.testing.assert_array_equal(order, pivots[:6])


def test_imagined_faces_bend_smoothly_and_by_as_much_as_said(rng):
    positions = np.array([[0.0, 0, 0], [0.5, 0, 0], [100.0, 0, 0], [0, 120.0, 0]])
    moves = np.ones((4, 3, 1))
    bent = np.stack([bend_displacements(moves, positions, 0.1, rng) - moves for _ in range(800)])[..., 0]
    # Each entry is the sum of three independent numbers of deviation 0.1.
    assert bent.std() == pytest.approx(0.1 * np.sqrt(3), rel=0.1)
    near, far = (np.corrcoef(bent[:, 0].ravel(), bent[:, k].ravel())[0, 1] for k in (1, 2))
    assert near > 0.98 and abs(far) < 0.2
    np.testing.assert_array_equal(bend_displacements(moves, positions, 0.0, rng), moves)
