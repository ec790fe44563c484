"""Direct deformation of a mesh as a thin shell, pulled by its markers (Reverdy 2019, 2.15-2.17).

No shapes and no weights: the displacement ``d`` of every vertex makes ``dᵀ K d`` least, with
``K = −k_s L* + k_b ℓ² L* M⁻¹ L*`` (2.16), while the marker vertices are held where the markers are. Splitting the
vertices into free (f) and held (h) ones, that is ``K_ff d_f = −K_fh d_h``, the thesis's ``a d* = b`` (2.17; its normal
equations are not needed, since ``K_ff`` is already symmetric and positive definite). The answer is linear in the
markers, so one factorisation a marker set gives a matrix that does every frame.

Here it is what weights are compared with: it fits the markers exactly, and knows of faces only that they are smooth.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu
from scipy.spatial import KDTree

from ..arrays import check_array
from ..errors import InputError, RigError
from .marker_map import check_vertices
from .mesh_operators import cotangent_weights, thin_shell_energy, vertex_areas
from .rig import Rig

Array = NDArray[np.floating[Any]]


class ThinShellDeformation:
    """The mesh of a rig's neutral, bent by markers.

    Parameters
    ----------
    rig
        Neutral and triangles, mm; its shapes are not used.
    vertices
        (P,) the vertex that each marker sits on.
    k_s, k_b
        Stiffness against stretching and bending, not negative and not both 0.
    length
        ``ℓ``, mm, at which ``k_s = k_b = 1`` is a balance of the two; by default the median distance of a marker to its
        nearest neighbour, so that displacements do not depend on the unit.
    fixed
        Vertices that stay where they are (scalp, neck). None by default.

    Attributes
    ----------
    response
        (n_vertices, P) displacement of each vertex for a displacement of 1 of each marker, in any direction alike.
        Parts of the mesh without a marker or fixed vertex stay at rest.

    Raises
    ------
    RigError
        If the vertices do not exist, repeat, or are also fixed.
    InputError
        If the stiffnesses or the length are out of range.
    """

    def __init__(
        self,
        rig: Rig,
        vertices: ArrayLike,
        *,
        k_s: float = 1.0,
        k_b: float = 1.0,
        length: float | None = None,
        fixed: ArrayLike | None = None,
    ) -> None:
        self.vertices = check_vertices(rig, vertices)
        self.neutral = rig.neutral
        still = np.empty(0, dtype=np.int64) if fixed is None else np.unique(np.asarray(fixed, dtype=np.int64))
        if still.size and (still[0] < 0 or still[-1] >= rig.n_vertices):
            raise RigError(f"fixed: expected vertex numbers from 0 to {rig.n_vertices - 1}, but got {still[[0, -1]]}")
        shared = np.intersect1d(still, self.vertices)
        if shared.size:
            raise RigError(f"fixed: vertex {shared[0]} carries a marker, so it cannot also stay at rest")
        if not (min(k_s, k_b) >= 0 and max(k_s, k_b) > 0 and np.isfinite(k_s + k_b)):
            raise InputError(f"k_s and k_b: expected numbers of 0 or more, not both 0, but got {k_s} and {k_b}")
        scale = _marker_spacing(rig.neutral[self.vertices]) if length is None else float(length)
        if not (np.isfinite(scale) and scale > 0):
            raise InputError(f"length: expected mm above 0, but got {scale}")
        areas = vertex_areas(rig.neutral, rig.triangles)
        K = thin_shell_energy(cotangent_weights(rig.neutral, rig.triangles), areas, k_s, k_b * scale**2)
        self.response, self._stiffness = _respond(K, self.vertices, still)

    def solve(self, positions: ArrayLike) -> Array:
        """Return the mesh of every frame.

        Parameters
        ----------
        positions
            (F, P, 3) marker positions in the rig's space, mm. A NaN marker pulls at nothing in that frame.

        Returns
        -------
        (F, n_vertices, 3) vertex positions, mm; NaN for frames without any marker.
        """
        return self.neutral + self.displacements(positions)

    def displacements(self, positions: ArrayLike, vertices: ArrayLike | None = None) -> Array:
        """Return (F, n_vertices, 3) the displacement from the neutral, mm; of some vertices only where asked."""
        positions = check_array(positions, name="positions", shape=(None, len(self.vertices), 3))
        moved = self._fill(positions - self.neutral[self.vertices])
        chosen = self.response if vertices is None else self.response[np.asarray(vertices, dtype=np.int64)]
        return np.matmul(chosen, moved)

    def _fill(self, moved: Array) -> Array:
        """Put missing markers where the sheet, held by the others only, comes to rest."""
        seen = np.asarray(np.isfinite(moved).all(axis=2))
        if seen.all():
            return moved
        filled = moved.copy()
        patterns, group = np.unique(seen, axis=0, return_inverse=True)
        for k, pattern in enumerate(patterns):
            frames = np.flatnonzero(group.reshape(-1) == k)
            if pattern.all():
                continue
            if not pattern.any():
                filled[frames] = np.nan
                continue
            # The energy of the whole sheet in terms of its markers, least over the missing ones.
            inner = self._stiffness[np.ix_(~pattern, ~pattern)]
            outer = self._stiffness[np.ix_(~pattern, pattern)]
            # Parts that have lost all their markers leave this singular; least norm keeps them at rest.
            follow = -np.linalg.lstsq(inner, outer, rcond=1e-10)[0]
            filled[np.ix_(frames, np.flatnonzero(~pattern))] = np.matmul(follow, moved[frames][:, pattern])
        return filled


def _marker_spacing(points: Array) -> float:
    """Return the median distance of a point to its nearest neighbour; 1 for a single point."""
    if len(points) < 2:
        return 1.0
    return float(np.median(KDTree(points).query(points, k=2)[0][:, 1]))


def _respond(K: csr_array, vertices: NDArray[np.int64], fixed: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return the response (V, P) to the markers and the energy ``Kₘ`` (P, P) of the sheet in terms of them."""
    n_vertices = K.shape[0]
    held = np.zeros(n_vertices, dtype=bool)
    held[vertices] = held[fixed] = True
    _, part = connected_components(K, directed=False)
    free = np.flatnonzero(~held & np.isin(part, np.unique(part[held])))
    response = np.zeros((n_vertices, len(vertices)))
    response[vertices] = np.eye(len(vertices))
    if free.size:
        K_ff = csc_array(K[free][:, free])
        K_fh = K[free][:, vertices].toarray()
        response[free] = splu(K_ff, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(-K_fh)
    stiffness = np.asarray((K @ response)[vertices])
    return response, 0.5 * (stiffness + stiffness.T)
