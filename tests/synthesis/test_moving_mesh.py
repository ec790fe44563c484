"""Only what moves is computed, and it is what the rig says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.synthesis.moving_mesh import MovingMesh, find_normals
from mimique.synthesis.rig import Rig


def make_rig(seed: int, moved: float, n_vertices: int = 40) -> Rig:
    rng = np.random.default_rng(seed)
    triangles = np.array([rng.choice(n_vertices - 2, 3, replace=False) for _ in range(50)])
    deltas = rng.normal(size=(3, n_vertices, 3)) * (rng.random((n_vertices, 1)) < moved)
    return Rig(rng.normal(size=(n_vertices, 3)) * 50, triangles, deltas, "abc")


@given(seed=st.integers(0, 10**6), moved=st.sampled_from([0.0, 0.03, 0.3, 1.0]))
def test_it_is_the_rig_posed_after_any_history(seed, moved):
    rig, rng = make_rig(seed, moved), np.random.default_rng(seed)
    mesh = MovingMesh(rig)
    for weights in rng.normal(size=(4, 3)):
        mesh.pose(weights)
        np.testing.assert_allclose(mesh.points, rig.pose(weights), atol=1e-4)
        np.testing.assert_allclose(mesh.normals, find_normals(rig.pose(weights), rig.triangles), atol=2e-3)
    mesh.pose(np.array([np.nan, 1, 1]))
    np.testing.assert_allclose(mesh.points, rig.neutral, atol=1e-4)


@given(seed=st.integers(0, 10**6), moved=st.sampled_from([0.0, 0.03, 0.3, 1.0]))
def test_the_pieces_are_all_triangles_once_and_what_is_said_to_stand_stands(seed, moved):
    rig = make_rig(seed, moved)
    mesh = MovingMesh(rig)
    together = np.concatenate([piece.vertices[piece.triangles] for piece in mesh.pieces])
    assert sorted(map(tuple, together)) == sorted(map(tuple, rig.triangles))
    before = mesh.points.copy(), mesh.normals.copy()
    mesh.pose(np.array([0.7, -0.4, 1.0]))
    for piece in mesh.pieces:
        if not piece.moves:
            np.testing.assert_array_equal(mesh.points[piece.vertices], before[0][piece.vertices])
            np.testing.assert_allclose(mesh.normals[piece.vertices], before[1][piece.vertices], atol=1e-6)
    if moved == 0:
        assert [piece.moves for piece in mesh.pieces] == [False]


def test_normals_are_those_of_a_slow_second_version():
    rig = make_rig(1, 1.0)
    slow = np.zeros_like(rig.neutral)
    for i, j, k in rig.triangles:
        slow[[i, j, k]] += np.cross(rig.neutral[j] - rig.neutral[i], rig.neutral[k] - rig.neutral[i])
    length = np.linalg.norm(slow, axis=1, keepdims=True)
    slow = np.divide(slow, length, out=np.zeros_like(slow), where=length > 0)
    assert (length == 0).sum() >= 2  # the vertices without a triangle
    np.testing.assert_allclose(find_normals(rig.neutral, rig.triangles), slow, atol=1e-4)
    assert find_normals(rig.neutral, rig.triangles).dtype == np.float32


def test_only_moved_vertices_are_written():
    rig = make_rig(2, 0.3)
    mesh = MovingMesh(rig)
    still = np.setdiff1d(np.arange(rig.n_vertices), mesh.moved)
    mesh.points[still] = 12345.0  # would be overwritten if all were computed
    mesh.pose(np.ones(3))
    assert (mesh.points[still] == 12345.0).all()
    assert mesh.points[mesh.moved] == pytest.approx(rig.pose(np.ones(3))[mesh.moved], abs=1e-3)
