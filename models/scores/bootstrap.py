"""How sure a score is, given the takes it comes from: percentile bootstrap over takes.

Neighbouring frames, and segments of one take, are alike: resampling them would promise far too much. Takes are drawn
with replacement instead, and the score is computed anew from all values of the drawn takes (Efron and Tibshirani, "An
introduction to the bootstrap", 1993, chapter 13). Where signers differ more than takes do, draw signers: give one entry
per signer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...errors import InputError

__all__ = ["Interval", "bootstrap_interval"]

Value = TypeVar("Value")
# Intervals from fewer resamples with a value than this part say more about which have one than about the score.
LEAST_DEFINED = 0.9


class Interval(NamedTuple):
    """A score and its interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"


def bootstrap_interval(
    values_per_take: Sequence[Value],
    statistic: Callable[[list[Value]], Any],
    rng: np.random.Generator,
    n: int = 1000,
    level: float = 0.95,
) -> Interval:
    """Score of some takes and its bootstrap interval.

    To compare two methods, give pairs of both methods' values per take, and their difference as the statistic: both
    then see the same takes.

    Parameters
    ----------
    values_per_take
        One entry per take, whatever the statistic needs of it: a number, counts, pairs of labels. Work that does not
        depend on the other takes is best done before: the statistic is computed `n` + 1 times.
    statistic
        From a list of entries, one or more of them repeated, to a number.
    rng
        Where the draws come from.
    n
        Number of draws, at least 1; a thousand give the ends of a 95 % interval well enough.
    level
        Part of the draws that the interval holds, above 0 and below 1.

    Returns
    -------
    ``value, low, high``: the score of all takes; the (1 ± level)/2 quantiles of the draws. Both ends are NaN with fewer
    than two takes, which say nothing about other takes, or where more than a tenth of the draws have no score. With
    fewer than about ten takes the interval is too short.

    Raises
    ------
    InputError
        Without takes, or if a number is out of range.
    """
    takes = list(values_per_take)
    if not takes:
        raise InputError("bootstrap: expected values of at least one take, but got none")
    if n < 1:
        raise InputError(f"bootstrap: expected at least 1 draw, but got {n}")
    if not 0 < level < 1:
        raise InputError(f"level: expected a share above 0 and below 1, but got {level}")
    value = float(statistic(takes))
    if len(takes) < 2:
        return Interval(value, float("nan"), float("nan"))
    drawn = np.array(
        [float(statistic([takes[i] for i in row])) for row in rng.integers(len(takes), size=(n, len(takes)))]
    )
    defined = drawn[~np.isnan(drawn)]
    if np.isnan(value) or len(defined) < LEAST_DEFINED * n:
        return Interval(value, float("nan"), float("nan"))
    low, high = np.quantile(defined, [(1 - level) / 2, (1 + level) / 2])
    return Interval(value, float(low), float(high))
