"""How well the labels of frames agree with their reference, and what guessing would reach.

Frames without a reference are gaps: left out, and counted. A labelled frame without an answer is wrong, and counted
too: leaving it out would reward silence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from .frame_labels import GAP, Labels, code_frames, find_runs

__all__ = ["ChanceLevel", "FrameScores", "chance_level", "class_counts", "score_frames"]


@dataclass(frozen=True)
class FrameScores:
    """Scores of frames, from 0 to 1; NaN where no frame has a reference.

    Parameters
    ----------
    accuracy
        Part of the reference's frames whose label is right.
    balanced_accuracy
        Mean recall over the classes of the reference.
    macro_f1
        Mean F1 over the classes that the reference or the answers contain; a class never right has 0.
    majority
        Accuracy of the best constant answer.
    chance
        Accuracy of guessing among the classes of the reference with equal odds.
    n_frames
        Frames with a reference: those that are scored.
    n_gaps
        Frames without a reference, left out.
    n_missed
        Scored frames without an answer, counted as wrong.
    confusion
        Counts: one row a class of the reference, one column an answer. Missed frames are in no column.
    classes
        Per class ``n_reference, n_predicted, n_missed, precision, recall, f1``; precision is NaN where the class was
        never answered, recall where it has no reference, F1 where both.
    """

    accuracy: float
    balanced_accuracy: float
    macro_f1: float
    majority: float
    chance: float
    n_frames: int
    n_gaps: int
    n_missed: int
    confusion: pd.DataFrame = field(repr=False)
    classes: pd.DataFrame = field(repr=False)


def score_frames(reference: Labels, predicted: Labels, *, classes: Sequence[Any] | None = None) -> FrameScores:
    """Compare the labels of frames with their reference.

    To score several takes together, join their frames: no score here looks at the order of frames.

    Parameters
    ----------
    reference, predicted
        ``(n_frames,)``, ``None`` for gaps.
    classes
        Order of the classes in the tables; by default those that occur, sorted.

    Raises
    ------
    InputError
        If the lengths differ, or a label is not among the classes.
    """
    (truth, answers), names = code_frames(reference, predicted, classes=classes)
    scored = truth != GAP
    answered = scored & (answers != GAP)
    n = len(names)
    counts = np.bincount(truth[answered] * n + answers[answered], minlength=n * n).reshape(n, n)
    n_reference = np.bincount(truth[scored], minlength=n)
    n_predicted = counts.sum(axis=0)
    right = np.diag(counts)
    with np.errstate(invalid="ignore"):
        precision, recall, f1 = right / n_predicted, right / n_reference, 2 * right / (n_reference + n_predicted)
    total = int(scored.sum())
    asked = n_reference > 0
    table = pd.DataFrame(
        {
            "n_reference": n_reference,
            "n_predicted": n_predicted,
            "n_missed": n_reference - counts.sum(axis=1),
            "precision": precision,
            "recall": recall,
            "f1": f1,
        },
        index=names,
    )
    nan = float("nan")
    return FrameScores(
        accuracy=float(right.sum() / total) if total else nan,
        balanced_accuracy=float(recall[asked].mean()) if total else nan,
        macro_f1=float(np.nanmean(f1)) if total else nan,
        majority=float(n_reference.max() / total) if total else nan,
        chance=1 / int(asked.sum()) if total else nan,
        n_frames=total,
        n_gaps=len(truth) - total,
        n_missed=total - int(answered.sum()),
        confusion=pd.DataFrame(counts, index=names, columns=names),
        classes=table,
    )


@dataclass(frozen=True)
class ChanceLevel:
    """Accuracy that guessing reaches; NaN where there is no reference.

    Parameters
    ----------
    uniform
        Guessing among the K classes with equal odds, 1/K.
    proportional
        Guessing each class as often as the reference has it, Σ p².
    majority
        Always answering the most frequent class, max p.
    """

    uniform: float
    proportional: float
    majority: float


def chance_level(reference: Labels) -> ChanceLevel:
    """Compute what guessing would reach on these labels, of frames or of segments; ``None`` is a gap."""
    (codes,), names = code_frames(reference)
    if not names:
        return ChanceLevel(float("nan"), float("nan"), float("nan"))
    shares = np.bincount(codes[codes != GAP], minlength=len(names)) / (codes != GAP).sum()
    return ChanceLevel(1 / len(names), float((shares**2).sum()), float(shares.max()))


def class_counts(labels: Labels, *, classes: Sequence[Any] | None = None) -> pd.DataFrame:
    """Count frames and segments of every class.

    Parameters
    ----------
    labels
        ``(n_frames,)`` of one take, ``None`` for gaps. For several takes, add the counts of each: joined frames would
        join segments too.
    classes
        Rows of the table; by default the classes that occur, sorted.

    Returns
    -------
    One row a class: ``n_frames``, ``n_segments`` and ``share`` of the annotated frames (NaN if there are none).
    """
    (codes,), names = code_frames(labels, classes=classes)
    frames = np.bincount(codes[codes != GAP], minlength=len(names))
    segments = np.bincount(find_runs(codes)[0], minlength=len(names))
    total = frames.sum()
    share = frames / total if total else np.full(len(names), np.nan)
    return pd.DataFrame({"n_frames": frames, "n_segments": segments, "share": share}, index=names)
