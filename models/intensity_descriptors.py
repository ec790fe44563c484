"""How strong a held expression is, in numbers that mean the same for every signer and every affect.

A degree of intensity (Reverdy 2019, 4.3.2: 1 weak, 2 moderate, 3 strong) is a relation: strong is what is strong for
this face. With a segment's mean weights w (4.6) and the signer's resting weights n, the *reach* a = w − n has a length
and a direction â = a/‖a‖. The signer's other frames tell how far this face goes in that direction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from ..features.descriptors import mean_weights
from .labelled_take import LabelledTake

__all__ = ["DESCRIPTORS", "describe_reach", "find_rest"]

DESCRIPTORS = ("reach", "share", "spread")
REST_QUANTILE = 0.2
"""Of each shape's weights over all of a signer's frames: faces rest, or nearly so, for a fifth of the time."""
FAR_QUANTILE = 0.99
"""Of the signer's frames along a direction: how far this face goes, short of single wild frames."""
N_FRAMES = 4000
"""Frames of a signer that are looked at, evenly spaced: more say the same again."""


def find_rest(frames: ArrayLike) -> NDArray[np.float64]:
    """Resting weights ``(n_shapes,)`` of a signer, from frames ``(n_frames, n_shapes)``; NaN frames are left out."""
    values = check_array(frames, name="frames", shape=(None, None))
    present = values[np.isfinite(values).all(axis=1)]
    if not len(present):
        raise InputError("intensity: expected frames with weights, but every one has NaN")
    return np.quantile(present, REST_QUANTILE, axis=0)


def describe_reach(segments: pd.DataFrame, take: LabelledTake, own: Sequence[LabelledTake]) -> NDArray[np.float64]:
    """Describe segments of one take by how far they go.

    Parameters
    ----------
    segments
        ``onset``, ``offset`` in frames of the take.
    take
        With weights.
    own
        All takes of the same signer with weights, this one among them; their labels are not looked at.

    Returns
    -------
    ``(n_segments, 3)``, the columns of :data:`DESCRIPTORS`: ``reach`` is ln Σ|a| over all; ``share`` is ‖a‖ over
    how far the signer goes along â, about 1 for the strongest that this face shows of this expression; ``spread`` is
    Σ|a|/‖a‖, which grows with the number of shapes at work. NaN where a segment has no frame without gaps, or does not
    differ from rest.
    """
    if take.weights is None or any(one.weights is None for one in own):
        raise InputError(f"take {take.name}: expected weights of the signer's takes; solve first")
    joined = np.concatenate([one.weights for one in own if one.weights is not None])
    joined = joined[np.isfinite(joined).all(axis=1)]
    joined = joined[:: max(1, len(joined) // N_FRAMES)]
    rest = find_rest(joined)
    reach = mean_weights(take.weights, segments[["onset", "offset"]]) - rest
    length = np.linalg.norm(reach, axis=1)
    total = np.abs(reach).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        direction = reach / length[:, None]
        far = np.quantile((joined - rest) @ direction.T, FAR_QUANTILE, axis=0)
        found = np.column_stack([np.log(total), length / far, total / length])
    found[~np.isfinite(found).all(axis=1) | ~(length > 0)] = np.nan
    return found
