"""Discrete operators of a triangle mesh (Reverdy 2019, 5.8-5.12 and 2.15-2.17).

Conventions: ``L*`` is the symmetric matrix of edge weights of 5.12, *negative* semidefinite (the diagonal holds minus
the sum of a row), ``M`` the diagonal of areas around the vertices, ``L = M⁻¹ L*`` the Laplacian, whose sign is that of
``Δ = ∂²/∂u² + ∂²/∂v²``. With lengths in some unit u, ``L*`` is a pure number, ``M`` is in u², ``L`` in 1/u².

The edge weights and the mixed areas are those of Meyer, Desbrun, Schröder and Barr, "Discrete differential-geometry
operators for triangulated 2-manifolds" (2003).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_array, diags_array

from ..arrays import check_array
from ..errors import InputError

Array = NDArray[np.floating[Any]]


def cotangent_weights(vertices: ArrayLike, triangles: ArrayLike) -> csr_array:
    """Return ``L*`` with ``w_ij = ½ (cot α_ij + cot β_ij)``, (V, V), no unit.

    Triangles without area carry no weight.
    """
    vertices, triangles = _check_mesh(vertices, triangles)
    cotangents, _, _ = _corners(vertices, triangles)
    ends = [(1, 2), (2, 0), (0, 1)]
    rows = np.concatenate([triangles[:, a] for a, _ in ends])
    columns = np.concatenate([triangles[:, b] for _, b in ends])
    return _laplacian(rows, columns, 0.5 * cotangents.T.ravel(), len(vertices))


def uniform_weights(n_vertices: int, triangles: ArrayLike) -> csr_array:
    """Return ``L*`` with weight 1 on every edge, (V, V): the graph Laplacian with negative diagonal."""
    triangles = check_array(triangles, name="triangles", shape=(None, 3), dtype=np.int64)
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges = np.unique(edges, axis=0)
    return _laplacian(edges[:, 0], edges[:, 1], np.ones(len(edges)), n_vertices)


def vertex_areas(vertices: ArrayLike, triangles: ArrayLike) -> Array:
    """Return the mixed Voronoi area around each vertex (Figure 5.2), (V,), in the square of the vertices' unit.

    In a triangle without obtuse angle it is the Voronoi area; the obtuse corner of another gets half of it, the two
    other corners a quarter each. The areas sum to that of the mesh.
    """
    vertices, triangles = _check_mesh(vertices, triangles)
    cotangents, squares, areas = _corners(vertices, triangles)
    weighted = squares * cotangents  # Of the side opposite each corner.
    voronoi = (weighted.sum(1, keepdims=True) - weighted) / 8.0
    obtuse = cotangents < 0
    mixed = np.where(obtuse, areas[:, None] / 2, areas[:, None] / 4)
    shares = np.where(obtuse.any(1, keepdims=True), mixed, voronoi)
    return np.bincount(triangles.ravel(), shares.ravel(), minlength=len(vertices)).astype(np.float64)


def laplacian(weights: csr_array, areas: ArrayLike) -> csr_array:
    """Return ``L = M⁻¹ L*``; rows of vertices without area (in no triangle) are zero."""
    return csr_array(diags_array(_inverse(np.asarray(areas, dtype=np.float64))) @ weights)


def thin_shell_operator(weights: csr_array, areas: ArrayLike, k_s: float = 1.0, k_b: float = 1.0) -> csr_array:
    """Return ``A = −k_s L + k_b L²`` (2.15, 5.25 with the square that 5.17 lacks), (V, V)."""
    L = laplacian(weights, areas)
    return csr_array(-k_s * L + k_b * (L @ L))


def thin_shell_energy(weights: csr_array, areas: ArrayLike, k_s: float = 1.0, k_b: float = 1.0) -> csr_array:
    """Return ``K = −k_s L* + k_b L* M⁻¹ L*`` (2.16), (V, V), symmetric and positive semidefinite.

    ``dᵀ K d`` is the discrete thin-shell energy (5.15) of one coordinate ``d`` of a displacement.
    """
    bend = weights @ diags_array(_inverse(np.asarray(areas, dtype=np.float64))) @ weights
    return csr_array(-k_s * weights + k_b * bend)


def _check_mesh(vertices: ArrayLike, triangles: ArrayLike) -> tuple[Array, NDArray[np.int64]]:
    vertices = check_array(vertices, name="vertices", shape=(None, 3), finite=True)
    triangles = check_array(triangles, name="triangles", shape=(None, 3), dtype=np.int64)
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(vertices)):
        raise InputError(f"triangles: expected vertex numbers below {len(vertices)}, but got {triangles.max()}")
    return vertices, triangles


def _corners(vertices: Array, triangles: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Return per triangle the cotangents at its corners and the squared opposite sides (T, 3), and areas (T,)."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    squares = np.stack([((c - b) ** 2).sum(1), ((a - c) ** 2).sum(1), ((b - a) ** 2).sum(1)], axis=1)
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    solid = areas > 1e-14 * squares.max(1, initial=0.0)
    # The law of cosines over the sine: cot A = (b² + c² − a²) / 4 area.
    numerator = squares.sum(1, keepdims=True) - 2 * squares
    cotangents = np.where(solid[:, None], numerator / np.where(solid, 4 * areas, 1.0)[:, None], 0.0)
    return cotangents, squares, np.where(solid, areas, 0.0)


def _laplacian(rows: NDArray, columns: NDArray, values: Array, n: int) -> csr_array:
    """Return the symmetric matrix with ``values`` off the diagonal and rows that sum to zero."""
    half = coo_array((values, (rows, columns)), shape=(n, n))
    off = csr_array(half + half.T)
    return csr_array(off - diags_array(off.sum(axis=1)))


def _inverse(areas: Array) -> Array:
    return np.divide(1.0, areas, out=np.zeros_like(areas), where=areas > 0)
