"""The parts of a rig (skin, eyes, teeth), each with its own vertices and only the shapes that touch it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import RigError
from .rig import Rig


@dataclass(frozen=True)
class RigPart:
    """One part of a rig, numbered by itself.

    Parameters
    ----------
    name
        What it is called.
    vertices
        (n,) the rig's numbers of its vertices, ascending.
    triangles
        (m, 3) counted within ``vertices``.
    shapes
        Places among the rig's shapes of those that move one of its vertices, ascending.
    """

    name: str
    vertices: NDArray[np.int64]
    triangles: NDArray[np.int64]
    shapes: NDArray[np.int64]


def split_parts(rig: Rig) -> list[RigPart]:
    """Split a rig into its parts; parts without a triangle are left out.

    Vertices that no triangle uses, and shapes that move nothing, belong to the first part, so that all of them together
    are the rig. A vertex that two parts share belongs to both.

    Raises
    ------
    RigError
        If the rig has no triangles: there is no surface.
    """
    if not len(rig.triangles):
        raise RigError("rig: it has no triangles, so there is no surface to write")
    named = [(name, count) for name, count in rig.parts if count] or [("face", len(rig.triangles))]
    touched = (rig.deltas != 0).any(axis=2)
    loose = np.setdiff1d(np.arange(rig.n_vertices), rig.triangles)
    still = np.flatnonzero(~touched.any(axis=1))
    parts, first = [], 0
    for name, count in named:
        corners = rig.triangles[first : first + count]
        vertices = np.unique(corners) if first else np.union1d(corners, loose)
        shapes = np.flatnonzero(touched[:, vertices].any(axis=1))
        if not first:
            shapes = np.union1d(shapes, still)
        parts.append(RigPart(name, vertices, np.searchsorted(vertices, corners), shapes))
        first += count
    return parts


def join_names(names: list[str]) -> list[str]:
    """Return the names, those that repeat numbered: ``eye``, ``eye 2``."""
    result: list[str] = []
    for name in names:
        plain, number = name, 2
        while name in result:
            name, number = f"{plain} {number}", number + 1
        result.append(name)
    return result
