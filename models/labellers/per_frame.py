"""Labels frame by frame from a classifier; alone, or with equal neighbours merged and short segments done away with.

The descriptor of a frame holds the weights and how they change: for each stated span of s seconds around the frame,

    v_s(t) = (w(t + s/2) − w(t − s/2)) / s
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, clone
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils import check_random_state

from ...errors import InputError
from .base import GAP, FrameLabeller
from .durations import absorb_short_segments, best_segmentation
from .takes import split_takes

__all__ = ["LEAST_PROBABILITY", "MergingLabeller", "PerFrameLabeller", "describe_samples", "make_classifier"]

LEAST_PROBABILITY = 1e-3
"""A forest of n trees says 0 where it means less than 1 / n; a logarithm of it would rule a class out for good."""


def describe_samples(values: NDArray, rate: float, spans: Sequence[float]) -> NDArray[np.float64]:
    """Weights of each frame and their velocities over the stated spans.

    Parameters
    ----------
    values
        ``(n_frames, n_features)``.
    rate
        Hz.
    spans
        Seconds, above 0. Near the ends of the sequence a velocity is taken over what there is of its span.

    Returns
    -------
    ``(n_frames, n_features · (1 + n_spans))``; velocities in 1/s.
    """
    parts = [values]
    frames = np.arange(len(values))
    for span in spans:
        if not (np.isfinite(span) and span > 0):
            raise InputError(f"velocity: expected spans in seconds above 0, but got {span}")
        reach = max(1, round(span * rate / 2))
        before, after = np.maximum(frames - reach, 0), np.minimum(frames + reach, len(values) - 1)
        seconds = np.maximum(after - before, 1)[:, None] / rate
        parts.append((values[after] - values[before]) / seconds)
    return np.hstack(parts)


def make_classifier(classifier: Any, seed: int) -> BaseEstimator:
    """Return the classifier of frames: ``"forest"``, ``"linear"``, or a copy of an estimator with ``predict_proba``.

    ``forest``: 100 trees with at least 3 frames in a leaf, each grown on a quarter of the frames, which is as accurate
    where frames are near copies of each other, and four times as fast. ``linear``: multinomial logistic regression on
    standardised descriptors, C = 0.01, which is strong since neighbouring frames say the same thing again.
    """
    if classifier == "forest":
        return RandomForestClassifier(100, min_samples_leaf=3, max_samples=0.25, random_state=seed)
    if classifier == "linear":
        return make_pipeline(StandardScaler(), LogisticRegression(C=0.01, max_iter=2000))
    if hasattr(classifier, "fit") and hasattr(classifier, "predict_proba"):
        own = clone(classifier)
        if "random_state" in own.get_params() and own.get_params()["random_state"] is None:
            own.set_params(random_state=seed)
        return own
    raise InputError(
        f"classifier: expected 'forest', 'linear' or an estimator with predict_proba, but got {classifier!r}"
    )


class PerFrameLabeller(FrameLabeller):
    """A classifier of single frames.

    Parameters
    ----------
    rate
        Of the recording, Hz.
    classifier
        See :func:`make_classifier`.
    velocity
        Spans of the velocities in seconds; none for weights alone.
    work_rate
        Rate at which frames are classified, Hz.
    single_take
        Whether ``fit`` and ``score`` may take `X` without groups for the frames of one take.
    random_state
        Seed.
    """

    def __init__(
        self,
        rate: float = 200.0,
        *,
        classifier: Any = "forest",
        velocity: Sequence[float] = (0.2,),
        work_rate: float = 25.0,
        single_take: bool = False,
        random_state: int | None = None,
    ) -> None:
        self.rate = rate
        self.classifier = classifier
        self.velocity = velocity
        self.work_rate = work_rate
        self.single_take = single_take
        self.random_state = random_state

    def _fit_samples(self, samples: list[NDArray], codes: list[NDArray], units: list[Any]) -> None:
        self.classifier_ = self._fit_classifier(samples, codes, self._seed())

    def _score_samples(self, samples: list[NDArray]) -> list[NDArray]:
        return self._classify(self.classifier_, samples)

    def _answer(self, samples: list[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
        scores = self._score_samples(samples)
        return scores, scores

    def _seed(self) -> int:
        return int(check_random_state(self.random_state).randint(2**31 - 1))

    def _fit_classifier(self, samples: list[NDArray], codes: list[NDArray], seed: int) -> BaseEstimator:
        described = np.concatenate([describe_samples(part, self.work_rate, self.velocity) for part in samples])
        joined = np.concatenate(codes)
        labelled = joined != GAP
        if len(np.unique(joined[labelled])) < 2:
            raise InputError("labels: expected frames of at least two classes in every part to train on, but got one")
        return make_classifier(self.classifier, seed).fit(described[labelled], joined[labelled])

    def _classify(self, classifier: Any, samples: list[NDArray]) -> list[NDArray]:
        """Probabilities of all the labeller's classes, also where the classifier knows only some of them."""
        if not samples:
            return []
        described = np.concatenate([describe_samples(part, self.work_rate, self.velocity) for part in samples])
        scores = np.zeros((len(described), len(self.classes_)))
        scores[:, classifier.classes_] = classifier.predict_proba(described)
        return np.split(scores, np.cumsum([len(part) for part in samples])[:-1])

    def _classify_unseen(
        self, samples: list[NDArray], codes: list[NDArray], units: list[Any], n_folds: int
    ) -> list[NDArray]:
        """Probabilities of the training frames by classifiers that did not see them (nor their take, or signer).

        On its own training frames a forest is right nearly always, and whatever is learned from that trusts it far too
        much. With a single take nothing else is to be had.
        """
        seed = self._seed()
        folds = split_takes(units, n_folds, np.random.default_rng(seed))
        if not folds:
            return self._classify(self.classifier_, samples)
        scores: list[NDArray] = [np.zeros((0, 0))] * len(samples)
        for train, test in folds:
            classifier = self._fit_classifier([samples[i] for i in train], [codes[i] for i in train], seed)
            for place, part in zip(test, self._classify(classifier, [samples[i] for i in test]), strict=True):
                scores[place] = part
        return scores


class MergingLabeller(PerFrameLabeller):
    """A classifier of single frames, equal neighbours merged, with a least duration.

    Parameters
    ----------
    rate, classifier, velocity, work_rate, single_take, random_state
        See :class:`PerFrameLabeller`.
    min_duration
        Seconds of the shortest segment, at least 0.
    method
        ``"absorption"`` or ``"best-segmentation"``, see :mod:`.durations`.
    change
        What a change of label costs the best segmentation, in units of log probability. Frames that follow each other
        are no independent witnesses, so that sums of their logarithms are too sure; a price makes up for it.
    """

    def __init__(
        self,
        rate: float = 200.0,
        *,
        classifier: Any = "forest",
        velocity: Sequence[float] = (0.2,),
        min_duration: float = 0.2,
        method: str = "best-segmentation",
        change: float = 1.0,
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
        self.min_duration = min_duration
        self.method = method
        self.change = change

    def _fit_samples(self, samples: list[NDArray], codes: list[NDArray], units: list[Any]) -> None:
        if self.method not in ("absorption", "best-segmentation"):
            raise InputError(f"method: expected 'absorption' or 'best-segmentation', but got {self.method!r}")
        if not 0 <= self.min_duration < np.inf:
            raise InputError(f"min_duration: expected seconds, at least 0, but got {self.min_duration}")
        if not 0 <= self.change < np.inf:
            raise InputError(f"change: expected a price of at least 0, but got {self.change}")
        super()._fit_samples(samples, codes, units)

    def _decode(self, samples: list[NDArray]) -> list[NDArray]:
        return self._answer(samples)[1]

    def _answer(self, samples: list[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
        scores = self._score_samples(samples)
        return scores, self._merge(scores)

    def _merge(self, scores: list[NDArray]) -> list[NDArray]:
        n_least = max(1, int(np.ceil(self.min_duration * self.work_rate - 1e-9)))
        if self.method == "absorption":
            return [absorb_short_segments(part.argmax(axis=1), n_least) for part in scores]
        return [best_segmentation(np.log(np.maximum(part, LEAST_PROBABILITY)), n_least, self.change) for part in scores]
