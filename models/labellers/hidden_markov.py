"""A hidden Markov chain over a classifier's answers: the hybrid of Bourlard and Morgan (1994).

The chain needs the likelihood of what is seen, the classifier gives the posterior of the class. By Bayes' rule they
differ by the class's prior and by a factor that is the same for all classes:

    log p(x | k) = log p(k | x) − log p(k) + const

Two exponents mend what the rule takes for granted. Frames that follow each other are no independent witnesses, and a
forest's answers are too timid: `emission_weight` says how much each frame counts. Timid answers also lean towards the
priors by less than Bayes' rule undoes, and rare classes win too often: `prior_weight` says how much is undone.

References
----------
.. [1] H. Bourlard, N. Morgan, "Connectionist Speech Recognition: A Hybrid Approach", Kluwer, 1994, chapter 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..scores.segment_metrics import pool_f1, segmental_f1
from .base import GAP
from .per_frame import LEAST_PROBABILITY, PerFrameLabeller
from .sequences import chain_marginals, viterbi

__all__ = ["HiddenMarkovLabeller", "count_steps"]

EMISSION_WEIGHTS = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0)
PRIOR_WEIGHTS = (0.0, 0.5, 1.0)


class HiddenMarkovLabeller(PerFrameLabeller):
    """A classifier of frames, smoothed by a Markov chain of the labels.

    Steps and starts are counted in the training labels, with `extra` added to each count. Where the recording's own
    labels leave a gap, no step is counted.

    Parameters
    ----------
    rate, classifier, velocity, work_rate, single_take, random_state
        See :class:`~mimique.models.labellers.PerFrameLabeller`.
    emission_weight
        Exponent of the likelihoods, above 0; ``None``: chosen of 0.3, 0.5, 0.7, 1, 1.5 and 2.
    prior_weight
        Exponent of the priors that are divided by, at least 0; ``None``: chosen of 0, 0.5 and 1. What is chosen has
        the best segmental F1@50 on training takes that the classifier did not see. (The likelihood of the labels would
        choose smaller weights: right about single frames, and too slow for short segments.)
    stay
        Probability of staying in a state from one sample to the next, for all states; ``None``: counted for each.
    extra
        Added to each count of steps, above 0: a step that was never seen is rare, not impossible.
    n_folds
        Folds of the cross-fitting behind the choice of the exponent.
    decoder
        ``"viterbi"``: the likeliest path; ``"marginal"``: the likeliest label of each frame.

    Attributes
    ----------
    transition_, start_, prior_ : ndarray
        Probabilities of steps, of the first state, and of states.
    emission_weight_, prior_weight_ : float
        The exponents in use.
    """

    def __init__(
        self,
        rate: float = 200.0,
        *,
        classifier: Any = "forest",
        velocity: Sequence[float] = (0.2,),
        emission_weight: float | None = None,
        prior_weight: float | None = None,
        stay: float | None = None,
        extra: float = 0.1,
        n_folds: int = 3,
        decoder: str = "viterbi",
        work_rate: float = 25.0,
        single_take: bool = False,
        random_state: int | None = None,
    ) -> None:
        super().__init__(
            rate,
            classifier=classifier,
            velocity=velocity,
            work_rate=work_rate,
            single_take=single_take,
            random_state=random_state,
        )
        self.emission_weight = emission_weight
        self.prior_weight = prior_weight
        self.stay = stay
        self.extra = extra
        self.n_folds = n_folds
        self.decoder = decoder

    def _fit_samples(self, samples: list[NDArray], codes: list[NDArray], units: list[Any]) -> None:
        if self.decoder not in ("viterbi", "marginal"):
            raise InputError(f"decoder: expected 'viterbi' or 'marginal', but got {self.decoder!r}")
        if not self.extra > 0:
            raise InputError(f"extra: expected a number above 0, but got {self.extra}")
        if self.stay is not None and not 0 < self.stay < 1:
            raise InputError(f"stay: expected a probability between 0 and 1, but got {self.stay}")
        if self.emission_weight is not None and not self.emission_weight > 0:
            raise InputError(f"emission_weight: expected a number above 0, but got {self.emission_weight}")
        if self.prior_weight is not None and not self.prior_weight >= 0:
            raise InputError(f"prior_weight: expected a number of at least 0, but got {self.prior_weight}")
        super()._fit_samples(samples, codes, units)
        n_classes = len(self.classes_)
        joined = np.concatenate(codes)
        counts = np.bincount(joined[joined != GAP], minlength=n_classes) + self.extra
        self.prior_ = counts / counts.sum()
        starts = np.bincount([c[0] for c in codes if c[0] != GAP], minlength=n_classes) + self.extra
        self.start_ = starts / starts.sum()
        steps = count_steps(codes, n_classes) + self.extra
        if self.stay is not None:
            np.fill_diagonal(steps, 0.0)
            steps *= (1 - self.stay) / steps.sum(axis=1, keepdims=True)
            np.fill_diagonal(steps, self.stay)
        self.transition_ = steps / steps.sum(axis=1, keepdims=True)
        choices = [
            (float(emission), float(prior))
            for emission in (EMISSION_WEIGHTS if self.emission_weight is None else (self.emission_weight,))
            for prior in (PRIOR_WEIGHTS if self.prior_weight is None else (self.prior_weight,))
        ]
        if len(choices) > 1:
            unseen = self._classify_unseen(samples, codes, units, self.n_folds)
            choices.sort(key=lambda weights: self._score_weights(weights, unseen, codes), reverse=True)
        self.emission_weight_, self.prior_weight_ = choices[0]

    def _score_weights(self, weights: tuple[float, float], scores: list[NDArray], codes: list[NDArray]) -> float:
        """Segmental F1@50 of the decoded labels."""
        self.emission_weight_, self.prior_weight_ = weights
        found = []
        for path, own in zip(self._decode_scores(scores), codes, strict=True):
            best = path.argmax(axis=1) if path.ndim == 2 else path
            found.append(segmental_f1(_name(own), _name(best), 0.5))
        return float(np.nan_to_num(float(pool_f1(found))))

    def _emissions(self, scores: NDArray) -> NDArray[np.float64]:
        likely = np.log(np.maximum(scores, LEAST_PROBABILITY)) - self.prior_weight_ * np.log(self.prior_)
        return self.emission_weight_ * likely

    def _smooth(self, scores: list[NDArray]) -> list[NDArray]:
        emissions = [self._emissions(part) for part in scores]
        return chain_marginals(emissions, np.log(self.transition_), np.log(self.start_))

    def _score_samples(self, samples: list[NDArray]) -> list[NDArray]:
        return self._smooth(super()._score_samples(samples))

    def _decode(self, samples: list[NDArray]) -> list[NDArray]:
        return self._decode_scores(super()._score_samples(samples))

    def _answer(self, samples: list[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
        scores = super()._score_samples(samples)
        return self._smooth(scores), self._decode_scores(scores)

    def _decode_scores(self, scores: list[NDArray]) -> list[NDArray]:
        if self.decoder == "marginal":
            return self._smooth(scores)
        transition, start = np.log(self.transition_), np.log(self.start_)
        return [viterbi(self._emissions(part), transition, start)[0] for part in scores]


def _name(codes: NDArray) -> list[str | None]:
    return [None if code == GAP else str(code) for code in codes]


def count_steps(codes: Sequence[NDArray], n_classes: int) -> NDArray[np.float64]:
    """Count the steps from one class to the next, ``(n_classes, n_classes)``; none into or out of a gap."""
    counts = np.zeros((n_classes, n_classes))
    for own in codes:
        known = (own[:-1] != GAP) & (own[1:] != GAP)
        np.add.at(counts, (own[:-1][known], own[1:][known]), 1.0)
    return counts
