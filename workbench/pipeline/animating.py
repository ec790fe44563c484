"""Animations that go out of a corpus: a take's weights on a rig, as glTF, USD or a sequence of OBJ files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError
from ...synthesis.animation import Frames, ResampledWeights, find_missing
from ...synthesis.shape_tables import SHAPE_TABLES, fit_table, read_named_table
from ..progress import Reporter
from .rig_colours import find_colours
from .rig_weights import RigWeights, read_rig_weights, read_shape_table

ANIMATION_SUFFIXES = (".glb", ".usda", ".usdc", ".usd", "")
"""Suffixes of animations, in lower case; a name without one is a folder of OBJ files."""


def write_animation(
    corpus: CorpusView,
    take: str,
    path: Path,
    *,
    solve: str | None = None,
    rig: str | None = None,
    shapes: str | None = None,
    rate: float | None = None,
    reporter: Reporter | None = None,
) -> str:
    """Write a take's weights on a rig as an animation; the suffix says in which format.

    Parameters
    ----------
    corpus, take
        What to write.
    path
        ``.glb``, ``.usda``, ``.usdc``, or a folder for a sequence of OBJ files.
    solve
        Which weights; the take's current ones if left out.
    rig
        The face, see :func:`.rig_weights.read_rig_weights`.
    shapes
        A CSV table ``from,to,gain``, or the name of one that comes with mimique, where the rig's names are others.
    rate
        Frames per second of the file; the take's own if left out.
    reporter
        Told how far a long sequence is.

    Returns
    -------
    What was written, and a line for each thing to know: frames without weights, shapes that move nothing.

    Raises
    ------
    MimiqueError
        If the take, weights, rig or table are not there or do not fit together, or the file cannot be written.
    """
    found = choose_weights(corpus, take, solve=solve, rig=rig, shapes=shapes)
    frames, fps = resample(found, rate)
    suffix = path.suffix.lower()
    if path.is_dir() or suffix == "":
        from ...synthesis.obj_sequence import write_obj_sequence

        with (reporter or Reporter()).stage(f"Writing {take}", len(frames)) as finished:
            write_obj_sequence(path, found.rig, frames, fps, name=take, progress=lambda done, of: finished(""))
    elif suffix == ".glb":
        from ...synthesis.gltf_writing import write_gltf

        write_gltf(path, found.rig, frames, fps, name=take, colours=find_colours(found.rig))
    else:
        from ...synthesis.usd_writing import write_usd

        write_usd(path, found.rig, frames, fps, colours=find_colours(found.rig))
    head = f"{path}: {len(frames)} frames at {fps:g} Hz, {found.rig.n_shapes} shapes of rig {found.rig_name}"
    return "\n".join([head, *(f"  {note}" for note in _describe_losses(found, frames))])


def choose_weights(
    corpus: CorpusView, take: str, *, solve: str | None = None, rig: str | None = None, shapes: str | None = None
) -> RigWeights:
    """Read a take's weights on a rig, by a table of shapes that is a file or one of mimique's own.

    Raises
    ------
    MimiqueError
        If the take, weights, rig or table are not there or do not fit together.
    """
    if shapes is None:
        return read_rig_weights(corpus, take, solve=solve, rig=rig)
    return read_rig_weights(
        corpus, take, solve=solve, rig=rig, table=_read_table(corpus, take, solve=solve, rig=rig, shapes=shapes)
    )


def resample(found: RigWeights, rate: float | None) -> tuple[Frames, float]:
    """Return the weights at a rate, their own if it is left out, and that rate."""
    if rate is None or rate == found.rate:
        return found.weights, found.rate
    return ResampledWeights(found.weights, found.rate, rate), float(rate)


def make_weights(found: RigWeights, rate: float | None, stored: xr.Dataset) -> xr.Dataset:
    """Return weights on a rig as the dataset that a weights file is written from."""
    frames, fps = resample(found, rate)
    values: NDArray[np.float64] = np.asarray(frames[0 : len(frames)], dtype=np.float64)
    start = float(stored["time"].values[0]) if stored.sizes["time"] else 0.0
    time = stored["time"].values if frames is found.weights else start + np.arange(len(values)) / fps
    return xr.Dataset(
        {"weights": (("time", "shape"), values.astype(np.float32))},
        {"time": ("time", time, {"units": "s"}), "shape": list(found.rig.shapes)},
        {**stored.attrs, "rate": fps, "rig": found.rig_name},
    )


def _read_table(corpus: CorpusView, take: str, *, solve: str | None, rig: str | None, shapes: str) -> pd.DataFrame:
    if Path(shapes).is_file() or shapes not in SHAPE_TABLES:
        if not Path(shapes).is_file():
            raise InputError(
                f"{shapes}: there is no such table of shapes; give a CSV file with the columns from,to,gain, "
                f"or one of {', '.join(SHAPE_TABLES)}"
            )
        return read_shape_table(Path(shapes))
    stored = corpus.weights(take, solve)
    name = rig or stored.attrs.get("rig")
    listed = corpus.rigs()
    if name is None and len(listed) == 1:
        name = listed[0]
    if name is None:
        raise InputError(f"take {take!r}: choose the rig that the table is for with --rig out of {', '.join(listed)}")
    target = [str(shape) for shape in corpus.rig(str(name))["shape"].values]
    source = [str(shape) for shape in stored["shape"].values]
    table = fit_table(read_named_table(shapes), source, target)
    if table.empty:
        raise InputError(f"{shapes}: none of its shapes is one of take {take!r} and of rig {name!r}")
    return table


def _describe_losses(found: RigWeights, frames: Frames) -> list[str]:
    """Say what of the take the animation does not show."""
    notes = []
    lost, never = find_missing(frames)
    if len(lost):
        count = int((lost[:, 1] - lost[:, 0]).sum())
        notes.append(f"{count} frames without weights show the neutral")
    unknown = [name for name, nothing in zip(found.rig.shapes, never, strict=True) if nothing]
    if unknown:
        notes.append(f"never known, and at rest: {_some(unknown)}")
    if found.mapping is not None:
        if found.mapping.unused:
            notes.append(f"move nothing on this rig: {_some(found.mapping.unused)}")
        if found.mapping.still:
            notes.append(f"nothing drives, and at rest: {_some(found.mapping.still)}")
    return notes


def _some(names: tuple[str, ...] | list[str]) -> str:
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
