"""Different people: a few understandable proportions that bend the base head smoothly.

All heads have the same vertices, so the vertex that is a mouth corner on one is a mouth corner on all.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .head import Head, Part, lid_vertices
from .muscles import falloff, ramp
from .sculpture import EYE_CENTRE

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Morphology:
    """Proportions of a face.

    Every parameter runs from −1 to 1, and 0 is the base face; the extent in brackets is what 1 does.

    Parameters
    ----------
    face_width, face_height
        Whole head (7 % wider, 7 % taller).
    jaw_width
        Angle of the jaw (9 mm further out).
    chin_length, chin_forward
        Chin (8 mm lower, 7 mm further forward).
    nose_length, nose_width, nose_bridge
        Tip (7 mm lower), wings (4.5 mm further out), bridge (4.5 mm higher).
    brow_ridge, brow_height
        Ridge over the eyes (4 mm stronger), brows (4 mm higher).
    eye_spacing, eye_size
        Eyes (2.5 mm further out each, 8 % larger).
    lip_fullness, mouth_width
        Red of the lips (3.5 mm fuller), corners (4.5 mm further out each).
    cheek_fullness, cheekbone
        Cheek (7 mm fuller), bone (5 mm further out).
    forehead
        Forehead (6 mm further forward).

    Raises
    ------
    InputError
        If a parameter is not a number from −1 to 1.
    """

    face_width: float = 0.0
    face_height: float = 0.0
    jaw_width: float = 0.0
    chin_length: float = 0.0
    chin_forward: float = 0.0
    nose_length: float = 0.0
    nose_width: float = 0.0
    nose_bridge: float = 0.0
    brow_ridge: float = 0.0
    brow_height: float = 0.0
    eye_spacing: float = 0.0
    eye_size: float = 0.0
    lip_fullness: float = 0.0
    mouth_width: float = 0.0
    cheek_fullness: float = 0.0
    cheekbone: float = 0.0
    forehead: float = 0.0

    def __post_init__(self) -> None:
        wrong = [
            f"{f.name} = {getattr(self, f.name)!r}"
            for f in fields(self)
            if not (isinstance(getattr(self, f.name), int | float) and -1.0 <= getattr(self, f.name) <= 1.0)
        ]
        if wrong:
            raise InputError(f"morphology: expected numbers from -1 to 1, but got {', '.join(wrong)}")


def random_morphology(rng: np.random.Generator, spread: float = 0.5) -> Morphology:
    """Return a plausible person: independent normal proportions of deviation ``spread``, cut at ±1."""
    names = [f.name for f in fields(Morphology)]
    values = np.clip(rng.normal(0.0, spread, len(names)), -1.0, 1.0)
    return Morphology(**{name: float(value) for name, value in zip(names, values, strict=True)})


# parameter: (place on the left side, reach, displacement at 1), mm
_BENDS: dict[str, list[tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]]] = {
    "jaw_width": [((52, -62, 15), (55, 60, 80), (9, 0, 0))],
    "chin_length": [((0, -110, 78), (60, 62, 75), (0, -8, 0))],
    "chin_forward": [((0, -104, 86), (52, 42, 65), (0, 0, 7))],
    "nose_length": [((0, -42, 104), (30, 34, 42), (0, -7, 1))],
    "nose_width": [((15, -45, 90), (19, 22, 28), (4.5, 0, 0))],
    "nose_bridge": [((0, -12, 92), (22, 38, 34), (0, 0, 4.5))],
    "brow_ridge": [((28, 18, 80), (42, 26, 44), (0, 0, 4))],
    "brow_height": [((30, 23, 78), (52, 26, 55), (0, 4, 0))],
    "lip_fullness": [((0, -63, 96), (34, 10, 26), (0, 1.6, 2.8)), ((0, -75, 96), (34, 12, 26), (0, -2.0, 3.0))],
    "mouth_width": [((26, -68, 84), (32, 32, 42), (4.5, 0, -1))],
    "cheek_fullness": [((44, -50, 55), (48, 46, 60), (5.5, 0, 4))],
    "cheekbone": [((54, -22, 48), (45, 34, 60), (5, 0, 1))],
    "forehead": [((0, 62, 78), (80, 62, 70), (0, 2, 6))],
}


def _bend(points: Floats, morphology: Morphology) -> Floats:
    """Return the points displaced by every proportion except the eyes' own."""
    side = np.where(points[:, :1] < 0, -1.0, 1.0)
    left = np.concatenate([np.abs(points[:, :1]), points[:, 1:]], axis=1)
    moved = left.copy()
    for name, bends in _BENDS.items():
        amount = getattr(morphology, name)
        if amount:
            for at, reach, by in bends:
                # a sideways pull fades towards the midline, or it would tear the two halves apart
                fade = ramp(left[:, 0], 0.0, 12.0) if by[0] else np.ones(len(left))
                moved += amount * (falloff(left, at, reach) * fade)[:, None] * np.array(by)
    moved[:, 0] *= 1 + 0.07 * morphology.face_width
    moved[:, 1] *= 1 + 0.07 * morphology.face_height
    moved[:, 2] *= 1 + 0.03 * morphology.face_width
    return np.concatenate([side * moved[:, :1], moved[:, 1:]], axis=1)


def eye_geometry(morphology: Morphology) -> tuple[Floats, float]:
    """Return the left eyeball's centre (3,) in mm and its size relative to the base face."""
    centre = _bend(EYE_CENTRE[None] + [0.0, 0.0, 12.0], morphology)[0] - [0.0, 0.0, 12.0]
    apart = np.array([2.5 * morphology.eye_spacing, 0.0, 0.0])
    return centre + apart, 1.0 + 0.08 * morphology.eye_size


def apply_morphology(head: Head, morphology: Morphology) -> Floats:
    """Return the head's vertices for a person, (n_vertices, 3), mm.

    Eyeballs, lashes and the inner loops of the lids move as one rigid, scaled piece, so that lids keep sliding on
    a sphere; the outer loops blend into the face.
    """
    points = head.vertices
    bent = _bend(points, morphology)
    centre, size = eye_geometry(morphology)
    sign = np.where(points[:, :1] < 0, [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0])
    with_eye = centre * sign + size * (points - EYE_CENTRE * sign)
    rigid = np.zeros(len(points))
    lids_here = lid_vertices(head)
    rigid[lids_here] = 1.0 - ramp(head.ring[lids_here], 3.0, 6.0)
    rigid[np.isin(head.part, [Part.EYEBALL, Part.LASHES])] = 1.0
    return bent + rigid[:, None] * (with_eye - bent)
