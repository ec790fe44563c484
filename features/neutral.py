"""Which frames show the neutral face (Reverdy 2019, 5.2.1 needs one "where the actor makes a neutral expression").

The first frame is no safe choice: takes start in mid-motion, or with markers not yet tracked. Unless a frame is given,
the neutral is the median over the half second that is still and lies nearest to the take's median pose.

The assumption is that the take returns to neutral often. Where it does not (a take that mostly holds one expression)
its median pose is that expression; pass the median over *all* takes of the signer as `typical` then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from .derivatives import check_rate

__all__ = ["Neutral", "find_neutral", "median_pose"]

STILLEST_SHARE = 0.25
TYPICAL_SHARE = 0.02


@dataclass(frozen=True)
class Neutral:
    """Markers of the neutral face and where they came from.

    Parameters
    ----------
    positions
        ``(n_markers, 3)`` in mm; NaN for a marker that the take never shows.
    onset, offset
        The frames that the neutral is the median of, half-open.
    filled
        ``(n_markers,)`` bool: missing in those frames, and taken from other frames near the same pose instead.
    """

    positions: NDArray[np.float64]
    onset: int
    offset: int
    filled: NDArray[np.bool_]

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Markers that have no neutral position, ``(n_markers,)``."""
        return np.asarray(np.isnan(self.positions).any(axis=1))


def find_neutral(
    positions: ArrayLike,
    rate: float,
    *,
    frame: int | None = None,
    duration: float = 0.5,
    typical: ArrayLike | None = None,
) -> Neutral:
    """Neutral pose of a stabilised take.

    Every window of `duration` gets two numbers: how much its markers move (root mean square over markers of their
    standard deviation) and how far its mean pose is from the typical one (root mean square over markers). Among the
    stillest quarter of the windows the one nearest the typical pose is taken. Windows in which less than half of the
    markers, or of the frames, are seen do not count, as long as there are others.

    Parameters
    ----------
    positions
        Markers *without head motion*, ``(n_frames, n_markers, 3)`` in mm, NaN where missing.
    rate
        Frames per second, above 0.
    frame
        The neutral frame, where it is known.
    duration
        Length of the window in seconds; the whole take if that is shorter.
    typical
        Pose to be near to, ``(n_markers, 3)`` in mm; by default the median over the take.

    Notes
    -----
    A marker that is missing in the chosen frames gets its median over the frames (one in fifty, at least three) whose
    other markers are nearest to the neutral found, as far as it is visible there; ``filled`` says so.

    Raises
    ------
    InputError
        If no marker is visible in the take, or in the given frame, or the frame is outside the take.
    """
    markers = check_array(positions, name="positions", shape=(None, None, 3))
    rate = check_rate(rate)
    n_frames, n_markers, _ = markers.shape
    seen = np.isfinite(markers).all(axis=2)
    if not seen.any():
        raise InputError(f"positions: expected a visible marker, but all {n_frames} frames are gaps")
    if frame is not None:
        if not 0 <= frame < n_frames:
            raise InputError(f"frame: expected a neutral frame from 0 to {n_frames - 1}, but got {frame}")
        if not seen[frame].any():
            raise InputError(f"frame: expected visible markers in the neutral frame, but frame {frame} is a gap")
        onset, offset = int(frame), int(frame) + 1
    else:
        pose = median_pose(markers) if typical is None else typical
        target = check_array(pose, name="typical", shape=(n_markers, 3))
        n_window = min(max(round(duration * rate), 1), n_frames)
        onset = _find_window(markers, seen, target, n_window)
        offset = onset + n_window
    neutral = median_pose(markers[onset:offset])
    return _fill_from_similar_frames(markers, seen, neutral, onset, offset)


def median_pose(positions: ArrayLike) -> NDArray[np.float64]:
    """Median over frames of each coordinate, ``(n_frames, n_markers, 3)`` to ``(n_markers, 3)``; NaN if never seen."""
    markers = check_array(positions, name="positions", shape=(None, None, 3))
    result = np.full(markers.shape[1:], np.nan)
    known = np.isfinite(markers).all(axis=2).any(axis=0)
    if known.any():
        result[known] = np.nanmedian(markers[:, known], axis=0)
    return result


def _find_window(markers: NDArray, seen: NDArray, target: NDArray, n_window: int) -> int:
    """First frame of the still window nearest the target pose."""
    seen = seen & np.isfinite(target).all(axis=1)
    if not seen.any():
        raise InputError("typical: expected a pose of markers that this take shows, but got none of them")
    # Differences from the target keep the sums of squares small, so that no digits are lost.
    away = np.where(seen[..., None], markers - target, 0.0)
    count = _window_sums(seen.astype(float), n_window)
    known = count > 0
    divisor = np.where(known, count, 1.0)
    mean = _window_sums(away, n_window) / divisor[..., None]
    square = _window_sums((away**2).sum(axis=2), n_window) / divisor
    variance = np.clip(square - (mean**2).sum(axis=2), 0, None)
    n_known = np.maximum(known.sum(axis=1), 1)
    motion = np.sqrt((variance * known).sum(axis=1) / n_known)
    distance = np.sqrt(((mean**2).sum(axis=2) * known).sum(axis=1) / n_known)

    well_seen = (count >= n_window / 2).sum(axis=1) >= seen.any(axis=0).sum() / 2
    candidates = well_seen if well_seen.any() else known.any(axis=1)
    still = candidates & (motion <= np.quantile(motion[candidates], STILLEST_SHARE))
    return int(np.argmin(np.where(still, distance, np.inf)))


def _window_sums(values: NDArray, n_window: int) -> NDArray:
    """Sum over each window of `n_window` frames along the first axis."""
    total = np.concatenate((np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)))
    return total[n_window:] - total[:-n_window]


def _fill_from_similar_frames(markers: NDArray, seen: NDArray, neutral: NDArray, onset: int, offset: int) -> Neutral:
    """Complete the neutral with markers that its own frames lack."""
    lacking = np.isnan(neutral).any(axis=1)
    filled = np.zeros(len(neutral), dtype=bool)
    result = neutral.copy()
    shared = seen & ~lacking
    gap = np.where(shared, ((markers - neutral) ** 2).sum(axis=2), 0.0).sum(axis=1)
    distance = np.sqrt(gap / np.maximum(shared.sum(axis=1), 1))
    n_similar = max(3, int(np.ceil(TYPICAL_SHARE * len(markers))))
    for marker in np.flatnonzero(lacking):
        usable = np.flatnonzero(seen[:, marker] & shared.any(axis=1))
        if len(usable):
            nearest = usable[np.argsort(distance[usable], kind="stable")[:n_similar]]
            result[marker] = np.median(markers[nearest, marker], axis=0)
            filled[marker] = True
    return Neutral(result, onset, offset, filled)
