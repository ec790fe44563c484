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
