"""Lips: rings around the mouth, from inside it over the line of contact and the red out to the cheek.

Ring 3 is the line where the lips meet, ring 4 the fullest part of the red, ring 5 its border; the last ring lies
on the face. Turns run from the middle of the upper lip (0) to the corner (half) and back to the middle below.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from .sculpture import cast

Floats = NDArray[np.float64]

RINGS, TURNS = 9, 20
CORNER_X, SEAM_Y = 24.5, -69.0
CONTACT, RED, BORDER = 3, 4, 5

# corner's x, height above and below the seam in mid mouth, how pointed the ring is at the corner
_CORNER = np.array([20.5, 22.0, 23.8, 25.0, 26.0, 27.2, 29.8, 33.0, 36.5])
_ABOVE = np.array([9.0, 4.5, 0.9, 0.03, 3.2, 7.4, 10.0, 12.6, 15.0])
_BELOW = np.array([9.0, 4.5, 0.9, 0.03, 4.4, 9.2, 12.6, 16.0, 19.5])
_POINTED = np.array([0.8, 0.8, 0.9, 1.0, 1.0, 0.95, 0.75, 0.6, 0.5])


def seam(t: Floats, tubercle: float | Floats = 1.0) -> Floats:
    """Return the height of the line of contact at ``t`` = x / corner's x, mm."""
    middle = 0.5 * np.exp(-(((t - 0.42) / 0.22) ** 2)) - 0.8 * np.exp(-((t / 0.20) ** 2))
    return SEAM_Y + tubercle * middle + 2.5 * t**4


def surface(ring: Floats, turn: Floats) -> Floats:
    """Return skin positions at (ring, turn), (n, 3), mm."""
    half = TURNS / 2
    upper = turn <= half
    s = np.where(upper, turn, TURNS - turn) / half  # 0 middle … 1 corner
    rows = []
    for k in range(RINGS):
        even = 0.75 if k <= 5 else 0.75 - 0.25 * (k - 5)
        t = np.minimum(even * s + (1 - even) * np.sin(0.5 * np.pi * s), 1.0)
        upper_arch = (1 - t**2.0) ** _POINTED[k]
        lower_arch = (1 - t**2.5) ** _POINTED[k]
        x = _CORNER[k] * t
        height = np.where(upper, _ABOVE[k] * upper_arch, -_BELOW[k] * lower_arch)
        bow = np.exp(-((t / 0.15) ** 2))
        if k in (5, 6):
            height = height - np.where(upper, (1.5, 0.9)[k - 5] * bow, 0.0)
        tubercle = np.where(upper, (1.0 if k <= 4 else 0.4), (1.0 if k <= 3 else 0.0))
        line = seam(np.clip(x / CORNER_X, 0, 1.15), tubercle) if k <= 6 else seam(t, 0.0)
        y = line + height
        start = np.stack([x, y, np.zeros_like(x)], -1)
        if k < 5:  # the face's depth at the border, so that the red follows the arch of the teeth
            start[:, 1] = line
        point = cast(start, np.broadcast_to([0.0, 0.0, 1.0], start.shape), reach=140.0)
        point[:, 1] = y
        rows.append(point)
    table = np.stack(rows)
    full = np.sqrt(np.clip(1 - s * s, 0, 1))
    depth = np.array([-12.0, -10.5, -6.0, -1.5, 2.0, 1.0, 0.2, 0.0, 0.0])
    for k in range(RINGS):
        # the red flattens towards the corners, the lower lip is a little fuller
        red = np.where(upper | (k == 6), 1.0, 1.1) * (0.25 + 0.75 * full)
        table[k, :, 2] += depth[k] * (red if k in (4, 5, 6) else 0.9 + 0.1 * full)
    spline = Akima1DInterpolator(np.arange(RINGS), table, axis=0, method="makima")
    out = np.empty((len(turn), 3))
    for value in np.unique(ring):
        here = ring == value
        out[here] = spline(value)[here]
    out[(turn == 0) | (turn == TURNS), 0] = 0.0
    return out
