"""Labellers on signers whom they never saw: each fold of signers is labelled by what the others taught.

Each labeller learns from the takes of all folds but one and labels the takes of that one, so every take is labelled
once, by a labeller that knows nobody in it. Transitions are one class. The scores are those of :mod:`.rater_scores`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..labellers import LABELLERS, LabelledFrames, MergingLabeller, NetworkLabeller, PerFrameLabeller
from ..labellers import check_no_take_is_split as check_split
from ..scores.rater_scores import MERGING, PER_FRAME, TEMPORAL

__all__ = ["check_classes", "deal_signers", "is_network", "kind_of", "train_labeller"]


def kind_of(name: str) -> str:
    """Return whether a labeller looks at single frames, merges these, or looks at the sequence."""
    labeller = _make(name, 0, 200.0)
    if isinstance(labeller, MergingLabeller):
        return MERGING
    return PER_FRAME if type(labeller) is PerFrameLabeller else TEMPORAL


def is_network(name: str) -> bool:
    """Return whether a labeller needs PyTorch."""
    return isinstance(_make(name, 0, 200.0), NetworkLabeller)


def deal_signers(signers: Sequence[str], n_folds: int, rng: np.random.Generator) -> list[tuple[str, ...]]:
    """Deal signers into folds at random, so evenly that no fold has two more than another.

    Raises
    ------
    InputError
        If there are fewer than two signers or folds, or more folds than signers.
    """
    names = sorted(set(signers))
    if len(names) < 2:
        raise InputError(
            f"labellers: expected takes of at least two signers, but all are of {', '.join(names) or 'nobody'}; "
            "record more people, or evaluate per signer with --protocol reverdy2019"
        )
    if not 2 <= n_folds <= len(names):
        raise InputError(f"folds: expected from 2 to the number of signers, {len(names)}, but got {n_folds}")
    dealt = rng.permutation(len(names))
    return [tuple(sorted(names[place] for place in dealt[fold::n_folds])) for fold in range(n_folds)]


def check_classes(frames: LabelledFrames, train: NDArray[np.bool_], test: NDArray[np.bool_], whom: str) -> str:
    """Return which classes a fold tests that it cannot learn, as a sentence; empty where all can be learned.

    Raises
    ------
    InputError
        If nothing is labelled on one side, or fewer than two classes are there to learn from.
    """
    learned, asked = ({label for label in frames.y[side] if label is not None} for side in (train, test))
    if not asked:
        raise InputError(f"{whom}: expected labelled frames to test on, but there are none")
    if len(learned) < 2:
        what = f"only {next(iter(learned))!r}" if learned else "none"
        raise InputError(f"{whom}: expected at least two classes to learn from the others, but got {what}")
    unknown = sorted(asked - learned)
    return f"{whom}: {', '.join(map(repr, unknown))} is tested, but nobody else shows it" if unknown else ""


def train_labeller(
    frames: LabelledFrames, name: str, train: NDArray[np.bool_], seed: Sequence[int] | int, **parameters: Any
) -> tuple[Any, Callable[[NDArray[np.bool_]], NDArray[np.object_]]]:
    """Train a labeller on some of the frames.

    Parameters
    ----------
    frames
        Of :func:`~.labellers.stack_takes`.
    name, parameters
        Of :data:`~.labellers.LABELLERS`.
    train
        ``(n_frames,)`` mask; whole signers.
    seed
        Of the labeller.

    Returns
    -------
    The fitted labeller, and a function from a mask of frames to their labels. It refuses frames of signers whom the
    labeller learned from.
    """
    labeller = _make(name, seed, frames.rate, **parameters)
    labeller.fit(frames.X[train], frames.y[train], frames.groups[train], signers=frames.signers[train])

    def predict(test: NDArray[np.bool_]) -> NDArray[np.object_]:
        check_split(frames.signers[train], frames.signers[test])
        labels: NDArray[np.object_] = labeller.predict(frames.X[test], frames.groups[test]).astype(object)
        return labels

    return labeller, predict


def _make(name: str, seed: Sequence[int] | int, rate: float, **more: Any) -> Any:
    if name not in LABELLERS:
        raise InputError(f"labeller: expected one of {', '.join(LABELLERS)}, but got {name!r}")
    return LABELLERS[name](np.random.default_rng(seed), rate=rate, **more)
