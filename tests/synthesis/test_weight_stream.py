import numpy as np
import pytest
from mimique.errors import InputError, RigError
from mimique.synthesis import Rig, WeightPrior, WeightSolver

N, P = 7, 10
RNG = np.random.default_rng(8)
POINTS = RNG.normal(0, 40, (P + 4, 3))
TRIANGLES = np.stack([np.arange(P + 2), np.arange(1, P + 3), np.arange(2, P + 4)], axis=1)
RIG = Rig(POINTS, TRIANGLES, RNG.normal(0, 4, (N, P + 4, 3)), [f"s{k}" for k in range(N)])
MARKERS = np.arange(P)
PRIOR = WeightPrior.fit(np.random.default_rng(6).beta(0.5, 2, (300, N)))


def take(n_frames=120):
    rng = np.random.default_rng(9)
    truth = np.clip(np.cumsum(rng.normal(0, 0.15, (n_frames, N)), axis=0), -0.2, 1.2).clip(0, 1)
    positions = RIG.pose(truth, MARKERS) + rng.normal(0, 1.0, (n_frames, P, 3))
    positions[rng.uniform(size=(n_frames, P)) < 0.05] = np.nan
    positions[20:30, 3:6] = np.nan
    positions[12] = np.nan
    return positions


@pytest.mark.parametrize("method", ["lsts", "lsts-published", "bounded", "map", "nnls", "least-squares"])
def test_a_stream_gives_the_weights_of_the_whole(method):
    positions = take(20 if method == "lsts-published" else 120)
    solver = WeightSolver(RIG, MARKERS, method, prior=PRIOR if method == "map" else None)
    stream = solver.stream()
    found = np.array([stream.push(frame) for frame in positions])
    np.testing.assert_allclose(found, solver.solve(positions), atol=1e-6)
    assert np.isnan(found).all(1).sum() == np.isnan(positions).all((1, 2)).sum()


def test_streams_of_one_solver_do_not_meet_and_forget_nothing_they_need():
    positions, solver = take(), WeightSolver(RIG, MARKERS)
    one, other = solver.stream(), solver.stream()
    for f in range(60):
        a, b = one.push(positions[f]), other.push(positions[-1 - f])
        np.testing.assert_allclose(a, solver.solve(positions[f : f + 1])[0], atol=1e-9)
        np.testing.assert_allclose(b, solver.solve(positions[-1 - f : len(positions) - f])[0], atol=1e-9)


def test_weights_that_were_handed_out_do_not_change():
    stream, positions = WeightSolver(RIG, MARKERS).stream(), take()
    first = stream.push(positions[0])
    kept = first.copy()
    first[:] = 9.0
    again = stream.push(positions[0])
    np.testing.assert_allclose(again, kept, atol=1e-12)


def test_bad_frames_are_refused():
    stream, positions = WeightSolver(RIG, MARKERS).stream(), take()
    with pytest.raises(InputError, match="frame: expected shape"):
        stream.push(positions[0, :-1])
    with pytest.raises(InputError, match="infinity"):
        stream.push(np.full((P, 3), np.inf))
    with pytest.raises(RigError, match="metres"):
        stream.push(RIG.neutral[MARKERS] / 1000)
