"""How well a labelled segmentation agrees with its reference: whole segments, their order, and their borders.

All functions take the labels of frames. Frames without a reference are left out: the answers there are taken away
before the segments of the answers are read, so that nobody is punished for a label where nothing was annotated. Such a
gap cuts the segments of both sides. Scores go from 0 to 1 (the literature often prints percent).

Per-frame accuracy hardly notices a hundred wrong slivers; these scores do.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..metrics import BoundaryScores, match_boundaries, score_boundaries
from .frame_labels import GAP, Labels, code_frames, find_runs, frames_of_segments, segments_of_frames

__all__ = [
    "F1",
    "OVERLAPS",
    "TOLERANCES",
    "boundary_scores",
    "edit_score",
    "find_boundaries",
    "frames_of_segments",
    "mean_boundary_offset",
    "pool_boundaries",
    "pool_f1",
    "segmental_f1",
    "segments_of_frames",
]

OVERLAPS = (0.10, 0.25, 0.50)
"""Least overlaps of F1@10, F1@25 and F1@50."""
TOLERANCES = (1, 2, 5, 10)
"""Distances in frames at which borders are scored."""


@dataclass(frozen=True)
class F1:
    """Segments that were found; ``float(…)`` gives the F1.

    Parameters
    ----------
    n_matched, n_predicted, n_reference
        Numbers of segments.
    """

    n_matched: int
    n_predicted: int
    n_reference: int

    @property
    def precision(self) -> float:
        """Part of the predicted segments that is matched; NaN if there are none."""
        return self.n_matched / self.n_predicted if self.n_predicted else float("nan")

    @property
    def recall(self) -> float:
        """Part of the reference's segments that is matched; NaN if there are none."""
        return self.n_matched / self.n_reference if self.n_reference else float("nan")

    @property
    def f1(self) -> float:
        """Harmonic mean of both; NaN if there is no segment on either side."""
        total = self.n_predicted + self.n_reference
        return 2 * self.n_matched / total if total else float("nan")

    def __float__(self) -> float:
        return self.f1


def segmental_f1(reference: Labels, predicted: Labels, overlap: float) -> F1:
    """Segmental F1@k of Lea et al. 2017.

    A predicted segment is right where the reference's segment of its label that it overlaps most, by intersection over
    union, reaches the overlap and was not taken by an earlier one. All others are false positives, so cutting a segment
    in two costs, and shifting its borders a little does not: F1 = 2 matched / (predicted + reference).

    Parameters
    ----------
    reference, predicted
        ``(n_frames,)`` of one take, ``None`` for gaps. Add takes with :func:`pool_f1`.
    overlap
        Least intersection over union, inclusive, above 0 and at most 1: 0.1, 0.25 and 0.5 for F1@10, 25 and 50.

    References
    ----------
    C. Lea, M. D. Flynn, R. Vidal, A. Reiter, G. D. Hager, "Temporal convolutional networks for action segmentation and
    detection", CVPR 2017, section 4.1.
    """
    if not 0 < overlap <= 1:
        raise InputError(f"overlap: expected a share above 0 and at most 1, but got {overlap}")
    truth, answers, _ = _code_pair(reference, predicted)
    labels, onsets, offsets = find_runs(truth)
    taken = np.zeros(len(labels), dtype=bool)
    n_matched = 0
    given = find_runs(answers)
    for label, onset, offset in zip(*given, strict=True):
        # Segments are in order and apart, so those that meet this one are neighbours.
        near = slice(int(np.searchsorted(offsets, onset, side="right")), int(np.searchsorted(onsets, offset)))
        common = np.minimum(offsets[near], offset) - np.maximum(onsets[near], onset)
        union = (offsets[near] - onsets[near]) + (offset - onset) - common
        share = np.where(labels[near] == label, common / union, 0.0)
        if not len(share):
            continue
        best = int(share.argmax())
        if share[best] >= overlap and not taken[near][best]:
            taken[near.start + best] = True
            n_matched += 1
    return F1(n_matched, len(given[0]), len(labels))


def pool_f1(scores: Iterable[F1]) -> F1:
    """F1 of several takes together: their segments are added."""
    some = list(scores)
    return F1(
        sum(one.n_matched for one in some), sum(one.n_predicted for one in some), sum(one.n_reference for one in some)
    )


def edit_score(reference: Labels, predicted: Labels) -> float:
    """Whether the right labels come in the right order, whatever their durations (Lea et al. 2016).

    One minus the Levenshtein distance of the two sequences of segment labels over the length of the longer one:
    1 − d / max(n, m). NaN where neither side has a segment.

    Parameters
    ----------
    reference, predicted
        ``(n_frames,)`` of one take, ``None`` for gaps.

    References
    ----------
    C. Lea, A. Reiter, R. Vidal, G. D. Hager, "Segmental spatiotemporal CNNs for fine-grained action segmentation",
    ECCV 2016, section 4.
    """
    truth, answers, _ = _code_pair(reference, predicted)
    first, second = find_runs(truth)[0], find_runs(answers)[0]
    longest = max(len(first), len(second))
    return 1 - _edit_distance(first, second) / longest if longest else float("nan")


def find_boundaries(labels: Labels) -> NDArray[np.int64]:
    """Frames at which the label changes from one to another: first frames of the new label.

    Where a gap begins or ends, somebody stopped annotating; that is no border between two expressions.
    """
    return _borders(code_frames(labels)[0][0])


def boundary_scores(reference: Labels, predicted: Labels, tolerance: float) -> BoundaryScores:
    """Precision, recall and F1 of borders, matched one to one within a tolerance.

    Parameters
    ----------
    reference, predicted
        ``(n_frames,)`` of one take, ``None`` for gaps. Add takes with :func:`pool_boundaries`.
    tolerance
        Greatest distance of a match in frames, inclusive; see :data:`TOLERANCES`.
    """
    truth, answers, _ = _code_pair(reference, predicted)
    return score_boundaries(_borders(answers), _borders(truth), tolerance)


def pool_boundaries(scores: Iterable[BoundaryScores]) -> BoundaryScores:
    """Scores of the borders of several takes together: borders and pairs are added."""
    some = list(scores)
    n, n_found, n_reference = (
        sum(getattr(one, name) for one in some) for name in ("n_matched", "n_found", "n_reference")
    )
    nan = float("nan")
    matched = [one for one in some if one.n_matched]
    return BoundaryScores(
        precision=n / n_found if n_found else nan,
        recall=n / n_reference if n_reference else nan,
        f1=2 * n / (n_found + n_reference) if n_found + n_reference else nan,
        mean_offset=sum(one.mean_offset * one.n_matched for one in matched) / n if n else nan,
        mean_distance=sum(one.mean_distance * one.n_matched for one in matched) / n if n else nan,
        n_found=n_found,
        n_reference=n_reference,
        n_matched=n,
    )


def mean_boundary_offset(
    reference: Labels, predicted: Labels, tolerance: float | None = None, *, signed: bool = False
) -> float:
    """Mean distance in frames between matched borders; NaN where none is matched.

    Parameters
    ----------
    reference, predicted
        ``(n_frames,)`` of one take, ``None`` for gaps.
    tolerance
        Greatest distance of a match in frames. With ``None`` all borders of the side that has fewer are matched, so a
        border that was not found at all can add the distance to a far one.
    signed
        Predicted minus reference instead of its absolute value: above 0 the predicted borders come late. Early and late
        ones cancel out.
    """
    truth, answers, _ = _code_pair(reference, predicted)
    found, wanted = _borders(answers), _borders(truth)
    pairs = match_boundaries(found, wanted, np.inf if tolerance is None else tolerance)
    if not len(pairs):
        return float("nan")
    away = found[pairs[:, 0]] - wanted[pairs[:, 1]]
    return float((away if signed else np.abs(away)).mean())


def _code_pair(reference: Labels, predicted: Labels) -> tuple[NDArray[np.int64], NDArray[np.int64], list]:
    """Codes of both, the answers without the frames that have no reference, and the classes."""
    (truth, answers), names = code_frames(reference, predicted)
    return truth, np.where(truth == GAP, GAP, answers), names


def _borders(codes: NDArray[np.int64]) -> NDArray[np.int64]:
    before, after = codes[:-1], codes[1:]
    return np.flatnonzero((before != after) & (before != GAP) & (after != GAP)) + 1


def _edit_distance(first: NDArray[np.int64], second: NDArray[np.int64]) -> int:
    """Fewest insertions, deletions and substitutions that turn one sequence into the other, one row at a time."""
    steps = np.arange(len(second) + 1)
    row = steps.copy()
    for count, item in enumerate(first, start=1):
        kept = np.concatenate(([count], np.minimum(row[1:] + 1, row[:-1] + (second != item))))
        # An insertion takes the value to the left plus one: a running minimum of what each column is above its number.
        row = np.minimum.accumulate(kept - steps) + steps
    return int(row[-1])
