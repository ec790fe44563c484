"""Which borders are mistakes, and which only scatter: two groups, told apart by the corpus itself.

Of the distances d of borders from where they belong, most scatter about 0, and a few are anywhere:

    f(d) = (1 − π) t_ν(d / κ s) / κ s + π [|d| ≥ 0.1 s] / (2 (0.8 s − 0.1 s))

with the usual distance s of such borders. π, κ and ν are those of greatest likelihood over all borders of the corpus,
so that a tier with many mistakes is looked at more sternly than one with few [1]_; takes of different protocols are
fitted apart, for machines err otherwise in signed discourse than in held expressions. A prior on π says that mistakes
are some per cent of all borders: what many borders do is scatter. The share of the second group at d is the probability
of a mistake.

Where a second person annotated the take, their border is one more witness. How far each of the two people and the
machine scatter follows from the three differences between them [2]_; witnesses count by the inverse of their variance,
and less where they contradict each other.

References
----------
.. [1] B. Efron, "Microarrays, empirical Bayes and the two-groups model", Statistical Science 2008.
.. [2] J. Gray, D. Allan, "A method for estimating the frequency stability of an individual oscillator", 1974 (the
   three-cornered hat).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import t as student

from ...arrays import check_array
from ...errors import InputError

__all__ = ["LEAST", "REACH", "Witnesses", "combine_witnesses", "probability_of_mistake", "score_by_cut"]

LEAST = 0.1
"""s from which a border is shifted at all."""
REACH = 0.8
"""s, the farthest that is expected."""
LEAST_BORDERS = 30
"""Fewer say nothing about groups."""
LEAST_GROUP = 100
LEAST_CUT = 0.2
"""What is less probable than this is not worth a look, whatever F1 would say."""
PRIOR = (2.0, 60.0)
"""Mistakes and good borders that π is believed to have been seen on before: about 3 per cent."""
TO_DEVIATION = 1.4826
"""Standard deviation of normal numbers over their median distance from the middle."""


def probability_of_mistake(
    distances: ArrayLike, usual: ArrayLike, groups: Sequence[str] | NDArray | None = None
) -> NDArray[np.float64]:
    """Return the probability of each border to be a mistake rather than scatter.

    Parameters
    ----------
    distances
        ``(n_borders,)`` seconds from where it belongs, signed; NaN where unknown.
    usual
        ``(n_borders,)`` usual size of that for such a border, seconds above 0.
    groups
        ``(n_borders,)`` what is fitted apart, such as the protocol; a group of fewer than 100 is fitted with all.

    Returns
    -------
    ``(n_borders,)`` from 0 to 1; 0 below 0.1 s; NaN where unknown, or where fewer than 30 are known.
    """
    d = check_array(distances, name="distances", shape=(None,))
    s = check_array(usual, name="usual distances", shape=d.shape)
    if (s <= 0).any():
        raise InputError("usual distances: expected seconds above 0")
    known = np.isfinite(d) & np.isfinite(s)
    result = np.full(len(d), np.nan)
    if known.sum() < LEAST_BORDERS:
        return result
    result[known] = _separate(d[known], s[known])
    names = np.asarray([""] * len(d) if groups is None else groups, dtype=object).astype(str)
    if names.shape != d.shape:
        raise InputError(f"groups: expected one per border ({len(d)}), but got {names.shape}")
    for name in sorted(set(names)):
        own = known & (names == name)
        if own.sum() >= LEAST_GROUP:
            result[own] = _separate(d[own], s[own])
    return result


def _separate(away: NDArray, scale: NDArray) -> NDArray[np.float64]:
    """Share of the second group at each distance, by the likeliest parameters."""
    far = np.where(np.abs(away) >= LEAST, 1.0 / (2 * (REACH - LEAST)), 0.0)

    def densities(parameters: NDArray) -> tuple[float, NDArray]:
        share, kappa, nu = 0.5 * expit(parameters[0]), np.exp(parameters[1]), 1.5 + np.exp(parameters[2])
        return float(share), student.pdf(away / (kappa * scale), nu) / (kappa * scale)

    def loss(parameters: NDArray) -> float:
        share, near = densities(parameters)
        prior = PRIOR[0] * np.log(share) + PRIOR[1] * np.log1p(-share)
        return float(-np.log(np.maximum((1 - share) * near + share * far, 1e-300)).sum() - prior)

    found = minimize(loss, np.array([-3.0, 0.3, 1.0]), method="Nelder-Mead", options={"maxiter": 600, "xatol": 1e-3})
    share, near = densities(found.x)
    return share * far / np.maximum((1 - share) * near + share * far, 1e-300)


def score_by_cut(probabilities: ArrayLike) -> NDArray[np.float64]:
    """Return scores that are 0.5 at the probability above which findings are expected to have the greatest F1.

    If p_i are right, the k likeliest of all borders have an expected F1 of about 2 Σ_{i≤k} p_i / (k + Σ p). The odds
    are scaled so that those of the least likely one that belongs to the best k become 1.

    Parameters
    ----------
    probabilities
        ``(n_borders,)`` from 0 to 1, NaN where unknown.

    Returns
    -------
    ``(n_borders,)`` in the same order, 0 to 1; NaN where unknown.
    """
    p = check_array(probabilities, name="probabilities", shape=(None,))
    known = np.sort(p[np.isfinite(p)])[::-1]
    if not len(known) or known[0] <= 0:
        return p
    expected = 2 * np.cumsum(known) / (np.arange(1, len(known) + 1) + known.sum())
    cut = min(max(float(known[int(expected.argmax())]), LEAST_CUT), 0.5)
    return p * (1 - cut) / (p * (1 - cut) + (1 - p) * cut)


@dataclass(frozen=True)
class Witnesses:
    """Where borders belong by machine and second person, and the usual distance from there, in seconds."""

    fitted: NDArray[np.float64]
    usual: NDArray[np.float64]


def combine_witnesses(given: ArrayLike, fitted: ArrayLike, usual: ArrayLike, second: ArrayLike) -> Witnesses:
    """Join what the machine and a second person say about borders.

    Parameters
    ----------
    given
        ``(n_borders,)`` seconds at which they are.
    fitted, usual
        Where the machine puts them, and the usual distance to there, seconds.
    second
        Where the second person puts them; NaN where they have none such.

    Returns
    -------
    The machine's alone where the second person says nothing, or where fewer than 30 borders are known to all three.
    """
    at, machine, size, other = (
        check_array(values, name="border times", shape=(None,)) for values in (given, fitted, usual, second)
    )
    both = np.isfinite(machine) & np.isfinite(size) & np.isfinite(other)
    if both.sum() < LEAST_BORDERS:
        return Witnesses(machine, size)
    to_machine, to_other = _variance((at - machine)[both]), _variance((at - other)[both])
    between = _variance((machine - other)[both])
    own = max((to_machine + to_other - between) / 2, 0.1 * to_machine)
    of_other = max((to_other + between - to_machine) / 2, 0.1 * to_other)
    # The median size over a t's spread is near enough to that of normal numbers.
    of_machine = np.maximum((TO_DEVIATION * size) ** 2 - own, 0.1 * (TO_DEVIATION * size) ** 2)
    # Beyond three standard deviations apart one of the two errs grossly, and nobody knows which.
    extra = np.maximum((machine - other) ** 2 - 9 * (of_machine + of_other), 0.0) / 2
    of_machine, of_second = of_machine + extra, of_other + extra
    joined = (machine / of_machine + other / of_second) / (1 / of_machine + 1 / of_second)
    spread = np.sqrt(own + 1 / (1 / of_machine + 1 / of_second)) / TO_DEVIATION
    return Witnesses(np.where(both, joined, machine), np.where(both, spread, size))


def _variance(values: NDArray) -> float:
    """Square of the robust standard deviation."""
    return float((TO_DEVIATION * np.median(np.abs(values - np.median(values)))) ** 2)
