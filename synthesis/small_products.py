"""Products of many rows with one small matrix, the work horse of the weight solvers.

A matrix product of thousands of rows makes the linear algebra library start threads, whose coming and going costs
more than products of this size (12 times more on two busy cores). Slices of 64 rows stay below its threshold.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

ROWS = 64


def times(rows: Array, matrix: Array) -> Array:
    """Return ``rows @ matrix`` for (F, N) rows and a small (N, M) matrix."""
    whole = len(rows) // ROWS * ROWS
    if not whole:
        return rows @ matrix
    out = np.empty((len(rows), matrix.shape[1]))
    np.matmul(rows[:whole].reshape(-1, ROWS, rows.shape[1]), matrix, out=out[:whole].reshape(-1, ROWS, matrix.shape[1]))
    if whole < len(rows):
        np.matmul(rows[whole:], matrix, out=out[whole:])
    return out
