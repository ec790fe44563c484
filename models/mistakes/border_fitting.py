"""Where each border of a tier fits the face best, if its labels and all other borders are right.

A border between two touching segments is moved alone, and each place is judged by what the frames on both sides of it
say, as speech recognition judges the borders of the phones of a known text (forced alignment). A frame of a stable
segment X speaks for it by

    log (1 − q) + v · log p_X

with the probability q that it belongs to a transition and p_X that it shows X; a frame of a transition by log q. How
long a transition lasts is weighed by a normal distribution of the logarithm of its duration. Neighbouring frames are no
independent witnesses, so that the evidence per second is scaled down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import check_array
from ...errors import InputError

__all__ = ["FittedBorders", "fit_borders"]

PER_SECOND = 25.0
"""Independent witnesses in a second of frames."""
VOICE = 0.5
"""v: how far what a face shows counts beside whether it moves."""
FLOOR = 0.02
"""Probabilities are raised to this: one odd frame does not decide."""


@dataclass(frozen=True)
class FittedBorders:
    """Borders of a tier and where they fit best.

    Parameters
    ----------
    given, fitted
        ``(n_borders,)`` frames.
    gain
        ``(n_borders,)`` log likelihood gained by moving this border alone; at least 0.
    """

    given: NDArray[np.int64]
    fitted: NDArray[np.int64]
    gain: NDArray[np.float64]


def fit_borders(
    bounds: ArrayLike,
    states: ArrayLike,
    frames: ArrayLike,
    moving: ArrayLike,
    rate: float,
    *,
    reach: float = 0.8,
    least: float = 0.1,
    transition: tuple[float, float] = (0.3, 0.5),
) -> FittedBorders:
    """Find the best place of each border of a run of touching segments, the others staying where they are.

    Parameters
    ----------
    bounds
        ``(n_segments + 1,)`` rising frames; the first and the last are no borders between two segments.
    states
        ``(n_segments,)`` column of each stable segment's class, −1 for a transition.
    frames
        ``(n_frames, n_classes)`` probabilities; NaN in gaps, which say nothing.
    moving
        ``(n_frames,)`` probability of belonging to a transition.
    rate
        Frames per second.
    reach
        Seconds that a border may move.
    least
        Seconds that each segment keeps.
    transition
        Typical duration of transitions in seconds, and the spread of its logarithm.
    """
    cuts = np.asarray(bounds, dtype=np.int64)
    columns = np.asarray(states, dtype=np.int64)
    p = check_array(frames, name="frames", shape=(None, None))
    q = check_array(moving, name="moving", shape=(len(p),))
    if len(cuts) != len(columns) + 1 or (np.diff(cuts) <= 0).any() or cuts[0] < 0 or cuts[-1] > len(p):
        raise InputError(
            f"bounds: expected {len(columns) + 1} rising frames within 0 to {len(p)}, but got {cuts.tolist()}"
        )
    score = _score_states(p, q, columns) * (PER_SECOND / rate)
    total = np.concatenate((np.zeros((1, score.shape[1])), np.cumsum(score, axis=0)))
    shortest = max(round(least * rate), 1)

    def judge_duration(i: int, lengths: NDArray) -> NDArray[np.float64]:
        if columns[i] >= 0:
            return np.zeros(len(lengths))
        return -0.5 * (np.log(lengths / rate / transition[0]) / transition[1]) ** 2

    fitted = cuts[1:-1].copy()
    gain = np.zeros(len(fitted))
    for b, cut in enumerate(cuts[1:-1].tolist()):
        left, right, away = int(cuts[b]), int(cuts[b + 2]), round(reach * rate)
        low, high = max(left + shortest, cut - away), min(right - shortest, cut + away)
        places = np.unique(np.append(np.arange(low, high + 1), cut))
        value = total[places, b] - total[places, b + 1]
        value += judge_duration(b, places - left) + judge_duration(b + 1, right - places)
        best = int(value.argmax())
        fitted[b], gain[b] = places[best], value[best] - value[places == cut][0]
    return FittedBorders(cuts[1:-1], fitted, gain)


def _score_states(p: NDArray, q: NDArray, columns: NDArray) -> NDArray[np.float64]:
    """Log likelihood of each frame for each segment, ``(n_frames, n_segments)``; 0 in gaps."""
    still, move = np.log(np.clip(1 - q, FLOOR, None)), np.log(np.clip(q, FLOOR, None))
    shown = np.log(np.clip(p, FLOOR, None)) * VOICE
    score = np.where(columns[None, :] < 0, move[:, None], still[:, None] + shown[:, np.maximum(columns, 0)])
    return np.nan_to_num(score, nan=0.0)
