"""Labellers of frames in time: classifiers with merging, hidden Markov chains, random fields, networks.

All follow scikit-learn (see :mod:`.base` for the conventions). ``LABELLERS[name](rng, rate=200.0)`` makes one with
its defaults; more keywords are its parameters. The networks need PyTorch, the others do not.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .base import FrameLabeller
from .durations import absorb_short_segments, best_segmentation
from .frames import (
    TRANSITION,
    LabelledFrames,
    fill_gaps,
    frame_labels,
    label_frames,
    segments_of_labels,
    stack_takes,
)
from .hidden_markov import HiddenMarkovLabeller
from .network_labeller import NetworkLabeller
from .network_training import Epoch
from .networks import has_torch
from .ordinal import OrdinalClassifier, score_degrees
from .per_frame import MergingLabeller, PerFrameLabeller
from .random_field import RandomFieldLabeller
from .takes import check_no_take_is_split, take_splits

__all__ = [
    "LABELLERS",
    "TRANSITION",
    "Epoch",
    "FrameLabeller",
    "HiddenMarkovLabeller",
    "LabelledFrames",
    "MergingLabeller",
    "NetworkLabeller",
    "OrdinalClassifier",
    "PerFrameLabeller",
    "RandomFieldLabeller",
    "absorb_short_segments",
    "best_segmentation",
    "check_no_take_is_split",
    "fill_gaps",
    "frame_labels",
    "has_torch",
    "label_frames",
    "score_degrees",
    "segments_of_labels",
    "stack_takes",
    "take_splits",
]


def _maker(kind: type[FrameLabeller], **fixed: Any) -> Callable[..., FrameLabeller]:
    def make(rng: np.random.Generator, **parameters: Any) -> FrameLabeller:
        return kind(**{**fixed, "random_state": int(rng.integers(2**31 - 1)), **parameters})

    return make


LABELLERS: dict[str, Callable[..., FrameLabeller]] = {
    "per-frame-forest": _maker(PerFrameLabeller, classifier="forest"),
    "per-frame-linear": _maker(PerFrameLabeller, classifier="linear"),
    "forest-merging": _maker(MergingLabeller, classifier="forest"),
    "linear-merging": _maker(MergingLabeller, classifier="linear"),
    "hmm": _maker(HiddenMarkovLabeller),
    "crf": _maker(RandomFieldLabeller),
    "lstm": _maker(NetworkLabeller, network="lstm"),
    "gru": _maker(NetworkLabeller, network="gru"),
    "tcn": _maker(NetworkLabeller, network="tcn", n_layers=6),
}
"""Name to ``make(rng, rate=…, **parameters)``."""
