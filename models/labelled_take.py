"""A take as the learners see it: weights over time, and what a person said about them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError

__all__ = ["LabelledTake", "check_segments", "find_covering_labels", "find_transitions"]


@dataclass(frozen=True)
class LabelledTake:
    """Weights and one reference tier of a take.

    Parameters
    ----------
    name, signer, protocol
        Which take it is; the protocol is a code such as IE, SE, IGE or EU.
    rate
        Frames per second, above 0.
    segments
        Reference tier: ``onset``, ``offset`` (half-open frames, without overlap) and ``label``. Transitions are told
        by :func:`find_transitions`. Frames that no segment covers are unlabelled.
    weights
        ``(n_frames, n_shapes)``, NaN in gaps; may be left out where only times are counted.
    n_frames
        Length of the take; taken from the weights where they are given.
    """

    name: str
    signer: str
    protocol: str
    rate: float
    segments: pd.DataFrame
    weights: NDArray[np.float64] | None = field(default=None, repr=False)
    n_frames: int = -1

    def __post_init__(self) -> None:
        if not np.isfinite(self.rate) or self.rate <= 0:
            raise InputError(f"take {self.name}: expected a frame rate in Hz above 0, but got {self.rate}")
        if self.weights is not None:
            weights = check_array(self.weights, name=f"take {self.name}, weights", shape=(None, None))
            object.__setattr__(self, "weights", weights)
            if self.n_frames not in (-1, len(weights)):
                raise InputError(
                    f"take {self.name}: expected {self.n_frames} frames of weights, but got {len(weights)}"
                )
            object.__setattr__(self, "n_frames", len(weights))
        if self.n_frames < 0:
            raise InputError(f"take {self.name}: expected weights or a number of frames, but got neither")
        object.__setattr__(self, "segments", check_segments(self.segments, self.n_frames, where=f"take {self.name}"))


def check_segments(segments: pd.DataFrame, n_frames: int, *, where: str = "segments") -> pd.DataFrame:
    """Return the table in order of time, or say which segment is outside the take, or overlaps another."""
    missing = [column for column in ("onset", "offset", "label") if column not in segments.columns]
    if missing:
        raise InputError(f"{where}: expected the columns onset, offset and label, but {', '.join(missing)} is missing")
    table = segments.sort_values("onset", kind="stable").reset_index(drop=True)
    onsets, offsets = table["onset"].to_numpy(dtype=np.int64), table["offset"].to_numpy(dtype=np.int64)
    wrong = np.flatnonzero((onsets < 0) | (offsets <= onsets) | (offsets > n_frames))
    if len(wrong):
        row = int(wrong[0])
        raise InputError(
            f"{where}: expected segments with 0 <= onset < offset <= {n_frames}, "
            f"but {table['label'][row]!r} is at [{onsets[row]}, {offsets[row]})"
        )
    overlapping = np.flatnonzero(onsets[1:] < offsets[:-1])
    if len(overlapping):
        row = int(overlapping[0])
        raise InputError(
            f"{where}: expected segments without overlap, but {table['label'][row]!r} at "
            f"[{onsets[row]}, {offsets[row]}) and {table['label'][row + 1]!r} at "
            f"[{onsets[row + 1]}, {offsets[row + 1]}) overlap"
        )
    return table


def find_transitions(segments: pd.DataFrame) -> NDArray[np.bool_]:
    """Which segments are transitions rather than held expressions.

    Told by the first of these columns that is there: ``is_transition`` (bool), ``from_label`` with ``to_label`` (both
    filled in, and not the same), ``kind`` (``"transition"``). A tier with none of them has no transitions. Where both
    the labels and the kind are there, either will do.
    """
    n_segments = len(segments)
    if "is_transition" in segments.columns:
        return segments["is_transition"].to_numpy(dtype=bool)
    found = np.zeros(n_segments, dtype=bool)
    if {"from_label", "to_label"} <= set(segments.columns):
        before = segments["from_label"].fillna("").astype(str).to_numpy()
        after = segments["to_label"].fillna("").astype(str).to_numpy()
        found |= (before != "") & (after != "") & (before != after)
    if "kind" in segments.columns:
        found |= (segments["kind"].fillna("").astype(str) == "transition").to_numpy()
    return found


def find_covering_labels(
    onsets: ArrayLike, offsets: ArrayLike, take: LabelledTake
) -> tuple[NDArray[np.object_], NDArray[np.bool_], NDArray[np.float64]]:
    """Find the reference of each interval: the label that covers most of its frames.

    Segments of one label inside the interval count together, and the frames that none covers count as "nothing", which
    can win too. Of equals the one that begins first wins, nothing last.

    Returns
    -------
    labels
        One label per interval, ``None`` where nothing wins.
    transitions
        Whether that label is a transition's.
    shares
        Part of the interval's frames that it covers, 0 to 1.
    """
    starts, ends = take.segments["onset"].to_numpy(), take.segments["offset"].to_numpy()
    names = take.segments["label"].astype(str).to_numpy()
    is_transition = find_transitions(take.segments)
    intervals = list(zip(np.asarray(onsets, dtype=np.int64), np.asarray(offsets, dtype=np.int64), strict=True))
    labels = np.full(len(intervals), None, dtype=object)
    transitions = np.zeros(len(intervals), dtype=bool)
    shares = np.zeros(len(intervals))
    for row, (onset, offset) in enumerate(intervals):
        overlap = np.minimum(ends, offset) - np.maximum(starts, onset)
        covered: dict[tuple[str, bool], int] = {}
        for index in np.flatnonzero(overlap > 0):
            key = (str(names[index]), bool(is_transition[index]))
            covered[key] = covered.get(key, 0) + int(overlap[index])
        n_nothing = int(offset - onset) - sum(covered.values())
        best = max(covered, key=lambda key: covered[key], default=None)
        if best is None or covered[best] < n_nothing:
            shares[row] = n_nothing / (offset - onset)
        else:
            labels[row], transitions[row] = best
            shares[row] = covered[best] / (offset - onset)
    return labels, transitions, shares
