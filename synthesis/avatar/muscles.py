"""Pulls on the skin: smooth fields of displacement with compact support, after Waters's muscles.

Waters (1987, *A muscle model for animating three-dimensional facial expression*) moves skin towards a muscle's
attachment, less and less with the distance from its insertion. Here one pull moves the skin at a named place by a
stated vector in mm; its influence falls from 1 to 0 at an ellipsoid around that place (``(1 − d²)³``, the C²
polynomial of Wyvill's soft objects).
Where lips are close in space but not in skin, a pull names the lip that it holds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Pull:
    """One pull: ``by`` mm at ``at``, falling to nothing ``reach`` mm away along x, y and z (base face, left side)."""

    at: tuple[float, float, float]
    reach: tuple[float, float, float]
    by: tuple[float, float, float]
    lip: Literal["both", "upper", "lower"] = "both"


def falloff(points: Floats, at: tuple[float, float, float], reach: tuple[float, float, float]) -> Floats:
    """Return ``(1 − d²)³`` with d the distance from ``at`` in units of ``reach``; 0 from d = 1 on."""
    square = (((points - np.array(at)) / np.array(reach)) ** 2).sum(-1)
    return np.clip(1.0 - square, 0.0, 1.0) ** 3


def plateau(
    points: Floats, at: tuple[float, float, float], reach: tuple[float, float, float], core: float = 0.5
) -> Floats:
    """Return 1 up to ``core`` of the reach, then a smooth step down to 0 at the reach."""
    d = np.linalg.norm((points - np.array(at)) / np.array(reach), axis=-1)
    return 1.0 - ramp(d, core, 1.0)


def ramp(values: Floats, start: float, end: float) -> Floats:
    """Return 0 before ``start``, 1 after ``end`` and a smooth step of zero end slopes between."""
    t = np.clip((values - start) / (end - start), 0.0, 1.0)
    return t * t * (3 - 2 * t)


def crease(points: Floats, path: Floats, width: float) -> Floats:
    """Return how far skin stands up beside a crease, (n,): up to 1 on one side of it, down to −1 on the other.

    Parameters
    ----------
    points
        (n, 3) places on the base face, mm; the crease is seen from the front, so only x and y count.
    path
        (k, 2) corners of the crease, mm; skin to the left of it (seen on the page) stands up. The crease fades out
        towards both ends.
    width
        Distance from the crease at which skin moves most, mm.
    """
    across = np.full(len(points), np.inf)
    along, standing = np.zeros(len(points)), np.zeros(len(points))
    steps = np.diff(path, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    for start, step, length, before in zip(path, steps, lengths, np.cumsum(lengths) - lengths, strict=False):
        arm = points[:, :2] - start
        s = np.clip(arm @ step / length**2, 0.0, 1.0)
        away = np.linalg.norm(arm - s[:, None] * step, axis=1)
        near = away < across
        side = np.sign(step[0] * arm[:, 1] - step[1] * arm[:, 0])
        across, standing = np.where(near, away, across), np.where(near, side, standing)
        along = np.where(near, (before + s * length) / lengths.sum(), along)
    d = np.clip(across / (3 * width), 0.0, 1.0)  # d (1 − d²)⁴ is largest at d = 1/3, where it is 1 / 4.805
    fade = np.sin(np.pi * along) ** 0.8
    return standing * fade * 4.805 * d * (1 - d * d) ** 4


def pull_all(points: Floats, lower: Floats, pulls: tuple[Pull, ...]) -> Floats:
    """Return the sum of pulls at points, (n, 3) mm; ``lower`` (n,) says 0..1 below the mouth."""
    # |x| rounded off at the midline, so that the two sides of a face add up without a crease between them
    points = np.concatenate([np.sqrt(points[:, :1] ** 2 + 36.0), points[:, 1:]], axis=1)
    moved = np.zeros_like(points)
    for pull in pulls:
        amount = falloff(points, pull.at, pull.reach)
        if pull.lip != "both":
            amount = amount * (lower if pull.lip == "lower" else 1 - lower)
        moved += amount[:, None] * np.array(pull.by)
    return moved
