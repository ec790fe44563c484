import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.synthesis import Rig, WeightSolver
from mimique.synthesis.diagnosis import find_conspicuous_frames
from mimique.synthesis.mesh_operators import cotangent_weights


def sheet():
    """A flat grid whose shapes all slide or lift vertices a little."""
    x, y = np.meshgrid(np.arange(8) * 10.0, np.arange(8) * 10.0, indexing="ij")
    v = np.stack([x, y, 3 * np.sin(x / 20)], -1).reshape(-1, 3)
    i = (np.arange(7)[:, None] * 8 + np.arange(7)).ravel()
    f = np.concatenate([np.stack([i, i + 8, i + 9], 1), np.stack([i, i + 9, i + 1], 1)])
    deltas = np.random.default_rng(0).normal(0, 2, (3, 64, 3))
    return Rig(v, f, deltas, ["a", "b", "c"])


RIG = sheet()
MARKERS = np.array([0, 9, 20, 33, 46, 60])


def test_each_number_by_its_formula():
    solver = WeightSolver(RIG, MARKERS)
    weights = np.array([[0.0, 0.0, 0.0], [0.5, 0.01, 1.0], [-0.1, 0.3, 1.25], [np.nan] * 3])
    positions = RIG.pose(np.nan_to_num(weights), MARKERS)
    positions[1, 0] += [3.0, 0.0, 0.0]
    positions[1, 1] += [0.0, 4.0, 0.0]
    positions[1, 2] = np.nan
    found = solver.diagnose(positions, weights)
    np.testing.assert_allclose(found.residual, [0, np.sqrt(25 / 5), 0, np.nan], atol=1e-12)
    np.testing.assert_array_equal(found.cardinality, [0, 2, 3, np.nan])
    np.testing.assert_allclose(found.bound_violation, [0, 0, 0.25, np.nan])
    assert found.roughness[0] == 0 and np.isnan(found.roughness[3])


def test_roughness_is_the_stretch_of_the_median_shape():
    """With no bending, one is what the shape of median energy has at weight 1, whatever the unit."""
    W = cotangent_weights(RIG.neutral, RIG.triangles).toarray()
    energy = np.array([-(d * (W @ d)).sum() for d in RIG.deltas])
    for scale in (1.0, 0.1):
        rig = Rig(RIG.neutral * scale, RIG.triangles, RIG.deltas * scale, RIG.shapes)
        solver = WeightSolver(rig, MARKERS, k_b=0.0)
        weights = np.vstack([np.eye(3), 0.5 * np.eye(3)])
        found = solver.diagnose(rig.pose(weights, MARKERS), weights).roughness
        np.testing.assert_allclose(found, np.r_[energy, energy / 4] / np.median(energy))


def test_markers_all_missing_leave_no_residual():
    solver = WeightSolver(RIG, MARKERS)
    positions = np.full((2, len(MARKERS), 3), np.nan)
    found = solver.diagnose(positions, solver.solve(positions))
    assert np.isnan(found.residual).all() and np.isnan(found.roughness).all()


def test_conspicuous_frames_are_found():
    residual = np.random.default_rng(1).normal(1.0, 0.1, 2000)
    residual[[5, 700]] = [2.0, 9.0]
    residual[8] = np.nan
    assert list(np.flatnonzero(find_conspicuous_frames(residual))) == [5, 700]
    assert not find_conspicuous_frames(np.ones(10)).any()
    assert not find_conspicuous_frames(np.r_[np.ones(10), 1.01]).any()
    assert not find_conspicuous_frames([]).any() and not find_conspicuous_frames([np.nan]).any()
    with pytest.raises(InputError, match="k: expected"):
        find_conspicuous_frames([1.0], k=0)


@given(st.integers(0, 2**32 - 1), st.floats(0.01, 100))
def test_conspicuous_frames_do_not_depend_on_the_unit_or_the_order(seed, scale):
    rng = np.random.default_rng(seed)
    residual = rng.gamma(2, 1, 60)
    flags = find_conspicuous_frames(residual, k=2.0)
    order = rng.permutation(60)
    np.testing.assert_array_equal(find_conspicuous_frames(scale * residual[order], k=2.0), flags[order])
