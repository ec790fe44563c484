"""The shapes that move most in a take, to have their curves offered first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .made_files import MadeFiles, make_key
from .shown_weights import ShownWeights

__all__ = ["find_strongest", "measure_spread"]

OFFERED = 8


def measure_spread(weights: ShownWeights) -> NDArray[np.float32]:
    """Return (n_shapes,) the standard deviation of each shape's weights over the known frames, 0 where there are none.

    Parameters
    ----------
    weights
        Read a block at a time.
    """
    total, squares, count = np.zeros(len(weights.shapes)), np.zeros(len(weights.shapes)), 0
    for _, block in weights.read_blocks():
        known = block[np.isfinite(block).all(axis=1)]
        total += known.sum(axis=0)
        squares += (known**2).sum(axis=0)
        count += len(known)
    mean = total / max(count, 1)
    # Weights are around 0 to 1 and in double precision, so that the difference of the two loses nothing that matters.
    spread: NDArray[np.float32] = np.sqrt(np.maximum(squares / max(count, 1) - mean**2, 0)).astype(np.float32)
    return spread


def find_strongest(files: MadeFiles, weights: ShownWeights) -> list[str]:
    """Return the names of the shapes that move most, the first one most; fewer where fewer move at all."""
    spread = files.find_array(make_key(spread=weights.key), lambda: measure_spread(weights))
    order = np.argsort(-spread, kind="stable")[:OFFERED]
    return [weights.shapes[place] for place in order if spread[place] > 1e-6]
