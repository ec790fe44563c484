"""Where planes cut the skin: the profile of a face, and level sections through it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .face_surface import FaceSurface
from .rig import Rig

Array = NDArray[np.floating[Any]]

STEP = 0.25  # mm between the samples of a section; far below what a vertex can resolve


def cut_skin(rig: Rig, surface: FaceSurface, axis: int, value: float, step: float = STEP) -> tuple[Array, Array]:
    """Return the foremost outline of the visible skin in a plane.

    Parameters
    ----------
    rig, surface
        The face.
    axis
        0 for the plane x = ``value`` (a profile), 1 for y = ``value`` (a level section).
    value
        Where the plane is, mm.
    step
        Distance between samples, mm.

    Returns
    -------
    along
        (n,) rising, mm: y of a profile, x of a level section.
    forward
        (n,) the greatest z there, mm; gaps are bridged by straight lines. Both are empty where the plane misses the
        skin.
    """
    triangles = rig.triangles[surface.visible[rig.triangles].all(axis=1)]
    corners = rig.neutral[triangles]
    side = corners[:, :, axis] - value
    # A vertex in the plane counts as a hair's breadth beside it, so that every cut triangle has two cut sides.
    side = np.where(side == 0, 1e-9, side)
    crossed = np.flatnonzero((side > 0).any(axis=1) & (side < 0).any(axis=1))
    if not len(crossed):
        return np.empty(0), np.empty(0)
    corners, side = corners[crossed], side[crossed]
    other = 1 - axis
    ends = np.full((len(crossed), 2, 2), np.nan)
    filled = np.zeros(len(crossed), dtype=np.int64)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        cut = (side[:, a] > 0) != (side[:, b] > 0)
        share = side[cut, a] / (side[cut, a] - side[cut, b])
        point = corners[cut, a] + share[:, None] * (corners[cut, b] - corners[cut, a])
        ends[np.flatnonzero(cut), filled[cut]] = point[:, [other, 2]]
        filled[cut] += 1
    low, high = ends[:, :, 0].min(), ends[:, :, 0].max()
    along = np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step
    forward = np.full(len(along), -np.inf)
    for (s0, z0), (s1, z1) in ends:
        first, last = np.searchsorted(along, [min(s0, s1) - 1e-9, max(s0, s1) + 1e-9])
        here = along[first:last]
        share = (here - s0) / (s1 - s0) if s1 != s0 else np.zeros(len(here))
        np.maximum(forward[first:last], z0 + share * (z1 - z0), out=forward[first:last])
    hit = np.isfinite(forward)
    return along, np.interp(along, along[hit], forward[hit]) if hit.any() else forward


def farthest_from_chord(along: Array, forward: Array, start: float, end: float, sign: float) -> float:
    """Return where an outline is farthest from the straight line between two of its points.

    Parameters
    ----------
    along, forward
        An outline as :func:`cut_skin` gives it.
    start, end
        Ends of the chord on ``along``, in any order.
    sign
        +1 for the point farthest in front of the chord, −1 for the point farthest behind it.

    Returns
    -------
    The place on ``along``; NaN where fewer than three samples lie between the ends.
    """
    low, high = sorted((start, end))
    inside = (along >= low) & (along <= high)
    if inside.sum() < 3:
        return float("nan")
    s, z = along[inside], forward[inside]
    chord = z[0] + (z[-1] - z[0]) * (s - s[0]) / (s[-1] - s[0])
    return float(s[np.argmax(sign * (z - chord))])
