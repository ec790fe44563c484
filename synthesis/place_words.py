"""Places on a face in words and distances, for the person who glues the markers."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..errors import InputError
from .landmark_finder import FaceLandmarks
from .landmark_names import MIDDLE
from .marker_map import check_vertices
from .rig import Rig

__all__ = ["describe_place", "describe_places"]

_WORDS = {
    "glabella": "the middle between the brows", "nasion": "the root of the nose", "nose_tip": "the tip of the nose",
    "nose_base": "the corner between nose and upper lip", "lip_upper_border": "the middle of the upper lip",
    "lip_lower_border": "the middle of the lower lip", "chin_fold": "the fold below the lower lip",
    "chin": "the front of the chin", "chin_bottom": "the bottom of the chin",
    "eye_inner": "the {side} eye's inner corner", "eye_outer": "the {side} eye's outer corner",
    "lid_upper": "the edge of the {side} upper lid", "lid_lower": "the edge of the {side} lower lid",
    "brow_inner": "the {side} brow's inner end", "brow_mid": "the middle of the {side} brow",
    "brow_outer": "the {side} brow's outer end", "nose_ala": "the {side} wing of the nose",
    "mouth_corner": "the {side} mouth corner",
}  # fmt: skip
"""Landmarks that a person finds on a face without measuring."""

HERE = 1.5  # mm; a shorter way is not worth saying


def describe_place(rig: Rig, vertex: int, *, landmarks: FaceLandmarks | None = None) -> str:
    """Say where a vertex is: ``12 mm above and 4 mm outside the left mouth corner``.

    The nearest landmark that can be found on a face without measuring is taken, on the vertex's own side or on the
    midline. Distances are straight, not along the skin: the first is upright, the second level (in depth and
    sideways); whole millimetres, and what is below 1.5 mm is left out. Outside is away from the midline, round the
    head.

    Parameters
    ----------
    rig
        The face.
    vertex
        A vertex of its skin.
    landmarks
        The rig's landmarks, where they were found before.

    Raises
    ------
    InputError
        If there is no such vertex, or no landmark can be found on this rig.
    """
    return describe_places(rig, [vertex], landmarks=landmarks)[0]


def describe_places(rig: Rig, vertices: Iterable[int], *, landmarks: FaceLandmarks | None = None) -> list[str]:
    """Say where each of several vertices is; see :func:`describe_place`."""
    found = FaceLandmarks(rig) if landmarks is None else landmarks
    numbers = check_vertices(rig, np.array(list(vertices), dtype=np.int64))
    known, missing = {}, ""
    for name in _WORDS:
        for side in ("",) if name in MIDDLE else ("left", "right"):
            try:
                known[name, side] = found.position(f"{name}_{side}" if side else name)
            except InputError as error:  # a rig without brow shapes still has a mouth to measure from
                missing = str(error)
    if not known:
        raise InputError(f"rig: no landmark to measure from; {missing}")
    middle = found.surface.middle
    out = []
    for point in rig.neutral[numbers]:
        across = point[0] - middle
        own = "" if abs(across) < HERE else "left" if across > 0 else "right"
        near = {key: float(np.linalg.norm(place - point)) for key, place in known.items() if key[1] in ("", own)}
        if not near:
            raise InputError(f"rig: no landmark on the midline to measure from; {missing}")
        # On the midline a landmark of the midline says more, even where a paired one is nearer.
        middles = {key: far for key, far in near.items() if not key[1]}
        name, side = (
            min(middles or near, key=(middles or near).__getitem__) if not own else min(near, key=near.__getitem__)
        )
        place = known[name, side]
        words = _WORDS[name].format(side=side)
        up, level = float(point[1] - place[1]), float(np.hypot(point[0] - place[0], point[2] - place[2]))
        outward = abs(float(found.unroll(point[None])[0, 0])) > abs(float(found.unroll(place[None])[0, 0]))
        parts = []
        if abs(up) >= HERE:
            parts.append(f"{abs(up):.0f} mm {'above' if up > 0 else 'below'}")
        if own and level >= HERE:
            direction = ("outside" if outward else "inside") if side else f"to the {own} of"
            parts.append(f"{level:.0f} mm {direction}")
        out.append(f"{' and '.join(parts)} {words}" if parts else f"at {words}")
    return out
