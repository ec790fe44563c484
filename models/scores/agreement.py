"""How much two or more annotators agree, beyond what chance would give: κ, α, and agreement of whole segments.

All coefficients are 1 for perfect agreement and, where they are corrected for chance, 0 for what chance would give. The
frames that an annotator left unannotated are left out where a coefficient compares frame by frame. They compare two
annotators as equals: neither is the reference. See :mod:`mimique.models.scores.staccato` for where the segments lie.

Never put agreement of people who labelled from scratch together with that of people who corrected one proposal: the
second have seen the same answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from .frame_labels import GAP, Labels, code_frames, find_runs
from .staccato import Staccato, count_nuclei, staccato

__all__ = [
    "Staccato",
    "cohen_kappa",
    "count_nuclei",
    "duration_weighted_agreement",
    "krippendorff_alpha",
    "mean_absolute_error",
    "staccato",
]

Weights = Literal["linear", "quadratic"]


def cohen_kappa(a: Labels, b: Labels, weights: Weights | None = None, *, classes: Sequence[Any] | None = None) -> float:
    """Cohen's κ of two people's labels of the same frames (or other items).

    κ = 1 − Σ w_ij o_ij / Σ w_ij e_ij, with o the counts of every pair of labels, e = row sum × column sum / n what
    chance gives with the same habits, and w the disagreement: 1 off the diagonal (Cohen 1960), |x_i − x_j| (linear) or
    its square (Cohen 1968), x the place on the scale.

    Parameters
    ----------
    a, b
        ``(n_frames,)``; frames where either is ``None`` are left out.
    weights
        ``None`` for names, ``"linear"`` or ``"quadratic"`` for degrees.
    classes
        The scale in order, for weights; its steps count as equal. Without it, degrees must be numbers, and their
        differences count: 0 and 2 are two apart, whether or not a 1 occurs.

    Returns
    -------
    At most 1; NaN where no frame has both labels, or both people use one and the same label throughout.

    References
    ----------
    J. Cohen, "A coefficient of agreement for nominal scales", Educational and Psychological Measurement 20 (1960);
    "Weighted kappa", Psychological Bulletin 70 (1968).
    """
    if weights not in (None, "linear", "quadratic"):
        raise InputError(f"weights: expected None, 'linear' or 'quadratic', but got {weights!r}")
    (first, second), names = code_frames(a, b, classes=classes)
    both = (first != GAP) & (second != GAP)
    n = len(names)
    observed = np.bincount(first[both] * n + second[both], minlength=n * n).reshape(n, n)
    if weights is None:
        disagreement = 1.0 - np.eye(n)
    else:
        scale = np.arange(n, dtype=float) if classes is not None else _as_numbers(names, "weights")
        disagreement = np.abs(np.subtract.outer(scale, scale)) ** (1 if weights == "linear" else 2)
    total = both.sum()
    expected = np.outer(observed.sum(axis=1), observed.sum(axis=0)) / max(total, 1)
    by_chance = (disagreement * expected).sum()
    return float(1 - (disagreement * observed).sum() / by_chance) if by_chance > 0 else float("nan")


def mean_absolute_error(reference: Labels, predicted: Labels) -> float:
    """Mean of |predicted − reference| of ordinal degrees, in steps of the scale.

    Parameters
    ----------
    reference, predicted
        ``(n_frames,)`` numbers, intensities 0 to 3 for instance; frames where either is ``None`` or NaN are left out.

    Returns
    -------
    At least 0; NaN where no frame has both.
    """
    (first, second), names = code_frames(reference, predicted)
    degrees = _as_numbers(names, "mean absolute error")
    both = (first != GAP) & (second != GAP)
    return float(np.abs(degrees[first[both]] - degrees[second[both]]).mean()) if both.any() else float("nan")


def duration_weighted_agreement(a: Labels, b: Labels) -> float:
    """Part of the segments' time in segments on whose label both people agree.

    A segment of one person agrees if the label that the other gave to most of its frames is its own (of equals, the one
    that comes first). With d the frames of a segment that both annotated, over the segments of both people:

        A = Σ d [agrees] / Σ d

    A long segment counts more than a short one, and a border set a little earlier or later costs nothing; not
    corrected for chance.

    Parameters
    ----------
    a, b
        ``(n_frames,)`` of one take, ``None`` for gaps.

    Returns
    -------
    From 0 to 1; NaN where no frame has both labels.
    """
    (first, second), names = code_frames(a, b)
    agreeing = total = 0
    for own, other in ((first, second), (second, first)):
        for label, onset, offset in zip(*find_runs(own), strict=True):
            votes = other[onset:offset]
            votes = votes[votes != GAP]
            if not len(votes):
                continue
            counts = np.bincount(votes, minlength=len(names))
            winners = np.flatnonzero(counts == counts.max())
            winner = next(vote for vote in votes if vote in winners) if len(winners) > 1 else winners[0]
            total += len(votes)
            agreeing += len(votes) * int(winner == label)
    return agreeing / total if total else float("nan")


def krippendorff_alpha(
    units: Sequence[Sequence[Any]] | NDArray | pd.DataFrame,
    metric: Literal["nominal", "ordinal"] = "nominal",
    *,
    classes: Sequence[Any] | None = None,
) -> float:
    """Krippendorff's α of any number of annotators, with any values missing.

    α = 1 − D_o / D_e, where the coincidences o_ck count the pairs of values c, k within units, each unit's pairs over
    its number of values less one, n_c = Σ_k o_ck, n = Σ_c n_c, and

        D_o = Σ o_ck δ²_ck / n,    D_e = Σ n_c n_k δ²_ck / (n (n − 1)).

    δ² is 1 for different names; for degrees it is (Σ_{g=c..k} n_g − (n_c + n_k)/2)², which uses their order only.
    Frames are no independent units: take the bootstrap over takes for how sure α is.

    Parameters
    ----------
    units
        ``(n_units, n_annotators)``: one row a unit (a frame, a segment), ``None`` or NaN where an annotator gave no
        value. Units with fewer than two values say nothing and are left out.
    metric
        ``"nominal"`` for names, ``"ordinal"`` for degrees.
    classes
        Order of the values for ``"ordinal"``; by default they must be numbers.

    Returns
    -------
    At most 1; NaN where no unit has two values, or all values are the same.

    References
    ----------
    K. Krippendorff, "Computing Krippendorff's alpha-reliability", University of Pennsylvania (2011).
    """
    if metric not in ("nominal", "ordinal"):
        raise InputError(f"metric: expected 'nominal' or 'ordinal', but got {metric!r}")
    table = np.array(units, dtype=object)
    if table.ndim != 2:
        raise InputError(
            "units: expected rows of one length, a row a unit and a column an annotator, with None where a value is "
            f"missing, but got shape {table.shape}"
        )
    (codes,), names = code_frames(table.ravel(), classes=classes)
    if metric == "ordinal" and classes is None:
        _as_numbers(names, "ordinal α")
    values = np.zeros((len(table), len(names)))
    given = codes != GAP
    rows = np.repeat(np.arange(len(table)), table.shape[1])
    np.add.at(values, (rows[given], codes[given]), 1)
    values = values[values.sum(axis=1) >= 2]
    weighted = values / (values.sum(axis=1, keepdims=True) - 1)
    coincidences = weighted.T @ values - np.diag(weighted.sum(axis=0))
    margin = values.sum(axis=0)
    total = margin.sum()
    if metric == "nominal":
        distance = 1.0 - np.eye(len(names))
    else:
        # Σ of n_g from c to k less half of both ends is the distance between the middles of their ranks.
        middle = np.cumsum(margin) - margin / 2
        distance = np.subtract.outer(middle, middle) ** 2
    expected = (np.outer(margin, margin) * distance).sum()
    if not expected > 0:
        return float("nan")
    return float(1 - (total - 1) * (coincidences * distance).sum() / expected)


def _as_numbers(names: Sequence[Any], what: str) -> NDArray[np.float64]:
    """Degrees as numbers, or say that names have no distance."""
    try:
        if any(isinstance(name, str) for name in names):
            raise TypeError
        return np.array([float(name) for name in names])
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{what}: expected degrees that are numbers, but got {', '.join(repr(name) for name in names[:5])}; "
            "names in order go by classes, where that is offered"
        ) from error
