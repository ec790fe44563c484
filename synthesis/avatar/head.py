"""The base head: skin and pieces in one vertex array, mirrored, with what shapes need to know of a vertex."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from . import hair, lips, pieces
from .template import EYE, MOUTH, SURFACE, build_half_skin

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Part(IntEnum):
    """What a vertex belongs to."""

    SKIN = 0
    EYEBALL = 1
    MOUTH_INSIDE = 2
    UPPER_TEETH = 3
    LOWER_TEETH = 4
    TONGUE = 5
    BROW = 6
    LASHES = 7
    HAIR = 8
    EAR = 9


@dataclass(frozen=True)
class Head:
    """The base head, mm.

    Parameters
    ----------
    vertices, triangles
        (n_vertices, 3) and (n_triangles, 3); skin first.
    part
        (n_vertices,) values of :class:`Part`.
    zone, ring, turn
        Place in the loops of the skin round eye and mouth, see :mod:`.template`; −1 elsewhere.
    mirror
        (n_vertices,) number of the mirror vertex; its own number on the midline.
    jaw, lower
        (n_vertices,) 0..1: how far a vertex follows the lower jaw, and whether it is below the mouth.
    """

    vertices: Floats
    triangles: Ints
    part: Ints
    zone: Ints
    ring: Floats
    turn: Floats
    mirror: Ints
    jaw: Floats
    lower: Floats


def _smooth_field(triangles: Ints, n_vertices: int, fixed: NDArray[np.bool_], values: Floats) -> Floats:
    """Return the biharmonic field that takes ``values`` (n_vertices, k) at the fixed vertices, by graph Laplacian."""
    i, j = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    ones = np.ones(2 * len(i))
    links = coo_array((ones, (np.r_[i, j], np.r_[j, i])), shape=(n_vertices, n_vertices)).tocsr()
    links.data[:] = 1.0
    degree = np.asarray(links.sum(axis=1)).ravel()
    step = diags_array(1 / degree) @ links - diags_array(np.ones(n_vertices))
    system = (step.T @ step).tocsr()
    free = np.flatnonzero(~fixed)
    known = np.flatnonzero(fixed)
    right = -(system[free][:, known] @ values[known])
    field = values.copy()
    field[free] = splu(system[free][:, free].tocsc()).solve(right)
    # a biharmonic field never quite dies out; what is next to nothing shall be nothing
    return np.clip((field - 0.01) / 0.98, 0.0, 1.0)


def _follow(vertices: Floats, triangles: Ints, zone: Ints, ring: Floats, turn: Floats) -> Floats:
    """Return (n, 2) weights of the half skin: following the jaw, being below the mouth."""
    x, y, z = vertices.T
    half = lips.TURNS / 2
    on_lips = (zone == MOUTH) & (ring <= 5.5)
    # along the lips the weight goes gently from 0 above over a half at the corner to 1 below: the mouth opens round
    s = np.clip(np.abs(turn - half) / half, 0.0, 1.0)
    share = np.where(turn <= half, 0.0, 1.0) + np.where(turn <= half, 0.5, -0.5) * (1 - s) ** 2.2
    chin = (y < -95) & (z > 45) & (y > -120)
    jawline = (y < -76) & (y > -108) & (z > 30) & (x > 22)
    calm = (y > -38) | (z < 2) | (y < -138)
    above = (y > -56) & (x < 20) & (z > 70)
    jaw_fixed = on_lips | chin | jawline | calm | above
    jaw = _smooth_field(
        triangles, len(vertices), jaw_fixed, np.where(on_lips, share, (chin | jawline).astype(float))[:, None]
    )
    sharp = np.where(turn == half, 0.5, (turn > half).astype(float))
    inner = on_lips & (np.abs(turn - half) >= 1)
    low_fixed = inner | above | chin | (y > -43) | (y < -103)
    low = _smooth_field(
        triangles, len(vertices), low_fixed, np.where(inner, sharp, (chin | (y < -103)).astype(float))[:, None]
    )
    return np.concatenate([jaw, low], axis=1)


@lru_cache(maxsize=1)
def base_head() -> Head:
    """Return the base head; it is computed once per process and its arrays are read-only."""
    skin = build_half_skin()
    follow = _follow(skin.vertices, skin.triangles, skin.zone, skin.ring, skin.turn)
    halves: list[tuple[Part, Floats, Ints]] = [
        (Part.SKIN, skin.vertices, skin.triangles),
        (Part.EYEBALL, *pieces.eyeball()),
        (Part.LASHES, *pieces.lashes()),
        (Part.BROW, *pieces.brow()),
        (Part.UPPER_TEETH, *pieces.teeth(upper=True)),
        (Part.LOWER_TEETH, *pieces.teeth(upper=False)),
        (Part.TONGUE, *pieces.tongue()),
        (Part.MOUTH_INSIDE, *pieces.cavity()),
        (Part.HAIR, *hair.hair()),
        (Part.EAR, *hair.ear()),
    ]
    vertices, triangles, part, mirror, source = [], [], [], [], []
    count = n_half = 0
    for kind, points, faces in halves:
        n = len(points)
        middle = points[:, 0] == 0.0
        other = np.full(n, -1)
        other[middle] = np.flatnonzero(middle)
        other[~middle] = n + np.arange((~middle).sum())
        back = np.concatenate([other, np.flatnonzero(~middle)])
        vertices += [points, points[~middle] * [-1.0, 1.0, 1.0]]
        triangles += [faces + count, other[faces[:, ::-1]] + count]
        part.append(np.full(len(back), int(kind)))
        mirror.append(back + count)
        source.append(np.concatenate([np.arange(n), np.flatnonzero(~middle)]) + n_half)
        count += len(back)
        n_half += n
    origin = np.concatenate(source)
    n_skin = len(skin.vertices)
    every_part = np.concatenate(part)

    def spread(values: Floats | Ints, rest: float) -> NDArray:
        return np.concatenate([values, np.full(n_half - n_skin, rest, dtype=values.dtype)])[origin]

    jaw, lower = spread(follow[:, 0], 0.0), spread(follow[:, 1], 0.0)
    moving = np.isin(every_part, [Part.LOWER_TEETH, Part.TONGUE])
    jaw[moving] = lower[moving] = 1.0
    all_vertices = np.concatenate(vertices)
    bag = every_part == Part.MOUTH_INSIDE
    jaw[bag] = lower[bag] = np.clip((-71.0 - all_vertices[bag, 1]) / 12.0, 0.0, 1.0)
    head = Head(
        all_vertices,
        np.concatenate(triangles),
        every_part,
        spread(skin.zone, SURFACE),
        spread(skin.ring, -1.0),
        spread(skin.turn, -1.0),
        np.concatenate(mirror),
        jaw,
        lower,
    )
    for array in vars(head).values():
        array.setflags(write=False)
    return head


def lid_vertices(head: Head) -> NDArray[np.bool_]:
    """Return which vertices belong to the loops of the lids."""
    return (head.part == Part.SKIN) & (head.zone == EYE)
