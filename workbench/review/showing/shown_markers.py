"""Markers in the space of the rig that the weights move: those that the solve adapted to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ....corpus.store.view import CorpusView
from .shown_weights import ShownWeights

__all__ = ["ShownMarkers", "open_markers"]


@dataclass(frozen=True)
class ShownMarkers:
    """Names of markers, and their positions on disk."""

    names: tuple[str, ...]
    stored: xr.Dataset

    def read(self, first: int, count: int) -> NDArray[np.float64]:
        """Return (n, n_markers, 3) mm from frame ``first`` on, NaN where a marker is missing; n is less at the end."""
        values = self.stored["position"].isel(time=slice(first, first + count))
        found: NDArray[np.float64] = values.transpose("time", "marker", "space").values.astype(np.float64)
        return found


def open_markers(corpus: CorpusView, weights: ShownWeights) -> ShownMarkers | None:
    """Return the markers that the weights were solved from, in the rig's space; None where there are none.

    Weights that came from a file, or that move another rig than the one they were solved on, have none: nothing says
    how the signer's head stands in the rig.
    """
    step = f"adapted-{weights.solve}"
    if weights.rig != weights.stored.attrs.get("rig") or step not in corpus.steps(weights.take):
        return None
    stored = corpus.processed(weights.take, step)
    if "position" not in stored or stored.sizes["time"] != weights.n_frames:
        return None
    names = tuple(str(name) for name in stored["marker"].values)
    return ShownMarkers(names, stored) if names else None
