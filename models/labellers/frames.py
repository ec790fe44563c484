"""From labelled takes to frames that a labeller learns from, and from its answers back to a tier.

Classes. A tier holds stable affects and transitions, each transition with its own name (``NA``: neutral to anger). As
classes there are three ways to take them: ``"single"``, all transitions are one class (:data:`TRANSITION`), whose two
sides are known from its neighbours once all is labelled; ``"named"``, each name is a class; ``"gap"``, transitions are
left out, as in Reverdy 2019.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ...arrays import check_array
from ...errors import InputError
from ...features.derivatives import find_runs
from ..labelled_take import LabelledTake, find_transitions

__all__ = [
    "TRANSITION",
    "LabelledFrames",
    "fill_gaps",
    "frame_labels",
    "label_frames",
    "segments_of_labels",
    "stack_takes",
]

TRANSITION = "transition"
"""The one class of all transitions."""

Transitions = Literal["single", "named", "gap"]


@dataclass(frozen=True)
class LabelledFrames:
    """Frames of several takes of one rate, one take after the other.

    ``X`` (n_frames, n_shapes) weights, ``y`` (n_frames,) labels or ``None``, ``groups`` (n_frames,) names of takes,
    ``signers`` (n_frames,), ``rate`` in Hz.
    """

    X: NDArray[np.float64]
    y: NDArray[np.object_]
    groups: NDArray[np.object_]
    signers: NDArray[np.object_]
    rate: float


def stack_takes(takes: Sequence[LabelledTake], transitions: Transitions = "single") -> LabelledFrames:
    """Join takes into the arrays that labellers are fitted to.

    Frames in gaps of the weights are filled from their neighbours and have no label. A take without a single whole
    frame is left out.

    Raises
    ------
    InputError
        If there is no take, one has no weights, two have the same name, or rates or numbers of shapes differ.
    """
    if not takes:
        raise InputError("takes: expected at least one labelled take, but got none")
    names = [take.name for take in takes]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"takes: expected different names, but {', '.join(twice)} comes twice")
    bare = [take.name for take in takes if take.weights is None]
    if bare:
        raise InputError(f"takes: expected weights, but {', '.join(bare[:5])} has none; solve first")
    for what, kinds in (
        ("frame rate", {take.rate for take in takes}),
        ("number of shapes", {take.weights.shape[1] for take in takes if take.weights is not None}),
    ):
        if len(kinds) > 1:
            raise InputError(f"takes: expected one {what}, but got {', '.join(f'{kind:g}' for kind in sorted(kinds))}")
    whole = [take for take in takes if np.isfinite(take.weights).all(axis=1).any()]  # type: ignore[arg-type]
    if not whole:
        raise InputError("takes: expected weights without gaps somewhere, but every frame has NaN")
    parts = []
    for take in whole:
        labels = frame_labels(take, transitions)
        values, missing = fill_gaps(take.weights)  # type: ignore[arg-type]
        labels[missing] = None
        parts.append((values, labels))
    lengths = [len(labels) for _, labels in parts]
    return LabelledFrames(
        X=np.concatenate([values for values, _ in parts]),
        y=np.concatenate([labels for _, labels in parts]),
        groups=np.repeat(np.array([take.name for take in whole], dtype=object), lengths),
        signers=np.repeat(np.array([take.signer for take in whole], dtype=object), lengths),
        rate=takes[0].rate,
    )


def frame_labels(take: LabelledTake, transitions: Transitions = "single") -> NDArray[np.object_]:
    """Label of each frame of a take's tier, ``(n_frames,)``; ``None`` where it has none."""
    if transitions not in ("single", "named", "gap"):
        raise InputError(f"transitions: expected single, named or gap, but got {transitions!r}")
    labels = np.full(take.n_frames, None, dtype=object)
    table = take.segments
    moving = find_transitions(table)
    for onset, offset, label, is_moving in zip(table["onset"], table["offset"], table["label"], moving, strict=True):
        if is_moving and transitions != "named":
            labels[onset:offset] = TRANSITION if transitions == "single" else None
        else:
            labels[onset:offset] = str(label)
    return labels


def fill_gaps(weights: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Fill frames with NaN by straight lines from their neighbours, and say which they are.

    Raises
    ------
    InputError
        If every frame has a NaN.
    """
    values = check_array(weights, name="weights", shape=(None, None))
    missing: NDArray[np.bool_] = ~np.isfinite(values).all(axis=1)
    if not missing.any():
        return values, missing
    present = np.flatnonzero(~missing)
    if not len(present):
        raise InputError("weights: expected at least one frame without NaN, but every frame has one")
    places = np.arange(len(values))
    filled = np.column_stack([np.interp(places, present, curve[present]) for curve in values.T])
    return filled, missing


def label_frames(labeller: Any, weights: ArrayLike) -> tuple[NDArray[np.object_], NDArray[np.float64]]:
    """Label a take with a fitted labeller; gaps of the weights get no label.

    Returns
    -------
    labels
        ``(n_frames,)``, ``None`` in gaps.
    probabilities
        ``(n_frames, n_classes)`` in the order of ``labeller.classes_``, NaN in gaps.
    """
    values, missing = fill_gaps(weights)
    labels = labeller.predict(values).astype(object)
    probabilities = labeller.predict_proba(values)
    labels[missing] = None
    probabilities[missing] = np.nan
    return labels, probabilities


def segments_of_labels(
    labels: Sequence[Any] | NDArray, probabilities: ArrayLike | None = None, classes: Sequence[Any] | None = None
) -> pd.DataFrame:
    """Merge equal neighbours into a tier.

    Parameters
    ----------
    labels
        ``(n_frames,)``, ``None`` for nothing.
    probabilities, classes
        Of :func:`label_frames`, for the confidences.

    Returns
    -------
    Table with ``onset``, ``offset`` (int64, half-open), ``label``, ``kind`` (``stable`` or ``transition``),
    ``confidence`` (mean probability of the label over its frames, NaN without probabilities), ``from_label`` and
    ``to_label``: the stable neighbours that touch a transition, both empty where one is missing or they are the same.
    """
    names = np.asarray(labels, dtype=object)
    present = np.array([name is not None for name in names], dtype=bool)
    scores = None if probabilities is None else np.asarray(probabilities, dtype=float)
    if scores is not None and (classes is None or scores.shape != (len(names), len(classes))):
        raise InputError("probabilities: expected one row per frame and one column per class")
    column = {str(name): place for place, name in enumerate(classes if classes is not None else ())}
    rows: list[dict[str, Any]] = []
    for onset, offset in find_runs(present):
        own = names[onset:offset]
        borders = [onset, *(onset + 1 + np.flatnonzero(own[1:] != own[:-1])).tolist(), offset]
        for first, last in pairwise(borders):
            label = str(names[first])
            rows.append(
                {
                    "onset": first,
                    "offset": last,
                    "label": label,
                    "kind": "transition" if label == TRANSITION else "stable",
                    "confidence": float(scores[first:last, column[label]].mean()) if scores is not None else np.nan,
                    "from_label": "",
                    "to_label": "",
                }
            )
    for before, row, after in zip(rows, rows[1:], rows[2:], strict=False):
        touching = before["offset"] == row["onset"] and row["offset"] == after["onset"]
        if row["kind"] == "transition" and touching and before["label"] != after["label"]:
            row["from_label"], row["to_label"] = before["label"], after["label"]
    kinds = {"onset": "int64", "offset": "int64", "label": "str", "kind": "str", "confidence": "float64"}
    kinds |= {"from_label": "str", "to_label": "str"}
    return pd.DataFrame({key: pd.Series([row[key] for row in rows], dtype=kind) for key, kind in kinds.items()})
