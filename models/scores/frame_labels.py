"""Labels of frames: one label per frame of a take, ``None`` (or NaN) where nobody annotated it.

Unannotated time is a gap, never a label. Every score of frames leaves it out by what :func:`code_frames` says.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError

__all__ = ["GAP", "Labels", "Segment", "code_frames", "find_runs", "frames_of_segments", "segments_of_frames"]

GAP = -1
"""Code of a frame that is not annotated."""

Labels: TypeAlias = Sequence[Any] | NDArray | pd.Series
Segment: TypeAlias = tuple[Any, int, int]
"""Label, onset, offset; half-open, in frames."""


def code_frames(*labels: Labels, classes: Sequence[Any] | None = None) -> tuple[list[NDArray[np.int64]], list[Any]]:
    """Give numbers to the labels of one or several annotations of the same frames.

    Parameters
    ----------
    labels
        Each ``(n_frames,)``, all of one length; ``None`` or NaN is a gap.
    classes
        Labels that may occur, in order; by default those that occur, sorted.

    Returns
    -------
    codes
        One array ``(n_frames,)`` per annotation: position in the classes, :data:`GAP` for gaps.
    classes
        The labels by code.

    Raises
    ------
    InputError
        If the lengths differ, the labels are no list of labels, or one is not among the classes.
    """
    columns = [_as_column(one) for one in labels]
    lengths = [len(column) for column in columns]
    if len(set(lengths)) > 1:
        raise InputError(f"frame labels: expected one length, but got {' and '.join(map(str, lengths))} frames")
    try:
        codes, found = pd.factorize(np.concatenate(columns))
    except TypeError as error:
        raise InputError(f"frame labels: expected names or numbers, but got something else ({error})") from error
    names = _sort(found) if classes is None else list(classes)
    if len(set(names)) != len(names):
        raise InputError(f"classes: expected each once, but got {', '.join(map(str, names))}")
    position: dict[Hashable, int] = {name: index for index, name in enumerate(names)}
    unknown = [str(name) for name in found if name not in position]
    if unknown:
        raise InputError(
            f"frame labels: expected {', '.join(map(str, names)) or 'no label'}, but got {', '.join(unknown[:5])}"
        )
    # The last entry is what the code −1 of a gap points at.
    table = np.array([*(position[name] for name in found), GAP], dtype=np.int64)
    return np.split(table[codes], np.cumsum(lengths)[:-1]), names


def find_runs(codes: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Longest stretches of one code, gaps left out: ``codes, onsets, offsets``, each ``(n_segments,)``."""
    if not len(codes):
        empty = np.zeros(0, dtype=np.int64)
        return empty, empty.copy(), empty.copy()
    onsets = np.concatenate(([0], np.flatnonzero(np.diff(codes)) + 1)).astype(np.int64)
    offsets = np.append(onsets[1:], len(codes))
    kept = codes[onsets] != GAP
    return codes[onsets][kept], onsets[kept], offsets[kept]


def segments_of_frames(labels: Labels) -> list[Segment]:
    """Segments of a take from the labels of its frames.

    Parameters
    ----------
    labels
        ``(n_frames,)``, ``None`` for gaps.

    Returns
    -------
    ``(label, onset, offset)`` of every longest stretch of one label, in order; a gap is no segment, and ends one.
    """
    (codes,), names = code_frames(labels)
    return [(names[code], int(onset), int(offset)) for code, onset, offset in zip(*find_runs(codes), strict=True)]


def frames_of_segments(segments: pd.DataFrame | Iterable[Segment], n_frames: int) -> NDArray[np.object_]:
    """Labels of frames ``(n_frames,)`` from segments, ``None`` where there is none.

    Two segments of one label that touch become one stretch.

    Parameters
    ----------
    segments
        Table with ``label``, ``onset``, ``offset``, or such triples, without overlap.
    n_frames
        Length of the take.
    """
    if isinstance(segments, pd.DataFrame):
        segments = list(zip(segments["label"], segments["onset"], segments["offset"], strict=True))
    labels = np.full(n_frames, None, dtype=object)
    taken = np.zeros(n_frames, dtype=bool)
    for label, onset, offset in segments:
        if not 0 <= onset < offset <= n_frames:
            raise InputError(
                f"segments: expected 0 <= onset < offset <= {n_frames}, but {label!r} is at [{onset}, {offset})"
            )
        if taken[onset:offset].any():
            raise InputError(f"segments: expected no overlap, but {label!r} at [{onset}, {offset}) overlaps another")
        labels[onset:offset] = label
        taken[onset:offset] = True
    return labels


def _as_column(labels: Labels) -> NDArray[np.object_]:
    if isinstance(labels, str):
        raise InputError(f"frame labels: expected one label per frame, but got the one text {labels!r}")
    column = np.asarray(labels, dtype=object)
    if column.ndim != 1:
        raise InputError(f"frame labels: expected one label per frame, but got an array of shape {column.shape}")
    return column


def _sort(labels: Iterable[Any]) -> list[Any]:
    names = list(labels)
    try:
        return sorted(names)
    except TypeError:  # names and numbers mixed
        return sorted(names, key=str)
