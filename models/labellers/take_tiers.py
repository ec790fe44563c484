"""From a fitted labeller to the segments of a take: held expressions and transitions in one pass."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..confidence.calibration import Calibrator, segment_probabilities
from ..scores.frame_labels import code_frames, find_runs
from .base import FrameLabeller
from .frames import TRANSITION, fill_gaps, segments_of_labels

__all__ = ["find_take_segments", "name_open_transitions"]


def find_take_segments(
    labeller: FrameLabeller, weights: ArrayLike, calibrator: Calibrator | None = None
) -> tuple[pd.DataFrame, NDArray[np.float64]]:
    """Label a take and cut it where the label changes.

    Parameters
    ----------
    labeller
        Fitted; transitions are its class :data:`~.frames.TRANSITION`, if it knows them.
    weights
        ``(n_frames, n_shapes)``, NaN in gaps, which get no segment and end one.
    calibrator
        Of segments' probabilities.

    Returns
    -------
    segments
        ``onset, offset, label, kind, confidence, from_label, to_label``, see :func:`~.frames.segments_of_labels`.
        Every transition has two sides, which differ (:func:`name_open_transitions`). The confidence is the (calibrated)
        mean over the frames of the label's probability.
    probabilities
        ``(n_segments, n_classes)``, calibrated where there is a calibrator.

    Raises
    ------
    InputError
        If every frame has a NaN.
    """
    values, missing = fill_gaps(weights)
    found, scores = labeller.predict_with_proba(values)
    labels = found.astype(object)
    labels[missing] = None
    scores[missing] = np.nan
    classes = [str(name) for name in labeller.classes_]
    segments = segments_of_labels(name_open_transitions(labels, scores, classes))
    pooled = segment_probabilities(scores, segments)
    if calibrator is not None:
        pooled = calibrator.apply(pooled)
    column = {name: place for place, name in enumerate(classes)}
    places = segments["label"].map(column).to_numpy(dtype=np.int64)
    return segments.assign(confidence=pooled[np.arange(len(segments)), places]), pooled


def name_open_transitions(labels: NDArray, probabilities: ArrayLike, classes: list[str]) -> NDArray[np.object_]:
    """Give transitions that lead from nowhere, to nowhere or back to the same expression to a held one.

    A movement between two segments of one label is part of that expression (Reverdy 2019, 4.3.2). One that a gap or the
    take's end cuts gets the likeliest of the held expressions over its frames: its other side is not known.

    Parameters
    ----------
    labels
        ``(n_frames,)``, ``None`` for nothing.
    probabilities, classes
        ``(n_frames, n_classes)`` and the labels of the columns.

    Returns
    -------
    The labels, changed.
    """
    names = np.array(labels, dtype=object)
    held = [place for place, name in enumerate(classes) if name != TRANSITION]
    if len(held) == len(classes):
        return names
    scores = np.asarray(probabilities, dtype=float)
    (codes,), present = code_frames(names)
    found, onsets, offsets = find_runs(codes)
    wanted = [present[code] for code in found]
    for row, (onset, offset) in enumerate(zip(onsets, offsets, strict=True)):
        if wanted[row] != TRANSITION:
            continue
        before = wanted[row - 1] if row and offsets[row - 1] == onset else None
        after = wanted[row + 1] if row + 1 < len(wanted) and offset == onsets[row + 1] else None
        if before is None or after is None:
            means = scores[onset:offset][:, held].mean(axis=0)
            names[onset:offset] = classes[held[int(means.argmax())]]
        elif before == after:
            names[onset:offset] = before
    return names
