"""Weights of a take on a rig of the corpus: the one they were solved on, or any other that shares shapes with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError, MimiqueError
from ...synthesis import Rig, ShapeMapping
from .shape_weights import read_shape_weights

TABLE_COLUMNS = ("from", "to", "gain")


@dataclass(frozen=True)
class RigWeights:
    """What moves a rig.

    Parameters
    ----------
    solve, rig_name
        Names in the corpus.
    rig
        The rig.
    weights
        (n_frames, n_shapes) of the rig's shapes, NaN where nothing is known.
    rate
        Hz.
    mapping
        How they came from the shapes that were solved; None where these are the rig's.
    """

    solve: str
    rig_name: str
    rig: Rig
    weights: NDArray[np.float64]
    rate: float
    mapping: ShapeMapping | None = None


def read_rig_weights(
    corpus: CorpusView,
    take: str,
    *,
    solve: str | None = None,
    rig: str | None = None,
    table: pd.DataFrame | None = None,
) -> RigWeights:
    """Read the weights of a take as weights of a rig.

    Parameters
    ----------
    corpus, take
        What to read.
    solve
        Which weights; the take's current ones if left out.
    rig
        Name of the rig; if left out the one that was solved on or, for weights that came from elsewhere, the corpus's
        only rig.
    table
        Of :meth:`mimique.synthesis.ShapeMapping.fit`, where names differ.

    Raises
    ------
    NotFoundError
        If take, weights or rig are not there.
    InputError
        If there are several rigs to choose from, or the shapes have nothing in common.
    """
    which = solve or corpus.current_solve(take)
    stored = read_shape_weights(corpus, take, which)
    names = [str(shape) for shape in stored["shape"].values]
    values = stored["weights"].values.astype(np.float64)
    rig_name = rig or stored.attrs.get("rig") or _choose_only_rig(corpus, take)
    found = Rig.from_dataset(corpus.rig(rig_name))
    rate = float(stored.attrs["rate"])
    if tuple(names) == found.shapes and table is None:
        return RigWeights(str(which), str(rig_name), found, values, rate)
    try:
        mapping = ShapeMapping.fit(names, found.shapes, table)
    except MimiqueError as error:
        raise type(error)(f"take {take!r} on rig {rig_name!r}: {error}") from error
    return RigWeights(str(which), str(rig_name), found, mapping.apply(values), rate, mapping)


def read_shape_table(path: Path) -> pd.DataFrame:
    """Read a table of shapes, ``from,to,gain`` as CSV; the gain is 1 where it is left out.

    Raises
    ------
    InputError
        If it cannot be read, or a column is not there.
    """
    try:
        table = pd.read_csv(path, dtype={"from": str, "to": str}, keep_default_na=False, comment="#")
    except (OSError, UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
        raise InputError(f"{path}: the table of shapes cannot be read ({str(error).splitlines()[0]})") from error
    if not {"from", "to"} <= set(table.columns):
        raise InputError(f"{path}: expected the columns {','.join(TABLE_COLUMNS)}, but got {','.join(table.columns)}")
    return table


def _choose_only_rig(corpus: CorpusView, take: str) -> str:
    rigs = corpus.rigs()
    if not rigs:
        raise InputError("the corpus has no rig yet; run: mimique rig add CORPUS NAME PATH")
    if len(rigs) > 1:
        raise InputError(
            f"take {take!r}: its weights were solved elsewhere; choose a rig of {', '.join(rigs)} with --rig"
        )
    return str(rigs[0])
