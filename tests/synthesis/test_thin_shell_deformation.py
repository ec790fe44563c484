import numpy as np
import pytest
from mimique.errors import InputError, RigError
from mimique.synthesis import Rig
from mimique.synthesis.mesh_operators import cotangent_weights, thin_shell_energy, vertex_areas
from mimique.synthesis.thin_shell_deformation import ThinShellDeformation


def strip(n=41, rows=5, step=2.0):
    """A flat strip of (n, rows) points, mm, as a rig with one idle shape."""
    x, y = np.meshgrid(step * np.arange(n), step * np.arange(rows), indexing="ij")
    v = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    i = (np.arange(n - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    f = np.concatenate([np.stack([i, i + rows, i + rows + 1], 1), np.stack([i, i + rows + 1, i + 1], 1)])
    return Rig(v, f, np.ones((1, *v.shape)), ["idle"])


def bumpy(rng, scale=1.0):
    rig = strip(15, 12)
    return Rig(
        (rig.neutral + rng.normal(0, 0.3, rig.neutral.shape)) * scale, rig.triangles, rig.deltas * scale, ["idle"]
    )


def test_pure_stretching_is_a_straight_ramp_between_two_held_ends():
    """With k_b = 0 the sheet solves Laplace's equation: linear from 0 to 3 mm."""
    rig = strip()
    ends = np.flatnonzero(np.isin(rig.neutral[:, 0], [0, 80]))
    moved = rig.neutral[ends] + np.where(rig.neutral[ends, :1] > 0, 1.0, 0.0) * [0, 0, 3.0]
    mesh = ThinShellDeformation(rig, ends, k_b=0).solve(moved[None])[0]
    np.testing.assert_allclose(mesh[:, 2], 3 * rig.neutral[:, 0] / 80, atol=1e-9)
    np.testing.assert_allclose(mesh[:, :2], rig.neutral[:, :2], atol=1e-9)


def test_pure_bending_is_a_clamped_beam():
    """A clamped beam whose ends are 3 mm apart follows 3(3t² − 2t³), t = x/l; two held columns make a clamp."""
    rig = strip(61, 3)
    x = rig.neutral[:, 0]
    held = np.flatnonzero((x <= 2) | (x >= 118))
    moved = rig.neutral[held] + (x[held, None] > 60) * np.array([0, 0, 3.0])
    z = ThinShellDeformation(rig, held, k_s=0).solve(moved[None])[0, :, 2]
    t = np.clip((x - 1) / 118, 0, 1)
    np.testing.assert_allclose(z, 3 * (3 * t**2 - 2 * t**3), atol=0.1)
    assert abs(z[np.isclose(x, 30)].mean() - 3 * 30 / 120) > 0.2  # A ramp would be another answer.


def test_it_is_the_minimum_of_the_energy_that_2_16_names(rng):
    rig, vertices = bumpy(rng), np.array([3, 60, 100, 170])
    moved = rig.neutral[vertices] + rng.normal(0, 2, (4, 3))
    d = ThinShellDeformation(rig, vertices, k_s=0.7, k_b=1.3, length=5.0).displacements(moved[None])[0]
    np.testing.assert_allclose(d[vertices], moved - rig.neutral[vertices])
    areas = vertex_areas(rig.neutral, rig.triangles)
    K = thin_shell_energy(cotangent_weights(rig.neutral, rig.triangles), areas, 0.7, 1.3 * 25).toarray()
    # A slow second version: the Lagrangian with one row a marker.
    C = np.eye(len(d))[vertices]
    system = np.block([[2 * K, C.T], [C, np.zeros((4, 4))]])
    slow = np.linalg.solve(system, np.vstack([np.zeros_like(d), moved - rig.neutral[vertices]]))[: len(d)]
    np.testing.assert_allclose(d, slow, atol=1e-6)


def test_a_missing_marker_is_as_if_it_had_never_been_there(rng):
    rig, vertices = bumpy(rng), np.array([3, 60, 100, 130, 170])
    moved = rig.neutral[vertices] + rng.normal(0, 2, (6, 5, 3))
    gaps = moved.copy()
    gaps[2:4, 1] = gaps[3:5, 4] = np.nan
    gaps[5] = np.nan
    mesh = ThinShellDeformation(rig, vertices, length=5.0).solve(gaps)
    for frame, left in [(0, [0, 1, 2, 3, 4]), (2, [0, 2, 3, 4]), (3, [0, 2, 3]), (4, [0, 1, 2, 3])]:
        alone = ThinShellDeformation(rig, vertices[left], length=5.0).solve(moved[frame, left][None])[0]
        np.testing.assert_allclose(mesh[frame], alone, atol=1e-6)
    assert np.isnan(mesh[5]).all()


def test_units_do_not_matter_and_common_shifts_are_kept(rng):
    rig = bumpy(rng)
    small = Rig(rig.neutral * 1e-3, rig.triangles, rig.deltas, ["idle"])
    vertices = np.array([3, 60, 100, 170])
    moved = rig.neutral[vertices] + rng.normal(0, 2, (2, 4, 3))
    shell = ThinShellDeformation(rig, vertices)
    tiny = ThinShellDeformation(small, vertices).solve(moved * 1e-3)
    np.testing.assert_allclose(shell.solve(moved), tiny * 1e3, atol=1e-6)
    shift = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(shell.solve(moved + shift), shell.solve(moved) + shift, atol=1e-6)


def test_fixed_vertices_and_parts_without_markers_stay(rng):
    one = bumpy(rng)
    n = one.n_vertices
    rig = Rig(
        np.vstack([one.neutral, one.neutral + 100, [[0, 0, 50.0]]]),
        np.vstack([one.triangles, one.triangles + n]),
        np.ones((1, 2 * n + 1, 3)),
        ["idle"],
    )
    vertices, fixed = np.array([3, 60, 100]), np.array([10, 11, 170])
    moved = rig.neutral[vertices] + rng.normal(0, 2, (1, 3, 3))
    d = ThinShellDeformation(rig, vertices, fixed=fixed).displacements(moved)[0]
    assert (d[fixed] == 0).all() and (d[n:] == 0).all() and (np.abs(np.delete(d[:n], fixed, 0)).max(1) > 0).all()


def test_bad_input_is_refused(rng):
    rig = bumpy(rng)
    with pytest.raises(RigError, match="carries a marker"):
        ThinShellDeformation(rig, [1, 2], fixed=[2])
    with pytest.raises(RigError, match="fixed: expected vertex"):
        ThinShellDeformation(rig, [1, 2], fixed=[10_000])
    with pytest.raises(InputError, match="k_s and k_b"):
        ThinShellDeformation(rig, [1, 2], k_s=0, k_b=0)
    with pytest.raises(InputError, match="length"):
        ThinShellDeformation(rig, [1, 2], length=-1)
    with pytest.raises(InputError, match="positions"):
        ThinShellDeformation(rig, [1, 2]).solve(np.zeros((4, 3, 3)))
