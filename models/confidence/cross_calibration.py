"""Calibration inside training: what a method answers about takes that it was not shown, and the correction from that.

The training takes are dealt into folds, by signer where there are several, else by take. For each fold the method
learns from the others and labels the fold's segments. From these answers comes the calibrator of the model that learns
from all takes. Its own scores are measured once more with one signer (or take) left out of the *calibrator's* fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..labelled_take import LabelledTake, find_transitions
from ..scores.calibration_metrics import brier_score, expected_calibration_error, log_loss
from .calibration import Calibrator, align_columns, calibrate

__all__ = ["CrossCalibration", "FoldAnswers", "calibrate_answers", "collect_fold_answers", "deal_folds"]

FEWEST = 20
"""Segments that a correction is learned from at least."""
FEWEST_PER_CLASS = 10
"""Segments of each class that one curve a class is learned from; a single temperature makes do with one."""


@dataclass(frozen=True)
class FoldAnswers:
    """Segments of held-out takes: ``probabilities`` (n_segments, n_classes), ``references``, ``units`` (n_segments,).

    ``left_out`` counts segments of classes that their fold had nothing to learn from.
    """

    probabilities: NDArray[np.float64]
    references: NDArray[np.object_]
    units: NDArray[np.object_]
    left_out: int


@dataclass(frozen=True)
class CrossCalibration:
    """A calibrator, or ``None`` with the reason in ``facts["why"]``; ``facts`` are JSON values, for people."""

    calibrator: Calibrator | None
    facts: Mapping[str, Any] = field(default_factory=dict)


def deal_folds(units: Sequence[str], classes: Sequence[Iterable[str]], n_folds: int) -> list[list[int]]:
    """Deal units into folds so that what is in a fold is, as far as possible, also in another.

    Parameters
    ----------
    units
        Names; equal names go together (the takes of one signer, say).
    classes
        What each holds.
    n_folds
        At least 2; fewer where there are fewer units.

    Returns
    -------
    Positions in `units`, fold by fold. Units with rare classes are dealt first, each into the fold that has least of
    its classes, of equals the emptiest.
    """
    if n_folds < 2:
        raise InputError(f"n_folds: expected at least 2, but got {n_folds}")
    names = list(dict.fromkeys(units))
    held: dict[str, set[str]] = {name: set() for name in names}
    for name, own in zip(units, classes, strict=True):
        held[name] |= {str(label) for label in own}
    frequency: dict[str, int] = {}
    for own in held.values():
        for label in own:
            frequency[label] = frequency.get(label, 0) + 1
    rarest = {name: min((frequency[label] for label in held[name]), default=0) for name in names}
    folds: list[list[str]] = [[] for _ in range(min(n_folds, len(names)))]
    for name in sorted(names, key=lambda name: (rarest[name], names.index(name))):

        def cost(fold: list[str], name: str = name) -> tuple[float, int]:
            shared = sum(1 / frequency[label] for other in fold for label in held[name] & held[other])
            return shared, len(fold)

        min(folds, key=cost).append(name)
    return [[place for place, name in enumerate(units) if name in fold] for fold in folds]


def collect_fold_answers(
    takes: Sequence[LabelledTake],
    n_folds: int,
    learn: Callable[[int, list[LabelledTake]], Any],
    answer: Callable[[Any, LabelledTake], tuple[NDArray, NDArray]],
    classes: Sequence[str],
) -> FoldAnswers:
    """Let a method label each take after learning from the other folds.

    Parameters
    ----------
    takes
        All that there is to learn from; of one signer folds are of takes, else of signers.
    n_folds
        At least 2.
    learn
        Called with the number of the fold and the takes of the others; returns a model with ``classes``.
    answer
        Called with a model and a take; returns probabilities ``(n_segments, n_model_classes)`` and what the segments
        really are ``(n_segments,)``, ``None`` where nobody knows.
    classes
        Order of the columns.

    Raises
    ------
    InputError
        If there is one take only, or a fold leaves nothing to learn from.
    """
    units = _units(takes)
    if len(set(units)) < 2:
        raise InputError("there is one take only")
    held = [set(take.segments["label"][~find_transitions(take.segments)].astype(str)) for take in takes]
    parts: list[tuple[NDArray, list[Any], list[str]]] = []
    left_out = 0
    for number, places in enumerate(deal_folds(units, held, n_folds)):
        model = learn(number, [take for place, take in enumerate(takes) if place not in places])
        for place in places:
            probabilities, references = answer(model, takes[place])
            if not len(references):
                continue
            rows = align_columns(probabilities, model.classes, classes)
            known = np.array([name is not None for name in references], dtype=bool)
            known &= np.isfinite(rows).all(axis=1)
            learned = np.isin(references.astype(str), list(model.classes))
            left_out += int((known & ~learned).sum())
            kept = known & learned
            parts.append((rows[kept], references[kept].tolist(), [units[place]] * int(kept.sum())))
    return FoldAnswers(
        probabilities=np.concatenate([np.zeros((0, len(classes))), *(part[0] for part in parts)]),
        references=np.array([name for part in parts for name in part[1]], dtype=object),
        units=np.array([unit for part in parts for unit in part[2]], dtype=object),
        left_out=left_out,
    )


def calibrate_answers(answers: FoldAnswers, classes: Sequence[str]) -> CrossCalibration:
    """Fit the calibrator, and score the answers before and after it.

    Returns
    -------
    The calibrator and ``facts``: ``method, n_segments, n_units, left_out, accuracy`` and ``ece, brier, log_loss``, each
    also with ``_calibrated``, by calibrators that did not see the unit. Without a calibrator ``method`` is ``None`` and
    ``why`` says why: fewer than 20 segments, or a class that no held-out segment had.
    """
    references = answers.references.astype(str)
    counts = {name: int((references == name).sum()) for name in classes}
    facts: dict[str, Any] = {
        "method": None,
        "n_segments": len(references),
        "n_units": len(set(answers.units)),
        "left_out": answers.left_out,
    }
    lacking = [name for name, count in counts.items() if not count]
    if len(references) < FEWEST:
        return CrossCalibration(None, facts | {"why": f"{len(references)} held-out segments are too few"})
    if lacking:
        return CrossCalibration(None, facts | {"why": f"no held-out segment was one of {', '.join(lacking)}"})
    if len(set(answers.units)) < 2:
        return CrossCalibration(None, facts | {"why": "all held-out segments are of one take or signer"})
    several = min(counts.values()) >= FEWEST_PER_CLASS
    fitted = calibrate(
        answers.probabilities,
        references,
        answers.units,
        classes=classes,
        method="best" if several else "temperature",
    )
    after = np.empty_like(answers.probabilities)
    for unit in set(answers.units):
        out = answers.units == unit
        other = calibrate(answers.probabilities[~out], references[~out], classes=classes, method=fitted.method)  # type: ignore[arg-type]
        after[out] = other.apply(answers.probabilities[out])
    right = np.array(classes)[answers.probabilities.argmax(axis=1)] == references
    facts |= {"method": fitted.method, "temperature": fitted.temperature, "accuracy": float(right.mean())}
    for suffix, values in (("", answers.probabilities), ("_calibrated", after)):
        facts[f"ece{suffix}"] = expected_calibration_error(values, references, classes)
        facts[f"brier{suffix}"] = brier_score(values, references, classes)
        facts[f"log_loss{suffix}"] = log_loss(values, references, classes)
    return CrossCalibration(fitted, facts)


def _units(takes: Sequence[LabelledTake]) -> list[str]:
    signers = [take.signer for take in takes]
    return signers if len(set(signers)) > 1 else [take.name for take in takes]
