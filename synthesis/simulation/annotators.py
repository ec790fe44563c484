"""Two simulated annotators: what they take an expression for, and where they put boundaries."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .parameters import NEUTRAL, Parameters
from .protocols import Instance


def see_steps(
    instances: Sequence[Instance], parameters: Parameters, difficulty: str, *, rng: np.random.Generator
) -> tuple[list[str], list[float]]:
    """Return what one annotator takes each step for, and how strong they find it.

    An expression is taken for its neighbour where the neighbour's share passes a wavering threshold, and for neutral
    where it is too weak (degree 0 counts as neutral: Reverdy 2019, Table B.1).

    Returns
    -------
    labels, and perceived intensities (0 where taken for neutral).
    """
    setting, unseen = parameters.annotators, parameters.level(difficulty)["unseen_below"]
    labels, intensities = [], []
    for instance in instances:
        threshold = setting["confused_at"] + setting["confused_spread"] * rng.standard_normal()
        strength = instance.intensity + setting["intensity_spread"] * rng.standard_normal()
        if instance.affect == NEUTRAL or strength < unseen:
            labels.append(NEUTRAL)
            intensities.append(0.0)
        else:
            labels.append(instance.partner if instance.blend > threshold else instance.affect)
            intensities.append(strength)
    return labels, intensities


def keep_enough(
    performed: Sequence[Sequence[Instance]], seen: Sequence[list[str]], parameters: Parameters
) -> list[list[str]]:
    """Return the labels of one signer's takes of a protocol with no affect lost among its neighbours.

    At least a share of ``annotators.kept`` of each affect's steps keeps its label; the least blended ones first.
    """
    kept = [list(labels) for labels in seen]
    for affect in parameters.affects:
        places = [
            (instance.blend, take, step)
            for take, instances in enumerate(performed)
            for step, instance in enumerate(instances)
            if instance.affect == affect
        ]
        missing = int(np.ceil(parameters.annotators["kept"] * len(places))) - sum(
            kept[take][step] == affect for _, take, step in places
        )
        for _, take, step in sorted(p for p in places if kept[p[1]][p[2]] != affect)[: max(missing, 0)]:
            kept[take][step] = affect
    return kept


def seen_degrees(intensities: Sequence[float], labels: Sequence[str], parameters: Parameters) -> list[int]:
    """Return the degrees 0 to 3 that belong to perceived intensities; 0 where the label is neutral."""
    bounds = parameters.annotators["degree_bounds"]
    return [
        0 if label == NEUTRAL else 1 + int(np.searchsorted(bounds, x))
        for x, label in zip(intensities, labels, strict=True)
    ]


def shift_boundaries(
    bounds: NDArray[np.int64], spread: float, share: float, *, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Return boundaries as somebody else would set them.

    Parameters
    ----------
    bounds
        Rising frames; the first and the last, where the take begins and ends, stay.
    spread
        Standard deviation, frames.
    share
        A boundary moves at most this share (below a half) of its shorter neighbour, so that the order stays.
    """
    lengths = np.diff(bounds)
    limit = np.floor(share * np.minimum(lengths[:-1], lengths[1:]))
    moved = bounds.copy()
    moved[1:-1] += np.round(np.clip(spread * rng.standard_normal(len(limit)), -limit, limit)).astype(np.int64)
    return moved
