"""Weights of a take on the rig that they move, read in the part that is asked for.

The same numbers as :func:`mimique.workbench.pipeline.rig_weights.read_rig_weights` gives, but a long take is never read
whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ....corpus.store.view import CorpusView
from ....errors import InputError, MimiqueError
from ....synthesis import ShapeMapping
from ..server.errors import Refusal
from .made_files import make_key

__all__ = ["BLOCK", "ShownWeights", "open_weights"]

BLOCK = 1 << 14
"""Frames that are held in memory at once where a whole take is gone through."""


@dataclass(frozen=True)
class ShownWeights:
    """What moves a rig, on disk; make one with :func:`open_weights`.

    Parameters
    ----------
    take, solve, rig
        Names.
    shapes
        Of the rig, in its order.
    rate
        Hz.
    n_frames
        Frames of the take.
    key
        Fingerprint of the weights on this rig.
    stored
        The dataset as stored, unread.
    kept
        Columns of it that are weights: the angles of head and eyes that Live Link Face adds are none.
    mapping
        From these columns to the rig's shapes; None where they are the rig's shapes.
    """

    take: str
    solve: str
    rig: str
    shapes: tuple[str, ...]
    rate: float
    n_frames: int
    key: str
    stored: xr.Dataset
    kept: NDArray[np.intp]
    mapping: ShapeMapping | None

    def read(self, first: int, count: int) -> NDArray[np.float64]:
        """Return (n, n_shapes) weights from frame ``first`` on, NaN where nothing is known; n is less at the end."""
        # All columns are read before some are chosen: they share their chunks.
        block = self.stored["weights"].isel(time=slice(first, first + count)).values
        values = block[:, self.kept].astype(np.float64)
        return values if self.mapping is None else self.mapping.apply(values)

    def read_blocks(self, size: int = BLOCK) -> Iterator[tuple[int, NDArray[np.float64]]]:
        """Return all weights a block at a time, each with its first frame."""
        for first in range(0, self.n_frames, size):
            yield first, self.read(first, size)

    def read_shape(self, shape: str) -> NDArray[np.float32]:
        """Return (n_frames,) one shape's weights."""
        place = self.shapes.index(shape)
        found = np.empty(self.n_frames, dtype=np.float32)
        for first, block in self.read_blocks():
            found[first : first + len(block)] = block[:, place]
        return found

    def read_residual(self) -> NDArray[np.float64] | None:
        """Return (n_frames,) the markers' root mean square residual, mm; None where none was stored."""
        if "residual" not in self.stored:
            return None
        values: NDArray[np.float64] = self.stored["residual"].values.astype(np.float64)
        return values


def open_weights(corpus: CorpusView, take: str, solve: str | None = None) -> ShownWeights:
    """Find the weights of a take and the rig that they move, without reading them.

    Parameters
    ----------
    corpus, take
        What to show.
    solve
        Which weights; the take's current ones if left out.

    Raises
    ------
    NotFoundError
        If take, solve or rig are not there.
    Refusal
        If the take has no weights.
    InputError
        If it is not known which rig they move, or they share no shape with it.
    """
    which = solve or corpus.current_solve(take)
    if which is None:
        raise Refusal(404, "no-weights", f"take {take!r} has no weights yet; run: mimique solve CORPUS")
    stored = corpus.weights(take, which)
    angles = set(stored.attrs.get("angles") or ())
    names = [str(name) for name in stored["shape"].values]
    kept = np.array([place for place, name in enumerate(names) if name not in angles], dtype=np.intp)
    solved = tuple(names[place] for place in kept)
    rig = str(stored.attrs.get("rig") or _find_rig(corpus, take, solved))
    shapes = tuple(str(name) for name in corpus.rig(rig)["shape"].values)
    mapping = None
    if solved != shapes:
        try:
            mapping = ShapeMapping.fit(solved, shapes)
        except MimiqueError as error:
            raise InputError(f"take {take!r} on rig {rig!r}: {error}") from error
    return ShownWeights(
        take=take,
        solve=which,
        rig=rig,
        shapes=shapes,
        rate=float(stored.attrs["rate"]),
        n_frames=int(stored.sizes["time"]),
        key=make_key(weights=corpus.fingerprint(take, "weights", which), shapes=shapes),
        stored=stored,
        kept=kept,
        mapping=mapping,
    )


def _find_rig(corpus: CorpusView, take: str, solved: tuple[str, ...]) -> str:
    """Return the rig on which most of the weights move something, the first by name of equals."""
    rigs = corpus.rigs()
    if not rigs:
        raise InputError("the corpus has no rig yet; run: mimique rig add CORPUS NAME PATH")
    used = {rig: _count_used(solved, [str(name) for name in corpus.rig(rig)["shape"].values]) for rig in rigs}
    best = min(rigs, key=lambda rig: (-used[rig], rig))
    if not used[best]:
        raise InputError(
            f"take {take!r}: its weights came from elsewhere, and none of the rigs {', '.join(rigs)} has their shapes; "
            "add a rig that has"
        )
    return str(best)


def _count_used(solved: tuple[str, ...], shapes: list[str]) -> int:
    try:
        mapping = ShapeMapping.fit(solved, shapes)
    except MimiqueError:
        return 0
    return len(solved) - len(mapping.unused)
