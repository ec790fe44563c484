"""Named places on the avatar: landmarks for measuring, 46 markers for capture."""

from __future__ import annotations

import numpy as np

from . import lids, lips
from .head import Part, base_head
from .template import EYE, MOUTH

# left side of the base face, mm; the nearest skin vertex outside the openings is taken
_FACE = {
    "brow_inner": (11.0, 15.5, 88.0), "brow_mid": (29.0, 22.0, 84.0), "brow_outer": (46.0, 18.0, 70.0),
    "forehead_inner": (12.0, 36.0, 88.0), "forehead_outer": (34.0, 38.0, 80.0),
    "lid_upper": (31.5, 12.0, 80.0), "lid_lower": (31.5, -13.5, 79.0),
    "eye_outer": (53.0, 0.0, 66.0),
    "nose_side": (9.0, -22.0, 95.0), "nose_ala": (16.0, -45.0, 93.0),
    "cheek_upper": (40.0, -25.0, 77.0), "cheek_mid": (38.0, -45.0, 76.0), "cheek_outer": (52.0, -48.0, 60.0),
    "fold": (25.0, -55.0, 88.0),
    "lip_corner": (27.5, -70.5, 86.0), "lip_upper": (11.0, -62.5, 97.0), "lip_lower": (12.0, -82.0, 96.0),
    "chin_side": (18.0, -101.0, 88.0), "jaw_line": (46.0, -78.0, 48.0),
}  # fmt: skip
# on the midline: with the pairs above, 40 markers of the face
_MIDDLE = {"nose_tip": (0.0, -40.0, 111.0), "chin": (0.0, -106.0, 90.0)}
# on the forehead below the hair, on the temple, and on the hair where a head band would run
_HEAD = {"head_front": (24.0, 60.0, 82.0), "head_temple": (67.0, 26.0, 41.0), "head_band": (80.0, 50.0, 0.0)}


def _nearest(place: tuple[float, float, float], middle: bool, part: Part = Part.SKIN) -> int:
    head = base_head()
    usable = head.part == part
    usable &= (head.zone != EYE) | (head.ring >= 2.5)
    usable &= (head.zone != MOUTH) | (head.ring >= 4.5)
    usable &= (head.vertices[:, 0] == 0) if middle else (head.vertices[:, 0] > 0)
    numbers = np.flatnonzero(usable)
    return int(numbers[np.argmin(((head.vertices[numbers] - np.array(place)) ** 2).sum(1))])


def _pair(found: dict[str, int], name: str, vertex: int) -> None:
    found[f"{name}_left"], found[f"{name}_right"] = vertex, int(base_head().mirror[vertex])


def _loop(zone: int, ring: float, turn: float) -> int:
    head = base_head()
    here = (head.part == Part.SKIN) & (head.zone == zone) & (head.ring == ring) & (head.turn == turn)
    here &= head.vertices[:, 0] >= 0
    return int(np.flatnonzero(here)[0])


def default_markers() -> dict[str, int]:
    """Return the vertex of each of 46 markers.

    Returns
    -------
    name -> vertex number: 40 on the face (``…_left`` and ``…_right`` pairs, ``nose_tip``, ``chin``) and six whose
    name begins with ``head_``, which no shape moves.
    """
    found: dict[str, int] = {}
    for name, place in _FACE.items():
        _pair(found, name, _nearest(place, middle=False))
    for name, place in _MIDDLE.items():
        found[name] = _nearest(place, middle=True)
    for name, place in _HEAD.items():
        _pair(found, name, _nearest(place, middle=False, part=Part.HAIR if name == "head_band" else Part.SKIN))
    return found


def landmarks() -> dict[str, int]:
    """Return the vertex of each named place: what tests and figures measure at.

    Returns
    -------
    name -> vertex number: corners of mouth and eyes, middles of lips and lids, brows, nose, chin, cheeks.
    """
    found: dict[str, int] = {}
    half, quarter = lids.TURNS / 2, lids.TURNS / 4
    for name, ring, turn in (
        ("eye_inner", 1.0, 0.0), ("eye_outer", 1.0, half), ("lid_upper", 1.0, quarter), ("lid_lower", 1.0, 3 * quarter),
    ):  # fmt: skip
        _pair(found, name, _loop(EYE, ring, turn))
    _pair(found, "mouth_corner", _loop(MOUTH, float(lips.CONTACT), lips.TURNS / 2))
    found["lip_upper"] = _loop(MOUTH, float(lips.CONTACT), 0.0)
    found["lip_lower"] = _loop(MOUTH, float(lips.CONTACT), float(lips.TURNS))
    found["lip_upper_border"] = _loop(MOUTH, float(lips.BORDER), 0.0)
    found["lip_lower_border"] = _loop(MOUTH, float(lips.BORDER), float(lips.TURNS))
    _pair(found, "lip_upper_side", _loop(MOUTH, float(lips.CONTACT), lips.TURNS / 4))
    _pair(found, "lip_lower_side", _loop(MOUTH, float(lips.CONTACT), 3 * lips.TURNS / 4))
    for name in ("brow_inner", "brow_mid", "brow_outer", "nose_ala", "cheek_upper", "cheek_mid", "jaw_line"):
        _pair(found, name, _nearest(_FACE[name], middle=False))
    for name, place in {**_MIDDLE, "nasion": (0.0, 4.0, 88.0), "forehead": (0.0, 75.0, 85.0)}.items():
        found[name] = _nearest(place, middle=True)
    head = base_head()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        eye = np.flatnonzero((head.part == Part.EYEBALL) & (sign * head.vertices[:, 0] > 0))
        found[f"pupil_{side}"] = int(eye[np.argmax(head.vertices[eye, 2])])
    return found


def mirror_pairs() -> np.ndarray:
    """Return the number of every vertex's mirror vertex, (n_vertices,); on the midline its own."""
    return base_head().mirror
