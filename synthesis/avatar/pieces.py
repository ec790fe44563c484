"""What sits on and in the skin: eyeballs, lashes, brows, teeth, tongue and the inside of the mouth.

Every function returns the left half of a piece (x ≥ 0) as vertices (n, 3) in mm and triangles; pieces that cross
the midline have vertices at x = 0 exactly, where the mirrored half is welded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import lids
from .grids import Piece, grid_triangles, sheet
from .sculpture import EYE_CENTRE, EYE_RADIUS, cast, head_normal

Floats = NDArray[np.float64]

# rings of the eyeball (degrees from the pupil's axis): pairs close together make crisp edges of colour
PUPIL, IRIS, LIMBUS = 12.0, 28.0, 30.0
EYE_RINGS = np.array([5.5, 11.5, 12.5, 16, 20, 24.5, 27.6, 28.4, 29.6, 30.4, 35, 42, 52, 64, 80, 105, 140.0])
EYE_STEPS = 32


def eyeball() -> Piece:
    """Return the left eyeball: a sphere whose pole is the pupil, with a slight bulge of the cornea."""
    angle = np.radians(EYE_RINGS)[:, None]
    around = np.linspace(0, 2 * np.pi, EYE_STEPS, endpoint=False)[None]
    bulge = EYE_RADIUS + 0.40 * np.clip(1 - (angle / np.radians(33)) ** 2, 0, 1) ** 2
    grid = bulge[..., None] * np.stack(
        [np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle) + 0 * around], -1
    )
    vertices = np.concatenate([grid.reshape(-1, 3), [[0, 0, EYE_RADIUS + 0.40], [0, 0, -EYE_RADIUS]]]) + EYE_CENTRE
    numbers = np.arange(grid.shape[0] * EYE_STEPS).reshape(-1, EYE_STEPS)
    front, back = len(vertices) - 2, len(vertices) - 1
    near, far = numbers[0], numbers[-1]
    fans = [
        np.stack([np.full(EYE_STEPS, front), near, np.roll(near, -1)], -1),
        np.stack([np.full(EYE_STEPS, back), np.roll(far, -1), far], -1),
    ]
    return vertices, np.concatenate([grid_triangles(numbers, closed=True)[:, ::-1], *fans])


LASH_STEPS = 29


def lash_turns() -> Floats:
    """Return the turns of the upper lid margin along which the lashes sit."""
    return np.linspace(1.2, lids.TURNS / 2 - 0.15, LASH_STEPS)


def lashes() -> Piece:
    """Return the upper lashes: one dark tapered ribbon along the margin, swept out and up."""
    turn = lash_turns()
    root = lids.surface(np.full(LASH_STEPS, 1.55), turn)
    out = root - EYE_CENTRE
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    s = np.linspace(0, 1, LASH_STEPS)[:, None]
    length = 0.3 + 2.9 * np.clip(s / 0.8, 0, 1) ** 1.3 * (1 - 0.35 * np.clip((s - 0.85) / 0.15, 0, 1))
    sweep = np.array([1.0, 0.25, 0.0]) * (s - 0.35)
    tip = root + length * (0.75 * out + sweep + np.array([0.0, 0.30, 0.15]))
    middle = 0.5 * (root + tip) - np.array([0, 0.12, 0]) * length
    below = root + (tip - root) * 0.02 - np.array([0.0, 0.55, 0.0])
    up = np.array([0.0, 1.0, 0.0])
    rows = np.stack([below, middle - 0.25 * up, tip, middle + 0.35 * up, root + 0.5 * up])
    numbers = np.arange(rows.shape[0] * LASH_STEPS).reshape(rows.shape[0], LASH_STEPS)
    return rows.reshape(-1, 3), grid_triangles(numbers)


def brow() -> Piece:
    """Return the left brow: a soft ribbon that lies on the brow ridge."""

    def point(u: Floats, v: Floats) -> Floats:
        v = v**1.35  # closer columns where the brow begins
        x = 10.0 + 39.0 * v
        arch = 20.6 + 4.4 * np.sin(np.pi * np.clip(v * 0.88, 0, 1)) ** 1.2 - 3.5 * v**2
        begin = np.sqrt(np.clip(1 - (1 - np.clip(v / 0.16, 0, 1)) ** 2, 0, 1))
        width = 2.9 * begin * (1 - 0.80 * np.clip((v - 0.30) / 0.70, 0, 1) ** 1.25) + 0.15
        across = np.cos(np.pi * u)
        start = np.stack([x - 1.0 * across * (1 - v) * begin, arch + across * width, np.zeros_like(x)], -1)
        skin = cast(start, np.broadcast_to([0.0, 0.0, 1.0], start.shape), reach=140.0)
        height = 1.5 * np.sin(np.pi * u) * (0.3 + 0.7 * np.sqrt(width / 3.7)) - 0.3
        return skin + height[:, None] * head_normal(skin)

    vertices, triangles = sheet(point, 7, 24)
    return vertices, triangles[:, ::-1]


def _arch(v: Floats, half_width: float, depth: float, front: float) -> Floats:
    """Return (x, z) along a dental arch from the midline (0) to the back teeth (1)."""
    angle = 0.5 * np.pi * v
    return np.stack([half_width * np.sin(angle), front - depth * (1 - np.cos(angle) ** 0.9)], -1)


def teeth(upper: bool) -> Piece:
    """Return half a row of teeth: one band along the dental arch, faintly scalloped into teeth."""
    top, tip, front, wide = (-60.0, -71.2, 86.0, 25.0) if upper else (-86.0, -74.4, 84.0, 21.0)

    def point(u: Floats, v: Floats) -> Floats:
        flat = _arch(v, wide, 34.0, front)
        scallop = np.abs(np.cos(5 * np.pi * v)) ** 0.5
        profile = np.interp(u, [0, 0.15, 0.45, 0.8, 0.92, 1.0], [-2.5, 0.2, 0.8, 0.5, -0.4, -2.6])
        y = np.interp(u, [0, 0.15, 0.45, 0.8, 0.92, 1.0], [0.0, 0.1, 0.45, 0.93, 1.0, 0.95])
        tip_here = tip - (0.0 if upper else 6.0) * v**1.5
        y = top + (tip_here - top) * y * (0.96 + 0.04 * scallop)
        inward = np.stack([flat[:, 0] / wide, np.full_like(v, 0.5)], -1)
        inward /= np.linalg.norm(inward, axis=-1, keepdims=True)
        bulge = (profile + 0.35 * (scallop - 1))[:, None] * inward
        return np.stack([flat[:, 0] + bulge[:, 0] * (v > 0), y, flat[:, 1] + bulge[:, 1]], -1)

    vertices, triangles = sheet(point, 7, 21)
    return vertices, triangles if not upper else triangles[:, ::-1]


def tongue() -> Piece:
    """Return half the tongue, resting behind the lower teeth."""

    def point(u: Floats, v: Floats) -> Floats:
        angle = np.pi * v  # over the back from the top (0) to below (1)
        along = np.sin(0.5 * np.pi * (0.06 + 0.94 * u))
        width, height = 17.0 * along**0.7, 4.5 * along**0.6
        z = 73.0 - 42.0 * u**1.4
        y = -87.0 + 6.0 * np.sin(np.pi * 0.6 * u)
        dent = 1.4 * np.exp(-((v / 0.16) ** 2)) * along
        return np.stack([width * np.sin(angle) * (v > 0) * (v < 1), y + height * np.cos(angle) - dent, z], -1)

    vertices, triangles = sheet(point, 12, 10)
    return vertices, triangles


def cavity() -> Piece:
    """Return half of the dark bag behind lips and teeth."""

    def point(u: Floats, v: Floats) -> Floats:
        angle = np.pi * v
        open_ = 1 - 0.94 * u**3
        z = 83.0 - 61.0 * u
        x = (31.5 - 6.0 * u) * np.sin(angle) * np.sqrt(open_) * (v > 0) * (v < 1)
        y = -71.0 + (15.0 + 4.0 * u) * np.cos(angle) * np.sqrt(open_)
        return np.stack([x, y, z - 16.0 * np.sin(angle) ** 2 * (1 - u)], -1)

    columns = 15
    vertices, triangles = sheet(point, 9, columns)
    last = np.arange(len(vertices) - columns, len(vertices))
    end = np.array([[0.0, -71.0, vertices[last, 2].mean() - 1.0]])
    fan = np.stack([np.full(columns - 1, len(vertices)), last[1:], last[:-1]], -1)
    return np.concatenate([vertices, end]), np.concatenate([triangles[:, ::-1], fan])
