"""How well a take is cut, whatever the segments are called: borders and segments against a reference, class-blind.

A border lies where one segment ends and another begins, and the reference is annotated on both sides: what is cut where
nobody annotated counts neither way. Segments of one label that touch in the reference are one. A segment is found where
the reference's segment that it overlaps most, by intersection over union, reaches an overlap and was not taken by an
earlier one: F1@k of Lea et al. 2017 with one class for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ..labelled_take import LabelledTake, check_segments
from ..metrics import match_boundaries
from .frame_labels import GAP, find_runs
from .segment_metrics import OVERLAPS, TOLERANCES

__all__ = [
    "OFFSET_REACH",
    "ReferenceCut",
    "clip_segments",
    "count_matched_borders",
    "count_matched_segments",
    "find_borders",
    "prepare_reference",
    "score_cut",
]

OFFSET_REACH = 0.25
"""Seconds within which borders are paired for the mean offset."""


@dataclass(frozen=True)
class ReferenceCut:
    """One annotator's segments of a take, as the scores need them.

    Parameters
    ----------
    annotated
        ``(n_frames,)`` bool.
    borders
        Frames, in order.
    onsets, offsets
        Segments, half-open frames.
    """

    annotated: NDArray[np.bool_]
    borders: NDArray[np.int64]
    onsets: NDArray[np.int64]
    offsets: NDArray[np.int64]


def prepare_reference(take: LabelledTake) -> ReferenceCut:
    """Return where a take's reference is annotated and cut; segments of one label that touch become one."""
    codes = np.full(take.n_frames, GAP, dtype=np.int64)
    numbers = pd.factorize(take.segments["label"].astype(str))[0]
    for onset, offset, number in zip(take.segments["onset"], take.segments["offset"], numbers, strict=True):
        codes[onset:offset] = number
    _, onsets, offsets = find_runs(codes)
    annotated = codes != GAP
    return ReferenceCut(annotated, find_borders(onsets, offsets, annotated), onsets, offsets)


def find_borders(onsets: ArrayLike, offsets: ArrayLike, annotated: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Frames where a segment begins as another ends, with the reference annotated on both sides.

    Parameters
    ----------
    onsets, offsets
        Half-open frames, in order, without overlap.
    annotated
        ``(n_frames,)``.
    """
    starts, ends = np.asarray(onsets, dtype=np.int64), np.asarray(offsets, dtype=np.int64)
    frames = starts[1:][starts[1:] == ends[:-1]]
    return frames[annotated[frames] & annotated[frames - 1]]


def clip_segments(
    onsets: ArrayLike, offsets: ArrayLike, annotated: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return what is left of segments where the reference is annotated; a gap of the reference cuts them."""
    codes = np.full(len(annotated), GAP, dtype=np.int64)
    for number, (onset, offset) in enumerate(zip(np.asarray(onsets), np.asarray(offsets), strict=True)):
        codes[onset:offset] = number
    return find_runs(np.where(annotated, codes, GAP))[1:]


def count_matched_borders(found: NDArray[np.int64], reference: NDArray[np.int64], tolerance: float) -> int:
    """Most borders that can be matched one to one within a tolerance in frames, inclusive; both in order.

    Going through both lists and giving each border the first that is left within its reach is a best matching on a
    line; it is much faster than finding the *nearest* best one (:func:`mimique.models.metrics.match_boundaries`).
    """
    n_matched = place = 0
    wanted = reference.tolist()
    for border in found.tolist():
        while place < len(wanted) and wanted[place] < border - tolerance:
            place += 1
        if place < len(wanted) and wanted[place] <= border + tolerance:
            n_matched += 1
            place += 1
    return n_matched


def count_matched_segments(
    onsets: NDArray[np.int64], offsets: NDArray[np.int64], reference: ReferenceCut, overlap: float
) -> int:
    """Count the segments that are found at an overlap, see the module."""
    taken = np.zeros(len(reference.onsets), dtype=bool)
    n_matched = 0
    for onset, offset in zip(onsets.tolist(), offsets.tolist(), strict=True):
        first = int(np.searchsorted(reference.offsets, onset, side="right"))
        last = int(np.searchsorted(reference.onsets, offset))
        if last <= first:
            continue
        a, b = reference.onsets[first:last], reference.offsets[first:last]
        common = np.minimum(b, offset) - np.maximum(a, onset)
        share = common / ((b - a) + (offset - onset) - common)
        best = int(share.argmax())
        if share[best] >= overlap and not taken[first + best]:
            taken[first + best] = True
            n_matched += 1
    return n_matched


def score_cut(
    reference: ReferenceCut,
    segments: pd.DataFrame,
    rate: float,
    *,
    tolerances: Sequence[int] = TOLERANCES,
    overlaps: Sequence[float] = OVERLAPS,
) -> dict[str, float]:
    """Count what the scores of a take are made from; the counts of several takes are added.

    Parameters
    ----------
    reference
        See :func:`prepare_reference`.
    segments
        ``onset``, ``offset`` in frames, without overlap; touching segments may have any label.
    rate
        Hz.
    tolerances
        Frames at which borders are matched.
    overlaps
        Least intersections over union of segments.

    Returns
    -------
    ``borders, reference_borders, matched_<frames>, pairs, offset, distance`` (sums over the pairs within
    :data:`OFFSET_REACH`, in seconds; an offset above 0 is late), ``segments, reference_segments, found_<percent>``.
    """
    for overlap in overlaps:
        if not 0 < overlap <= 1:
            raise InputError(f"overlap: expected a share above 0 and at most 1, but got {overlap}")
    table = check_segments(segments.assign(label=""), len(reference.annotated), where="cut")
    onsets, offsets = table["onset"].to_numpy(np.int64), table["offset"].to_numpy(np.int64)
    borders = find_borders(onsets, offsets, reference.annotated)
    pieces = clip_segments(onsets, offsets, reference.annotated)
    counts: dict[str, float] = {"borders": len(borders), "reference_borders": len(reference.borders)}
    for tolerance in tolerances:
        counts[f"matched_{tolerance}"] = count_matched_borders(borders, reference.borders, tolerance)
    pairs = match_boundaries(borders, reference.borders, OFFSET_REACH * rate)
    away = (borders[pairs[:, 0]] - reference.borders[pairs[:, 1]]) / rate
    counts |= {"pairs": len(pairs), "offset": float(away.sum()), "distance": float(np.abs(away).sum())}
    counts |= {"segments": len(pieces[0]), "reference_segments": len(reference.onsets)}
    for overlap in overlaps:
        counts[f"found_{round(100 * overlap)}"] = count_matched_segments(*pieces, reference, overlap)
    return counts
