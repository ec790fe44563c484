"""Learning a model that a corpus can keep: the method on all takes, and its calibration on takes held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..errors import InputError
from .affect_classifiers import CLASSIFIERS, fit_affect_classifier
from .confidence.cross_calibration import CrossCalibration, calibrate_answers, collect_fold_answers
from .evaluation.protocols import collect_training_samples
from .evaluation.tested_segments import collect_tested_segments
from .labelled_take import LabelledTake, find_covering_labels
from .labellers import LABELLERS, TRANSITION, FrameLabeller, LabelledFrames, stack_takes
from .labellers.take_tiers import find_take_segments
from .scores.calibration_metrics import brier_score, expected_calibration_error, log_loss
from .stored_models import SegmentModel, StoredModel, TakeModel

__all__ = ["METHODS", "WHOLE", "FitPart", "count_folds", "learn_model", "measure_confidence"]

METHODS = (*CLASSIFIERS, *LABELLERS)
"""Names of all methods: classifiers of segments, then labellers of frames in time."""
WHOLE = "all takes"
"""Name of the part of the work that learns from all takes."""
SIGNER_FOLDS = {"classifier": 5, "labeller": 3}
TAKE_FOLDS = {"classifier": 12, "labeller": 5}

FitPart = Callable[[str, FrameLabeller, LabelledFrames], FrameLabeller]


def learn_model(
    name: str,
    takes: Sequence[LabelledTake],
    *,
    seed: int,
    shapes: Sequence[str],
    automatic: Mapping[str, pd.DataFrame] | None = None,
    calibrated: bool = True,
    parameters: Mapping[str, Any] | None = None,
    fit_part: FitPart | None = None,
) -> tuple[StoredModel, dict[str, Any]]:
    """Learn from takes, and calibrate on takes held out.

    Parameters
    ----------
    name
        One of :data:`METHODS`.
    takes
        With weights of the same shapes and one rate, in a fixed order.
    seed
        Of what is random; every fold uses the same.
    shapes
        Names of the weights.
    automatic
        Segments (``onset, offset``) by take name, on which a classifier of segments is calibrated; takes without use
        their own labelled segments. Labellers are calibrated on the segments that they find.
    calibrated
        Whether to calibrate. Of several signers, signers are held out in 5 folds (labellers: 3), of one, takes in 12
        (labellers: 5).
    parameters
        Of a labeller, to change its defaults.
    fit_part
        Called as ``fit_part(part, labeller, frames)`` for every fit of a labeller and returns it fitted, for progress
        and checkpoints; ``part`` is :data:`WHOLE` or ``"fold 1 of 3"``. By default it is just fitted.

    Returns
    -------
    The model, and the facts of :func:`~.cross_calibration.calibrate_answers` with ``held_out`` (signers or takes) and
    ``n_folds``.

    Raises
    ------
    InputError
        If the name is unknown, or there is nothing to learn from.
    """
    if name not in METHODS:
        raise InputError(f"classifier: expected one of {', '.join(METHODS)}, but got {name!r}")
    if name in CLASSIFIERS:
        if parameters:
            raise InputError(
                f"classifier {name}: expected no parameters of a labeller, but got {', '.join(parameters)}"
            )
        return _learn_classifier(name, takes, seed, shapes, automatic or {}, calibrated)
    return _learn_labeller(name, takes, seed, shapes, calibrated, dict(parameters or {}), fit_part or _just_fit)


def count_folds(name: str, takes: Sequence[LabelledTake]) -> tuple[str, int]:
    """Return what is held out for calibration (``"signers"`` or ``"takes"``), and into how many folds it is dealt."""
    kind = "classifier" if name in CLASSIFIERS else "labeller"
    n_signers = len({take.signer for take in takes})
    if n_signers > 1:
        return "signers", min(SIGNER_FOLDS[kind], n_signers)
    return "takes", min(TAKE_FOLDS[kind], len(takes))


def measure_confidence(
    model: StoredModel, takes: Sequence[LabelledTake], automatic: Mapping[str, pd.DataFrame] | None = None
) -> dict[str, Any]:
    """Return ``n_segments``, ``ece``, ``brier`` and ``log_loss`` of a model's (calibrated) answers for other takes.

    Segments whose label the model does not know are left out; empty where nothing is left.
    """
    parts = [_answer(model, take, automatic or {}) for take in takes]
    references = np.concatenate([np.zeros(0, dtype=object), *(references for _, references in parts)])
    probabilities = np.concatenate([np.zeros((0, len(model.classes))), *(some for some, _ in parts)])
    known = np.isin(references.astype(str), list(model.classes)) & np.isfinite(probabilities).all(axis=1)
    if not known.any():
        return {}
    rows, labels = probabilities[known], references[known].astype(str)
    if model.calibrator is not None:
        rows = model.calibrator.apply(rows)
    return {
        "n_segments": len(labels),
        "ece": expected_calibration_error(rows, labels, model.classes),
        "brier": brier_score(rows, labels, model.classes),
        "log_loss": log_loss(rows, labels, model.classes),
    }


def _answer(model: StoredModel, take: LabelledTake, automatic: Mapping[str, pd.DataFrame]) -> tuple[NDArray, NDArray]:
    """Return uncalibrated probabilities of a take's segments, and what they really are (None: nobody knows)."""
    nothing = np.zeros((0, len(model.classes))), np.zeros(0, dtype=object)
    if not np.isfinite(take.weights).all(axis=1).any():  # type: ignore[arg-type]
        return nothing
    if isinstance(model, SegmentModel):
        test = collect_tested_segments([take], "automatic" if take.name in automatic else "manual", automatic)
        if not len(test.segments):
            return nothing
        return model.classifier.predict_proba(test.means), test.segments["reference"].to_numpy(dtype=object)
    segments, probabilities = find_take_segments(model.labeller, take.weights)  # type: ignore[arg-type]
    references, moving, _ = find_covering_labels(segments["onset"], segments["offset"], take)
    references[moving] = TRANSITION
    return probabilities, references


def _learn_classifier(
    name: str,
    takes: Sequence[LabelledTake],
    seed: int,
    shapes: Sequence[str],
    automatic: Mapping[str, pd.DataFrame],
    calibrated: bool,
) -> tuple[StoredModel, dict[str, Any]]:
    def learn(_: int, taught: Sequence[LabelledTake]) -> SegmentModel:
        samples, labels = collect_training_samples(taught)
        rng = np.random.default_rng(seed)
        return SegmentModel(fit_affect_classifier(name, samples, list(labels), rng=rng, shapes=shapes))

    whole = learn(-1, takes)
    found, facts = _calibrate(name, takes, learn, automatic, whole.classes, calibrated)
    return SegmentModel(whole.classifier, found.calibrator), facts


def _learn_labeller(
    name: str,
    takes: Sequence[LabelledTake],
    seed: int,
    shapes: Sequence[str],
    calibrated: bool,
    parameters: dict[str, Any],
    fit_part: FitPart,
) -> tuple[StoredModel, dict[str, Any]]:
    n_folds = count_folds(name, takes)[1]

    def learn(number: int, taught: Sequence[LabelledTake]) -> TakeModel:
        frames = stack_takes(taught)
        labeller = LABELLERS[name](np.random.default_rng(seed), rate=frames.rate, **parameters)
        part = WHOLE if number < 0 else f"fold {number + 1} of {n_folds}"
        return TakeModel(name, fit_part(part, labeller, frames), tuple(shapes))

    whole = learn(-1, takes)
    found, facts = _calibrate(name, takes, learn, {}, whole.classes, calibrated)
    return TakeModel(name, whole.labeller, whole.shapes, found.calibrator), facts


def _calibrate(
    name: str,
    takes: Sequence[LabelledTake],
    learn: Callable[[int, list[LabelledTake]], Any],
    automatic: Mapping[str, pd.DataFrame],
    classes: Sequence[str],
    calibrated: bool,
) -> tuple[CrossCalibration, dict[str, Any]]:
    def answer(model: StoredModel, take: LabelledTake) -> tuple[NDArray, NDArray]:
        return _answer(model, take, automatic)

    held_out, n_folds = count_folds(name, takes)
    how = {"held_out": held_out, "n_folds": n_folds}
    if not calibrated:
        return CrossCalibration(None), {"method": None, "why": "it was not asked for"}
    try:
        found = calibrate_answers(collect_fold_answers(takes, n_folds, learn, answer, classes), classes)
    except InputError as error:  # a fold that leaves one class, or none: the model itself stands all the same
        found = CrossCalibration(None, {"method": None, "why": str(error)})
    return found, {**how, **found.facts}


def _just_fit(_: str, labeller: FrameLabeller, frames: LabelledFrames) -> FrameLabeller:
    labeller.fit(frames.X, frames.y, frames.groups, signers=frames.signers if len(set(frames.signers)) > 1 else None)
    return labeller
