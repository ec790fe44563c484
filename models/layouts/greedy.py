"""Greedy layouts: the next marker is the one with which the face is told best (:mod:`.reconstruction`).

Markers fall off, so the value of a layout S may count what remains when one is lost,

    ``V(S) = (1 − q) J(S) + q · mean_j J(S ∖ j)``,

with ``q`` the share of frames in which one marker is missing. ``J`` alone shortlists the units, ``V`` chooses among
these.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .constraints import Places
from .reconstruction import Reconstruction, State

__all__ = ["choose_greedily", "choose_in_turn", "value_of"]

SHORTLIST = 12
"""Units that are valued with their losses; further ones are never the best of some thousand tried."""

Vertices = NDArray[np.int64]
Pick = Callable[[list[int], list[Vertices]], tuple[int, ...]]


def choose_greedily(problem: Reconstruction, places: Places, n_markers: int, loss: float = 0.0) -> list[list[int]]:
    """Choose unit after unit; the gain of a pair counts half, for it costs two markers.

    Parameters
    ----------
    problem
        What the candidates tell.
    places
        Which of them may be combined.
    n_markers
        How many candidates to choose, with those kept.
    loss
        ``q``, 0 to 1.

    Returns
    -------
    The units in the order chosen, as lists of candidates; kept ones come first.

    Raises
    ------
    InputError
        If no place is left before the number is reached.
    """

    def pick(chosen: list[int], choices: list[Vertices]) -> tuple[int, ...]:
        state = problem.state(np.array(chosen, dtype=np.int64))
        before = value_of(state, chosen, loss)
        options = [best_unit(problem, state, chosen, units, loss) for units in choices]
        return max(options, key=lambda option: (before - option[1]) / len(option[0]))[0]

    return choose_in_turn(places, n_markers, pick)


def choose_in_turn(places: Places, n_markers: int, pick: Pick) -> list[list[int]]:
    """Let ``pick`` choose unit after unit out of those that are allowed, until there are n_markers."""
    units = [[int(c)] for c in places.kept]
    chosen = [c for unit in units for c in unit]
    while len(chosen) < n_markers:
        choices = places.choices(chosen, n_markers - len(chosen))
        if not choices:
            raise InputError(
                f"layout: after {len(chosen)} of {n_markers} markers no place is left; "
                "lower min_distance, forbid fewer vertices or set mirror=False"
            )
        units.append(list(pick(chosen, choices)))
        chosen += units[-1]
    return units


def best_unit(
    problem: Reconstruction, state: State, chosen: list[int], units: Vertices, loss: float
) -> tuple[tuple[int, ...], float]:
    """Return the unit to add and the value of the layout with it."""
    errors = state.errors_with(units)
    if loss == 0:
        best = int(errors.argmin())
        return tuple(int(c) for c in units[best]), float(errors[best])
    values = {}
    for row in np.argsort(errors, kind="stable")[:SHORTLIST]:
        unit = tuple(int(c) for c in units[row])
        values[unit] = value_of(problem.state(np.array([*chosen, *unit])), [*chosen, *unit], loss)
    unit = min(values, key=values.__getitem__)
    return unit, values[unit]


def value_of(state: State, chosen: list[int], loss: float) -> float:
    """Return ``V``, mm²."""
    whole = state.error()
    if loss == 0 or not chosen:
        return whole
    lost = state.errors_without(np.array(chosen, dtype=np.int64)[:, None])
    return (1.0 - loss) * whole + loss * float(lost.mean())
