"""Tables that come with mimique for :class:`.ShapeMapping` between rigs whose shapes have no name in common."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources

import pandas as pd

from ..errors import NotFoundError
from .arkit import arkit_name, match_shapes

SHAPE_TABLES = ("arkit-to-makehuman",)
"""Their names. They are drawn up by hand, from what the shapes look like, and not measured."""


def read_named_table(name: str) -> pd.DataFrame:
    """Return one of :data:`SHAPE_TABLES`: ``from, to, gain``.

    Raises
    ------
    NotFoundError
        If there is none of that name.
    """
    if name not in SHAPE_TABLES:
        raise NotFoundError(f"shapes: no table {name!r} comes with mimique; there is {', '.join(SHAPE_TABLES)}")
    file = resources.files(__package__).joinpath("shape_tables", f"{name}.csv")
    with file.open("r", encoding="utf-8") as stream:
        return pd.read_csv(stream, comment="#", dtype={"from": str, "to": str})


def fit_table(table: pd.DataFrame, source: Sequence[str], target: Sequence[str]) -> pd.DataFrame:
    """Return a table's rows in the spelling of two rigs.

    A shape is found by its own name, else by its ARKit name; halves of it (``browInnerUp_L``, ``_R``) share its gain.
    Rows whose shapes one of the rigs does not have are left out.

    Parameters
    ----------
    table
        Columns ``from``, ``to``, ``gain``.
    source, target
        Names of the shapes of the two rigs.
    """
    rows = []
    for driver, driven, gain in zip(table["from"], table["to"], table["gain"], strict=True):
        to = match_shapes([driven], target)[0]
        same = [driver] if driver in source else [name for name in source if arkit_name(name) == driver]
        if to is not None:
            rows += [(name, target[to], gain / len(same)) for name in same]
    return pd.DataFrame(rows, columns=["from", "to", "gain"])
