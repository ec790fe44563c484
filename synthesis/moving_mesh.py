"""A rig's surface frame by frame, of which only what can move is computed and sent to be drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .animation import Animation
from .rig import Rig


@dataclass(frozen=True)
class Piece:
    """Some triangles of a rig as a mesh of their own.

    Parameters
    ----------
    vertices
        (n,) the rig's numbers of its vertices.
    triangles
        (m, 3) in numbers of its own.
    moves
        Whether any shape moves or turns any of it.
    """

    vertices: NDArray[np.int64]
    triangles: NDArray[np.int64]
    moves: bool


class MovingMesh:
    """Vertices and normals of a rig for one frame after the other, in single precision.

    A vertex that no shape moves keeps its place, one of whose triangles no corner moves keeps its normal. Both are
    computed once.

    Parameters
    ----------
    rig
        The face.
    """

    def __init__(self, rig: Rig) -> None:
        moved = (rig.deltas != 0).any(axis=(0, 2))
        turned = np.zeros(rig.n_vertices, dtype=bool)
        turned[rig.triangles[moved[rig.triangles].any(axis=1)]] = True
        changing = turned[rig.triangles].any(axis=1)
        self.rig = rig
        self.moved = np.flatnonzero(moved)
        """Numbers of the vertices that some shape moves."""
        self.pieces = [
            Piece(*_cut(rig.triangles[chosen]), moves) for chosen, moves in ((changing, True), (~changing, False))
        ]
        """What moves and what never does; what is empty is left out."""
        self.pieces = [piece for piece in self.pieces if len(piece.triangles)]
        self._animation = Animation(Rig(rig.neutral[moved], np.empty((0, 3)), rig.deltas[:, moved], rig.shapes))
        self._turned, self._corners, self._gather = _gather(rig.triangles[changing], turned)
        self.points: NDArray[np.float32] = rig.neutral.astype(np.float32)
        """(n_vertices, 3) of the present frame, mm."""
        self.normals: NDArray[np.float32] = find_normals(self.points, rig.triangles)
        """(n_vertices, 3) of the present frame; zero where a vertex has no triangle."""

    def pose(self, weights: NDArray[np.float64]) -> None:
        """Bring :attr:`points` and :attr:`normals` to weights (n_shapes,), ``V = C·B`` (5.2); NaN counts as neutral."""
        known = weights if np.isfinite(weights).all() else np.zeros_like(weights)
        self.points[self.moved] = self._animation.positions(known[None])[0]
        self.normals[self._turned] = _normalise(self._gather @ _cross_edges(self.points, self._corners))


def find_normals(points: NDArray[Any], triangles: NDArray[Any]) -> NDArray[np.float32]:
    """Return unit normals at vertices (n_vertices, 3): the adjoining triangles' normals, weighted by their areas.

    Zero where a vertex has no triangle.
    """
    _, corners, gather = _gather(triangles, np.ones(len(points), dtype=bool))
    return _normalise(gather @ _cross_edges(points.astype(np.float32), corners))


def _cut(triangles: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices that triangles use, and the triangles in numbers of these."""
    vertices, numbers = np.unique(triangles, return_inverse=True)
    return vertices.astype(np.int64), numbers.reshape(-1, 3).astype(np.int64)


def _gather(
    triangles: NDArray[np.int64], wanted: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64], sparse.csr_array]:
    """Return the wanted vertices, the triangles' corners (3, m), and the matrix that sums triangles at the vertices."""
    vertices = np.flatnonzero(wanted)
    row = np.full(len(wanted), -1)
    row[vertices] = np.arange(len(vertices))
    rows, columns = row[triangles].ravel(), np.repeat(np.arange(len(triangles)), 3)
    kept = rows >= 0
    ones = np.ones(int(kept.sum()), dtype=np.float32)
    gather = sparse.csr_array((ones, (rows[kept], columns[kept])), shape=(len(vertices), len(triangles)))
    return vertices, np.ascontiguousarray(triangles.T), gather


def _cross_edges(points: NDArray[np.float32], corners: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the cross products of triangles' edges (m, 3); written out, since np.cross takes three times as long."""
    origin = points[corners[0]]
    a, b = points[corners[1]] - origin, points[corners[2]] - origin
    crossed = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        crossed[:, i] = a[:, j] * b[:, k] - a[:, k] * b[:, j]
    return crossed


def _normalise(summed: NDArray[np.float32]) -> NDArray[np.float32]:
    length = np.sqrt(np.einsum("ij,ij->i", summed, summed))[:, None]
    return np.divide(summed, length, out=np.zeros_like(summed), where=length > 0)
