"""Probabilities that mean what they say: of the answers given with 0.8, eight in ten are right.

Scores order a classifier's answers by how sure it is; forests are too modest, softmaxes too bold. Two corrections are
fitted to answers about signers that the classifier was not trained on:

| method | what it does | keeps |
|---|---|---|
| ``temperature`` | ``p_k^(1/T)``, renormalised; one T, of least log loss [1]_ | the order of all classes |
| ``isotonic`` | one rising curve per class against the rest, renormalised [2]_ | the order within a class |

A calibrator must see *out-of-fold* probabilities (:func:`predict_out_of_group`): those of the training frames are far
too good. Whole signers are left out, because the next signer is what the correction is for.

References
----------
.. [1] C. Guo, G. Pleiss, Y. Sun, K. Q. Weinberger, "On Calibration of Modern Neural Networks", ICML 2017.
.. [2] B. Zadrozny, C. Elkan, "Transforming Classifier Scores into Accurate Multiclass Probability Estimates", KDD 2002.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar
from sklearn.base import clone
from sklearn.isotonic import IsotonicRegression
from sklearn.model_selection import GroupKFold

from ...arrays import check_array
from ...errors import InputError

__all__ = ["METHODS", "Calibrator", "calibrate", "predict_out_of_group", "segment_probabilities"]

METHODS = ("temperature", "isotonic")
LEAST = 1e-4
"""Probabilities are raised to this before logarithms are taken: a forest without a vote for a class says 0."""
HOTTEST = 20.0
"""Temperatures are sought between 1/20 and 20."""


@dataclass(frozen=True)
class Calibrator:
    """A fitted correction of probabilities.

    Parameters
    ----------
    method
        ``"temperature"`` or ``"isotonic"``.
    classes
        Labels of the columns.
    temperature
        T; below 1 the scores were too modest, above 1 too bold. 1 for isotonic.
    curves
        For isotonic: per class the knots of its curve, ``(n_knots, 2)`` score and probability, both rising.
    scores
        Log loss of each method on groups left out, where they were compared; otherwise empty.
    """

    method: str
    classes: tuple[str, ...]
    temperature: float = 1.0
    curves: tuple[NDArray[np.float64], ...] = field(default=(), repr=False)
    scores: Mapping[str, float] = field(default_factory=dict)

    def apply(self, probabilities: ArrayLike) -> NDArray[np.float64]:
        """Return calibrated probabilities.

        Parameters
        ----------
        probabilities
            ``(n_rows, n_classes)``, each row at least 0 with sum 1; rows with NaN stay NaN.

        Returns
        -------
        ``(n_rows, n_classes)``; each row sums to 1.
        """
        values = check_probabilities(probabilities, len(self.classes))
        if self.method == "temperature":
            return _temper(values, self.temperature)
        return _apply_curves(values, self.curves)

    def to_arrays(self) -> tuple[dict[str, NDArray], dict[str, Any]]:
        """Return all that makes the calibrator: arrays, and metadata that JSON can hold."""
        arrays = {f"curve{k}": curve for k, curve in enumerate(self.curves)}
        metadata = {
            "method": self.method,
            "classes": list(self.classes),
            "temperature": self.temperature,
            "scores": dict(self.scores),
        }
        return arrays, metadata

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, ArrayLike], metadata: Mapping[str, Any]) -> Calibrator:
        """Return the calibrator that :meth:`to_arrays` described."""
        lacking = [key for key in ("method", "classes", "temperature") if key not in metadata]
        n_curves = len(metadata.get("classes", ())) if metadata.get("method") == "isotonic" else 0
        lacking += [f"curve{k}" for k in range(n_curves) if f"curve{k}" not in arrays]
        if lacking:
            raise InputError(f"stored calibrator: expected {', '.join(lacking)}, but it is not there")
        method = _check_method(metadata["method"])
        curves = tuple(
            check_array(arrays[f"curve{k}"], name=f"curve {k}", shape=(None, 2), finite=True) for k in range(n_curves)
        )
        classes = tuple(str(name) for name in metadata["classes"])
        return cls(method, classes, float(metadata["temperature"]), curves, dict(metadata.get("scores", {})))


def calibrate(
    probabilities: ArrayLike,
    labels: Sequence[str] | NDArray,
    groups: Sequence[str] | NDArray | None = None,
    *,
    classes: Sequence[str],
    method: Literal["best", "temperature", "isotonic"] = "best",
    weights: ArrayLike | None = None,
) -> Calibrator:
    """Fit a calibrator to out-of-fold probabilities.

    Parameters
    ----------
    probabilities
        ``(n_rows, n_classes)`` of frames or of segments, from models that did not see the row's group.
    labels
        ``(n_rows,)`` what each row really is; rows labelled ``None`` and rows with NaN are left out.
    groups
        ``(n_rows,)`` signer of each row. Needed to choose the method.
    classes
        Labels of the columns.
    method
        ``"best"`` takes that of least log loss when each group in turn is left out of the fit.
    weights
        ``(n_rows,)`` what each row counts, at least 0; all 1 by default.

    Raises
    ------
    InputError
        If lengths do not fit, a label is no class, nothing is left to fit to, or ``"best"`` has fewer than two groups.
    """
    names = tuple(str(name) for name in classes)
    values = check_probabilities(probabilities, len(names))
    codes = _encode(labels, names, len(values))
    counted = np.ones(len(values))
    if weights is not None:
        counted = check_array(weights, name="weights", shape=(len(values),), finite=True)
        if (counted < 0).any():
            raise InputError("weights: expected numbers of at least 0")
    kept = (codes >= 0) & np.isfinite(values).all(axis=1) & (counted > 0)
    if not kept.any():
        raise InputError("calibration: expected rows with a label and probabilities, but none has both")
    rows = values[kept], codes[kept], counted[kept]
    if method != "best":
        return _fit(*rows, names, _check_method(method))
    if groups is None or len(groups) != len(values):
        raise InputError(f"groups: expected the signer of each of the {len(values)} rows to choose a method by")
    members = np.asarray(groups, dtype=object).astype(str)[kept]
    if len(set(members)) < 2:
        raise InputError("groups: expected at least two signers to choose a method by; name the method instead")
    scores = {name: _score_left_out(*rows, members, names, name) for name in METHODS}
    chosen = min(METHODS, key=lambda name: scores[name])
    fitted = _fit(*rows, names, chosen)
    return Calibrator(chosen, names, fitted.temperature, fitted.curves, scores)


def predict_out_of_group(
    estimator: Any,
    samples: ArrayLike,
    labels: Sequence[str] | NDArray,
    groups: Sequence[str] | NDArray,
    *,
    classes: Sequence[str],
    n_folds: int | None = None,
) -> NDArray[np.float64]:
    """Probabilities of each row by a model that saw nothing of the row's group.

    Parameters
    ----------
    estimator
        In scikit-learn's convention, with ``predict_proba``; it is cloned, not changed.
    samples, labels, groups
        ``(n_rows, n_features)``, ``(n_rows,)`` and ``(n_rows,)``.
    classes
        Order of the columns; a class that a fold's training rows lack gets 0.
    n_folds
        Groups are left out in this many bundles; one by one if ``None``.

    Returns
    -------
    ``(n_rows, n_classes)``.
    """
    X = check_array(samples, name="samples", shape=(None, None), finite=True)
    y = np.asarray(labels, dtype=object).astype(str)
    members = np.asarray(groups, dtype=object).astype(str)
    if y.shape != (len(X),) or members.shape != (len(X),):
        raise InputError(
            f"samples: expected a label and a group for each of {len(X)}, but got {y.shape}, {members.shape}"
        )
    n_groups = len(set(members))
    n_splits = n_groups if n_folds is None else min(n_folds, n_groups)
    if n_splits < 2:
        raise InputError(f"groups: expected at least two to leave one out, but got {n_groups}")
    names = [str(name) for name in classes]
    result = np.zeros((len(X), len(names)))
    for train, test in GroupKFold(n_splits).split(X, y, members):
        fitted = clone(estimator).fit(X[train], y[train])
        result[test] = align_columns(fitted.predict_proba(X[test]), fitted.classes_, names)
    return result


def align_columns(
    probabilities: NDArray, found: Sequence[str] | NDArray, classes: Sequence[str]
) -> NDArray[np.float64]:
    """Columns in the order of the classes; those that are not there are 0."""
    place = {str(name): column for column, name in enumerate(found)}
    unknown = sorted(set(place) - set(classes))
    if unknown:
        raise InputError(f"classes: expected {', '.join(classes)}, but the model also gives {', '.join(unknown)}")
    result = np.zeros((len(probabilities), len(classes)))
    for column, name in enumerate(classes):
        if name in place:
            result[:, column] = probabilities[:, place[name]]
    return result


def segment_probabilities(
    probabilities: ArrayLike, segments: pd.DataFrame, *, pooling: Literal["mean", "log"] = "mean"
) -> NDArray[np.float64]:
    """Probabilities of segments from those of their frames.

    Parameters
    ----------
    probabilities
        ``(n_frames, n_classes)``, NaN in gaps, which are left out.
    segments
        Table with ``onset`` and ``offset``, half-open frames inside the take.
    pooling
        ``"mean"``: arithmetic mean. ``"log"``: geometric mean, renormalised, in which one frame's firm no weighs more.
        Neither is the product: neighbouring frames are no independent witnesses.

    Returns
    -------
    ``(n_segments, n_classes)``; NaN for a segment that is all gaps. Calibrate these, not the frames, to ask how sure a
    segment's label is.
    """
    values = check_probabilities(probabilities, None)
    if pooling not in ("mean", "log"):
        raise InputError(f"pooling: expected 'mean' or 'log', but got {pooling!r}")
    pooled = np.log(np.clip(values, LEAST, None)) if pooling == "log" else values
    present: NDArray[np.bool_] = np.asarray(np.isfinite(values).all(axis=1))
    result = np.full((len(segments), values.shape[1]), np.nan)
    for row, (onset, offset) in enumerate(zip(segments["onset"], segments["offset"], strict=True)):
        if not 0 <= onset < offset <= len(values):
            raise InputError(
                f"segments: expected frames within 0 to {len(values)}, but row {row} is [{onset}, {offset})"
            )
        frames = pooled[onset:offset][present[onset:offset]]
        if len(frames):
            mean = frames.mean(axis=0)
            mean = np.exp(mean - mean.max()) if pooling == "log" else mean
            result[row] = mean / mean.sum()
    return result


def check_probabilities(probabilities: ArrayLike, n_classes: int | None) -> NDArray[np.float64]:
    """Return probabilities as float64, or say which row is none."""
    values = check_array(probabilities, name="probabilities", shape=(None, n_classes))
    sums = values.sum(axis=1)
    is_wrong: NDArray[np.bool_] = (values < 0).any(axis=1) | (np.abs(sums - 1) > 1e-3)
    wrong = np.flatnonzero(np.isfinite(sums) & is_wrong)
    if len(wrong):
        row = int(wrong[0])
        raise InputError(
            f"probabilities: expected rows of at least 0 that sum to 1, but row {row} sums to {sums[row]:g}"
        )
    return values


def _fit(values: NDArray, codes: NDArray, counted: NDArray, names: tuple[str, ...], method: str) -> Calibrator:
    if method == "temperature":
        return Calibrator(method, names, _fit_temperature(values, codes, counted))
    return Calibrator(
        method, names, 1.0, tuple(_fit_curve(values[:, k], codes == k, counted) for k in range(len(names)))
    )


def _fit_temperature(values: NDArray, codes: NDArray, counted: NDArray) -> float:
    def loss(log_temperature: float) -> float:
        tempered = _temper(values, float(np.exp(log_temperature)))
        return float(-(counted * np.log(np.clip(tempered[np.arange(len(codes)), codes], LEAST**2, None))).sum())

    bound = np.log(HOTTEST)
    return float(np.exp(minimize_scalar(loss, bounds=(-bound, bound), method="bounded", options={"xatol": 1e-6}).x))


def _temper(values: NDArray, temperature: float) -> NDArray[np.float64]:
    powers = np.log(np.clip(values, LEAST, None)) / temperature
    powers = np.exp(powers - powers.max(axis=1, keepdims=True))
    return powers / powers.sum(axis=1, keepdims=True)


def _fit_curve(score: NDArray, is_class: NDArray, counted: NDArray) -> NDArray[np.float64]:
    curve = IsotonicRegression(y_min=0.0, y_max=1.0, out_of_bounds="clip")
    curve.fit(score, is_class.astype(float), sample_weight=counted)
    # A curve learned from n rows cannot tell 0 from one in n + 2, nor 1 from all but one: Laplace's rule of succession.
    n_rows = counted.sum()
    heights = (np.asarray(curve.y_thresholds_) * n_rows + 1) / (n_rows + 2)
    return np.column_stack((np.asarray(curve.X_thresholds_), heights))


def _apply_curves(values: NDArray, curves: Sequence[NDArray]) -> NDArray[np.float64]:
    raised = np.column_stack([np.interp(values[:, k], curve[:, 0], curve[:, 1]) for k, curve in enumerate(curves)])
    raised[~np.isfinite(values).all(axis=1)] = np.nan
    return raised / raised.sum(axis=1, keepdims=True)


def _score_left_out(
    values: NDArray, codes: NDArray, counted: NDArray, members: NDArray, names: tuple[str, ...], method: str
) -> float:
    loss = 0.0
    for group in sorted(set(members)):
        out = members == group
        fitted = _fit(values[~out], codes[~out], counted[~out], names, method)
        given = fitted.apply(values[out])[np.arange(int(out.sum())), codes[out]]
        loss -= float((counted[out] * np.log(np.clip(given, LEAST**2, None))).sum())
    return loss / float(counted.sum())


def _encode(labels: Sequence[str] | NDArray, names: tuple[str, ...], n_rows: int) -> NDArray[np.int64]:
    """Column of each row's label, −1 where it has none."""
    given = np.asarray(labels, dtype=object)
    if given.shape != (n_rows,):
        raise InputError(f"labels: expected one per row of probabilities ({n_rows}), but got {given.shape}")
    place = {name: column for column, name in enumerate(names)}
    unknown = sorted({str(label) for label in given if label is not None and str(label) not in place})
    if unknown:
        raise InputError(f"labels: expected one of {', '.join(names)}, but got {', '.join(unknown)}")
    return np.array([-1 if label is None else place[str(label)] for label in given], dtype=np.int64)


def _check_method(method: str) -> str:
    if method not in METHODS:
        raise InputError(f"calibration: expected one of best, {', '.join(METHODS)}, but got {method!r}")
    return method
