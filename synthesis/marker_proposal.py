"""Propose a marker map from a few landmarks: align, adapt, take the nearest vertex, say how far each marker is off.

A proposal is for a person to look at, not to trust: markers that end far from the skin are on another face than the
rig's, misnamed, or paired with the wrong landmark.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from ..arrays import check_array
from ..errors import RigError
from .alignment import align_points
from .marker_map import check_vertices
from .morph_map import MorphMap
from .rig import Rig

Array = NDArray[np.floating[Any]]

RIDGE = 0.1
"""Ridge of the map that bends the signer's face towards the rig's: landmarks are rough, so they only pull."""


def propose_marker_map(
    rig: Rig,
    neutral: ArrayLike,
    markers: Sequence[str],
    landmarks: Mapping[str, int],
    *,
    rounds: int = 5,
    candidates: ArrayLike | None = None,
) -> pd.DataFrame:
    """Propose the vertex of each marker.

    The markers are moved onto the rig by the similarity of the landmark pairs. Then, ``rounds`` times, a smooth map
    (radial basis functions ``φ(r) = r`` with an affine part and ridge) is fitted from all markers to their nearest
    points on the skin, with the landmarks to their vertices, and applied. Last, each marker takes the nearest vertex
    that is free, nearest markers first.

    Parameters
    ----------
    rig
        The rig, mm.
    neutral
        (P, 3) the signer's neutral markers, any place, turn and size; NaN where one is missing: it is left out.
    markers
        P names.
    landmarks
        Vertex of a few markers, at least four that are not in one plane; eye corners, nose, mouth corners, chin.
    rounds
        How often the map is refined; 0 keeps the similarity.
    candidates
        Vertex numbers that markers may take; all by default.

    Returns
    -------
    DataFrame ``marker, vertex, distance``: how far, mm, each marker was from the skin after the *similarity*, that is,
    how well the two faces agree there. Sorted as ``markers``.

    Raises
    ------
    RigError
        If a landmark names an unknown marker or vertex, is missing in the neutral, or the landmarks are too few.
    """
    neutral = check_array(neutral, name="neutral markers", shape=(len(markers), 3))
    names = [str(m) for m in markers]
    unknown = [m for m in landmarks if m not in names]
    if unknown:
        raise RigError(f"landmarks: there is no marker {', '.join(unknown)}; the markers are {', '.join(names)}")
    seen = np.isfinite(neutral).all(1)
    lost = [m for m in landmarks if not seen[names.index(m)]]
    if lost:
        raise RigError(f"landmarks: {', '.join(lost)} is missing in the neutral frame; choose another frame")
    targets = check_vertices(rig, np.array(list(landmarks.values()), dtype=np.int64), list(landmarks))
    allowed = np.arange(rig.n_vertices) if candidates is None else check_vertices(rig, candidates)
    rows = np.flatnonzero(seen)
    pairs = np.array([int(np.flatnonzero(rows == names.index(m))[0]) for m in landmarks], dtype=np.int64)

    placed: Array = align_points(neutral[rows[pairs]], rig.neutral[targets], scale=True).apply(neutral[rows])
    skin = _Skin(rig)
    distance = np.linalg.norm(placed - skin.nearest(placed), axis=1)
    for _ in range(rounds):
        goals = skin.nearest(placed)
        goals[pairs] = rig.neutral[targets]
        placed = MorphMap.fit(placed, goals, kernel="linear", ridge=RIDGE, names=[names[r] for r in rows])(placed)

    vertices = _assign(placed, rig.neutral[allowed])
    return pd.DataFrame(
        {
            "marker": pd.array([names[r] for r in rows], dtype="str"),
            "vertex": allowed[vertices],
            "distance": distance,
        }
    )


def _assign(points: Array, vertices: Array) -> NDArray[np.int64]:
    """Give each point the nearest vertex that is free, nearest points first."""
    if len(vertices) < len(points):
        raise RigError(f"marker map: expected at least {len(points)} vertices to choose from, but got {len(vertices)}")
    k = min(len(points), len(vertices))
    found = KDTree(vertices).query(points, k=k)
    distances, nearest = (np.asarray(a).reshape(len(points), k) for a in found)
    chosen = np.empty(len(points), dtype=np.int64)
    taken: set[int] = set()
    for i in np.argsort(distances[:, 0], kind="stable"):
        chosen[i] = next(int(v) for v in nearest[i] if int(v) not in taken)
        taken.add(int(chosen[i]))
    return chosen


class _Skin:
    """Nearest points on the surface of the rig's neutral."""

    NEIGHBOURS = 8

    def __init__(self, rig: Rig) -> None:
        self._corners = rig.neutral[rig.triangles]
        self._tree = KDTree(self._corners.mean(1))

    def nearest(self, points: Array) -> Array:
        """Return the nearest point of the triangles whose middles are nearest, (n, 3)."""
        k = min(self.NEIGHBOURS, len(self._corners))
        _, index = self._tree.query(points, k=k)
        corners = self._corners[np.asarray(index).reshape(len(points), k)]
        feet = closest_on_triangles(points[:, None, :], corners)
        best = np.linalg.norm(feet - points[:, None, :], axis=2).argmin(1)
        return feet[np.arange(len(points)), best]


def closest_on_triangles(points: Array, corners: Array) -> Array:
    """Return the point of each triangle that is nearest to a point.

    Parameters
    ----------
    points
        (..., 3).
    corners
        (..., 3, 3) the three corners.

    Returns
    -------
    (..., 3): the foot of the perpendicular where it lies inside, else the nearest point of the three sides.
    """
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    area = uu * vv - uv * uv
    safe = np.where(area > 0, area, 1.0)
    s, t = (vv * wu - uv * wv) / safe, (uu * wv - uv * wu) / safe
    inside = (area > 0) & (s >= 0) & (t >= 0) & (s + t <= 1)
    best = a + s[..., None] * u + t[..., None] * v
    gap = np.where(inside, ((best - points) ** 2).sum(-1), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        length = (side * side).sum(-1)
        along = np.clip(((points - start) * side).sum(-1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
        foot = start + along[..., None] * side
        away = ((foot - points) ** 2).sum(-1)
        nearer = away < gap
        best, gap = np.where(nearer[..., None], foot, best), np.where(nearer, away, gap)
    return best
