"""Descriptors of frames and segments for the classifiers (Reverdy 2019, 4.4.1, 4.4.3).

The descriptor of a frame is its vector of weights; that of a segment is the mean over its F frames,

    W̄ = (1/F) Σ_f W_f        (4.6)
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError

__all__ = ["mean_weights", "sample_frames"]


def mean_weights(weights: ArrayLike, segments: pd.DataFrame) -> NDArray[np.float64]:
    """Mean weights of each segment (4.6), over the frames that are not gaps.

    Parameters
    ----------
    weights
        ``(n_frames, n_shapes)``; a frame with a NaN is a gap.
    segments
        Table with the integer columns ``onset`` and ``offset``, half-open frames inside the take.

    Returns
    -------
    ``(n_segments, n_shapes)``; NaN for a segment that is all gaps.
    """
    values = check_array(weights, name="weights", shape=(None, None))
    onsets, offsets = _check_bounds(segments, len(values))
    present = np.isfinite(values).all(axis=1)
    result = np.full((len(onsets), values.shape[1]), np.nan)
    for row, (onset, offset) in enumerate(zip(onsets, offsets, strict=True)):
        frames = values[onset:offset][present[onset:offset]]
        if len(frames):
            result[row] = frames.mean(axis=0)
    return result


def sample_frames(
    weights: ArrayLike, segments: pd.DataFrame, rate: float, per_second: float | None = 10.0
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Frames of segments as training samples, thinned evenly.

    Frames of 200 Hz are near copies of their neighbours: a face takes a few tenths of a second to change, so that ten
    frames a second hold nearly all that 200 hold, and the classifiers train twenty times faster or more. Each segment
    gives at least one frame, and as many as its duration asks for, spread evenly over its frames that are not gaps.

    Parameters
    ----------
    weights
        ``(n_frames, n_shapes)``; a frame with a NaN is a gap and never a sample.
    segments
        Table with the integer columns ``onset`` and ``offset``.
    rate
        Frames per second, above 0.
    per_second
        Samples per second, above 0; ``None`` takes every frame.

    Returns
    -------
    samples
        ``(n_samples, n_shapes)``, segment by segment.
    rows
        ``(n_samples,)``: the position in the table of the segment that each sample comes from.
    """
    values = check_array(weights, name="weights", shape=(None, None))
    if per_second is not None and not per_second > 0:
        raise InputError(f"per_second: expected samples per second above 0, but got {per_second}")
    onsets, offsets = _check_bounds(segments, len(values))
    present = np.isfinite(values).all(axis=1)
    chosen = [np.zeros(0, dtype=np.int64)]
    rows = [np.zeros(0, dtype=np.int64)]
    for row, (onset, offset) in enumerate(zip(onsets, offsets, strict=True)):
        frames = onset + np.flatnonzero(present[onset:offset])
        if per_second is not None and len(frames):
            n_wanted = min(max(1, round(len(frames) / rate * per_second)), len(frames))
            # Middles of n equal parts: no sample on the very border, where neighbours meet.
            frames = frames[((np.arange(n_wanted) + 0.5) * len(frames) / n_wanted).astype(np.int64)]
        chosen.append(frames)
        rows.append(np.full(len(frames), row, dtype=np.int64))
    return values[np.concatenate(chosen)], np.concatenate(rows)


def _check_bounds(segments: pd.DataFrame, n_frames: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    missing = [column for column in ("onset", "offset") if column not in segments.columns]
    if missing:
        raise InputError(f"segments: expected the columns onset and offset, but {' and '.join(missing)} is missing")
    onsets = segments["onset"].to_numpy(dtype=np.int64)
    offsets = segments["offset"].to_numpy(dtype=np.int64)
    wrong = np.flatnonzero((onsets < 0) | (offsets <= onsets) | (offsets > n_frames))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(
            f"segments: expected 0 <= onset < offset <= {n_frames}, "
            f"but row {row} has onset {onsets[row]} and offset {offsets[row]}"
        )
    return onsets, offsets
