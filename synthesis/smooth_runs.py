"""Where smoothness over time begins and ends: runs of frames that can be solved, and windows of long runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bounded import Bounded
from .smooth_box_qp import SmoothBoxQP

Array = NDArray[np.floating[Any]]

LEAST_FRAMES = 3
"""A run shorter than this has no second difference: its frames are solved one by one."""


def runs(solvable: NDArray[np.bool_]) -> Iterator[slice]:
    """Yield the runs of frames that can be solved; a frame that cannot be ends a run, nothing reaches across it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], solvable, [False]]).astype(np.int8)))
    for onset, offset in edges.reshape(-1, 2):
        yield slice(int(onset), int(offset))


def solve_runs(
    method: Bounded,
    basis: Array,
    displacements: Callable[[slice], Array],
    solvable: NDArray[np.bool_],
    rate: float,
    smoothness: float,
    frame_by_frame: Callable[[NDArray[np.int64]], Array],
) -> Array:
    """Return (F, N) weights, smooth within every run; NaN outside the runs.

    Long runs are solved in windows of a fixed number of knots, whatever the solver's block size. They overlap by so
    much that what lies beyond has no say; where they end does not show in the weights beyond the tolerance that each
    is solved to (:mod:`.smooth_box_qp`), and the memory at work does not grow with the take.

    Parameters
    ----------
    method
        Box, quadratic penalty and linear penalty.
    basis
        (3P, N).
    displacements
        (frames, P, 3) of a stretch of frames, in the basis's unit; NaN where a marker is missing.
    solvable
        (F,) frames with markers enough.
    rate
        Frames per second.
    smoothness
        Time constant, s.
    frame_by_frame
        Weights without smoothness of some frames, given by their numbers.
    """
    program = SmoothBoxQP(basis, method.quadratic, method.offset, rate, smoothness)
    weights = np.full((len(solvable), basis.shape[1]), np.nan)
    for run in runs(solvable):
        if run.stop - run.start < LEAST_FRAMES:
            weights[run] = frame_by_frame(np.arange(run.start, run.stop))
            continue
        for onset in range(run.start, run.stop, program.window):
            offset = min(onset + program.window, run.stop)
            first, last = max(onset - program.margin, run.start), min(offset + program.margin, run.stop)
            moved = displacements(slice(first, last))
            seen = np.asarray(np.isfinite(moved).all(axis=2))
            moved = np.where(seen[:, :, None], moved, np.nan).reshape(last - first, -1)
            found = program.solve(moved, frame_by_frame(first + np.flatnonzero(~seen.all(axis=1))))
            weights[onset:offset] = found[onset - first : offset - first]
    return weights


def acceleration_term(weights: Array, rate: float, smoothness: float) -> Array:
    """Return (F,) ``τ⁴ ‖ẅ‖²`` of every frame, by second differences; 0 where a neighbour is missing or unsolved."""
    out = np.zeros(len(weights))
    if len(weights) >= LEAST_FRAMES:
        bent = (np.diff(weights, 2, axis=0) ** 2).sum(1) * (smoothness * rate) ** 4
        out[1:-1] = np.where(np.isfinite(bent), bent, 0.0)
    return out
