"""Grids of vertices and their triangles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Piece = tuple[Floats, Ints]


def grid_triangles(numbers: Ints, closed: bool = False) -> Ints:
    """Return the triangles of a (rows, columns) grid of vertex numbers; ``closed`` joins last and first column."""
    after = np.roll(numbers, -1, axis=1)
    a, b, c, d = numbers[:-1], after[:-1], after[1:], numbers[1:]
    if not closed:
        a, b, c, d = (x[:, :-1] for x in (a, b, c, d))
    quads = np.stack([a, b, c, d], -1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def sheet(point: Callable[[Floats, Floats], Floats], rows: int, columns: int) -> Piece:
    """Return the grid ``point(u, v)`` with u, v from 0 to 1 along rows and columns."""
    u, v = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    return point(u.ravel(), v.ravel()), grid_triangles(np.arange(rows * columns).reshape(rows, columns))
