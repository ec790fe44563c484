"""Whether probabilities are what they say: of the answers given with 0.8, 80 % should be right.

The expected calibration error asks exactly that, of the best answer only, and can be 0 for a useless model that always
says how useless it is. The Brier score and the log loss are proper scores: only the true probabilities make them best.
So the three stand together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ...arrays import check_array
from ...errors import InputError
from .frame_labels import GAP, Labels, code_frames

__all__ = ["brier_score", "expected_calibration_error", "log_loss", "reliability_table"]


def expected_calibration_error(
    probabilities: ArrayLike, labels: Labels, classes: Sequence[Any], *, n_bins: int = 15
) -> float:
    """Compute the expected calibration error of the best answer (Guo et al. 2017, equation 3).

    ECE = Σ_b n_b / n · |accuracy(b) − confidence(b)| over bins of equal width of the highest probability. It depends on
    the bins and grows by chance with few items a bin: compare at the same number of bins and similar n.

    Parameters
    ----------
    probabilities
        ``(n_items, n_classes)``, each row at least 0 and with sum 1.
    labels
        ``(n_items,)`` true labels; items with ``None`` are left out.
    classes
        Label of each column.
    n_bins
        At least 1.

    Returns
    -------
    From 0 to 1; NaN where no item has a label.

    Raises
    ------
    InputError
        For NaN or rows that are no probabilities, a label that is not among the classes, or lengths that do not fit.

    References
    ----------
    C. Guo, G. Pleiss, Y. Sun, K. Q. Weinberger, "On calibration of modern neural networks", ICML 2017.
    """
    table = reliability_table(probabilities, labels, classes, n_bins=n_bins)
    filled = table[table["n"] > 0]
    if not len(filled):
        return float("nan")
    gap = (filled["accuracy"] - filled["confidence"]).abs()
    return float((filled["n"] * gap).sum() / filled["n"].sum())


def reliability_table(
    probabilities: ArrayLike, labels: Labels, classes: Sequence[Any], *, n_bins: int = 15
) -> pd.DataFrame:
    """Tabulate a reliability diagram: confidence and accuracy of the best answer, by bins of its probability.

    Parameters
    ----------
    probabilities, labels, classes, n_bins
        See :func:`expected_calibration_error`.

    Returns
    -------
    One row a bin: ``low, high`` (the bin holds low < p ≤ high), ``n`` items, ``confidence`` their mean probability and
    ``accuracy`` the part that is right, both NaN in an empty bin.
    """
    if n_bins < 1:
        raise InputError(f"n_bins: expected at least 1, but got {n_bins}")
    values, truth = _check(probabilities, labels, classes)
    best = values.argmax(axis=1)
    confidence = np.minimum(values.max(axis=1), 1.0) if len(values) else np.zeros(0)
    edges = np.linspace(0, 1, n_bins + 1)
    bins = np.searchsorted(edges[1:-1], confidence)
    count = np.bincount(bins, minlength=n_bins)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(bins, weights=confidence, minlength=n_bins) / count
        right = np.bincount(bins, weights=best == truth, minlength=n_bins) / count
    return pd.DataFrame({"low": edges[:-1], "high": edges[1:], "n": count, "confidence": mean, "accuracy": right})


def brier_score(probabilities: ArrayLike, labels: Labels, classes: Sequence[Any]) -> float:
    """Brier score: mean over items of Σ_k (p_k − [label is k])² (Brier 1950).

    Parameters
    ----------
    probabilities, labels, classes
        See :func:`expected_calibration_error`.

    Returns
    -------
    From 0 (sure and right) to 2 (sure and wrong), summed over all classes; of two classes some halve it. Equal odds
    give 1 − 1/K. NaN where no item has a label.
    """
    values, truth = _check(probabilities, labels, classes)
    if not len(values):
        return float("nan")
    return float(((values - np.eye(len(classes))[truth]) ** 2).sum(axis=1).mean())


def log_loss(probabilities: ArrayLike, labels: Labels, classes: Sequence[Any]) -> float:
    """Mean of −ln p of the true label, in nats.

    A probability of 0 for what was true would make it infinite; it counts as the smallest step of a double, 2.2e-16,
    which is a loss of 36 nats.

    Parameters
    ----------
    probabilities, labels, classes
        See :func:`expected_calibration_error`.

    Returns
    -------
    At least 0; equal odds give ln K. NaN where no item has a label.
    """
    values, truth = _check(probabilities, labels, classes)
    if not len(values):
        return float("nan")
    smallest = np.finfo(np.float64).eps
    given = np.clip(values[np.arange(len(values)), truth], smallest, 1 - smallest)
    return float(-np.log(given).mean())


def _check(
    probabilities: ArrayLike, labels: Labels, classes: Sequence[Any]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Probabilities and codes of the items that have a label."""
    if not len(classes):
        raise InputError("classes: expected the label of each column, but got none")
    values = check_array(probabilities, name="probabilities", shape=(None, len(classes)), finite=True)
    (codes,), _ = code_frames(labels, classes=classes)
    if len(codes) != len(values):
        raise InputError(f"labels: expected one per row of the probabilities ({len(values)}), but got {len(codes)}")
    wrong = np.flatnonzero((values < 0).any(axis=1) | (np.abs(values.sum(axis=1) - 1) > 1e-4))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(
            f"probabilities: expected rows of numbers of at least 0 with sum 1, but row {row} has "
            f"least {values[row].min():.4g} and sum {values[row].sum():.4g}"
        )
    return values[codes != GAP], codes[codes != GAP]
