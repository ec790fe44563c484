"""Where numbers stand beside crowded points, so that none covers another or a point.

Each label has a few dozen possible places round its point. One after the other takes the place that costs least given
the others, for some rounds: overlap of labels and covered points cost most, then leader lines that cross or run over
other points, then distance. The result depends on nothing but the points.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating[Any]]

__all__ = ["count_overlaps", "place_labels"]

ANGLES = 24
REACHES = (0.95, 1.3, 1.8, 2.4, 3.2, 4.2, 5.4)  # in heights of a label, from its nearer edge
ROUNDS = 8
_OVERLAP, _COVERED, _CROSSING, _PASSING = 40.0, 40.0, 12.0, 6.0


def place_labels(points: ArrayLike, sizes: ArrayLike, radius: float) -> NDArray[np.float64]:
    """Return the centre of each point's label.

    Parameters
    ----------
    points
        (n, 2), in the picture's units.
    sizes
        (n, 2) width and height of each label.
    radius
        Of the dots at the points.

    Returns
    -------
    (n, 2).
    """
    here, boxes = np.asarray(points, dtype=float).reshape(-1, 2), np.asarray(sizes, dtype=float).reshape(-1, 2)
    if not len(here):
        return np.empty((0, 2))
    height = float(boxes[:, 1].max())
    choices = _candidates(here, boxes, height, radius)
    away = np.linalg.norm(choices - here[:, None], axis=2) / height
    outward = _outward(here)
    angles = choices - here[:, None]
    along = np.einsum("ncd,nd->nc", angles / np.linalg.norm(angles, axis=2, keepdims=True), outward)
    own = away - 0.15 * along
    for i in range(len(here)):
        others = np.delete(here, i, axis=0)
        own[i] += _COVERED * _covers(choices[i], boxes[i], others, radius).sum(axis=1)
        own[i] += _PASSING * _passes(here[i], choices[i], others, radius)
    taken = own.argmin(axis=1)
    for _ in range(ROUNDS):
        before = taken.copy()
        for i in range(len(here)):
            placed = choices[np.arange(len(here)), taken]
            rest = np.arange(len(here)) != i
            cost = own[i] + _OVERLAP * _overlap(choices[i], boxes[i], placed[rest], boxes[rest]).sum(axis=1)
            cost += _CROSSING * _cross(here[i], choices[i], here[rest], placed[rest]).sum(axis=1)
            # A leader that runs below another label would be hidden there.
            cost += _PASSING * _passes(here[i], choices[i], placed[rest], height / 2)
            taken[i] = int(cost.argmin())
        if (before == taken).all():
            break
    return np.asarray(choices[np.arange(len(here)), taken])


def count_overlaps(centres: ArrayLike, sizes: ArrayLike) -> int:
    """Return how many pairs of labels overlap."""
    c, s = np.asarray(centres, dtype=float).reshape(-1, 2), np.asarray(sizes, dtype=float).reshape(-1, 2)
    hit = (np.abs(c[:, None] - c) < (s[:, None] + s) / 2).all(axis=2)
    return int((hit.sum() - len(c)) // 2)


def _candidates(points: Array, boxes: Array, height: float, radius: float) -> Array:
    turn = np.arange(ANGLES) * 2 * np.pi / ANGLES
    unit = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    # From the point to the label's edge, then on to its centre: wide labels stand farther to the side.
    half = np.abs(unit) @ boxes.T / 2
    reach = radius + height * (np.asarray(REACHES) - 0.75)
    centre = unit[:, None, None, :] * (half[:, None, :, None] + reach[None, :, None, None])
    return np.asarray(centre.reshape(-1, len(boxes), 2).transpose(1, 0, 2) + points[:, None])


def _outward(points: Array) -> Array:
    """Return unit vectors away from the neighbours, near ones counting most."""
    between = points[:, None] - points
    squared = (between**2).sum(axis=2)
    np.fill_diagonal(squared, np.inf)
    push = (between / np.maximum(squared, 1e-9)[..., None]).sum(axis=1)
    return np.asarray(push / np.maximum(np.linalg.norm(push, axis=1, keepdims=True), 1e-12))


def _overlap(centres: Array, box: Array, others: Array, boxes: Array) -> Array:
    """(candidates, others) whether a label at each candidate meets another label, with a little air between."""
    return np.asarray((np.abs(centres[:, None] - others) < 1.08 * (box + boxes) / 2).all(axis=2))


def _covers(centres: Array, box: Array, dots: Array, radius: float) -> Array:
    return np.asarray((np.abs(centres[:, None] - dots) < box / 2 + 1.1 * radius).all(axis=2))


def _passes(start: Array, ends: Array, dots: Array, radius: float) -> Array:
    """(candidates,) how many dots lie under the line from ``start`` to each end."""
    if not len(dots):
        return np.zeros(len(ends))
    way = ends - start
    share = np.clip(((dots[None] - start) * way[:, None]).sum(axis=2) / (way**2).sum(axis=1)[:, None], 0, 1)
    near = start + share[..., None] * way[:, None]
    return np.asarray((np.linalg.norm(dots[None] - near, axis=2) < radius).sum(axis=1))


def _cross(start: Array, ends: Array, starts: Array, others: Array) -> Array:
    """(candidates, others) whether the line from ``start`` to each end crosses each other leader."""

    def side(a: Array, b: Array, c: Array) -> Array:
        return np.asarray(
            (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])
        )

    a, b = start[None, None], ends[:, None]
    c, d = starts[None], others[None]
    return np.asarray((side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0))
