"""All scores of labels over time at once, from counts that add up over takes, and their bootstrap intervals.

Each take gives a fixed set of counts (:class:`LabelCounts`). The counts of some takes are the sum of theirs, and every
score is a function of the sum. So a bootstrap over takes is a matrix product: multiplicities of the takes, draw by
draw, times their counts. All raters of the same takes see the same draws, so that differences are paired.

The definitions are those of :mod:`.frame_metrics`, :mod:`.segment_metrics`, :mod:`.agreement` and :mod:`.staccato`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..metrics import match_boundaries
from .agreement import duration_weighted_agreement
from .bootstrap import LEAST_DEFINED
from .frame_labels import GAP, Labels, code_frames
from .segment_metrics import OVERLAPS, TOLERANCES, boundary_scores, edit_score, find_boundaries, segmental_f1
from .staccato import staccato

__all__ = ["SCORES", "LabelCounts", "add_counts", "count_labels", "draw_takes", "find_intervals", "score_counts"]

FAR = 0.25
"""Seconds: borders farther apart than this are not the same border, when their mean distance is taken."""
BLUR = 0.1
"""Seconds of overlap that Staccato does not count; two readings by one person differ by as much (see `.staccato`)."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LabelCounts:
    """Counts of one take, or sums of several; leading axes (draws of a bootstrap) may come before those named here.

    Parameters
    ----------
    confusion
        ``(n_classes, n_classes)`` frames: one row a class of the reference, one column an answer.
    missed
        ``(n_classes,)`` frames with a reference and without an answer.
    segments
        ``(n_overlaps + 1, 3)`` matched, predicted and reference segments at each of
        :data:`~.segment_metrics.OVERLAPS`; the last row is at 0.5 and of the classes that are not in motion only.
    borders
        ``(n_tolerances, 3)`` matched, found and reference borders at each of :data:`~.segment_metrics.TOLERANCES`.
    offsets
        ``(3,)`` sums in ms of answer minus reference and of its absolute value, over borders within :data:`FAR`; pairs.
    edit
        ``(2,)`` sum of edit scores, takes.
    agreeing
        ``(2,)`` frames of segments whose label the other shares, frames of all segments, of both sides.
    nuclei
        ``(3,)`` Staccato: segments in nuclei, segments that chance would put there, all segments.
    """

    confusion: Array
    missed: Array
    segments: Array
    borders: Array
    offsets: Array
    edit: Array
    agreeing: Array
    nuclei: Array


def count_labels(
    reference: Labels,
    answers: Labels,
    classes: Sequence[str],
    rate: float,
    *,
    rng: np.random.Generator,
    moving: str | None = None,
    n_simulations: int = 50,
) -> LabelCounts:
    """Count what the scores of one take need.

    Parameters
    ----------
    reference, answers
        ``(n_frames,)``, ``None`` for gaps.
    classes
        All labels that may occur, in any take.
    rate
        Hz.
    rng, n_simulations
        Of Staccato's random segmentations.
    moving
        The class of transitions; left out of the last row of ``segments``.
    """
    (truth, given), _ = code_frames(reference, answers, classes=classes)
    n = len(classes)
    both = (truth != GAP) & (given != GAP)
    missed = (truth != GAP) & (given == GAP)
    scores = [segmental_f1(reference, answers, overlap) for overlap in OVERLAPS]
    truth_still, given_still = (_cut(labels, [one == moving for one in labels]) for labels in (reference, answers))
    scores.append(segmental_f1(truth_still, given_still, 0.5))
    borders = [boundary_scores(reference, answers, tolerance) for tolerance in TOLERANCES]
    order = edit_score(reference, answers)
    n_both = int(both.sum())
    cut = staccato(reference, answers, n_simulations, rng, tolerance=round(BLUR * rate))
    return LabelCounts(
        confusion=np.bincount(truth[both] * n + given[both], minlength=n * n).reshape(n, n).astype(float),
        missed=np.bincount(truth[missed], minlength=n).astype(float),
        segments=np.array([(one.n_matched, one.n_predicted, one.n_reference) for one in scores], dtype=float),
        borders=np.array([(one.n_matched, one.n_found, one.n_reference) for one in borders], dtype=float),
        offsets=_offsets(reference, answers, rate),
        edit=np.zeros(2) if np.isnan(order) else np.array([order, 1.0]),
        # d of every segment adds up to the frames that both labelled, once for each side.
        agreeing=2.0 * n_both * np.array([duration_weighted_agreement(reference, answers) if n_both else 0.0, 1.0]),
        nuclei=np.array([2.0 * cut.n_nuclei, cut.expected, cut.n_segments]),
    )


def add_counts(counts: Sequence[LabelCounts], multiplicities: Array | None = None) -> LabelCounts:
    """Add the counts of takes, each as often as the multiplicities ``(n_draws, n_takes)`` say; once without them."""
    if not counts:
        raise InputError("counts: expected those of at least one take, but got none")
    often = np.ones(len(counts)) if multiplicities is None else multiplicities
    return LabelCounts(
        **{
            part.name: np.tensordot(often, np.stack([getattr(one, part.name) for one in counts]), axes=1)
            for part in fields(LabelCounts)
        }
    )


def score_counts(counts: LabelCounts) -> dict[str, Array]:
    """Return all scores, each with the leading axes of the counts; NaN where there is nothing to score.

    ``accuracy, macro_f1, kappa, alpha`` (frames), ``agreement`` (segments' time), ``f1_10, f1_25, f1_50,
    f1_50_stable, edit``, ``border_precision_1, border_recall_1, border_f1_1`` … for each tolerance in frames,
    ``offset_ms`` (above 0: late), ``distance_ms``, ``staccato``, and ``majority`` and ``chance``, the accuracy of the
    best constant answer and of guessing with equal odds.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        table = counts.confusion
        right = np.diagonal(table, axis1=-2, axis2=-1)
        asked, given = table.sum(axis=-1) + counts.missed, table.sum(axis=-2)
        n_asked = asked.sum(axis=-1)
        n_classes = (asked > 0).sum(axis=-1)
        found = {
            "accuracy": right.sum(axis=-1) / n_asked,
            "macro_f1": np.where(asked + given > 0, 2 * right / np.where(asked + given > 0, asked + given, 1), 0.0).sum(
                axis=-1
            )
            / (asked + given > 0).sum(axis=-1),
            "kappa": _kappa(table),
            "alpha": _alpha(table),
            "agreement": counts.agreeing[..., 0] / counts.agreeing[..., 1],
            "majority": asked.max(axis=-1) / n_asked,
            "chance": np.where(n_classes > 0, 1 / n_classes, np.nan),
        }
        for name, some in zip(("f1_10", "f1_25", "f1_50", "f1_50_stable"), _last(counts.segments), strict=True):
            found[name] = 2 * some[0] / (some[1] + some[2])
        found["edit"] = counts.edit[..., 0] / counts.edit[..., 1]
        for tolerance, (n, n_found, n_reference) in zip(TOLERANCES, _last(counts.borders), strict=True):
            found[f"border_precision_{tolerance}"] = n / n_found
            found[f"border_recall_{tolerance}"] = n / n_reference
            found[f"border_f1_{tolerance}"] = 2 * n / (n_found + n_reference)
        found["offset_ms"] = counts.offsets[..., 0] / counts.offsets[..., 2]
        found["distance_ms"] = counts.offsets[..., 1] / counts.offsets[..., 2]
        in_nuclei, expected, n_segments = np.moveaxis(counts.nuclei, -1, 0)
        room = n_segments - expected
        room = np.where(in_nuclei < expected, np.maximum(room, expected), room)
        found["staccato"] = np.where(room > 0, (in_nuclei - expected) / room, np.nan)
    return {name: np.asarray(values, dtype=float) for name, values in found.items()}


def draw_takes(n_takes: int, rng: np.random.Generator, n_draws: int, units: Sequence[str] | None = None) -> Array:
    """Multiplicities ``(n_draws, n_takes)`` of a bootstrap over takes, or over units (signers) that takes belong to.

    The draws are those of :func:`.bootstrap.bootstrap_interval` with the same generator.
    """
    if units is None:
        places, n_units = np.arange(n_takes), n_takes
    else:
        places = np.unique(np.asarray(units), return_inverse=True)[1]
        n_units = int(places.max()) + 1
    drawn = rng.integers(n_units, size=(n_draws, n_units))
    often = np.zeros((n_draws, n_units))
    np.add.at(often, (np.arange(n_draws)[:, None], drawn), 1.0)
    return often[:, places]


def find_intervals(value: float, drawn: Array, level: float = 0.95) -> tuple[float, float]:
    """Return the ends of the percentile interval; NaN where the score or more than a tenth of its draws is NaN."""
    defined = drawn[~np.isnan(drawn)]
    if np.isnan(value) or not len(defined) or len(defined) < LEAST_DEFINED * len(drawn):
        return float("nan"), float("nan")
    low, high = np.quantile(defined, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


SCORES = (
    [
        "accuracy",
        "macro_f1",
        "kappa",
        "alpha",
        "agreement",
        "f1_10",
        "f1_25",
        "f1_50",
        "f1_50_stable",
        "edit",
        "staccato",
    ]
    + [f"border_{what}_{tolerance}" for tolerance in TOLERANCES for what in ("precision", "recall", "f1")]
    + ["offset_ms", "distance_ms"]
)
"""Names of the scores that have an interval, in order."""


def _cut(labels: Labels, where: Sequence[bool]) -> NDArray[np.object_]:
    """Return the labels with gaps where they are told."""
    kept = np.array(labels, dtype=object)
    kept[np.asarray(where, dtype=bool)] = None
    return kept


def _offsets(reference: Labels, answers: Labels, rate: float) -> Array:
    # Where the reference has a gap the answers have none either, as everywhere in `segment_metrics`.
    kept = _cut(answers, [one is None for one in reference])
    found, wanted = find_boundaries(kept), find_boundaries(reference)
    pairs = match_boundaries(found, wanted, FAR * rate)
    away = (found[pairs[:, 0]] - wanted[pairs[:, 1]]) * 1000.0 / rate
    return np.array([away.sum(), np.abs(away).sum(), len(away)])


def _last(counts: Array) -> list[Array]:
    """Rows of the second last axis, each with its numbers first."""
    return [np.moveaxis(counts[..., row, :], -1, 0) for row in range(counts.shape[-2])]


def _kappa(table: Array) -> Array:
    total = table.sum(axis=(-2, -1))
    expected = (table.sum(axis=-1) * table.sum(axis=-2)).sum(axis=-1) / total**2
    observed = np.trace(table, axis1=-2, axis2=-1) / total
    return np.where(expected < 1, (observed - expected) / (1 - expected), np.nan)


def _alpha(table: Array) -> Array:
    """Krippendorff's nominal α of two annotators: each frame with both labels is a unit with two values."""
    margin = table.sum(axis=-1) + table.sum(axis=-2)
    total = margin.sum(axis=-1)
    # Coincidences are the table plus its transpose, so those of unequal labels are twice what is off the diagonal.
    unequal = total - 2 * np.trace(table, axis1=-2, axis2=-1)
    expected = total**2 - (margin**2).sum(axis=-1)
    return np.where(expected > 0, 1 - (total - 1) * unequal / np.where(expected > 0, expected, 1), np.nan)
