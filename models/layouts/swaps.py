"""Refinement of a layout by local swaps: each marker, or pair, may move to where the face is told better.

One unit after another is taken out and the best of its size put in, until a whole round brings nothing; the value of
the layout (:mod:`.greedy`) never rises. What is kept stays.
"""

from __future__ import annotations

import numpy as np

from .constraints import Places
from .greedy import best_unit, value_of
from .reconstruction import Reconstruction

__all__ = ["improve_by_swaps"]

LEAST_GAIN = 1e-6
"""Part of the value below which a swap is not worth the move."""


def improve_by_swaps(
    problem: Reconstruction, places: Places, units: list[list[int]], n_rounds: int, loss: float = 0.0
) -> list[list[int]]:
    """Swap units for better ones.

    Parameters
    ----------
    problem, places
        As in :func:`.choose_greedily`.
    units
        A layout, kept candidates first.
    n_rounds
        How often every unit is tried, at most.
    loss
        Share of frames in which one marker is missing.

    Returns
    -------
    The units, as many and of the same sizes.
    """
    units = [list(u) for u in units]
    everything = [c for unit in units for c in unit]
    value = value_of(problem.state(np.array(everything)), everything, loss)
    for _ in range(n_rounds):
        before = value
        for i in range(len(places.kept), len(units)):
            others = [c for k, unit in enumerate(units) if k != i for c in unit]
            options = places.allowed(places.singles if len(units[i]) == 1 else places.pairs, others)
            if not len(options):
                continue
            state = problem.state(np.array(others, dtype=np.int64))
            unit, reached = best_unit(problem, state, others, options, loss)
            if reached < value * (1.0 - LEAST_GAIN):
                units[i], value = list(unit), reached
        if not value < before:
            break
    return units
