"""Scores of a labeller on takes that it has not learned from: per frame, and per segment with its borders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ...errors import InputError
from ..evaluation.intervals import accuracy_of, macro_f1_of
from ..labelled_take import LabelledTake
from ..scores.bootstrap import bootstrap_interval
from ..scores.segment_metrics import edit_score, pool_f1, segmental_f1
from .base import FrameLabeller
from .frames import frame_labels
from .take_tiers import find_take_segments

__all__ = ["score_takes"]

OVERLAPS = {"f1_10": 0.10, "f1_25": 0.25, "f1_50": 0.50}


def score_takes(
    labeller: FrameLabeller, takes: Sequence[LabelledTake], *, rng: np.random.Generator, n_draws: int = 1000
) -> pd.DataFrame:
    """Score a fitted labeller; all transitions are one class.

    Returns
    -------
    One row, or none where no frame of the takes is annotated: ``segmentation`` ("own"), ``n_takes``, ``n_segments``
    (annotated ones), ``seconds``, ``accuracy`` and ``macro_f1`` per annotated frame, segmental ``f1_10, f1_25, f1_50``,
    ``edit`` (mean over takes), each with ``_low`` and ``_high`` (95 %, bootstrap over takes), ``majority`` and
    ``chance``.
    """
    known = [str(name) for name in labeller.classes_]
    pairs = []
    for take in takes:
        truth = frame_labels(take)
        if take.weights is None or not np.isfinite(take.weights).all(axis=1).any():
            continue
        found = np.full(take.n_frames, None, dtype=object)
        for row in find_take_segments(labeller, take.weights)[0].itertuples():
            found[row.onset : row.offset] = row.label
        if any(label is not None for label in truth):
            pairs.append((truth, found, take.rate))
    if not pairs:
        return pd.DataFrame()
    classes = sorted({*known, *(str(label) for truth, _, _ in pairs for label in truth if label is not None)})
    place = {name: index for index, name in enumerate(classes)}
    units: list[dict[str, Any]] = []
    for truth, found, rate in pairs:
        asked = np.array([a is not None and b is not None for a, b in zip(truth, found, strict=True)], dtype=bool)
        counts = np.zeros((len(classes), len(classes)))
        cells = [np.array([place[str(label)] for label in some[asked]], dtype=np.int64) for some in (truth, found)]
        np.add.at(counts, tuple(cells), 1.0)
        units.append(
            {
                "counts": counts,
                "edit": edit_score(truth, found),
                "seconds": float(sum(label is not None for label in truth) / rate),
                **{name: segmental_f1(truth, found, overlap) for name, overlap in OVERLAPS.items()},
            }
        )
    total = np.sum([unit["counts"] for unit in units], axis=0)
    if not total.sum():
        raise InputError("takes: expected annotated frames with weights to score, but there are none")
    record: dict[str, Any] = {
        "segmentation": "own",
        "n_takes": len(units),
        "n_segments": int(sum(unit["f1_50"].n_reference for unit in units)),
        "seconds": sum(unit["seconds"] for unit in units),
    }
    scores: dict[str, Callable[[Sequence[dict[str, Any]]], float]] = {
        "accuracy": lambda some: accuracy_of(np.sum([unit["counts"] for unit in some], axis=0)),
        "macro_f1": lambda some: macro_f1_of(np.sum([unit["counts"] for unit in some], axis=0)),
        **{name: _pool(name) for name in OVERLAPS},
        "edit": lambda some: float(np.nanmean([unit["edit"] for unit in some])),
    }
    for name, score in scores.items():
        value, low, high = bootstrap_interval(units, score, rng, n=n_draws)
        record |= {name: value, f"{name}_low": low, f"{name}_high": high}
    record |= {"majority": float(total.sum(axis=1).max() / total.sum()), "chance": 1 / len(known)}
    return pd.DataFrame([record])


def _pool(name: str) -> Callable[[Sequence[dict[str, Any]]], float]:
    return lambda some: float(pool_f1([unit[name] for unit in some]))
