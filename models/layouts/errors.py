"""How far a synthesised face is from the true one (Reverdy 2019, 3.3.2), overall and by region.

Three numbers, with three names that are never exchanged. For N frames and P vertices, ``e_np = ‖v_np − v̂_np‖`` in mm:

- ``rmse_published = √(1/N Σ_n Σ_p e_np²)``, the thesis's RMSE as printed (3.5): divided by the frames, not by the
  vertices, so it grows with ``√P`` and compares only meshes, or regions, with the same number of vertices;
- ``rmse_mm = rmse_published/√P``, the usual root mean square;
- ``mean_mm = 1/(NP) Σ_n Σ_p e_np``, the mean distance of a vertex from where it should be.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import check_array
from ...errors import InputError
from ...synthesis import Rig

Array = NDArray[np.floating[Any]]
Index = NDArray[np.int64]

__all__ = ["WHOLE", "VertexErrors", "measure_vertex_errors", "measure_weight_errors"]

WHOLE = "all"
"""Name under which the errors over all measured vertices stand."""
BLOCK = 4_000_000
"""Coordinates that are at work at a time."""


@dataclass(frozen=True)
class VertexErrors:
    """Errors over frames and some vertices; NaN where there is no frame or no vertex.

    Parameters
    ----------
    n_frames, n_left_out
        Frames that were measured, and frames that were not because what was made, or the truth, has a NaN there.
    n_vertices
        How many vertices were measured.
    rmse_published
        (3.5) as printed, mm: divided by the frames alone.
    rmse_mm
        Root mean square distance, mm.
    mean_mm
        Mean distance, mm.
    """

    n_frames: int
    n_left_out: int
    n_vertices: int
    rmse_published: float
    rmse_mm: float
    mean_mm: float


def measure_vertex_errors(
    true: ArrayLike,
    made: ArrayLike,
    *,
    vertices: ArrayLike | None = None,
    regions: Mapping[str, ArrayLike] | None = None,
) -> dict[str, VertexErrors]:
    """Compare positions, or displacements, of vertices.

    Parameters
    ----------
    true, made
        (n_frames, n_vertices, 3), mm. A frame with a NaN in either is left out of every region, and counted.
    vertices
        (n_vertices,) the rig's numbers of these vertices; 0, 1, 2 … by default.
    regions
        Name to vertex numbers of the rig; those that were not given are passed over.

    Returns
    -------
    Errors over all vertices under ``all``, then of each region.

    Raises
    ------
    InputError
        If the shapes differ, vertices repeat, or a region is named ``all``.
    """
    truth = check_array(true, name="true positions", shape=(None, None, 3))
    found = check_array(made, name="made positions", shape=truth.shape)
    places = _places(_numbers(vertices, truth.shape[1], "vertices"), regions)
    if len(places[WHOLE]) != truth.shape[1]:
        raise InputError(f"vertices: expected {truth.shape[1]}, as many as positions, but got {len(places[WHOLE])}")
    usable = np.isfinite(truth).all(axis=(1, 2)) & np.isfinite(found).all(axis=(1, 2))

    def blocks() -> Iterator[Array]:
        for part in _parts(np.flatnonzero(usable), truth.shape[1]):
            yield found[part] - truth[part]

    return _accumulate(blocks(), places, int(usable.sum()), int((~usable).sum()))


def measure_weight_errors(
    rig: Rig,
    true: ArrayLike,
    made: ArrayLike,
    *,
    vertices: ArrayLike | None = None,
    regions: Mapping[str, ArrayLike] | None = None,
) -> dict[str, VertexErrors]:
    """Compare the meshes that two sequences of weights make of one rig, without keeping the meshes.

    Parameters
    ----------
    rig
        The face that both move; its neutral does not matter.
    true, made
        (n_frames, n_shapes) weights. A frame with a NaN in either is left out, and counted.
    vertices
        Numbers of the vertices to measure; all by default, as in the thesis.
    regions
        Name to vertex numbers; vertices that are not measured are passed over.

    Returns
    -------
    As :func:`measure_vertex_errors`.
    """
    truth = check_array(true, name="true weights", shape=(None, rig.n_shapes))
    found = check_array(made, name="made weights", shape=truth.shape)
    chosen = _numbers(vertices, rig.n_vertices, "vertices", rig.n_vertices)
    usable = np.isfinite(truth).all(axis=1) & np.isfinite(found).all(axis=1)
    deltas = rig.deltas[:, chosen].reshape(rig.n_shapes, -1)

    def blocks() -> Iterator[Array]:
        for part in _parts(np.flatnonzero(usable), len(chosen)):
            yield ((found[part] - truth[part]) @ deltas).reshape(len(part), len(chosen), 3)

    return _accumulate(blocks(), _places(chosen, regions), int(usable.sum()), int((~usable).sum()))


def _numbers(vertices: ArrayLike | None, count: int, name: str, limit: int | None = None) -> Index:
    """Vertex numbers, each once and, with a limit, below it."""
    if vertices is None:
        return np.arange(count)
    numbers = check_array(vertices, name=name, shape=(None,), dtype=np.int64)
    if len(np.unique(numbers)) != len(numbers):
        raise InputError(f"{name}: expected every vertex once, but some repeat")
    if limit is not None and numbers.size and not 0 <= numbers.min() <= numbers.max() < limit:
        raise InputError(f"{name}: expected numbers from 0 to {limit - 1}, but got {numbers.min()} to {numbers.max()}")
    return numbers


def _places(vertices: Index, regions: Mapping[str, ArrayLike] | None) -> dict[str, Index]:
    """Where, among the measured vertices, those of each region stand."""
    if regions is not None and WHOLE in regions:
        raise InputError(f"regions: {WHOLE!r} is the name of the whole; call the region otherwise")
    places: dict[str, Index] = {WHOLE: np.arange(len(vertices))}
    for name, members in (regions or {}).items():
        numbers = _numbers(members, 0, f"region {name}")
        places[str(name)] = np.flatnonzero(np.isin(vertices, numbers))
    return places


def _parts(frames: Index, n_vertices: int) -> list[Index]:
    step = max(1, BLOCK // max(1, 3 * n_vertices))
    return [frames[start : start + step] for start in range(0, len(frames), step)]


def _accumulate(
    blocks: Iterator[Array], places: dict[str, Index], n_frames: int, n_left_out: int
) -> dict[str, VertexErrors]:
    """Sum squared distances and distances over frames, vertex by vertex, then over each region."""
    n_vertices = len(places[WHOLE])
    squares, distances = np.zeros((2, n_vertices))
    for difference in blocks:
        squared = np.einsum("npd,npd->np", difference, difference)
        squares += squared.sum(axis=0)
        distances += np.sqrt(squared).sum(axis=0)
    out = {}
    for name, members in places.items():
        published = rmse = mean = np.nan
        if n_frames and len(members):
            published = float(np.sqrt(squares[members].sum() / n_frames))
            rmse = published / float(np.sqrt(len(members)))
            mean = float(distances[members].sum() / (n_frames * len(members)))
        out[name] = VertexErrors(n_frames, n_left_out, len(members), published, rmse, mean)
    return out
