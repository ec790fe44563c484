"""Numbers that say how good an estimate is: of positions, of labels, of borders.

Two root mean squares of positions are about and must not be mixed. Reverdy 2019, 3.5, divides by the frames only:

    RMSE = sqrt(1/N Σ_n Σ_p ‖v_pn − v̂_pn‖²)        (3.5)

which grows with the number P of points; :func:`rmse_as_printed` is for redrawing its figures. People are told the
distance of a typical point, ``RMSE / √P``: :func:`rmse_per_point`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from .scores.agreement import cohen_kappa

__all__ = [
    "BoundaryScores",
    "LabelScores",
    "cohen_kappa",
    "match_boundaries",
    "rmse_as_printed",
    "rmse_per_point",
    "score_boundaries",
    "score_labels",
]


def rmse_as_printed(found: ArrayLike, truth: ArrayLike) -> float:
    """Root mean square error per frame, summed over points: Reverdy 2019, 3.5, as printed.

    Parameters
    ----------
    found, truth
        ``(n_frames, n_points, 3)`` in one unit, without gaps: a missing point would make the sum smaller.
    """
    a, b = _check_pair(found, truth, finite=True)
    return float(np.sqrt(((a - b) ** 2).sum() / len(a)))


def rmse_per_point(found: ArrayLike, truth: ArrayLike) -> float:
    """Root mean square distance of a point, in the unit given (mm): 3.5 divided by √P where nothing is missing.

    Parameters
    ----------
    found, truth
        ``(n_frames, n_points, 3)``; a point with a NaN on either side is not counted. NaN if none is left.
    """
    a, b = _check_pair(found, truth, finite=False)
    square = ((a - b) ** 2).sum(axis=2)
    square = square[np.isfinite(square)]
    return float(np.sqrt(square.mean())) if len(square) else float("nan")


@dataclass(frozen=True)
class LabelScores:
    """How well labels agree with their reference; all from 0 to 1, NaN where there is nothing to score.

    Parameters
    ----------
    accuracy
        Part that is right.
    balanced_accuracy
        Mean over the classes of the reference of the part of each that is found.
    macro_f1
        Mean F1 over the classes that the reference or the labels contain; a class never right has 0.
    majority
        Accuracy of the best constant answer: the share of the reference's most frequent class.
    n_items
        Number of labels that were compared.
    confusion
        Table of weights (counts, if none were given): one row a class of the reference, one column a label given.
    """

    accuracy: float
    balanced_accuracy: float
    macro_f1: float
    majority: float
    n_items: int
    confusion: pd.DataFrame = field(repr=False)


def score_labels(
    reference: Sequence[str] | NDArray,
    given: Sequence[str] | NDArray,
    *,
    weights: ArrayLike | None = None,
    classes: Sequence[str] | None = None,
) -> LabelScores:
    """Compare labels with their reference.

    Parameters
    ----------
    reference, given
        One label per item.
    weights
        What each item counts, at least 0 (its duration, for instance); all 1 by default.
    classes
        Order of the classes in the confusion table; by default those that occur, sorted.
    """
    truth = np.asarray(reference, dtype=object).astype(str)
    labels = np.asarray(given, dtype=object).astype(str)
    if truth.shape != labels.shape or truth.ndim != 1:
        raise InputError(f"labels: expected one per reference {truth.shape}, but got {labels.shape}")
    counted = np.ones(len(truth)) if weights is None else check_array(weights, name="weights", shape=(len(truth),))
    if not (counted >= 0).all():
        raise InputError("weights: expected numbers of at least 0")
    occurring = sorted({*truth, *labels})
    names = occurring if classes is None else list(classes)
    unknown = sorted(set(occurring) - set(names))
    if unknown:
        raise InputError(f"labels: expected one of {', '.join(names)}, but got {', '.join(unknown)}")
    if not len(truth) or not counted.sum() > 0:
        empty = pd.DataFrame(np.zeros((len(names), len(names))), index=names, columns=names)
        return LabelScores(np.nan, np.nan, np.nan, np.nan, len(truth), empty)
    position = {name: index for index, name in enumerate(names)}
    counts = np.zeros((len(names), len(names)))
    np.add.at(counts, ([position[name] for name in truth], [position[name] for name in labels]), counted)
    right = np.diag(counts)
    wrong = (counts - np.diag(right)).sum()
    total = right.sum() + wrong  # in this order all right is 1 exactly
    in_reference, in_given = counts.sum(axis=1), counts.sum(axis=0)
    asked = in_reference > 0
    either = in_reference + in_given > 0
    return LabelScores(
        accuracy=float(right.sum() / total),
        balanced_accuracy=float((right[asked] / in_reference[asked]).mean()),
        macro_f1=float((2 * right[either] / (in_reference + in_given)[either]).mean()),
        majority=float(in_reference.max() / total),
        n_items=len(truth),
        confusion=pd.DataFrame(counts, index=names, columns=names),
    )


@dataclass(frozen=True)
class BoundaryScores:
    """How well borders were found.

    Parameters
    ----------
    precision, recall, f1
        From 0 to 1; NaN where nothing was found, or nothing was to be found (F1: neither).
    mean_offset
        Mean of found minus reference over the matched pairs, in the unit given; NaN without pairs.
    mean_distance
        The same of its absolute value.
    n_found, n_reference, n_matched
        Numbers of borders.
    """

    precision: float
    recall: float
    f1: float
    mean_offset: float
    mean_distance: float
    n_found: int
    n_reference: int
    n_matched: int


def score_boundaries(found: ArrayLike, reference: ArrayLike, tolerance: float) -> BoundaryScores:
    """Compare borders with the reference; a border counts once, within the tolerance.

    Parameters
    ----------
    found, reference
        Times of borders, in one unit (frames or seconds).
    tolerance
        Greatest distance of a match, inclusive, in the same unit.
    """
    pairs = match_boundaries(found, reference, tolerance)
    a, b = np.sort(np.asarray(found, dtype=float)), np.sort(np.asarray(reference, dtype=float))
    away = a[pairs[:, 0]] - b[pairs[:, 1]]
    n = len(pairs)
    return BoundaryScores(
        precision=n / len(a) if len(a) else float("nan"),
        recall=n / len(b) if len(b) else float("nan"),
        f1=2 * n / (len(a) + len(b)) if len(a) + len(b) else float("nan"),
        mean_offset=float(away.mean()) if n else float("nan"),
        mean_distance=float(np.abs(away).mean()) if n else float("nan"),
        n_found=len(a),
        n_reference=len(b),
        n_matched=n,
    )


def match_boundaries(found: ArrayLike, reference: ArrayLike, tolerance: float) -> NDArray[np.int64]:
    """Match as many borders one to one as the tolerance allows, and of all ways to do so, at the least total distance.

    On a line some best matching never crosses, so it is an alignment of the two sorted lists. Borders farther from
    their neighbours than the tolerance, in both lists, part the problem into small ones.

    Parameters
    ----------
    found, reference
        Times of borders, in one unit.
    tolerance
        Greatest distance of a match, inclusive; may be infinite.

    Returns
    -------
    ``(n_matched, 2)``: positions in the sorted `found` and the sorted `reference`.
    """
    if not tolerance >= 0:
        raise InputError(f"tolerance: expected at least 0, but got {tolerance}")
    a = np.sort(check_array(found, name="found borders", shape=(None,), finite=True))
    b = np.sort(check_array(reference, name="reference borders", shape=(None,), finite=True))
    everything = np.sort(np.concatenate((a, b)))
    # Each part begins at a border that lies beyond the reach of the one before it.
    starts = everything[1:][np.diff(everything) > tolerance]
    parts = zip(
        [0, *np.searchsorted(a, starts)],
        [*np.searchsorted(a, starts), len(a)],
        [0, *np.searchsorted(b, starts)],
        [*np.searchsorted(b, starts), len(b)],
        strict=True,
    )
    pairs = [
        (i + first, j + second)
        for first, i_end, second, j_end in parts
        for i, j in _align(a[first:i_end], b[second:j_end], tolerance)
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _align(a: NDArray, b: NDArray, tolerance: float) -> list[tuple[int, int]]:
    """Pairs of the best alignment of two sorted lists: first the most pairs, then the least total distance."""
    if not len(a) or not len(b):
        return []
    distance = np.abs(np.subtract.outer(a, b))
    # One pair more outweighs all the distance that there can be.
    prize = 1.0 + distance.max() * min(len(a), len(b))
    gain = np.where(distance <= tolerance, prize - distance, -np.inf)
    best = np.zeros((len(a) + 1, len(b) + 1))
    for i in range(len(a)):
        best[i + 1, 1:] = np.maximum.accumulate(np.maximum(best[i, 1:], best[i, :-1] + gain[i]))
    pairs: list[tuple[int, int]] = []
    i, j = len(a), len(b)
    while i and j:
        if best[i, j] == best[i - 1, j]:
            i -= 1
        elif best[i, j] == best[i, j - 1]:
            j -= 1
        else:
            i, j = i - 1, j - 1
            pairs.append((i, j))
    return pairs[::-1]


def _check_pair(found: ArrayLike, truth: ArrayLike, *, finite: bool) -> tuple[NDArray, NDArray]:
    a = check_array(found, name="found", shape=(None, None, 3), finite=finite)
    b = check_array(truth, name="truth", shape=a.shape, finite=finite)
    if not a.size:
        raise InputError(f"found: expected at least one point in one frame, but got {a.shape}")
    return a, b
