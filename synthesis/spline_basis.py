"""Curves over time as cubic B-splines on even knots (de Boor 1978), or as one value a frame.

A curve with time constant ``τ`` needs no knot every frame of a fast recording. Splines sum to one and are not negative,
so a curve stays within the bounds of its coefficients; and with knots every ``h`` its second derivative at a knot is
exactly ``(a₋₁ − 2 a₀ + a₊₁)/h²`` of the three coefficients around it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, eye_array

Array = NDArray[np.floating[Any]]


def spline_basis(n_frames: int, step: int) -> csr_array:
    """Return the (n_frames, n_coefficients) matrix that turns coefficients into the curve at every frame.

    Parameters
    ----------
    n_frames
        Length of the curve.
    step
        Frames from knot to knot; with 1 the coefficients are the curve's values.
    """
    if step == 1:
        return csr_array(eye_array(n_frames))
    frames = np.arange(n_frames)
    knot, t = frames // step, frames % step / step
    values = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], axis=1) / 6
    columns = knot[:, None] + np.arange(4)
    n_coefficients = (n_frames - 1) // step + 4
    rows = np.repeat(frames, 4)
    return csr_array((values.ravel(), (rows, columns.ravel())), shape=(n_frames, n_coefficients))


def second_differences_squared(n: int) -> Array:
    """Return ``DᵀD`` of second differences over n values, free at both ends, as its lower (3, n) diagonals."""
    out = np.zeros((3, n))
    pattern = (1.0, -2.0, 1.0)
    for i in range(3):
        for j in range(i, 3) if n > 2 else ():
            out[j - i, i : n - 2 + i] += pattern[i] * pattern[j]
    return out


def diagonals(matrix: csr_array, n_below: int) -> Array:
    """Return the (n_below + 1, n) lower diagonals of a symmetric banded matrix, as LAPACK keeps them."""
    out = np.zeros((n_below + 1, matrix.shape[0]))
    for k in range(n_below + 1):
        diagonal = matrix.diagonal(-k)
        out[k, : len(diagonal)] = diagonal
    return out
