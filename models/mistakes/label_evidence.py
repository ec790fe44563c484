"""What the faces of a corpus say about its own labels, take by take, from models that never saw the take.

Models fitted to the stable segments and transitions that people annotated, on all takes but those judged:

* **affect**: two logistic regressions of the mean weights of stable segments (Reverdy 2019, 4.6), less the signer's
  median face, one of the weights and one of their square roots with their sign, in which what is weak counts for more;
  the geometric mean of both answers. It judges segments, and frames through weights that are smoothed over a quarter of
  a second. A segment's mean leaves out a fifth at each end, where the face may still be on its way.
* **movement**: gradient-boosted trees tell frames of transitions from others by the motion energies (4.4, 4.5) around
  them, relative to the signer's own typical energy, and by how far the affect model's answer changes across them: a
  mouth that speaks moves much, and means the same before and after.
* **temporal**, where one is given: a labeller of frames in time with transitions as a class (:mod:`.labellers`).
* **borders**: where each border belongs by all of these, see :mod:`.border_regression`.

A label that is wrong in the training takes hurts little as long as most are right; a wrong label cannot vouch for
itself, since its whole take is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from ...errors import InputError
from ...features.derivatives import differentiate
from ...features.descriptors import mean_weights
from ...features.energies import motion_energy
from ..confidence.calibration import align_columns, calibrate
from ..labelled_take import LabelledTake, find_transitions
from ..labellers import (
    TRANSITION,
    FrameLabeller,
    MergingLabeller,
    NetworkLabeller,
    has_torch,
    label_frames,
    stack_takes,
)
from .border_regression import BORDER_COLUMNS, describe_borders, place_borders

__all__ = ["LabelEvidence", "collect_label_evidence", "make_temporal_labeller"]

STEP = 0.02
"""s between the frames at which movement is judged; between them it is interpolated."""
LAGS = np.arange(-0.32, 0.321, 0.04)
"""s around a frame at which the energies are looked at."""
REACHES = (0.06, 0.12, 0.2, 0.3)
"""s before and after which the affect model's answers are compared."""
PENALTY = 0.1
"""C of the logistic regressions: small, for there are few segments and many shapes."""
ENDS = 0.2
"""Part of a segment at each end that its mean leaves out."""
LEAST_PROBABILITY = 0.005
"""Probabilities are raised to this before their logarithm is looked at."""


@dataclass(frozen=True)
class LabelEvidence:
    """What models that did not see a take say about it.

    Parameters
    ----------
    classes
        Labels of stable segments, sorted.
    segments
        ``(n_segments, n_classes)`` probability of each class for each segment of the tier, in order of time; NaN for a
        segment that is all gaps. Those of transitions mean little.
    frames
        ``(n_frames, n_classes)`` the same for each frame; NaN in gaps.
    moving
        ``(n_frames,)`` probability that the frame belongs to a transition; NaN in gaps.
    borders
        Where each border belongs, see :func:`mimique.models.mistakes.border_regression.place_borders`.
    """

    classes: tuple[str, ...]
    segments: NDArray[np.float64] = field(repr=False)
    frames: NDArray[np.float64] = field(repr=False)
    moving: NDArray[np.float64] = field(repr=False)
    borders: pd.DataFrame = field(repr=False, default_factory=lambda: pd.DataFrame(columns=BORDER_COLUMNS))


def make_temporal_labeller(rate: float, seed: int) -> FrameLabeller:
    """Return the temporal labeller to look for mistakes with: a temporal convolution, or without PyTorch a forest."""
    if has_torch():
        return NetworkLabeller(rate, network="tcn", n_layers=6, random_state=seed)
    return MergingLabeller(rate, classifier="forest", random_state=seed)


def collect_label_evidence(
    takes: Sequence[LabelledTake],
    *,
    rng: np.random.Generator,
    n_folds: int = 5,
    temporal: Callable[[float, int], FrameLabeller] | None = None,
    finished: Callable[[str], Any] | None = None,
) -> dict[str, LabelEvidence]:
    """Judge every take by models of the others.

    Parameters
    ----------
    takes
        With weights and tiers; names differ. Each signer's takes are spread over all folds, so that a signer's other
        takes help to judge each.
    rng
        Deals the takes to the folds, and seeds the models.
    n_folds
        How many times models are fitted; at most the number of takes.
    temporal
        Makes a temporal labeller of a rate and a seed, such as :func:`make_temporal_labeller`; it is most of the work,
        and sharpens borders in signed discourse. Left out where None.
    finished
        Called with a word after each fold.

    Returns
    -------
    Evidence by the name of the take.

    Raises
    ------
    InputError
        If there are fewer than two takes, names repeat, weights are lacking, or a fold leaves fewer than two classes.
    """
    _check_takes(takes)
    n_folds = min(n_folds, len(takes))
    folds = _deal(takes, n_folds, rng)
    seed = int(rng.integers(2**31))
    smooth, energy = _describe(takes)
    stable = [~find_transitions(take.segments) for take in takes]
    means = [mean_weights(curve, _trim(take.segments)) for curve, take in zip(smooth, takes, strict=True)]
    labels = [take.segments["label"].astype(str).to_numpy(dtype=object) for take in takes]
    classes = tuple(
        sorted({str(name) for own, is_stable in zip(labels, stable, strict=True) for name in own[is_stable]})
    )
    found: dict[str, LabelEvidence] = {}
    shown: dict[str, NDArray] = {}
    for fold in range(n_folds):
        inside = [i for i in range(len(takes)) if folds[i] != fold]
        kept = [stable[i] & np.isfinite(means[i]).all(axis=1) for i in inside]
        X = np.concatenate([means[i][own] for i, own in zip(inside, kept, strict=True)])
        y = np.concatenate([labels[i][own] for i, own in zip(inside, kept, strict=True)]).astype(str)
        if len(set(y)) < 2:
            raise InputError("takes: expected stable segments of at least two classes in every fold, but got fewer")
        affect = _AffectModel(X, y)
        frames = [_judge(affect, curve, classes) for curve in smooth]
        curves = [
            np.column_stack((own, _measure_change(judged, take.rate)))
            for own, judged, take in zip(energy, frames, takes, strict=True)
        ]
        movement = _fit_movement([curves[i] for i in inside], [takes[i] for i in inside], seed)
        outside = np.flatnonzero(folds == fold).tolist()
        for i in outside:
            found[takes[i].name] = LabelEvidence(
                classes,
                _judge(affect, means[i], classes),
                frames[i],
                _judge_movement(movement, curves[i], takes[i].rate),
            )
        if temporal is not None:
            shown |= _show([takes[i] for i in inside], [takes[i] for i in outside], temporal, seed + fold, classes)
        if finished is not None:
            finished(f"fold {fold + 1} of {n_folds}")
    found = _calibrate(found, takes, labels, stable, classes)
    described = [
        _describe_borders(take, found[take.name], own, motion, is_stable, shown.get(take.name))
        for take, own, motion, is_stable in zip(takes, smooth, energy, stable, strict=True)
    ]
    fitted = place_borders(described, [take.protocol for take in takes], [take.rate for take in takes], folds, rng=rng)
    return {take.name: replace(found[take.name], borders=own) for take, own in zip(takes, fitted, strict=True)}


class _AffectModel:
    """The two logistic regressions; see the module."""

    def __init__(self, means: NDArray, labels: NDArray) -> None:
        self._models = [
            make_pipeline(StandardScaler(), LogisticRegression(C=PENALTY, max_iter=500)).fit(rows, labels)
            for rows in (means, _root(means))
        ]
        self.classes_ = self._models[0].classes_

    def predict_proba(self, rows: NDArray) -> NDArray[np.float64]:
        first, second = (m.predict_proba(r) for m, r in zip(self._models, (rows, _root(rows)), strict=True))
        joined = np.sqrt(np.maximum(first * second, 1e-12))
        return joined / joined.sum(axis=1, keepdims=True)


def _root(rows: NDArray) -> NDArray[np.float64]:
    return np.sign(rows) * np.sqrt(np.abs(rows))


def _trim(segments: pd.DataFrame) -> pd.DataFrame:
    end = ((segments["offset"] - segments["onset"]) * ENDS).astype("int64")
    return segments.assign(onset=segments["onset"] + end, offset=segments["offset"] - end)


def _show(
    inside: Sequence[LabelledTake],
    outside: Sequence[LabelledTake],
    temporal: Callable[[float, int], FrameLabeller],
    seed: int,
    classes: Sequence[str],
) -> dict[str, NDArray]:
    """Log probabilities of a temporal labeller, ``(n_frames, 1 + n_classes)``, the first of a transition."""
    stacked = stack_takes(inside)
    labeller = temporal(stacked.rate, seed).fit(stacked.X, stacked.y, groups=stacked.groups)
    wanted = [TRANSITION, *classes]
    result = {}
    for take in outside:
        weights = take.weights
        if weights is None or not np.isfinite(weights).all(axis=1).any():
            continue
        _, given = label_frames(labeller, weights)
        result[take.name] = np.log(np.maximum(align_columns(given, labeller.classes_, wanted), LEAST_PROBABILITY))
    return result


def _describe_borders(
    take: LabelledTake,
    evidence: LabelEvidence,
    smooth: NDArray,
    energy: NDArray,
    stable: NDArray,
    shown: NDArray | None,
) -> list[Any]:
    curves = [evidence.moving, energy[:, 0]]
    judged = [np.log(np.maximum(evidence.frames, LEAST_PROBABILITY))]
    if shown is not None:
        curves.append(shown[:, 0])
        judged.append(shown[:, 1:])
    return describe_borders(
        take.segments, ~stable, smooth, np.column_stack(curves), np.hstack(judged), evidence.classes
    )


def _check_takes(takes: Sequence[LabelledTake]) -> None:
    if len(takes) < 2:
        raise InputError(f"takes: expected at least two, to judge each by the others, but got {len(takes)}")
    names = [take.name for take in takes]
    if len(set(names)) < len(names):
        raise InputError("takes: expected names that differ")
    bare = [take.name for take in takes if take.weights is None]
    if bare:
        raise InputError(f"takes: expected weights, but {', '.join(bare[:5])} has none; solve first")
    widths = {take.weights.shape[1] for take in takes if take.weights is not None}
    if len(widths) > 1:
        raise InputError(f"takes: expected the same shapes everywhere, but got {sorted(widths)} weights a frame")


def _calibrate(
    found: Mapping[str, LabelEvidence],
    takes: Sequence[LabelledTake],
    labels: Sequence[NDArray],
    stable: Sequence[NDArray],
    classes: Sequence[str],
) -> dict[str, LabelEvidence]:
    """Bring all probabilities to the temperature at which the stable segments are as sure as they are right.

    A model of few segments is too modest, and thresholds on its answers would mean something else than with many.
    """
    judged = np.concatenate([found[take.name].segments[own] for take, own in zip(takes, stable, strict=True)])
    given = np.concatenate([names[own] for names, own in zip(labels, stable, strict=True)])
    calibrator = calibrate(judged, given, classes=classes, method="temperature")
    return {
        name: replace(one, segments=calibrator.apply(one.segments), frames=calibrator.apply(one.frames))
        for name, one in found.items()
    }


def _deal(takes: Sequence[LabelledTake], n_folds: int, rng: np.random.Generator) -> NDArray[np.int64]:
    folds = np.zeros(len(takes), dtype=np.int64)
    position = 0
    for signer in sorted({take.signer for take in takes}):
        own = [i for i, take in enumerate(takes) if take.signer == signer]
        for i in rng.permutation(own):
            folds[i] = position % n_folds
            position += 1
    return folds


def _describe(takes: Sequence[LabelledTake]) -> tuple[list[NDArray], list[NDArray]]:
    """Smoothed weights less the signer's median, and logarithms of the energies less the signer's median."""
    smooth, energy = [], []
    for take in takes:
        weights = np.zeros((0, 0)) if take.weights is None else take.weights
        smooth.append(differentiate(weights, take.rate, max_order=0)[0])
        motion = motion_energy(weights, take.rate)
        energy.append(np.log(np.column_stack((motion.velocity, motion.acceleration)) + 1e-6))
    for signer in {take.signer for take in takes}:
        own = [i for i, take in enumerate(takes) if take.signer == signer]
        for curves in (smooth, energy):
            joined = np.concatenate([curves[i] for i in own])
            joined = joined[np.isfinite(joined).all(axis=1)]
            centre = np.median(joined, axis=0) if len(joined) else 0.0
            for i in own:
                curves[i] = curves[i] - centre
    return smooth, energy


def _judge(model: object, rows: NDArray, classes: Sequence[str]) -> NDArray[np.float64]:
    result = np.full((len(rows), len(classes)), np.nan)
    present = np.isfinite(rows).all(axis=1)
    if present.any():
        given = model.predict_proba(rows[present])  # type: ignore[attr-defined]
        result[present] = align_columns(given, model.classes_, classes)  # type: ignore[attr-defined]
    return result


def _measure_change(frames: NDArray, rate: float) -> NDArray[np.float64]:
    """Total variation distance, 0 to 1, of the answers some way before and after each frame, ``(n, n_reaches)``."""
    places = np.arange(len(frames))
    result = np.empty((len(frames), len(REACHES)))
    for column, reach in enumerate(REACHES):
        away = max(round(reach * rate), 1)
        before, after = np.clip(places - away, 0, None), np.clip(places + away, None, max(len(frames) - 1, 0))
        result[:, column] = 0.5 * np.abs(frames[after] - frames[before]).sum(axis=1)
    return result


def _look_around(energy: NDArray, frames: NDArray, rate: float) -> NDArray[np.float64]:
    """Energies at the lags around some frames, ``(n, 2 n_lags)``; NaN outside the take, which trees can read."""
    places = frames[:, None] + np.round(LAGS * rate).astype(np.int64)
    inside = (places >= 0) & (places < len(energy))
    values = energy[np.clip(places, 0, len(energy) - 1)]
    values[~inside] = np.nan
    return values.reshape(len(frames), -1)


def _judged_frames(n_frames: int, rate: float) -> NDArray[np.int64]:
    return np.unique(np.append(np.arange(0, n_frames, max(round(STEP * rate), 1)), n_frames - 1))


def _fit_movement(
    energies: Sequence[NDArray], takes: Sequence[LabelledTake], seed: int
) -> HistGradientBoostingClassifier | None:
    X, y = [], []
    for energy, take in zip(energies, takes, strict=True):
        if not take.n_frames:
            continue
        state = np.full(take.n_frames, -1)
        rows = zip(take.segments["onset"], take.segments["offset"], find_transitions(take.segments), strict=True)
        for onset, offset, moves in rows:
            state[onset:offset] = int(moves)
        frames = _judged_frames(take.n_frames, take.rate)[::2]
        frames = frames[(state[frames] >= 0) & np.isfinite(energy[frames]).all(axis=1)]
        X.append(_look_around(energy, frames, take.rate))
        y.append(state[frames])
    known = np.concatenate(y)
    if len(set(known.tolist())) < 2:
        return None
    model = HistGradientBoostingClassifier(
        max_iter=80, max_leaf_nodes=15, min_samples_leaf=40, early_stopping=False, random_state=seed
    )
    return model.fit(np.concatenate(X), known)


def _judge_movement(model: HistGradientBoostingClassifier | None, energy: NDArray, rate: float) -> NDArray[np.float64]:
    """Probability of moving at every frame; NaN where nothing is known, or where no tier tells the two apart."""
    if model is None or not len(energy):
        return np.full(len(energy), np.nan)
    frames = _judged_frames(len(energy), rate)
    given = model.predict_proba(_look_around(energy, frames, rate))[:, 1]
    result = np.interp(np.arange(len(energy)), frames, given)
    result[~np.isfinite(energy).all(axis=1)] = np.nan
    return result
