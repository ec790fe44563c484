"""Eyelids: rings around the eye, from inside the lid over its margin and the crease out to the orbit.

Positions are found in the sphere of the eyeball: a direction from its centre and a radius. Ring 0 lies under the
lid, ring 1 is the inner and ring 2 the outer edge of the lid's margin, ring 4 the crease; the last ring lies on
the face. Turns run from the inner corner (0) over the upper lid to the outer corner (half) and back below.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from .sculpture import EYE_CENTRE, EYE_RADIUS, cast

Floats = NDArray[np.float64]

RINGS, TURNS = 7, 24
HALF_OPENING = np.radians(57.0)  # azimuth of the corners either side of the opening's middle
MIDDLE = np.radians(4.0)  # azimuth of the opening's middle: a little towards the temple
TILT = np.radians(3.5)  # the outer corner is higher
UPPER, LOWER = np.radians(23.8), np.radians(22.5)  # elevation of the margins in mid opening

MARGIN_HEIGHT = 0.95  # of the lid's inner edge over the eyeball, mm


def margin(turn: Floats) -> tuple[Floats, Floats]:
    """Return azimuth and elevation (rad) of the lid margin at a turn."""
    half = TURNS / 2
    upper = turn <= half
    s = np.where(upper, turn / half, (TURNS - turn) / half)  # 0 inner corner … 1 outer corner
    t = 0.55 * (2 * s - 1) - 0.45 * np.cos(np.pi * s)
    azimuth = MIDDLE + HALF_OPENING * t
    arch = np.maximum(1 - t * t, 0.0)
    # the upper lid is highest a little towards the nose, the lower lid lowest towards the temple
    up = UPPER * arch**0.72 * (1 - 0.10 * t)
    down = -LOWER * arch**0.80 * (1 + 0.12 * t)
    return azimuth, np.where(upper, up, down) + TILT * t


def direction(azimuth: Floats, elevation: Floats) -> Floats:
    """Return unit vectors, (..., 3): azimuth from +Z towards +X, elevation towards +Y."""
    flat = np.cos(elevation)
    return np.stack([np.sin(azimuth) * flat, np.sin(elevation), np.cos(azimuth) * flat], -1)


def _outline(turn: Floats) -> Floats:
    """Return the outermost ring on the face, (n, 3), mm."""
    angle = np.pi - 2 * np.pi * turn / TURNS  # inner corner, up, outer corner, down
    x = EYE_CENTRE[0] + 1.2 + np.where(np.cos(angle) > 0, 22.0, 19.5) * np.cos(angle)
    y = EYE_CENTRE[1] + 0.6 + np.where(np.sin(angle) > 0, 17.5, 18.5) * np.sin(angle) + 1.0 * np.cos(angle)
    return _on_face(x, y)


def _on_face(x: Floats, y: Floats) -> Floats:
    """Return the points of the sculpted face in front of (x, y), (n, 3), mm."""
    start = np.stack([x, y, np.zeros_like(x)], -1)
    return cast(start, np.broadcast_to([0.0, 0.0, 1.0], start.shape), reach=140.0)


def _rings(turn: Floats) -> Floats:
    """Return the positions of all rings at some turns, (RINGS, n, 3), mm."""
    azimuth, elevation = margin(turn)
    half = TURNS / 2
    upper = (turn > 0) & (turn < half)
    away = np.where((turn == 0) | (turn == half), 0.0, np.where(upper, 1.0, -1.0))
    t = (azimuth - MIDDLE) / HALF_OPENING
    open_ = np.sqrt(np.clip(1 - t * t, 0, 1))  # 0 at the corners
    corner = np.sign(t) * (1 - open_)
    # at the corners the crease climbs towards nose and temple: a gutter there would be a dark spot
    climb = (1 - open_) ** 2 * np.where(t < 0, 1.7, 0.9)
    rows = []
    # shifts in elevation and azimuth from the margin (degrees), and height over the eyeball (mm)
    levels = ((7.5, 6.0, 0.75), (-0.5, 0.0, MARGIN_HEIGHT), (2.5, 3.0, 2.1), (9.0, 4.0, 2.3 + climb))
    for lift_up, spread, height in levels:
        shift = away * np.radians(lift_up) * np.where(upper | (lift_up < 7), 1.0, 0.8) * (0.25 + 0.75 * open_)
        towards = direction(azimuth + corner * np.radians(spread), elevation + shift)
        rows.append(EYE_CENTRE + (EYE_RADIUS + np.asarray(height)[..., None]) * towards)
    outline = _outline(turn)
    for fraction, fold in ((0.34, -0.3), (0.67, 0.7)):
        xy = rows[3][:, :2] * (1 - fraction) + outline[:, :2] * fraction
        point = _on_face(xy[:, 0], xy[:, 1])
        point[:, 2] += fold * open_ * np.where(away > 0, 1.0, 0.3)
        rows.append(point)
    rows.append(outline)
    return np.stack(rows)


def surface(ring: Floats, turn: Floats) -> Floats:
    """Return skin positions at (ring, turn), (n, 3), mm."""
    table = _rings(turn)
    spline = Akima1DInterpolator(np.arange(RINGS), table, axis=0, method="makima")
    out = np.empty((len(turn), 3))
    for value in np.unique(ring):
        here = ring == value
        out[here] = spline(value)[here]
    # between rings the lid stays round
    inner = ring < 3
    arm = out[inner] - EYE_CENTRE
    low = np.floor(ring[inner]).astype(int)
    number = np.flatnonzero(inner)
    ends = np.linalg.norm(table[:, number] - EYE_CENTRE, axis=-1)
    pick = np.arange(len(number))
    f = ring[inner] - low
    radius = ends[low, pick] * (1 - f) + ends[np.minimum(low + 1, RINGS - 1), pick] * f
    out[inner] = EYE_CENTRE + arm * (radius / np.linalg.norm(arm, axis=-1))[:, None]
    return out
