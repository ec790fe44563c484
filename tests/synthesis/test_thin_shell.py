import numpy as np
import pytest
from mimique.errors import InputError, RigError
from mimique.synthesis import Rig
from mimique.synthesis.mesh_operators import cotangent_weights, thin_shell_operator, vertex_areas
from mimique.synthesis.thin_shell import published_thin_shell_matrix, rig_length, thin_shell_matrix


def sheet(n=25, scale=1.0, size=100.0):
    """A flat sheet of some mm with three smooth shapes that vanish towards its edge."""
    g = np.linspace(-size / 2, size / 2, n)
    x, y = np.meshgrid(g, g, indexing="ij")
    v = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    f = np.concatenate([np.stack([i, i + n, i + n + 1], 1), np.stack([i, i + n + 1, i + 1], 1)])
    widths = (6.0, 7.0, 8.5)
    deltas = np.zeros((3, len(v), 3))
    for k, width in enumerate(widths):
        deltas[k, :, 2] = 5 * np.exp(-(v**2).sum(1) / (2 * width**2))
    return Rig(v * scale, f, deltas * scale, list("abc"))


NONE = np.empty(0, dtype=np.int64)


def test_stretching_and_bending_of_a_bump_in_closed_form():
    """∫|∇d|² = π h² and ∫(Δd)² = 2π h²/w² for d = h exp(−r²/2w²)."""
    rig = sheet(81)
    np.testing.assert_allclose(np.diag(thin_shell_matrix(rig, NONE, k_b=0)), np.pi * 25, rtol=0.01)
    bend = np.diag(thin_shell_matrix(rig, NONE, k_s=0))
    np.testing.assert_allclose(bend, np.pi * 25 * 7.0**2 / np.array([6.0, 7.0, 8.5]) ** 2, rtol=0.02)


@pytest.mark.parametrize("form", ["energy", "residual"])
def test_the_matrix_is_symmetric_positive_and_in_square_lengths(form):
    rig, small = sheet(), sheet(scale=1e-3)
    E = thin_shell_matrix(rig, NONE, form)
    np.testing.assert_allclose(E, E.T)
    assert np.linalg.eigvalsh(E).min() > 0
    np.testing.assert_allclose(thin_shell_matrix(small, NONE, form), E * 1e-6, rtol=1e-9)


@pytest.mark.parametrize(("form", "tolerance"), [("energy", 0.05), ("residual", 0.12)])
def test_it_does_not_depend_on_the_resolution(form, tolerance):
    coarse, fine = (thin_shell_matrix(sheet(n), NONE, form) for n in (41, 81))
    np.testing.assert_allclose(coarse, fine, rtol=tolerance)


def test_residual_form_leaves_the_marker_rows_out():
    rig = sheet()
    middle = np.array([int((rig.neutral**2).sum(1).argmin())])
    whole, without = (np.diag(thin_shell_matrix(rig, v, "residual")) for v in (NONE, middle))
    assert (without < 0.97 * whole).all()
    np.testing.assert_array_equal(thin_shell_matrix(rig, middle), thin_shell_matrix(rig, NONE))


def test_published_matrix_is_the_squared_norm_of_the_rows_off_the_markers():
    rig, vertices = sheet(15), np.array([100, 112])
    A = thin_shell_operator(
        cotangent_weights(rig.neutral / 10, rig.triangles), vertex_areas(rig.neutral / 10, rig.triangles), 1.0, 1.0
    ).toarray()
    c = np.array([0.3, -0.2, 0.9])
    rows = np.delete(A @ np.tensordot(c, rig.deltas / 10, 1), vertices, axis=0)
    assert c @ published_thin_shell_matrix(rig, vertices, 10.0) @ c == pytest.approx((rows**2).sum())


def test_seams_do_not_matter():
    """Exporters double the vertices along texture seams; the two halves must still be one sheet."""
    rig = sheet(21)
    left = rig.neutral[rig.triangles].mean(1)[:, 0] < 0
    triangles = rig.triangles.copy()
    triangles[left] += rig.n_vertices
    split = Rig(np.tile(rig.neutral, (2, 1)), triangles, np.tile(rig.deltas, (1, 2, 1)), rig.shapes)
    np.testing.assert_allclose(thin_shell_matrix(split, NONE), thin_shell_matrix(rig, NONE), rtol=1e-9)


def test_rig_length_is_the_side_of_what_moves():
    n, v = 61, sheet(61)
    inside = (np.abs(v.neutral[:, :2]) < 25.1).all(1)
    rig = Rig(v.neutral, v.triangles, np.where(inside[None, :, None], 1.0, 0.0) * np.ones((2, n * n, 3)), ["a", "b"])
    assert rig_length(rig) == pytest.approx(50, rel=0.05)
    assert rig_length(sheet(scale=0.01)) == pytest.approx(0.01 * rig_length(sheet()))
    with pytest.raises(RigError, match="moves any vertex"):
        rig_length(Rig(v.neutral, v.triangles, np.zeros((1, n * n, 3)), ["a"]))


def test_unknown_form():
    with pytest.raises(InputError, match="residual or energy, but got 'bending'"):
        thin_shell_matrix(sheet(9), NONE, "bending")
