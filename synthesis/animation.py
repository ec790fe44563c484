"""A rig over time, ``V = C·B`` (Reverdy 2019, 5.2 and 5.3), a few frames at once.

Ten minutes at 200 Hz of 11 000 vertices are 16 GB; a block of frames is a few megabytes. What writes or measures
meshes goes through :class:`Animation` and never holds them all.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ..arrays import check_array
from ..errors import InputError, RigError
from .rig import Rig

BLOCK_NUMBERS = 1 << 20
"""Coordinates in a block of frames: 4 MB in single precision."""

SPARSE_BELOW = 0.1
"""Part of the deltas that is not zero up to which few frames at once are faster with a sparse matrix (measured)."""

SPARSE_FRAMES = 4
"""So many frames are few: with more, the dense product reads its matrix once for all of them and wins."""


class Frames(Protocol):
    """Weights that can be read a part at a time: an array, or anything that is sliced like one."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(n_frames, n_shapes)."""

    def __getitem__(self, part: Any) -> Any:
        """Return some frames."""

    def __len__(self) -> int:
        """Return the number of frames."""


class Animation:
    """Meshes of a rig for weights over time.

    Computed in single precision, with the dense or the sparse product, whichever suits the rig and the number of
    frames.

    Parameters
    ----------
    rig
        The face.
    dense
        Which product, for all numbers of frames; chosen if left out.
    """

    def __init__(self, rig: Rig, *, dense: bool | None = None) -> None:
        self.rig = rig
        self._neutral = rig.neutral.astype(np.float32).ravel()
        flat = rig.deltas.reshape(rig.n_shapes, -1).astype(np.float32)
        self.density = float(np.count_nonzero(flat) / max(flat.size, 1))
        few = self.density <= SPARSE_BELOW
        self._sparse_up_to = (SPARSE_FRAMES if few else 0) if dense is None else 0 if dense else np.inf
        self._dense = flat
        self._sparse = sparse.csr_array(flat.T) if self._sparse_up_to else None

    @property
    def block_frames(self) -> int:
        """Frames of a block of :meth:`blocks` unless it is told otherwise."""
        return max(BLOCK_NUMBERS // (3 * self.rig.n_vertices), 1)

    def positions(self, weights: ArrayLike) -> NDArray[np.float32]:
        """Return the meshes for (n_frames, n_shapes) weights: (n_frames, n_vertices, 3), mm; NaN where a weight is."""
        values = check_array(weights, name="weights", shape=(None, None), dtype=np.float32)
        if values.shape[1] != self.rig.n_shapes:
            raise RigError(f"weights: expected {self.rig.n_shapes} columns, one a shape, but got {values.shape[1]}")
        known = np.isfinite(values)
        values = np.where(known, values, 0)
        if self._sparse is not None and len(values) <= self._sparse_up_to:
            meshes = np.ascontiguousarray((self._sparse @ values.T).T)
        else:
            meshes = values @ self._dense
        meshes += self._neutral
        meshes[~known.all(axis=1)] = np.nan
        return np.asarray(meshes.reshape(len(values), -1, 3))

    def blocks(self, weights: Frames, frames: int | None = None) -> Iterator[tuple[int, NDArray[np.float32]]]:
        """Yield the first frame of a block and its meshes, in order.

        Parameters
        ----------
        weights
            (n_frames, n_shapes), read block by block.
        frames
            Number of frames of a block.
        """
        for first, values in weight_blocks(weights, frames or self.block_frames):
            yield first, self.positions(values)


def weight_blocks(weights: Frames, frames: int = 4096) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Yield the first frame and a copy of the (≤ frames, n_shapes) weights of one block after the other."""
    for first in range(0, len(weights), frames):
        yield first, np.array(weights[first : first + frames], dtype=np.float64)


def check_weights(rig: Rig, weights: Frames, rate: float) -> None:
    """Refuse weights that are not the rig's, no frames at all, weights that are infinite, and an impossible rate.

    Raises
    ------
    RigError, InputError
        What is wrong, and in which frame.
    """
    if len(weights.shape) != 2 or weights.shape[1] != rig.n_shapes:
        raise RigError(f"weights: expected {rig.n_shapes} columns, one a shape, but got shape {tuple(weights.shape)}")
    if not len(weights):
        raise InputError("weights: expected at least one frame, but got none; there is nothing to write")
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(f"rate: expected a positive number of frames per second, but got {rate}")
    for first, values in weight_blocks(weights):
        wrong = np.argwhere(np.isinf(values) | (np.abs(values) > np.finfo(np.float32).max))
        if len(wrong):
            frame, column = (int(i) for i in wrong[0])
            raise InputError(
                f"weights, frame {first + frame}, shape {rig.shapes[column]!r}: expected a number of single precision, "
                f"but got {values[frame, column]}"
            )


def find_missing(weights: Frames) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the frames in which a weight is not known, as intervals, and which columns are never known.

    Files of animations have no way to say that a weight is missing. What mimique writes shows the neutral in such
    frames, as its player does, and notes them where the format lets it; a column that is known nowhere is 0 and does
    not count.

    Returns
    -------
    (n_intervals, 2) onset and offset, half-open, and (n_shapes,).
    """
    never = np.ones(weights.shape[1], dtype=bool)
    for _, values in weight_blocks(weights):
        never &= np.isnan(values).all(axis=0)
    missing = np.zeros(len(weights) + 2, dtype=bool)
    for first, values in weight_blocks(weights):
        wrong = np.isnan(values[:, ~never]).any(axis=1) | bool(never.all())
        missing[1 + first : 1 + first + len(values)] = wrong
    borders = np.flatnonzero(missing[1:] != missing[:-1])
    return borders.reshape(-1, 2), never


def fill_missing(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a block of weights with 0 in the frames that lack one; see :func:`find_missing` for its columns."""
    return np.where(np.isnan(values).any(axis=1, keepdims=True), 0.0, values)


class ResampledWeights:
    """Weights at another rate, computed where they are read: linear between the two frames around.

    A frame is NaN where either of its two is; the last is the last that the old frames reach.

    Parameters
    ----------
    weights
        (n_frames, n_shapes).
    rate, new_rate
        Hz.
    """

    def __init__(self, weights: Frames, rate: float, new_rate: float) -> None:
        if not (np.isfinite(new_rate) and new_rate > 0):
            raise InputError(f"rate: expected a positive number of frames per second, but got {new_rate}")
        self._weights, self._step = weights, rate / new_rate
        n_frames = int(np.floor((len(weights) - 1) / self._step + 1e-9)) + 1 if len(weights) else 0
        self.shape: tuple[int, ...] = (n_frames, weights.shape[1])

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, part: slice) -> NDArray[np.float64]:
        """Return the frames of a slice."""
        frames = np.arange(*part.indices(len(self)))
        if not len(frames):
            return np.empty((0, self.shape[1]))
        place = frames * self._step
        below = np.minimum(np.floor(place + 1e-9).astype(np.int64), len(self._weights) - 1)
        above = np.minimum(below + 1, len(self._weights) - 1)
        base = int(below.min())
        source = np.asarray(self._weights[base : int(above.max()) + 1], dtype=np.float64)
        after = np.clip(place - below, 0, 1)[:, None]
        after[np.abs(after) < 1e-9] = 0
        # What has no share is not read: a missing frame must not spread to one that lies exactly on a known one.
        mixed = np.where(after > 0, source[above - base], 0.0) * after + source[below - base] * (1 - after)
        return np.asarray(mixed)
