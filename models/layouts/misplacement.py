"""Markers that were glued beside their place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ...arrays import check_array
from ...errors import InputError
from ...synthesis import Rig

__all__ = ["Sites", "place_beside"]

Array = NDArray[np.floating[Any]]

N_NEAR = 40
"""Triangles near the wanted place that are tried."""


@dataclass(frozen=True)
class Sites:
    """Places on the skin: corners of triangles (n_markers, 3) and the share (n_markers, 3) of each corner."""

    corners: NDArray[np.int64]
    shares: Array

    @classmethod
    def at(cls, vertices: ArrayLike) -> Sites:
        """Return the places of vertices."""
        numbers = check_array(vertices, name="vertices", shape=(None,), dtype=np.int64)
        return cls(np.repeat(numbers[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(numbers), 1)))

    def neutral(self, rig: Rig) -> Array:
        """Return (n_markers, 3) positions on a rig's neutral, mm."""
        return np.einsum("pcd,pc->pd", rig.neutral[self.corners], self.shares)

    def on(self, rig: Rig, weights: Array) -> Array:
        """Return (n_frames, n_markers, 3) positions on a face that makes these weights, mm."""
        moves = np.einsum("npcd,pc->npd", rig.deltas[:, self.corners], self.shares)
        return self.neutral(rig) + np.tensordot(weights, moves, axes=1)


def place_beside(rig: Rig, vertices: ArrayLike, off: float, rng: np.random.Generator) -> Sites:
    """Return places on the skin at about ``off`` mm from vertices, in random directions.

    Each place is the point of the mesh nearest a point ``off`` mm away in the tangent plane; on curved skin, or where
    the mesh ends, it may be nearer. Triangles that look the other way (the inside of the lips) are left out.

    Parameters
    ----------
    rig
        The face.
    vertices
        (n_markers,) where the markers should be.
    off
        mm, straight, 0 or more.
    rng
        Draws the directions.
    """
    if not (np.isfinite(off) and off >= 0):
        raise InputError(f"off: expected mm, 0 or more, but got {off}")
    numbers = check_array(vertices, name="vertices", shape=(None,), dtype=np.int64)
    if off == 0:
        return Sites.at(numbers)
    corners = rig.neutral[rig.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upright = np.zeros_like(rig.neutral)
    for c in range(3):
        np.add.at(upright, rig.triangles[:, c], normals)
    tree = cKDTree(corners.mean(axis=1))
    found, shares = np.empty((len(numbers), 3), dtype=np.int64), np.empty((len(numbers), 3))
    for p, vertex in enumerate(numbers):
        normal = upright[vertex] / max(float(np.linalg.norm(upright[vertex])), 1e-12)
        way = rng.normal(size=3)
        way -= (way @ normal) * normal
        wanted = rig.neutral[vertex] + off * way / np.linalg.norm(way)
        near = np.atleast_1d(tree.query(wanted, k=min(N_NEAR, len(corners)))[1])
        facing = near[normals[near] @ normal > 0]
        near = facing if len(facing) else near
        share = _nearest_shares(corners[near], wanted)
        away = np.linalg.norm(np.einsum("tcd,tc->td", corners[near], share) - wanted, axis=1)
        best = int(np.argmin(away))
        found[p], shares[p] = rig.triangles[near[best]], share[best]
    return Sites(found, shares)


def _nearest_shares(triangles: Array, point: Array) -> Array:
    """Return shares of the corners whose sum is near the point: its projection, pushed back into each triangle."""
    edges = triangles[:, 1:] - triangles[:, :1]
    gram = edges @ edges.transpose(0, 2, 1)
    gram += 1e-12 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(2) + 1e-15 * np.eye(2)
    inner = np.linalg.solve(gram, (edges @ (point - triangles[:, 0])[:, :, None]))[:, :, 0]
    shares = np.maximum(np.column_stack([1.0 - inner.sum(axis=1), inner]), 0.0)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))
