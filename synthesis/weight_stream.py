"""Weights of one frame at a time, as a camera delivers them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array

if TYPE_CHECKING:
    from .weight_solver import WeightSolver

Array = NDArray[np.floating[Any]]
Follow = Callable[[Array, "Array | None"], Array]

PATTERNS = 64  # Sets of visible markers that are kept prepared.
CHECKED = 30  # Frames at the start whose place and size are checked.


class WeightStream:
    """Solves frame after frame, each from the weights of the one before; made by :meth:`.WeightSolver.stream`.

    The weights are those that ``solver.solve(positions)`` gives without smoothness over time, which would need frames
    that are yet to come. A set of visible markers that is seen for the first time takes a few milliseconds more.

    Parameters
    ----------
    solver
        Any weight solver.
    """

    def __init__(self, solver: WeightSolver) -> None:
        self._solver = solver
        self._patterns: OrderedDict[bytes, tuple[NDArray[np.int64], Follow]] = OrderedDict()
        self._last: Array | None = None
        self._n_frames = 0
        self._prepare(np.ones(len(solver.vertices), dtype=bool))

    def push(self, frame: ArrayLike) -> Array:
        """Return the (n_shapes,) weights of the next frame.

        Parameters
        ----------
        frame
            (P, 3) marker positions in the rig's space, mm; NaN where a marker is missing. Too few visible: NaN.

        Raises
        ------
        RigError
            If one of the first frames is not in the rig's space.
        """
        solver = self._solver
        position = check_array(frame, name="frame", shape=(len(solver.vertices), 3))
        if self._n_frames < CHECKED or np.isinf(position).any():
            solver._check_positions(position[None])
            self._n_frames += 1
        seen = np.asarray(np.isfinite(position).all(axis=1))
        if int(seen.sum()) < solver.minimum_markers:
            return np.full(solver.rig.n_shapes, np.nan)
        visible, follow = self._patterns.get(seen.tobytes()) or self._prepare(seen)
        moved = (position[visible] - solver.rest[visible]) / solver.unit
        self._last = follow(moved.reshape(1, -1), self._last)
        return np.array(self._last[0])

    def _prepare(self, seen: NDArray[np.bool_]) -> tuple[NDArray[np.int64], Follow]:
        solver = self._solver
        visible = np.flatnonzero(seen)
        basis = np.ascontiguousarray(solver._basis[visible].reshape(-1, solver.rig.n_shapes))
        entry = visible, _follow(solver._method, basis)
        self._patterns[seen.tobytes()] = entry
        if len(self._patterns) > PATTERNS:
            self._patterns.popitem(last=False)
        return entry


def _follow(method: Any, basis: Array) -> Follow:
    """Return the method's own way of going on from the last frame, or else its way of solving anew."""
    if hasattr(method, "follow"):
        follow: Follow = method.follow(basis)
        return follow
    solve = method.prepare(basis)
    return lambda displacements, start: np.asarray(solve(displacements))
