"""Where markers may sit: candidates, mirrored pairs, distances, forbidden and kept vertices.

A *unit* is what is chosen at once: with mirror symmetry a pair of mirrored vertices or one vertex of the midline, else
any one vertex.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ...errors import InputError
from ...synthesis import Rig
from ...synthesis.marker_map import check_vertices
from .kmeans import find_moving_vertices

__all__ = ["Places", "find_places", "mirror_by_position", "spread_points"]

Array = NDArray[np.floating[Any]]
Vertices = NDArray[np.int64]

SCARCE = 3
"""One pair may take the last so many places of the midline away, by standing too near them."""


@dataclass(frozen=True)
class Places:
    """Candidates for markers and how they may be combined.

    Parameters
    ----------
    vertices
        (n_candidates,) vertex numbers; what follows counts in places of this list.
    positions
        (n_candidates, 3) on the neutral, mm.
    singles, pairs
        (n, 1) and (m, 2) units.
    kept
        (k,) candidates that every layout has.
    min_distance
        mm between any two markers, straight; kept markers may be nearer each other.
    """

    vertices: Vertices
    positions: Array
    singles: Vertices
    pairs: Vertices
    kept: Vertices
    min_distance: float

    def allowed(self, units: Vertices, chosen: ArrayLike) -> Vertices:
        """Return the units of which no vertex is chosen or too near one that is."""
        taken = np.asarray(chosen, dtype=np.int64)
        if not len(taken) or not len(units):
            return units
        far = cKDTree(self.positions[taken]).query(self.positions)[0] >= max(self.min_distance, 1e-9)
        far[taken] = False
        return units[far[units].all(axis=1)]

    def choices(self, chosen: ArrayLike, n_left: int) -> list[Vertices]:
        """Return the units that may come next when ``n_left`` markers are to be chosen, by size."""
        singles = self.allowed(self.singles, chosen)
        pairs = self.allowed(self.pairs, chosen) if n_left > 1 else self.pairs[:0]
        # An odd rest needs the midline: take its last places in time, and leave them alone where the rest is even.
        if len(pairs) and len(singles) <= SCARCE:
            odd_and_possible = n_left % 2 == 1 and len(singles) > 0
            singles, pairs = (singles, pairs[:0]) if odd_and_possible else (singles[:0], pairs)
        return [units for units in (singles, pairs) if len(units)]


def find_places(
    rig: Rig,
    n_markers: int,
    *,
    mirror: bool | ArrayLike = False,
    forbidden: ArrayLike | None = None,
    keep: ArrayLike | None = None,
    min_distance: float = 0.0,
    n_candidates: int = 600,
    least: float = 0.5,
) -> Places:
    """Collect the places that markers may take.

    Parameters
    ----------
    rig
        The face.
    n_markers
        How many markers there will be; kept ones count.
    mirror
        Whether markers come in mirrored pairs or on the midline; or (n_vertices,) the mirrored vertex of each vertex,
        itself on the midline, −1 where there is none.
    forbidden
        Vertices that take no marker: lids, inner lips.
    keep
        Vertices that have one in any case; they are not mirrored.
    min_distance
        mm, straight, between two markers on the neutral.
    n_candidates
        About how many vertices to consider, spread evenly over the skin.
    least
        Vertices that no shape moves by more than this, in mm, are left out.

    Raises
    ------
    InputError
        If the numbers contradict each other, or fewer places remain than markers are asked for.
    """
    if not np.isfinite(min_distance) or min_distance < 0:
        raise InputError(f"min_distance: expected mm, 0 or more, but got {min_distance}")
    kept = _numbers(rig, keep)
    banned = _numbers(rig, forbidden)
    both = np.intersect1d(kept, banned)
    if both.size:
        raise InputError(f"keep: vertex {both[0]} is also forbidden")
    moving = find_moving_vertices(rig, least)
    if not 1 <= n_markers <= len(moving):
        raise InputError(f"n_markers: expected 1 to {len(moving)}, the vertices that move, but got {n_markers}")
    if len(kept) > n_markers:
        raise InputError(f"keep: {len(kept)} markers must stay, but only {n_markers} are asked for")
    free = np.setdiff1d(moving, np.concatenate([kept, banned]))
    if isinstance(mirror, bool | np.bool_):
        twins = mirror_by_position(rig) if mirror else None
    else:
        twins = np.asarray(mirror, dtype=np.int64)
        if twins.shape != (rig.n_vertices,) or twins.min() < -1 or twins.max() >= rig.n_vertices:
            raise InputError(f"mirror: expected the mirrored vertex of each of {rig.n_vertices} vertices, or -1")
    lone, left = (free, free[:0]) if twins is None else _split(rig, free, twins)
    n_left = n_markers - len(kept)
    if len(left):  # The midline is a line, the side an area: thin each by itself, the line as densely as the side.
        left = left[spread_points(rig.neutral[left], max(n_candidates // 2, n_left))]
        lone = lone[spread_points(rig.neutral[lone], max(n_candidates // 8, n_left))]
    else:
        lone = lone[spread_points(rig.neutral[lone], max(n_candidates, n_left))]
    right = left if twins is None else twins[left]
    vertices = np.concatenate([lone, left, right, kept])
    n, m = len(lone), len(left)
    pairs = np.column_stack([np.arange(n, n + m), np.arange(n + m, n + 2 * m)])
    positions = rig.neutral[vertices]
    wide = np.linalg.norm(positions[pairs[:, 0]] - positions[pairs[:, 1]], axis=1) >= min_distance
    if n + 2 * int(wide.sum()) < n_left or (n_left == 1 and n == 0):
        what = "mirrored pairs and places on the midline" if twins is not None else "places"
        raise InputError(f"layout: too few {what} for {n_left} markers; forbid fewer vertices or set mirror=False")
    places = np.arange(n + 2 * m, len(vertices))
    return Places(vertices, positions, np.arange(n)[:, None], pairs[wide], places, float(min_distance))


def mirror_by_position(rig: Rig, tolerance: float | None = None) -> Vertices:
    """Return the mirrored vertex of each vertex by position, itself on the midline, −1 where there is none.

    The mirror plane is normal to X. Of the origin, the middle of the extent and the median, it goes through the one
    under which the mesh mirrors best. Two vertices are twins if each is the nearest to the other's image.

    Parameters
    ----------
    rig
        The face.
    tolerance
        How far from its image a twin may be, mm; half the median length of the mesh's edges by default.
    """
    points = rig.neutral
    if tolerance is None:
        edges = np.linalg.norm(points[rig.triangles[:, 0]] - points[rig.triangles[:, 1]], axis=1)
        tolerance = 0.5 * float(np.median(edges)) if len(edges) else 0.0
    tree = cKDTree(points)
    x = points[:, 0]
    found = []
    for middle in (0.0, 0.5 * (x.min() + x.max()), float(np.median(x))):
        distances, twins = tree.query(points * [-1.0, 1.0, 1.0] + [2.0 * middle, 0.0, 0.0])
        found.append((float(distances.mean()), distances, twins))
    _, distances, twins = min(found, key=lambda row: row[0])
    own = np.arange(len(points))
    return np.where((distances <= tolerance) & (twins[twins] == own), twins, -1).astype(np.int64)


def spread_points(points: Array, n_points: int) -> Vertices:
    """Return up to n_points points, each the farthest from those before it (Gonzalez 1985); all if there are fewer."""
    if len(points) <= n_points:
        return np.arange(len(points))
    centre = int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmin())
    chosen = [centre]
    away = np.linalg.norm(points - points[centre], axis=1)
    while len(chosen) < n_points:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.sort(np.array(chosen, dtype=np.int64))


def _numbers(rig: Rig, vertices: ArrayLike | None) -> Vertices:
    array = np.asarray([] if vertices is None else vertices)
    return np.zeros(0, dtype=np.int64) if array.size == 0 else np.unique(check_vertices(rig, np.unique(array)))


def _split(rig: Rig, free: Vertices, twins: Vertices) -> tuple[Vertices, Vertices]:
    """Return the free vertices of the midline and, of each free pair, the one on the subject's left."""
    own = twins[free] == free
    mutual = (twins[free] >= 0) & (twins[twins[free]] == free)  # Else two pairs could share a vertex.
    side = free[~own & mutual & np.isin(twins[free], free)]
    return free[own], side[rig.neutral[side, 0] > rig.neutral[twins[side], 0]]
