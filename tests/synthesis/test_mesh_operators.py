import igl
import numpy as np
import potpourri3d
import pytest
from mimique.errors import InputError
from mimique.synthesis.mesh_operators import (
    cotangent_weights,
    laplacian,
    thin_shell_energy,
    thin_shell_operator,
    uniform_weights,
    vertex_areas,
)


def bumpy_sheet(n=14, seed=0):
    """A sheet with boundary, irregular triangles, some of them obtuse."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    v = np.stack([x, y, 0 * x], -1).reshape(-1, 3) + rng.uniform(-0.35, 0.35, (n * n, 3))
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    f = np.concatenate([np.stack([i, i + n, i + n + 1], 1), np.stack([i, i + n + 1, i + 1], 1)])
    return v, f


def flat_grid(n=21, h=0.1):
    x, y = np.meshgrid(np.arange(n) * h, np.arange(n) * h, indexing="ij")
    v = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    _, f = bumpy_sheet(n)
    return v, f


def face(shared_data):
    with np.load(shared_data / "ict_facekit" / "rig.npz") as z:
        return z["vertices"].astype(float), z["triangles"].astype(np.int64)


@pytest.fixture(params=["sheet", "face"])
def mesh(request):
    return bumpy_sheet() if request.param == "sheet" else face(request.getfixturevalue("shared_data"))


def test_cotangent_weights_agree_with_libigl_and_potpourri3d(mesh):
    v, f = mesh
    ours = cotangent_weights(v, f)
    assert abs(ours - igl.cotmatrix(v, f)).max() < 1e-9 * abs(ours).max()
    assert abs(ours + potpourri3d.cotan_laplacian(v, f)).max() < 1e-9 * abs(ours).max()


def test_areas_agree_with_libigl_and_sum_to_the_mesh(mesh):
    v, f = mesh
    ours = vertex_areas(v, f)
    oracle = igl.massmatrix(v, f, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    np.testing.assert_allclose(ours, oracle, rtol=1e-8)
    assert ours.sum() == pytest.approx(igl.doublearea(v, f).sum() / 2)


def test_weights_are_negative_semidefinite_and_kill_constants():
    v, f = bumpy_sheet()
    for weights in (cotangent_weights(v, f), uniform_weights(len(v), f)):
        dense = weights.toarray()
        np.testing.assert_allclose(dense, dense.T)
        np.testing.assert_allclose(dense @ np.ones(len(v)), 0, atol=1e-12)
        assert np.linalg.eigvalsh(dense).max() < 1e-9


def test_uniform_weights_by_hand():
    expected = [[-2, 1, 1, 0], [1, -3, 1, 1], [1, 1, -3, 1], [0, 1, 1, -2]]
    np.testing.assert_array_equal(uniform_weights(4, [[0, 1, 2], [2, 1, 3]]).toarray(), expected)


def test_the_laplacian_of_a_parabola_is_its_second_derivative():
    v, f = flat_grid()
    L = laplacian(cotangent_weights(v, f), vertex_areas(v, f))
    inside = ((v[:, :2] > 0.05) & (v[:, :2] < 1.95)).all(1)
    np.testing.assert_allclose((L @ (v[:, 0] ** 2 + 3 * v[:, 1]))[inside], 2.0, atol=1e-8)


def test_thin_shell_operator_and_energy_by_definition():
    v, f = bumpy_sheet()
    W, M = cotangent_weights(v, f).toarray(), np.diag(vertex_areas(v, f))
    L = np.linalg.solve(M, W)
    A = thin_shell_operator(cotangent_weights(v, f), vertex_areas(v, f), 0.7, 0.3)
    K = thin_shell_energy(cotangent_weights(v, f), vertex_areas(v, f), 0.7, 0.3)
    np.testing.assert_allclose(A.toarray(), -0.7 * L + 0.3 * L @ L, atol=1e-7)
    np.testing.assert_allclose(K.toarray(), M @ A.toarray(), atol=1e-7)
    assert np.linalg.eigvalsh(K.toarray()).min() > -1e-8


def test_units():
    v, f = bumpy_sheet()
    np.testing.assert_allclose(cotangent_weights(10 * v, f).toarray(), cotangent_weights(v, f).toarray(), atol=1e-9)
    np.testing.assert_allclose(vertex_areas(10 * v, f), 100 * vertex_areas(v, f))


def test_degenerate_triangles_and_lonely_vertices_carry_nothing():
    v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [9, 9, 9.0]])
    with_flat = [[0, 1, 2], [0, 3, 1]]
    np.testing.assert_array_equal(
        cotangent_weights(v, with_flat).toarray(), cotangent_weights(v, [[0, 1, 2]]).toarray()
    )
    areas = vertex_areas(v, with_flat)
    assert areas[3] == areas[4] == 0
    assert np.isfinite(laplacian(cotangent_weights(v, with_flat), areas).toarray()).all()


def test_a_triangle_that_points_nowhere_is_refused():
    with pytest.raises(InputError, match="below 3, but got 7"):
        vertex_areas(np.eye(3), [[0, 1, 7]])
