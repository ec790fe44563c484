"""The placement sheet: every marker of a layout in words, for the person who glues them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.spatial import KDTree

from ...errors import InputError, MimiqueError
from ...synthesis.face_regions import face_regions
from ...synthesis.head_markers import head_markers
from ...synthesis.landmarks import FaceLandmarks
from ...synthesis.place_words import describe_places
from ...synthesis.rig import Rig

__all__ = ["PlacementSheet", "make_placement_sheet"]

PARTNER = 6.0  # mm; a marker so near another's mirror image is its partner
MIDLINE = 1.5  # mm


@dataclass(frozen=True)
class PlacementSheet:
    """A layout in words.

    Parameters
    ----------
    markers
        One row a marker of the face: ``number, marker, place`` (in words), ``region, partner`` (number of the marker
        on the other side, ``midline``, or a dash), ``nearest`` (the nearest other marker and how far, straight),
        ``vertex``.
    head
        One row a rigid marker: ``number`` (H1 …), ``marker, place, vertex``; empty where the rig has no place for them.
    notes
        What could not be said, and why.
    """

    markers: pd.DataFrame
    head: pd.DataFrame
    notes: tuple[str, ...]


def make_placement_sheet(
    rig: Rig,
    layout: pd.DataFrame,
    *,
    head: Mapping[str, int] | None = None,
    landmarks: FaceLandmarks | None = None,
) -> PlacementSheet:
    """Put a layout into words.

    Parameters
    ----------
    rig
        The face.
    layout
        ``marker, vertex``, in the order of their numbers.
    head
        The rigid markers, name to vertex; chosen by :func:`.head_markers` by default. An empty mapping means none.
    landmarks
        The rig's landmarks, where they were found before.

    Raises
    ------
    InputError
        If the layout is empty, or has a vertex that the rig has not.
    """
    vertices = layout["vertex"].to_numpy(dtype=np.int64)
    if not len(vertices):
        raise InputError("layout: expected at least one marker, but got none")
    if vertices.min() < 0 or vertices.max() >= rig.n_vertices:
        raise InputError(f"layout: expected vertices 0 to {rig.n_vertices - 1}, but got {vertices.max()}")
    notes: list[str] = []
    found = landmarks
    if found is None:
        try:
            found = FaceLandmarks(rig)
        except MimiqueError as error:
            notes.append(f"Places are given as coordinates on the rig, because no landmarks were found: {error}")
    points = rig.neutral[vertices]
    table = pd.DataFrame(
        {
            "number": np.arange(1, len(vertices) + 1),
            "marker": layout["marker"].astype(str).to_numpy(),
            "place": _say_places(rig, vertices, found, notes),
            "region": _say_regions(rig, vertices, found, notes),
            "partner": _say_partners(points, 0.0 if found is None else found.surface.middle),
            "nearest": _say_nearest(points),
            "vertex": vertices,
        }
    )
    if head is None:
        try:
            head = head_markers(rig, landmarks=found)
        except MimiqueError as error:
            head = {}
            notes.append(f"Rigid head markers are needed in every capture, but could not be placed: {error}")
    numbers = np.array(list(head.values()), dtype=np.int64)
    rigid = pd.DataFrame(
        {
            "number": [f"H{k}" for k in range(1, len(head) + 1)],
            "marker": [str(name) for name in head],
            "place": _say_places(rig, numbers, found, notes) if len(numbers) else [],
            "vertex": numbers,
        }
    )
    return PlacementSheet(table, rigid, tuple(dict.fromkeys(notes)))


def _say_places(rig: Rig, vertices: np.ndarray, found: FaceLandmarks | None, notes: list[str]) -> list[str]:
    if found is not None:
        try:
            return describe_places(rig, vertices.tolist(), landmarks=found)
        except MimiqueError as error:
            notes.append(f"Places are given as coordinates on the rig: {error}")
    return [
        f"{abs(x):.0f} mm to the {'left' if x > 0 else 'right'}, {y:.0f} mm up, {z:.0f} mm forward in the rig"
        for x, y, z in rig.neutral[vertices]
    ]


def _say_regions(rig: Rig, vertices: np.ndarray, found: FaceLandmarks | None, notes: list[str]) -> list[str]:
    region_of: dict[int, str] = {}
    if found is not None:
        try:
            for name, members in face_regions(rig, landmarks=found).items():
                region_of |= dict.fromkeys(members.tolist(), name)
        except MimiqueError as error:
            notes.append(f"Regions are not named: {error}")
    return [region_of.get(int(vertex), "–") for vertex in vertices]


def _say_partners(points: np.ndarray, middle: float) -> list[str]:
    """Return each marker's partner: the nearest to its mirror image, if either is the other's."""
    across = points[:, 0] - middle
    away, nearest = KDTree(points).query(points * [-1, 1, 1] + [2 * middle, 0, 0])
    out = []
    for i, (gap, other) in enumerate(zip(away, nearest, strict=True)):
        if abs(across[i]) < MIDLINE:
            out.append("midline")
        elif other == i or gap > PARTNER or nearest[other] != i:
            out.append("–")
        else:
            out.append(f"{other + 1}" if gap < MIDLINE else f"{other + 1} ({gap:.0f} mm off)")
    return out


def _say_nearest(points: np.ndarray) -> list[str]:
    if len(points) < 2:
        return ["–"]
    away, nearest = KDTree(points).query(points, k=2)
    return [f"{other + 1}: {gap:.0f} mm" for gap, other in zip(away[:, 1], nearest[:, 1], strict=True)]
