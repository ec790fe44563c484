"""The segments that classifiers are tested on, with their references (Reverdy 2019, 4.5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...features.descriptors import mean_weights
from ...features.segmentation import measure_joint_restlessness, segment
from ..labelled_take import LabelledTake, find_covering_labels, find_transitions

__all__ = ["SEGMENTATIONS", "TestedSegments", "collect_tested_segments", "cut_takes"]

SEGMENTATIONS = ("manual", "automatic")


@dataclass(frozen=True)
class TestedSegments:
    """Segments of one signer to be labelled, and how many were left out."""

    segments: pd.DataFrame
    means: NDArray[np.float64]
    left_out: dict[str, int]


def cut_takes(takes: Sequence[LabelledTake], own: Sequence[LabelledTake]) -> dict[str, pd.DataFrame]:
    """Cut takes by their motion, with the restlessness that all of the signer's own takes show together."""
    if not takes:
        return {}
    restlessness = measure_joint_restlessness((take.weights, take.rate) for take in own if take.weights is not None)
    return {take.name: segment(take.weights, take.rate, restlessness=restlessness) for take in takes}  # type: ignore[arg-type]


def collect_tested_segments(
    takes: Sequence[LabelledTake], segmentation: str, automatic: Mapping[str, pd.DataFrame]
) -> TestedSegments:
    """Segments with a stable reference and their mean weights."""
    tables: list[pd.DataFrame] = []
    means: list[NDArray[np.float64]] = []
    left_out = {"left_out_transition": 0, "left_out_unlabelled": 0, "left_out_missing": 0}
    for take in takes:
        if segmentation == "manual":
            pieces = take.segments[["onset", "offset"]]
            labels = take.segments["label"].astype(str).to_numpy(dtype=object)
            moving = find_transitions(take.segments)
            shares = np.ones(len(pieces))
        else:
            pieces = automatic[take.name][["onset", "offset"]].reset_index(drop=True)
            labels, moving, shares = find_covering_labels(pieces["onset"], pieces["offset"], take)
        described = mean_weights(take.weights, pieces)  # type: ignore[arg-type]
        unlabelled = np.array([label is None for label in labels], dtype=bool)
        missing = ~np.isfinite(described).all(axis=1) & ~moving & ~unlabelled
        left_out["left_out_transition"] += int(moving.sum())
        left_out["left_out_unlabelled"] += int(unlabelled.sum())
        left_out["left_out_missing"] += int(missing.sum())
        kept = ~(moving | unlabelled | missing)
        tables.append(
            pieces[kept].assign(
                take=take.name,
                seconds=(pieces["offset"] - pieces["onset"])[kept] / take.rate,
                reference=labels[kept],
                share=shares[kept],
            )
        )
        means.append(described[kept])
    if not tables:
        return TestedSegments(pd.DataFrame(), np.zeros((0, 0)), left_out)
    return TestedSegments(pd.concat(tables, ignore_index=True), np.concatenate(means), left_out)
