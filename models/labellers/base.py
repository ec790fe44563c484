"""What all labellers share: scikit-learn's conventions, takes, gaps, and a rate of their own.

Conventions
-----------
- ``fit(X, y, groups)``: `X` ``(n_frames, n_features)`` of all takes one after the other, each in order of time; `y`
  ``(n_frames,)`` labels, ``None`` where nobody labelled (such a frame gives its values to its neighbours' context and
  counts nowhere else); `groups` ``(n_frames,)`` the take of each frame. A data frame whose index has a level ``take``
  brings its groups along, so that scikit-learn's searches need nothing else.
- ``predict`` and ``predict_proba`` answer for every frame; without `groups` they take `X` for one take.
- ``fit`` and ``score`` without groups are refused, unless the labeller was made with ``single_take=True``. A search
  over plain arrays passes the groups to its splitter only: the labeller would read many takes as one sequence, and
  could not see that a split goes through the middle of one. Frames of a take on both sides of a split are an error.
- `rate` is the recording's, in Hz. Values are brought to `work_rate`, labelled there, and the answers brought back, so
  that the same motion gets the same labels at every rate.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import assert_all_finite, check_is_fitted, column_or_1d, validate_data

from ...errors import InputError
from ...features.derivatives import check_rate
from .resampling import resample_codes, resample_curves, restore_codes, restore_curves
from .takes import check_no_take_is_split, find_takes

__all__ = ["GAP", "FrameLabeller", "encode_labels"]

GAP = -1
"""Code of a frame without a label."""


class FrameLabeller(ClassifierMixin, BaseEstimator):
    """Base of the labellers; they add how samples at the working rate are learned and scored.

    Attributes
    ----------
    classes_ : ndarray
        Labels, sorted; the columns of ``predict_proba``.
    takes_ : tuple
        Names of the takes that were trained on; empty where no groups were given.
    take_seconds_ : tuple of float
        How long each of them was.
    """

    __metadata_request__fit: ClassVar[dict[str, bool]] = {"groups": True, "signers": True}
    __metadata_request__predict: ClassVar[dict[str, bool]] = {"groups": True}
    __metadata_request__predict_proba: ClassVar[dict[str, bool]] = {"groups": True}
    __metadata_request__score: ClassVar[dict[str, bool]] = {"groups": True}

    rate: float
    work_rate: float
    single_take: bool
    classes_: NDArray
    takes_: tuple[Any, ...]
    take_seconds_: tuple[float, ...]

    def fit(
        self, X: ArrayLike, y: ArrayLike, groups: ArrayLike | None = None, signers: ArrayLike | None = None
    ) -> FrameLabeller:
        """Learn from labelled frames.

        Parameters
        ----------
        X, y, groups
            See the module.
        signers
            ``(n_frames,)`` the signer of each frame. Where the labeller holds takes out of its own training (early
            stopping, cross-fitting), it then holds out whole signers, as fits a labeller for signers it never saw.

        Raises
        ------
        InputError
            For NaN, fewer than two classes, lengths that do not fit, takes whose frames are not together, or frames
            whose takes nobody told.
        """
        rate, work_rate = check_rate(self.rate), check_rate(self.work_rate)
        groups = self._need_groups(X, groups)
        values = self._check_values(X, reset=True)
        self.classes_, codes = encode_labels(y, len(values))
        takes = find_takes(groups, len(values))
        self.takes_ = () if groups is None else tuple(name for name, _ in takes)
        known = takes[: len(self.takes_)]
        self.take_seconds_ = tuple(float((frames.stop - frames.start) / rate) for _, frames in known)
        units = _units_of(takes, signers, len(values))
        samples = [resample_curves(values[frames], rate, work_rate) for _, frames in takes]
        sample_codes = [resample_codes(codes[frames], rate, work_rate) for _, frames in takes]
        self._fit_samples(samples, sample_codes, units)
        return self

    def predict_proba(self, X: ArrayLike, groups: ArrayLike | None = None) -> NDArray[np.float64]:
        """Probability of each class at each frame, ``(n_frames, n_classes)``; each row sums to 1."""
        samples, takes, n_frames = self._prepare(X, groups)
        return self._restore_scores(self._score_samples(samples), takes, n_frames)

    def predict(self, X: ArrayLike, groups: ArrayLike | None = None) -> NDArray:
        """Label of each frame, ``(n_frames,)``."""
        samples, takes, n_frames = self._prepare(X, groups)
        return self._restore_labels(self._decode(samples), takes, n_frames)

    def predict_with_proba(self, X: ArrayLike, groups: ArrayLike | None = None) -> tuple[NDArray, NDArray[np.float64]]:
        """Return what ``predict`` and ``predict_proba`` do, in little more than the time of one of them."""
        samples, takes, n_frames = self._prepare(X, groups)
        scores, paths = self._answer(samples)
        return self._restore_labels(paths, takes, n_frames), self._restore_scores(scores, takes, n_frames)

    def score(
        self, X: ArrayLike, y: ArrayLike, groups: ArrayLike | None = None, sample_weight: ArrayLike | None = None
    ) -> float:
        """Part of the labelled frames whose label is right, each counted by its weight where weights are given.

        Raises
        ------
        InputError
            If a take was trained on (as far as takes were named), or no frame has a label.
        """
        groups = self._need_groups(X, groups)
        if groups is not None and getattr(self, "takes_", None):
            check_no_take_is_split(np.asarray(self.takes_), groups)
        found = self.predict(X, groups)
        truth = column_or_1d(y)
        asked = ~pd.isna(truth)
        weight = np.ones(len(truth)) if sample_weight is None else np.asarray(sample_weight, dtype=float)
        if not weight[asked].sum() > 0:
            raise InputError("labels: expected at least one labelled frame to score, but got none")
        right = found[asked].astype(str) == truth[asked].astype(str)
        return float(np.average(right, weights=weight[asked]))

    def _fit_samples(self, samples: list[NDArray], codes: list[NDArray], units: list[Any]) -> None:
        """Learn from sequences at the working rate; `units` are what is held out together."""
        raise TypeError(f"{type(self).__name__} does not say how it learns")

    def _score_samples(self, samples: list[NDArray]) -> list[NDArray]:
        """Probabilities of sequences at the working rate."""
        raise TypeError(f"{type(self).__name__} does not say how it labels")

    def _decode(self, samples: list[NDArray]) -> list[NDArray]:
        """Classes ``(n_samples,)`` of each sequence, or scores ``(n_samples, n_classes)`` of which the best wins."""
        return self._score_samples(samples)

    def _answer(self, samples: list[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
        """Both of the above; labellers that can do it in one go do."""
        return self._score_samples(samples), self._decode(samples)

    def _restore_scores(
        self, scores: list[NDArray], takes: list[tuple[Any, slice]], n_frames: int
    ) -> NDArray[np.float64]:
        result = np.empty((n_frames, len(self.classes_)))
        for (_, frames), own in zip(takes, scores, strict=True):
            result[frames] = restore_curves(own, frames.stop - frames.start, self.rate, self.work_rate)
        return result

    def _restore_labels(self, paths: list[NDArray], takes: list[tuple[Any, slice]], n_frames: int) -> NDArray:
        codes = np.empty(n_frames, dtype=np.int64)
        for (_, frames), path in zip(takes, paths, strict=True):
            n_own = frames.stop - frames.start
            if path.ndim == 2:
                codes[frames] = restore_curves(path, n_own, self.rate, self.work_rate).argmax(axis=1)
            else:
                codes[frames] = restore_codes(path, n_own, self.rate, self.work_rate)
        return self.classes_[codes]

    def _need_groups(self, X: ArrayLike, groups: ArrayLike | None) -> ArrayLike | None:
        """Return the take of each frame; None only where the user said that all frames are of one take."""
        groups = _groups_of(X, groups)
        if groups is None and not self.single_take:
            raise InputError(
                "groups: expected the take of each frame, but got none; pass groups, give X as a DataFrame whose index "
                "has a level 'take' (scikit-learn's searches pass it on), or say single_take=True"
            )
        return groups

    def _prepare(self, X: ArrayLike, groups: ArrayLike | None) -> tuple[list[NDArray], list[tuple[Any, slice]], int]:
        check_is_fitted(self)
        groups = _groups_of(X, groups)
        values = self._check_values(X, reset=False)
        takes = find_takes(groups, len(values))
        learned = dict(zip(getattr(self, "takes_", ()), getattr(self, "take_seconds_", ()), strict=True))
        for name, frames in takes if groups is not None else ():
            seconds = (frames.stop - frames.start) / self.rate
            if abs(learned.get(name, seconds) - seconds) * self.rate > 0.5:
                raise InputError(
                    f"split: expected all frames of a take on one side, but {name!s} was trained on with "
                    f"{learned[name]:.4g} s and has {seconds:.4g} s here; split by take (take_splits)"
                )
        return [resample_curves(values[frames], self.rate, self.work_rate) for _, frames in takes], takes, len(values)

    def _check_values(self, X: ArrayLike, *, reset: bool) -> NDArray[np.float64]:
        try:
            values = validate_data(self, X, reset=reset, dtype=np.float64, ensure_all_finite=False)
        except ValueError as error:
            raise InputError(" ".join(str(error).split())) from error
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise InputError(
                f"X: expected finite numbers, but frame {bad[0]} holds NaN or infinity ({len(bad)} such frames); "
                "fill them first, and give them no label"
            )
        return values


def encode_labels(y: ArrayLike | None, n_frames: int) -> tuple[NDArray, NDArray[np.int64]]:
    """Return the classes, sorted, and each frame's code, :data:`GAP` where the label is ``None``.

    Raises
    ------
    InputError
        If there is not one label per frame, or there are fewer than two classes.
    """
    if y is None:
        raise InputError("this labeller requires y to be passed, but the target y is None")
    try:
        labels = column_or_1d(y, warn=True)
        if labels.dtype.kind in "fc":
            assert_all_finite(labels, input_name="y")
        labelled = ~np.asarray(pd.isna(labels), dtype=bool)
        given = labels[labelled]
        if labels.dtype == object:
            kinds = sorted({type(label).__name__ for label in given if not isinstance(label, str)})
            if kinds and any(isinstance(label, str) for label in given):
                raise InputError(f"labels: expected all text or all numbers, but got text and {', '.join(kinds)}")
            given = np.array(list(given))
        if len(given):
            check_classification_targets(given)
    except ValueError as error:
        raise InputError(" ".join(str(error).split())) from error
    if len(labels) != n_frames:
        raise InputError(f"labels: expected one per frame ({n_frames}), but got {len(labels)}")
    classes, found = np.unique(given, return_inverse=True)
    if len(classes) < 2:
        what = f"one class, {str(classes[0])!r}" if len(classes) else "no labelled frame"
        raise InputError(f"labels: expected frames of at least two classes, but got {what}")
    codes = np.full(n_frames, GAP, dtype=np.int64)
    codes[labelled] = found
    return classes, codes


def _groups_of(X: ArrayLike, groups: ArrayLike | None) -> ArrayLike | None:
    if groups is None and isinstance(X, pd.DataFrame) and "take" in X.index.names:
        return X.index.get_level_values("take").to_numpy()
    return groups


def _units_of(takes: list[tuple[Any, slice]], signers: ArrayLike | None, n_frames: int) -> list[Any]:
    """Return what each take is held out together with: its signer, or itself."""
    if signers is None:
        return [name for name, _ in takes]
    names = np.asarray(signers)
    if names.shape != (n_frames,):
        raise InputError(f"signers: expected one per frame ({n_frames}), but got {names.shape}")
    for name, frames in takes:
        if len(set(names[frames].tolist())) > 1:
            raise InputError(f"signers: expected one signer per take, but {name!s} has several")
    return [names[frames.start] for _, frames in takes]
