"""A linear-chain conditional random field over frames (Lafferty, McCallum and Pereira 2001).

    log p(s | x) = Σ_t (w[s_t]·φ(x_t) + b[s_t]) + start[s_0] + Σ_t transition[s_{t-1}, s_t] − log Z(x)

It learns what the emissions and the steps are worth *together*, where a hidden Markov chain counts them apart. The
parameters are those of the least penalised negative log likelihood, which is convex while every frame is labelled, by
L-BFGS with the exact gradient. A frame without a label is summed over: log p of the labels that are known is the
difference of two partition functions, one of the paths that agree with them and one of all.

References
----------
.. [1] J. Lafferty, A. McCallum, F. Pereira, "Conditional random fields: probabilistic models for segmenting and
   labeling sequence data", ICML 2001, 282-289.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from ...errors import InputError
from .base import GAP
from .per_frame import LEAST_PROBABILITY, PerFrameLabeller, describe_samples
from .sequences import BLOCK, chain_marginals, forward_backward, viterbi

__all__ = ["RandomFieldLabeller", "field_loss"]

logger = logging.getLogger(__name__)


def field_loss(
    parameters: NDArray, features: Sequence[NDArray], codes: Sequence[NDArray], n_classes: int, penalty: float
) -> tuple[float, NDArray[np.float64]]:
    """Penalised negative log likelihood of a random field, and its gradient.

    Parameters
    ----------
    parameters
        Emission weights ``(n_classes, n_features)``, biases ``(n_classes,)``, starts ``(n_classes,)`` and transitions
        ``(n_classes, n_classes)``, flattened and joined in this order.
    features
        ``(n_samples, n_features)`` of each sequence.
    codes
        Class of each sample, -1 where it is unknown.
    n_classes
        Number of classes.
    penalty
        λ of the penalty ``λ/2 ‖parameters‖²``, at least 0.

    Returns
    -------
    The value, and the gradient in the shape of `parameters`.
    """
    weights, bias, start, transition = _unpack(parameters, n_classes, features[0].shape[1])
    value = penalty / 2 * float(parameters @ parameters)
    gradient = [np.zeros_like(part) for part in (weights, bias, start, transition)]
    order = np.argsort([len(part) for part in features], kind="stable")
    for first in range(0, len(order), BLOCK):
        chosen = order[first : first + BLOCK]
        lengths = np.array([len(features[i]) for i in chosen])
        block = np.zeros((len(chosen), lengths.max(), features[0].shape[1]))
        known = np.full(block.shape[:2], GAP)
        for row, i in enumerate(chosen):
            block[row, : lengths[row]], known[row, : lengths[row]] = features[i], codes[i]
        emission = block @ weights.T + bias
        allowed = (known[:, :, None] == GAP) | (known[:, :, None] == np.arange(n_classes))
        free = forward_backward(emission, transition, start, lengths)
        held = forward_backward(np.where(allowed, emission, -np.inf), transition, start, lengths)
        value += float((free.log_partition - held.log_partition).sum())
        difference = free.marginals - held.marginals
        gradient[0] += np.tensordot(difference, block, axes=([0, 1], [0, 1]))
        gradient[1] += difference.sum(axis=(0, 1))
        gradient[2] += difference[:, 0].sum(axis=0)
        gradient[3] += free.transitions - held.transitions
    return value, np.concatenate([part.ravel() for part in gradient]) + penalty * parameters


class RandomFieldLabeller(PerFrameLabeller):
    """A linear-chain conditional random field.

    Parameters
    ----------
    rate, classifier, velocity, work_rate, single_take, random_state
        See :class:`~mimique.models.labellers.PerFrameLabeller`.
    emissions
        ``"posteriors"``: the logarithms of the classifier's answers, which for training come from classifiers that did
        not see the take (or signer); ``"descriptors"``: standardised weights and velocities, without a classifier.
    penalty
        λ of ``λ/2 ‖parameters‖²``, above 0.
    max_iterations
        Of L-BFGS, at least 1.
    n_folds
        Folds of the cross-fitting, at least 2.
    decoder
        ``"viterbi"``: the likeliest path; ``"marginal"``: the likeliest label of each frame.
    callback
        Called with the number of each iteration and the value of the loss.

    Attributes
    ----------
    emission_, bias_, start_, transition_ : ndarray
        The parameters, as in the module's formula.
    loss_ : float
        The penalised loss at the end.
    """

    def __init__(
        self,
        rate: float = 200.0,
        *,
        classifier: Any = "forest",
        velocity: Sequence[float] = (0.2,),
        emissions: str = "posteriors",
        penalty: float = 1.0,
        max_iterations: int = 100,
        n_folds: int = 3,
        decoder: str = "viterbi",
        callback: Callable[[int, float], None] | None = None,
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
        self.emissions = emissions
        self.penalty = penalty
        self.max_iterations = max_iterations
        self.n_folds = n_folds
        self.decoder = decoder
        self.callback = callback

    def _fit_samples(self, samples: list[NDArray], codes: list[NDArray], units: list[Any]) -> None:
        if self.decoder not in ("viterbi", "marginal"):
            raise InputError(f"decoder: expected 'viterbi' or 'marginal', but got {self.decoder!r}")
        if not self.penalty > 0:
            raise InputError(f"penalty: expected a number above 0, but got {self.penalty}")
        if self.emissions == "posteriors":
            super()._fit_samples(samples, codes, units)
            features = [_log(part) for part in self._classify_unseen(samples, codes, units, self.n_folds)]
        elif self.emissions == "descriptors":
            described = np.concatenate([describe_samples(part, self.work_rate, self.velocity) for part in samples])
            self.mean_ = described.mean(axis=0)
            spread = described.std(axis=0)
            self.spread_ = np.where(spread > 1e-9 * np.abs(described).max(initial=1e-300), spread, 1.0)
            features = [self._standardise(part) for part in samples]
        else:
            raise InputError(f"emissions: expected 'posteriors' or 'descriptors', but got {self.emissions!r}")
        n_classes, n_features = len(self.classes_), features[0].shape[1]
        begin = np.zeros(n_classes * (n_features + 2 + n_classes))
        if self.emissions == "posteriors":  # begin at the classifier's own answer
            begin[: n_classes * n_features] = np.eye(n_classes).ravel()
        losses: list[float] = []

        def loss(parameters: NDArray) -> tuple[float, NDArray[np.float64]]:
            value, gradient = field_loss(parameters, features, codes, n_classes, self.penalty)
            losses.append(value)
            return value, gradient

        def report(_: NDArray) -> None:
            report.count += 1  # type: ignore[attr-defined]
            if self.callback is not None:
                self.callback(report.count, min(losses))  # type: ignore[attr-defined]

        report.count = 0  # type: ignore[attr-defined]
        found = minimize(
            loss, begin, jac=True, method="L-BFGS-B", callback=report, options={"maxiter": self.max_iterations}
        )
        if not found.success:
            logger.info("random field: stopped after %d iterations at a loss of %.6g", found.nit, found.fun)
        self.loss_, self.n_iter_ = float(found.fun), int(found.nit)
        self.emission_, self.bias_, self.start_, self.transition_ = _unpack(found.x, n_classes, n_features)

    def _standardise(self, sample: NDArray) -> NDArray[np.float64]:
        return (describe_samples(sample, self.work_rate, self.velocity) - self.mean_) / self.spread_

    def _emission_scores(self, samples: list[NDArray]) -> list[NDArray]:
        if self.emissions == "posteriors":
            features = [_log(part) for part in super()._score_samples(samples)]
        else:
            features = [self._standardise(part) for part in samples]
        return [part @ self.emission_.T + self.bias_ for part in features]

    def _score_samples(self, samples: list[NDArray]) -> list[NDArray]:
        return chain_marginals(self._emission_scores(samples), self.transition_, self.start_)

    def _decode(self, samples: list[NDArray]) -> list[NDArray]:
        if self.decoder == "marginal":
            return self._score_samples(samples)
        return self._find_paths(self._emission_scores(samples))

    def _answer(self, samples: list[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
        emissions = self._emission_scores(samples)
        marginals = chain_marginals(emissions, self.transition_, self.start_)
        return marginals, marginals if self.decoder == "marginal" else self._find_paths(emissions)

    def _find_paths(self, emissions: list[NDArray]) -> list[NDArray]:
        return [viterbi(scores, self.transition_, self.start_)[0] for scores in emissions]


def _log(scores: NDArray) -> NDArray[np.float64]:
    return np.log(np.maximum(scores, LEAST_PROBABILITY))


def _unpack(parameters: NDArray, n_classes: int, n_features: int) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    parts = np.split(parameters, np.cumsum([n_classes * n_features, n_classes, n_classes]))
    return (
        parts[0].reshape(n_classes, n_features),
        parts[1],
        parts[2],
        parts[3].reshape(n_classes, n_classes),
    )
