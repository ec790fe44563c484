"""A draft's tier as a table, as the corpus keeps it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pandas as pd

from ....corpus.versions.segment_rows import Columns, Row, join_table

__all__ = ["fit_columns", "make_table"]


def make_table(columns: Columns, rows: Iterable[Row]) -> pd.DataFrame:
    """Return the table of rows, with every column that some row fills, in types that can hold what is missing."""
    rows = list(rows)
    return join_table(fit_columns(columns, rows), rows)


def fit_columns(columns: Columns, rows: Iterable[Row]) -> Columns:
    """Return the columns that rows need: those given, then what edits brought (``parents``, ``from_label``)."""
    rows = list(rows)
    known = dict(columns)
    fitted: dict[str, Any] = {}
    for name in dict.fromkeys((*known, *(name for row in rows for name in row))):
        values = [row.get(name) for row in rows]
        spelled = known.get(name)
        if spelled is None:
            spelled = "str" if all(value is None or isinstance(value, str) for value in values) else "object"
        elif isinstance(spelled, str) and spelled.startswith(("int", "uint", "bool")) and None in values:
            spelled = "object"
        elif isinstance(spelled, (list, tuple)) and not {v for v in values if v is not None} <= set(spelled[0]):
            spelled = "object"  # a category that no label of the draft was
        fitted[name] = spelled
    return tuple(fitted.items())
