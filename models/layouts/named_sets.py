"""Marker sets of the literature, placed on any rig by the names of their points (Reverdy 2019, 3.5).

The thesis compares four published sets (STAR) and four of its own (MAN) and shows them as pictures only. The lists
here are rebuilt from what is known of each; :data:`SOURCES` says from what, and every point says how sure it is. A
point is a *place*: a weighted sum of anatomical landmarks on the unrolled face (``places.csv``), alike on both sides.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ...synthesis import Rig
from ...synthesis.landmark_finder import ON_LINE
from ...synthesis.landmarks import MIDDLE, PAIRED, FaceLandmarks

__all__ = ["NAMED_SETS", "SOURCES", "place_named_set", "place_names"]

NAMED_SETS = ("Face Robot 35", "SignCom 41", "MPEG-4 53", "Sign3D 60", "MAN 62", "MAN 46", "MAN 30", "MAN 15")
"""The sets that :func:`place_named_set` knows, with their number of markers."""

SOURCES = {
    "Face Robot 35": (
        "Softimage's pages on Face Robot: 32 control points that markers drive, and three markers for the head's "
        "motion. The picture of them was not found; the points are rebuilt, from the areas that such controls move."
    ),
    "SignCom 41": (
        "Gibet, Courty, Duarte and Le Naour, ACM TiiS 1(1), 2011; 41 markers by the thesis's count. No list of them "
        "was found. Rebuilt by region."
    ),
    "MPEG-4 53": (
        "ISO/IEC 14496-2, facial definition parameters: of the 84 feature points those on the skin of the face, that "
        "is, without tongue, teeth, spine, pupils, ears, hair and the four on the lids' edges. The standard's numbers "
        "are the markers' names, as its table is commonly reproduced; the standard's own text was not at hand. Which "
        "53 the thesis took it does not say; these are 53."
    ),
    "Sign3D 60": (
        "Lefebvre-Albaret, Gibet, Turki, Hamon and Brun, SLTAT 2013, who captured with a head-mounted eye tracker; 60 "
        "markers by the thesis's count. No list of them was found. Rebuilt by region, without markers on the lids: the "
        "thesis finds its error greater round the eyes (3.5.1)."
    ),
    "MAN 62": (
        "Reverdy 2019, 3.5.2: a mix of points of the published sets, from which the least useful were taken away by "
        "eye. Only pictures are shown; the choice of points is rebuilt, and each smaller set lies within the larger."
    ),
}
for _size in (46, 30, 15):
    SOURCES[f"MAN {_size}"] = SOURCES["MAN 62"]

_SURE = ("low", "fair", "high")
_TERM = re.compile(r"([+-]?)\s*([0-9.]+)\s+([a-z_]+)")
FARTHEST = 10.0  # mm a marker may stand from its place for want of vertices


@dataclass(frozen=True)
class _Place:
    side: str
    lip: str
    words: str
    where: tuple[tuple[float, str], ...]

    @property
    def sure(self) -> str:
        """The least sure of the landmarks that it is measured from."""
        return min((({**MIDDLE, **PAIRED}[name][0]) for _, name in self.where), key=_SURE.index)


@dataclass(frozen=True)
class _Point:
    codes: tuple[str, ...]
    place: str
    listed: str


def place_named_set(rig: Rig, name: str, *, landmarks: FaceLandmarks | None = None) -> pd.DataFrame:
    """Place a named marker set on a rig.

    Each place is a weighted sum of landmarks, unrolled from a cylinder round the head; the marker takes the nearest
    vertex of the skin that can be seen and is free. On a mesh whose sides mirror each other, so do the markers.

    Parameters
    ----------
    rig
        The face.
    name
        One of :data:`NAMED_SETS`, in any case.
    landmarks
        The rig's landmarks, where they were found before.

    Returns
    -------
    DataFrame ``marker, vertex, name, sure, listed``: the marker's name (the standard's number for MPEG-4), its vertex,
    where it is in words, how surely that place was found (``high``, ``fair`` or ``low``: the least sure of the
    landmarks that it is measured from, see :mod:`~mimique.synthesis.landmarks`), and how surely the set has such a
    point: ``standard`` where a standard defines it, ``rebuilt`` where no list was found. Each vertex occurs once.

    Raises
    ------
    InputError
        If the set is unknown, the rig lacks a landmark that it needs, or the mesh is too coarse for it.
    """
    points, places = _points(_check_name(name)), _places()
    found = FaceLandmarks(rig) if landmarks is None else landmarks
    taken: set[int] = set()
    rows = []
    for point in points:
        place = places[point.place]
        sides = ("left", "right") if place.side == "both" else ("middle",)
        codes = point.codes or tuple(point.place if s == "middle" else f"{point.place}_{s}" for s in sides)
        partner: int | None = None
        for code, side in zip(codes, sides, strict=True):
            if partner is not None and found.surface.symmetric:
                vertex = int(found.surface.mirror[partner])
            else:
                vertex = _find_vertex(found, point.place, side, taken, name)
            taken.add(vertex)
            partner = vertex
            words = place.words if side == "middle" else f"{place.words}, {side}"
            rows.append((code, vertex, words, place.sure, point.listed))
    table = pd.DataFrame(rows, columns=["marker", "vertex", "name", "sure", "listed"])
    if table["vertex"].duplicated().any():
        twice = table.loc[table["vertex"].duplicated(keep=False), "marker"]
        raise InputError(f"{name}: {', '.join(twice)} fall on one vertex; the mesh is too coarse for this set")
    return table.astype({"marker": "str", "vertex": np.int64, "name": "str", "sure": "str", "listed": "str"})


def place_names(name: str) -> list[str]:
    """Return the names of a set's places, one for each marker or mirrored pair."""
    return [point.place for point in _points(_check_name(name))]


def _check_name(name: str) -> str:
    for known in NAMED_SETS:
        if known.lower() == str(name).strip().lower():
            return known
    raise InputError(f"marker set: expected one of {', '.join(NAMED_SETS)}, but got {name!r}")


def _find_vertex(found: FaceLandmarks, name: str, side: str, taken: set[int], set_name: str) -> int:
    """Return the free vertex nearest a place."""
    place = _places()[name]
    try:
        wanted = np.zeros(2)
        for weight, landmark in place.where:
            full = landmark if landmark in MIDDLE else f"{landmark}_{side}"
            wanted += weight * found.unroll(found.position(full)[None])[0]
    except InputError as error:
        raise InputError(f"{set_name}: the marker {name} cannot be placed; {error}") from error
    allowed = found.outside.copy()
    if place.lip:
        allowed &= found.lower_lip if place.lip == "lower" else ~found.lower_lip
    allowed[list(taken)] = False
    across = found.rig.neutral[:, 0] - found.surface.middle
    if side == "middle":
        on_line = allowed & (np.abs(across) < ON_LINE * found.width)
        allowed = on_line if on_line.sum() > 30 else allowed & (np.abs(across) < 0.03 * found.width)
    else:
        allowed &= across * (1 if side == "left" else -1) > ON_LINE * found.width
    # A landmark is a vertex already; its unrolled place alone would let a hidden fold behind it win.
    if len(place.where) == 1 and place.where[0][0] == 1:
        landmark = place.where[0][1]
        vertex = found.vertex(landmark if side == "middle" else f"{landmark}_{side}")
        if allowed[vertex]:
            return vertex
    numbers = np.flatnonzero(allowed)
    away: NDArray[np.floating[Any]] = np.linalg.norm(found.unroll(found.rig.neutral[numbers]) - wanted, axis=1)
    if not len(numbers) or away.min() > FARTHEST:
        raise InputError(
            f"{set_name}: no free vertex of the skin lies within {FARTHEST:g} mm of {name} ({side}); "
            "the mesh is too coarse there for this set"
        )
    return int(numbers[np.argmin(away)])


def _read(name: str) -> list[dict[str, str]]:
    text = files(__package__).joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


@lru_cache
def _places() -> dict[str, _Place]:
    places = {}
    for row in _read("places.csv"):
        terms = tuple(
            (float(number) * (-1 if sign == "-" else 1), name) for sign, number, name in _TERM.findall(row["where"])
        )
        places[row["place"]] = _Place(row["side"], row["lip"], row["words"], terms)
    return places


@lru_cache
def _points(name: str) -> tuple[_Point, ...]:
    """Return a set's points; a smaller MAN set holds those of the largest that are kept the longest."""
    own, size = ("MAN 62", int(name.split()[-1])) if name.startswith("MAN") else (name, 0)
    return tuple(
        _Point(tuple(row["codes"].split("|")) if row["codes"] else (), row["place"], row["listed"])
        for row in _read("named_sets.csv")
        if row["set"] == own and (not size or int(row["least"]) <= size)
    )
