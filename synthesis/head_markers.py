"""The rigid markers that tell the head's motion from the face's (Reverdy 2019, 5.2)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .landmark_finder import FaceLandmarks
from .rig import Rig

__all__ = ["head_markers"]

# Along the unrolled face in widths between the outer eye corners, and up from the eyes in heights from mouth to eyes.
_TARGETS = {"head_front": (0.35, 1.05), "head_ear": (1.4, 0.35), "head_temple": (0.95, 0.6)}

APART = 0.3  # of the width: no two head markers are nearer to each other
LEAST_SPREAD = 0.12  # of the width: second singular value (per marker) below which the markers are as good as in line


def head_markers(
    rig: Rig, n_markers: int = 6, *, still: float = 0.25, landmarks: FaceLandmarks | None = None
) -> dict[str, int]:
    """Choose vertices for the markers that hold still while the face moves.

    They lie above the brows, above the ears and, with six, on the temples, left and right in pairs, each at the vertex
    nearest its proper place that no shape moves by more than ``still``. Where a place has none, the free vertex
    farthest from all others is taken. A rig whose forehead moves up to the crown has them there: on a band or a cap.

    Parameters
    ----------
    rig
        The face.
    n_markers
        4, 5 or 6; with an odd number one is on the midline.
    still
        Greatest motion, mm, at weight 1 of any shape.
    landmarks
        The rig's landmarks, where they were found before.

    Returns
    -------
    name -> vertex number, ``head_front_left`` and so on.

    Raises
    ------
    InputError
        If too little of the head above the eyes holds still, or what does is nearly one line.
    """
    if n_markers not in (4, 5, 6):
        raise InputError(f"n_markers: expected 4, 5 or 6 head markers, but got {n_markers}")
    found = FaceLandmarks(rig) if landmarks is None else landmarks
    flat = found.unroll(rig.neutral)
    eyes = float(np.mean([found.position(f"eye_outer_{s}")[1] for s in ("left", "right")]))
    mouth = float(np.mean([found.position(f"mouth_corner_{s}")[1] for s in ("left", "right")]))
    moved = np.linalg.norm(rig.deltas, axis=2).max(axis=0)
    free = found.outside & (moved <= still) & (flat[:, 1] > eyes) & ~_on_ears(found)
    free &= np.abs(flat[:, 0]) < 1.9 * found.width
    if not free.any():
        raise InputError(
            f"head markers: no skin above the eyes holds still to {still:g} mm under every shape; "
            "say a greater still=, or put them on a head band"
        )
    chosen: dict[str, int] = {}
    if n_markers == 5:
        _add(found, chosen, free, "head_middle", np.array([0.0, eyes + 1.2 * (eyes - mouth)]), "")
    names = list(_TARGETS)[: n_markers // 2]
    for name in names:
        along, up = _TARGETS[name]
        for side, sign in (("left", 1.0), ("right", -1.0)):
            place = np.array([sign * along * found.width, eyes + up * (eyes - mouth)])
            _add(found, chosen, free, f"{name}_{side}", place, side)
    points = rig.neutral[list(chosen.values())]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1] / np.sqrt(len(points))
    if spread < LEAST_SPREAD * found.width:
        raise InputError(
            f"head markers: what holds still to {still:g} mm above the eyes lies nearly on one line; "
            "say a greater still="
        )
    return chosen


def _add(
    found: FaceLandmarks,
    chosen: dict[str, int],
    free: NDArray[np.bool_],
    name: str,
    place: NDArray[np.floating[Any]],
    side: str,
) -> None:
    """Add the free vertex nearest a place, or farthest from all others where the place has none."""
    points, middle = found.rig.neutral, found.surface.middle
    if side == "right" and found.surface.symmetric:
        partner = int(found.surface.mirror[chosen[name.removesuffix("right") + "left"]])
        if free[partner] and partner not in chosen.values():
            chosen[name] = partner
            return
    here = free.copy()
    if side:
        here &= (points[:, 0] - middle) * (1 if side == "left" else -1) > 0.1 * found.width
    others = points[list(chosen.values())]
    numbers = np.flatnonzero(here)
    if len(others) and len(numbers):
        clear = np.linalg.norm(points[numbers, None] - others, axis=2).min(axis=1)
        numbers, clear = numbers[clear > APART * found.width], clear[clear > APART * found.width]
    if not len(numbers):
        raise InputError(f"head markers: too little of the head above the eyes holds still; {name} has no vertex")
    away = np.linalg.norm(found.unroll(points[numbers]) - place, axis=1)
    if len(others) and away.min() > 0.5 * found.width:
        chosen[name] = int(numbers[np.argmax(clear)])
    else:
        chosen[name] = int(numbers[np.argmin(away)])


def _on_ears(found: FaceLandmarks) -> NDArray[np.bool_]:
    """(n_vertices,) what is near an ear: it bends, and hair hangs over it."""
    points = found.rig.neutral
    near = [
        np.linalg.norm(points - found.position(f"ear_{side}"), axis=1) < 0.35 * found.width
        for side in ("left", "right")
    ]
    return np.asarray(near[0] | near[1])
