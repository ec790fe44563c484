"""Which frame belongs to which take, and a guard that no take is on both sides of a split.

Neighbouring frames of one take are near copies of each other. A labeller that is tested on frames whose neighbours it
was trained on is tested on what it has seen, so takes are the least that a split may part.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError

__all__ = ["check_no_take_is_split", "find_takes", "hold_out_takes", "split_takes", "take_splits"]


def check_no_take_is_split(groups_train: ArrayLike, groups_test: ArrayLike) -> None:
    """Refuse a split with frames of one take (or of one signer, if those are the groups) on both sides.

    Parameters
    ----------
    groups_train, groups_test
        The take of each frame to train on, and to test on.

    Raises
    ------
    InputError
        If a take is on both sides; the message names it.
    """
    both = sorted({str(name) for name in _names(groups_train)} & {str(name) for name in _names(groups_test)})
    if both:
        more = f" and {len(both) - 3} more" if len(both) > 3 else ""
        raise InputError(
            f"split: expected all frames of a take on one side, but {', '.join(both[:3])}{more} "
            "has frames to train on and frames to test on; split by take (GroupKFold)"
        )


def find_takes(groups: ArrayLike | None, n_frames: int) -> list[tuple[Any, slice]]:
    """Find where each take's frames are.

    Parameters
    ----------
    groups
        ``(n_frames,)``: the take of each frame, the frames of a take together and in order of time. ``None``: all
        frames are of one take.
    n_frames
        Number of frames.

    Returns
    -------
    Name and frames of each take, in order.

    Raises
    ------
    InputError
        If there is not one name per frame, or the frames of a take are in several places.
    """
    if groups is None:
        return [(0, slice(0, n_frames))]
    names = _names(groups)
    if len(names) != n_frames:
        raise InputError(f"groups: expected the take of each of the {n_frames} frames, but got {len(names)}")
    if not n_frames:
        return []
    starts = np.flatnonzero(np.concatenate(([True], names[1:] != names[:-1])))
    ends = np.append(starts[1:], n_frames)
    takes = [(names[start], slice(int(start), int(end))) for start, end in zip(starts, ends, strict=True)]
    seen: set[Any] = set()
    for name, frames in takes:
        if name in seen:
            raise InputError(
                f"groups: expected the frames of a take together and in order of time, "
                f"but {name!s} comes again at frame {frames.start}"
            )
        seen.add(name)
    return takes


def hold_out_takes(groups: Sequence[Any], share: float, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Choose at random which of some sequences to keep from training; those of one group go together.

    Parameters
    ----------
    groups
        The group of each *sequence*.
    share
        Part of the groups that is held out, between 0 and 1; at least one group, and never all.

    Returns
    -------
    Positions of the sequences to train on, and of those held out (none where there is one group only).
    """
    if not 0 < share < 1:
        raise InputError(f"held out share: expected a number between 0 and 1, but got {share}")
    places = np.unique(np.asarray([str(group) for group in groups]), return_inverse=True)[1]
    n_groups = int(places.max()) + 1 if len(places) else 0
    if n_groups < 2:
        return np.arange(len(places)), np.zeros(0, dtype=np.int64)
    n_out = min(max(1, round(share * n_groups)), n_groups - 1)
    out = np.isin(places, rng.permutation(n_groups)[:n_out])
    check_no_take_is_split(places[~out], places[out])
    return np.flatnonzero(~out), np.flatnonzero(out)


def split_takes(groups: Sequence[Any], n_folds: int, rng: np.random.Generator) -> list[tuple[NDArray, NDArray]]:
    """Split sequences for cross-fitting: each is in exactly one test part, those of one group in the same.

    Parameters
    ----------
    groups
        The group of each *sequence*.
    n_folds
        Number of folds, at least 2; as many as there are groups if there are fewer.

    Returns
    -------
    Positions of the sequences to train on and to test on, fold by fold; no fold where there is one group only.
    """
    if n_folds < 2:
        raise InputError(f"n_folds: expected at least 2, but got {n_folds}")
    places = np.unique(np.asarray([str(group) for group in groups]), return_inverse=True)[1]
    n_groups = int(places.max()) + 1 if len(places) else 0
    if n_groups < 2:
        return []
    fold = rng.permutation(n_groups) % min(n_folds, n_groups)
    splits = []
    for number in range(min(n_folds, n_groups)):
        test = fold[places] == number
        check_no_take_is_split(places[~test], places[test])
        splits.append((np.flatnonzero(~test), np.flatnonzero(test)))
    return splits


def take_splits(
    groups: ArrayLike, n_folds: int, rng: np.random.Generator, signers: ArrayLike | None = None
) -> list[tuple[NDArray, NDArray]]:
    """Split *frames* so that no take (or no signer) is on both sides; for the `cv` of scikit-learn's searches.

    Parameters
    ----------
    groups
        ``(n_frames,)`` the take of each frame.
    n_folds
        Number of folds, at least 2, and at most the number of takes, or of signers where they are given.
    rng
        Deals takes, or signers, into folds.
    signers
        ``(n_frames,)`` the signer of each frame; whole signers are then kept together.

    Returns
    -------
    Positions of the frames to train on and to test on, fold by fold, each in order of time.

    Raises
    ------
    InputError
        If there are fewer takes, or signers, than folds, or the frames of a take are in several places.
    """
    names = _names(groups)
    takes = find_takes(names, len(names))
    units = [name for name, _ in takes]
    if signers is not None:
        people = _names(signers)
        if len(people) != len(names):
            raise InputError(f"signers: expected one per frame ({len(names)}), but got {len(people)}")
        units = [people[frames.start] for _, frames in takes]
    n_units = len({str(unit) for unit in units})
    if n_units < n_folds:
        what = "takes" if signers is None else "signers"
        raise InputError(f"n_folds: expected at most as many as there are {what} ({n_units}), but got {n_folds}")
    splits = []
    for train, test in split_takes(units, n_folds, rng):
        sides = [
            np.concatenate([np.arange(takes[i][1].start, takes[i][1].stop) for i in side]) for side in (train, test)
        ]
        check_no_take_is_split(names[sides[0]], names[sides[1]])
        splits.append((sides[0], sides[1]))
    return splits


def _names(groups: ArrayLike) -> NDArray:
    names = np.asarray(groups)
    if names.ndim != 1:
        raise InputError(f"groups: expected one take per frame, but got an array of shape {names.shape}")
    return names
