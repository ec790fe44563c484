"""Layouts by QR with block pivoting: the baseline of sensor placement (Manohar et al. 2018), a marker a block.

The three rows ``b_v Σ^½`` of each vertex say how its marker moves under likely weights. The pivot is the block with the
largest volume in what the blocks before it leave over, and its rows are then projected out of all others. Plain QR has
nothing left once the rows span all weights, after 18 markers for 53 shapes; with the noise σ of a coordinate beside
the rows it goes on and averages noise. A block's volume is then ``det(I + b C bᵀ/σ²)^½`` with ``C`` the covariance of
weights that the markers so far leave; at σ → 0 the order is that of the plain QR as long as it lasts.

It looks at what tells markers apart, not at the error of the face.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .constraints import Places
from .greedy import choose_in_turn

__all__ = ["choose_by_qr"]

Array = NDArray[np.floating[Any]]


def choose_by_qr(basis: Array, covariance: Array, noise: float, places: Places, n_markers: int) -> list[list[int]]:
    """Choose unit after unit by the largest volume; that of a pair counts with its root, for it costs two markers.

    Parameters
    ----------
    basis
        (n_candidates, 3, n_shapes) how the shapes move the candidates, mm.
    covariance
        (n_shapes, n_shapes) ``Σ``.
    noise
        ``σ``, mm, above 0.
    places
        Which candidates may be combined.
    n_markers
        How many to choose, with those kept.

    Returns
    -------
    The units in the order chosen, as lists of candidates; kept ones come first.
    """
    rows = basis @ np.linalg.cholesky(covariance) / noise

    def pick(chosen: list[int], choices: list[NDArray[np.int64]]) -> tuple[int, ...]:
        known = rows[chosen].reshape(-1, rows.shape[2])
        left = np.linalg.inv(np.eye(rows.shape[2]) + known.T @ known)
        best: tuple[float, tuple[int, ...]] = (-np.inf, ())
        for units in choices:
            blocks = rows[units].reshape(len(units), -1, rows.shape[2])
            volumes = np.linalg.slogdet(np.eye(blocks.shape[1]) + blocks @ left @ blocks.transpose(0, 2, 1))[1]
            first = int(volumes.argmax())
            best = max(best, (float(volumes[first]) / units.shape[1], tuple(int(c) for c in units[first])))
        return best[1]

    return choose_in_turn(places, n_markers, pick)
