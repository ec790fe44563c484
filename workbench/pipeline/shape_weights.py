"""The weights of a take that move a face: without the angles of head and eyes that some trackers write beside them."""

from __future__ import annotations

import xarray as xr

from ...corpus.store.view import CorpusView

__all__ = ["read_shape_weights"]


def read_shape_weights(corpus: CorpusView, take: str, solve: str | None = None) -> xr.Dataset:
    """Return ``weights (time, shape)`` of one solve, or of the current one, of shapes alone; read when they are used.

    What the attribute ``angles`` names (Live Link Face: nine angles in radians) are no shapes.

    Raises
    ------
    NotFoundError
        As :meth:`mimique.corpus.Corpus.weights`.
    """
    stored = corpus.weights(take, solve)
    angles = set(stored.attrs.get("angles") or ())
    kept = [place for place, name in enumerate(stored["shape"].values) if str(name) not in angles]
    return stored if len(kept) == stored.sizes["shape"] else stored.isel(shape=kept)
