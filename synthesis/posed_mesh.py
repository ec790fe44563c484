"""A rig's surface for given weights: vertices and the normals that light needs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .rig import Rig


class PosedMesh:
    """Vertices and normals of a rig, in single precision, as fast as a film needs them.

    Parameters
    ----------
    rig
        The face.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._deltas = rig.deltas.reshape(rig.n_shapes, -1).astype(np.float32)
        corners = rig.triangles.ravel()
        faces = np.repeat(np.arange(len(rig.triangles)), 3)
        ones = np.ones(len(corners), dtype=np.float32)
        self._gather = sparse.csr_array((ones, (corners, faces)), shape=(rig.n_vertices, len(rig.triangles)))

    def points(self, weights: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the vertices for weights (n_shapes,), (n_vertices, 3) in mm (5.2)."""
        moved = weights.astype(np.float32) @ self._deltas
        return self.rig.neutral.astype(np.float32) + moved.reshape(-1, 3)

    def normals(self, points: NDArray[Any]) -> NDArray[np.float32]:
        """Return unit normals at vertices (n_vertices, 3): the adjoining triangles' normals, weighted by their areas.

        Zero where a vertex has no triangle.
        """
        a, b, c = (points[self.rig.triangles[:, i]].astype(np.float32) for i in range(3))
        summed = self._gather @ np.cross(b - a, c - a)
        length = np.linalg.norm(summed, axis=1, keepdims=True)
        return np.divide(summed, length, out=np.zeros_like(summed), where=length > 0)
