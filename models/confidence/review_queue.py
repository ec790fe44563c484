"""Which segments a reviewer should look at first, and what that saves.

A reviewer who looks at a segment makes its label right. With calibrated probabilities p of what each segment really is,
the F1 of class k can be foreseen from soft counts: TP_k, the sum of p_k over segments labelled k; P_k, how many are
labelled k; R_k, the sum of p_k over all. What looking at a segment labelled a gains in

    macro F1 = 1/K Σ_k 2 TP_k / (P_k + R_k)

is, if it really is j ≠ a (which has the probability p_j), a right answer more for j and a false one less for a. The
expectation of it joins how unsure a label is with how rare the classes at stake are: one segment of a class of five
moves its F1 as much as twenty of a class of a hundred. Where time counts rather than segments, each counts by its
duration, and where longer segments take longer to look at, the gain is per second of looking.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ...arrays import check_array
from ...errors import InputError
from .calibration import check_probabilities

__all__ = [
    "PREFIX",
    "ReviewReplay",
    "compare_review_orders",
    "expected_gains",
    "looks_to_reach",
    "order_for_review",
    "probability_columns",
    "replay_review",
]

PREFIX = "p_"
"""A table's column of the probability of a class is named by this and the class."""


def probability_columns(probabilities: ArrayLike, classes: Sequence[str]) -> pd.DataFrame:
    """Return probabilities as columns ``p_<class>``, to stand beside a table of segments."""
    values = check_array(probabilities, name="probabilities", shape=(None, len(classes)))
    return pd.DataFrame(values, columns=[f"{PREFIX}{name}" for name in classes])


def order_for_review(
    table: pd.DataFrame, *, weighted: bool = False, seconds_per_look: float | None = None, overhead: float = 2.0
) -> NDArray[np.int64]:
    """Return the order in which looking at segments is expected to help most.

    Parameters
    ----------
    table
        One row a segment: calibrated probabilities ``p_<class>`` (:func:`probability_columns`); ``label``, what it is
        labelled now (that of the highest probability if there is no such column); ``seconds``, its duration, where
        that is asked for below. A segment without probabilities (NaN) comes first: nothing is known about it.
    weighted
        Whether segments count by their duration in the macro F1, rather than alike.
    seconds_per_look
        Seconds of looking per second of segment. If given, the gain is divided by ``overhead`` plus this times the
        duration, so that what is quick to see comes earlier.
    overhead
        Seconds that each look takes whatever the duration.

    Returns
    -------
    ``(n_segments,)``: positions in the table, most useful first; of equals the earlier row.
    """
    names = [str(column)[len(PREFIX) :] for column in table.columns if str(column).startswith(PREFIX)]
    if len(names) < 2:
        raise InputError(
            f"table: expected columns {PREFIX}<class> of at least two classes, but got {list(table.columns)}"
        )
    probabilities = table[[f"{PREFIX}{name}" for name in names]].to_numpy(dtype=np.float64)
    labels = None
    if "label" in table.columns:
        labels = table["label"].astype(str).to_numpy(dtype=object)
    seconds = _durations(table) if weighted or seconds_per_look is not None else np.ones(len(table))
    gains = expected_gains(probabilities, names, labels=labels, weights=seconds if weighted else None)
    if seconds_per_look is not None:
        if not seconds_per_look >= 0 or not overhead > 0:
            raise InputError("seconds_per_look and overhead: expected at least 0, and above 0")
        gains = gains / (overhead + seconds_per_look * seconds)
    gains = np.where(np.isnan(gains), np.inf, gains)
    return np.argsort(-gains, kind="stable").astype(np.int64)


def expected_gains(
    probabilities: ArrayLike,
    classes: Sequence[str],
    *,
    labels: Sequence[str] | NDArray | None = None,
    weights: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Return the expected gain in macro F1 of putting each segment right, all others left as they are.

    Parameters
    ----------
    probabilities
        ``(n_segments, n_classes)`` calibrated; NaN rows count for nothing and get NaN.
    classes
        Labels of the columns.
    labels
        ``(n_segments,)`` what each is labelled now, one of the classes; by default that of the highest probability.
    weights
        ``(n_segments,)`` what each counts, at least 0; all 1 by default.

    Returns
    -------
    ``(n_segments,)`` in units of F1, at least 0. The macro F1 that is meant counts the classes that are labelled or
    have any probability.
    """
    p = check_probabilities(probabilities, len(classes))
    known: NDArray[np.bool_] = np.asarray(np.isfinite(p).all(axis=1))
    counted = np.ones(len(p)) if weights is None else check_array(weights, name="weights", shape=(len(p),), finite=True)
    if (counted < 0).any():
        raise InputError("weights: expected numbers of at least 0")
    p, w, rows = p[known], counted[known, None], np.arange(int(known.sum()))
    if labels is None:
        given = p.argmax(axis=1)
    else:
        place = {str(name): k for k, name in enumerate(classes)}
        chosen = [str(label) for label in np.asarray(labels, dtype=object)[known]]
        unknown = sorted(set(chosen) - set(place))
        if unknown:
            raise InputError(f"labels: expected one of {', '.join(classes)}, but got {', '.join(unknown)}")
        given = np.array([place[label] for label in chosen], dtype=np.int64)
    hot = np.zeros_like(p)
    hot[rows, given] = 1.0
    right, labelled, real = (w * p * hot).sum(axis=0), (w * hot).sum(axis=0), (w * p).sum(axis=0)
    n_classes = max(int(((labelled + real) > 0).sum()), 1)
    # If a segment labelled a really is j: its own soft counts are replaced by that certainty in "before", and the look
    # then moves it from a to j. Columns are j; the classes that the look touches are j and a.
    others = right - w * p * hot
    real_if = real - w * p + w
    before_j, after_j = _f1(others, labelled + real_if), _f1(others + w, labelled + w + real_if)
    right_a, sum_a = others[rows, given][:, None], (labelled + real - w * p)[rows, given][:, None]
    before_a, after_a = _f1(right_a, sum_a), _f1(right_a, sum_a - w)
    gain = (p * (1.0 - hot) * (after_j - before_j + after_a - before_a)).sum(axis=1) / n_classes
    result = np.full(len(known), np.nan)
    result[known] = gain
    return result


def replay_review(
    reference: Sequence[str] | NDArray,
    labels: Sequence[str] | NDArray,
    order: ArrayLike,
    *,
    weights: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Macro F1 after each look of a reviewer who puts segments right in an order.

    Parameters
    ----------
    reference, labels
        ``(n_segments,)`` what the segments are, and what they are labelled before the review.
    order
        ``(n_segments,)`` positions, each once.
    weights
        ``(n_segments,)`` what each counts; all 1 by default.

    Returns
    -------
    ``(n_segments + 1,)``: before the first look, after the first, … after the last, which is 1. The mean goes over the
    classes of the reference throughout: a class that stands for mistakes only would be undefined once they are gone.
    """
    truth = np.asarray(reference, dtype=object).astype(str)
    given = np.asarray(labels, dtype=object).astype(str)
    if truth.shape != given.shape or truth.ndim != 1 or not len(truth):
        raise InputError(f"labels: expected one per reference {truth.shape}, at least one, but got {given.shape}")
    sequence = np.asarray(order)
    if sequence.shape != truth.shape or not np.array_equal(np.sort(sequence), np.arange(len(truth))):
        raise InputError(f"order: expected each position from 0 to {len(truth) - 1} once")
    counted = np.ones(len(truth))
    if weights is not None:
        counted = check_array(weights, name="weights", shape=truth.shape, finite=True)
    names, codes = np.unique(truth, return_inverse=True)
    place = {name: k for k, name in enumerate(names)}
    found = np.array([place.get(label, -1) for label in given])
    one = np.eye(len(names))
    hot_truth = one[codes] * counted[:, None]
    hot_given = np.where(found[:, None] >= 0, one[found], 0.0) * counted[:, None]
    hot_right = hot_truth * (found == codes)[:, None]
    real = hot_truth.sum(axis=0)
    right = hot_right.sum(axis=0) + np.cumsum((hot_truth - hot_right)[sequence], axis=0)
    labelled = hot_given.sum(axis=0) + np.cumsum((hot_truth - hot_given)[sequence], axis=0)
    right = np.vstack((hot_right.sum(axis=0), right))
    labelled = np.vstack((hot_given.sum(axis=0), labelled))
    return _f1(right, labelled + real).mean(axis=1)


def looks_to_reach(curve: ArrayLike, target: float) -> int:
    """Fewest looks after which the curve has reached the target; the curve ends at 1, so there is an answer.

    Raises
    ------
    InputError
        If the target is not in (0, 1].
    """
    if not 0 < target <= 1:
        raise InputError(f"target: expected a macro F1 above 0 and at most 1, but got {target}")
    values = check_array(curve, name="curve", shape=(None,), finite=True)
    reached = np.flatnonzero(values >= target - 1e-12)
    if not len(reached):
        raise InputError(f"curve: expected one that reaches {target}, but it ends at {values[-1]:.3f}")
    return int(reached[0])


@dataclass(frozen=True)
class ReviewReplay:
    """Outcome of :func:`compare_review_orders`.

    Parameters
    ----------
    curve
        ``(n_segments + 1,)`` macro F1 against segments looked at, in the queue's order.
    random_curves
        ``(n_orders, n_segments + 1)`` the same in random orders.
    table
        One row a target: ``target, queue`` (looks), ``random`` (mean looks), ``random_low, random_high`` (5 % and 95 %
        of the orders), ``saved`` (1 − queue over random; NaN where the labels reach the target unreviewed).
    """

    curve: NDArray[np.float64] = field(repr=False)
    random_curves: NDArray[np.float64] = field(repr=False)
    table: pd.DataFrame


def compare_review_orders(
    reference: Sequence[str] | NDArray,
    labels: Sequence[str] | NDArray,
    order: ArrayLike,
    *,
    rng: np.random.Generator,
    targets: Sequence[float] = (0.9, 0.95, 0.99),
    n_orders: int = 20,
    weights: ArrayLike | None = None,
) -> ReviewReplay:
    """Replay a review in an order and in random orders, and say what the order saves on the way to each target."""
    if n_orders < 1:
        raise InputError(f"n_orders: expected at least 1, but got {n_orders}")
    curve = replay_review(reference, labels, order, weights=weights)
    shuffled = np.array(
        [replay_review(reference, labels, rng.permutation(len(curve) - 1), weights=weights) for _ in range(n_orders)]
    )
    rows = []
    for target in targets:
        looks = np.array([looks_to_reach(one, target) for one in shuffled])
        queue = looks_to_reach(curve, target)
        mean = float(looks.mean())
        low, high = np.quantile(looks, [0.05, 0.95])
        saved = 1 - queue / mean if mean else float("nan")
        rows.append((float(target), queue, mean, float(low), float(high), saved))
    columns = ["target", "queue", "random", "random_low", "random_high", "saved"]
    return ReviewReplay(curve, shuffled, pd.DataFrame(rows, columns=columns))


def _f1(right: NDArray, total: NDArray) -> NDArray[np.float64]:
    """``2 TP / (P + R)``; 0 where the class does not occur."""
    right, total = np.broadcast_arrays(right, total)
    return np.divide(2 * right, total, out=np.zeros(total.shape), where=total > 1e-12)


def _durations(table: pd.DataFrame) -> NDArray[np.float64]:
    if "seconds" not in table.columns:
        raise InputError("table: expected the column seconds to weigh durations by, but it is missing")
    seconds = check_array(table["seconds"], name="seconds", shape=(len(table),), finite=True)
    if (seconds < 0).any():
        raise InputError("seconds: expected durations of at least 0")
    return seconds
