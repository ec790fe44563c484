"""The report's tables as HTML. Every text that comes from outside is escaped here."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from numbers import Integral, Real

import numpy as np
import pandas as pd

from ...synthesis.affect_colours import find_affects, find_label_colours

_NAMES = {
    "n_segments": "segments",
    "n_left_out": "left out",
    "n_markers": "markers",
    "n_frames": "frames",
    "frames_lost": "frames lost",
    "accuracy_duration": "accuracy by duration",
    "rate": "rate (Hz)",
    "seconds": "length (s)",
    "mean": "mean (mm)",
    "p95": "95th percentile (mm)",
    "max": "largest (mm)",
}
_SHARES = {"accuracy", "accuracy_duration", "majority", "majority_duration", "chance"}


def format_value(value: object, column: str = "") -> str:
    """Return a cell's text: shares in per cent, whole numbers whole, others with sensible digits, gaps as a dash."""
    if value is None or value is pd.NaT or (isinstance(value, Real) and np.isnan(float(value))):
        return "–"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, Integral):
        return f"{int(value)}"
    if isinstance(value, Real):
        number = float(value)
        if column in _SHARES:
            return f"{100 * number:.1f} %"
        if number.is_integer() and column != "seconds":
            return f"{int(number)}"
        return f"{number:.1f}" if column == "seconds" or abs(number) >= 100 else f"{number:.3g}"
    return str(value)


def _take_intervals(table: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, pd.DataFrame]]:
    """Take the ends of intervals out of a table: what is left, and ``low, high`` by the column that they belong to."""
    names = [str(c) for c in table.columns if {f"{c}_low", f"{c}_high"} <= set(table.columns)]
    ends = {name: table[[f"{name}_low", f"{name}_high"]].set_axis(["low", "high"], axis=1) for name in names}
    return table.drop(columns=[f"{name}_{end}" for name in names for end in ("low", "high")]), ends


def _bracket(intervals: Mapping[str, pd.DataFrame], column: str, row: int) -> str:
    if column not in intervals or intervals[column].iloc[row].isna().any():
        return ""
    low, high = (format_value(value, column).removesuffix(" %") for value in intervals[column].iloc[row])
    return f" [{low}, {high}]"


def make_table(table: pd.DataFrame, caption: str = "", fold_beyond: int = 24) -> str:
    """Return any table; a long one is folded away behind its caption (and unfolded on paper).

    Columns ``x_low`` and ``x_high`` beside ``x`` are its interval, in brackets behind the number.
    """
    table, intervals = _take_intervals(table)
    numeric = {str(c): _is_numeric(table.iloc[:, i]) for i, c in enumerate(table.columns)}
    head = "".join(
        f'<th scope="col"{_css(numeric[str(c)])}>{escape(_NAMES.get(str(c), str(c).replace("_", " ")))}</th>'
        for c in table.columns
    )
    rows = []
    for i, values in enumerate(table.itertuples(index=False, name=None)):
        cells = "".join(
            f"<td{_css(numeric[str(c)])}>{escape(format_value(v, str(c)) + _bracket(intervals, str(c), i))}</td>"
            for c, v in zip(table.columns, values, strict=True)
        )
        rows.append(f"<tr>{cells}</tr>")
    folded = len(table) > fold_beyond
    words = f"<caption>{escape(caption)}</caption>" if caption and not folded else ""
    html = (
        f'<div class="scroll"><table>{words}<thead><tr>{head}</tr></thead><tbody>\n'
        + "\n".join(rows)
        + "\n</tbody></table></div>"
    )
    if folded:
        return f"<details><summary>{escape(caption or 'Table')} ({len(table)} rows)</summary>{html}</details>"
    return html


def make_time_table(times: pd.DataFrame, caption: str) -> str:
    """Return Table B.1: seconds by row and column with both totals; label columns carry their colour."""
    table = times.astype(float).fillna(0.0)
    head = "".join(f'<th scope="col" class="number">{_swatch(str(c))}{escape(str(c))}</th>' for c in table.columns)
    rows = []
    for name, values in zip(table.index, table.to_numpy(), strict=True):
        rows.append(_time_row(str(name), values))
    rows.append(_time_row("all", table.to_numpy().sum(axis=0), css=' class="total"'))
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption><thead><tr><th></th>{head}'
        '<th scope="col" class="number">total</th></tr></thead><tbody>' + "\n".join(rows) + "</tbody></table></div>"
    )


def _time_row(name: str, values: np.ndarray, css: str = "") -> str:
    cells = "".join(f'<td class="number">{v:.1f}</td>' for v in values)
    return f'<tr{css}><th scope="row">{escape(name)}</th>{cells}<td class="number total">{values.sum():.1f}</td></tr>'


def make_confusion_table(counts: pd.DataFrame, title: str) -> str:
    """Return a confusion matrix: counts, shaded by their share of the reference's row."""
    head = "".join(f'<th scope="col">{escape(str(c))}</th>' for c in counts.columns)
    rows = []
    for name, values in zip(counts.index, counts.to_numpy(dtype=float), strict=True):
        total = values.sum()
        cells = "".join(f'<td style="--share: {v / total if total else 0:.3f}">{format_value(v)}</td>' for v in values)
        rows.append(f'<tr><th scope="row">{_swatch(str(name))}{escape(str(name))}</th>{cells}</tr>')
    return (
        f'<div class="scroll"><table class="matrix"><caption>{escape(title)}</caption>'
        f"<thead><tr><th></th>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def make_parameter_table(parameters: Mapping[str, object]) -> str:
    """Return names and values in two columns."""
    rows = "".join(
        f'<tr><th scope="row">{escape(str(k))}</th><td class="mono">{escape(format_value(v))}</td></tr>'
        for k, v in parameters.items()
    )
    return f'<div class="scroll"><table><tbody>{rows}</tbody></table></div>'


def _is_numeric(column: pd.Series) -> bool:
    return pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(column)


def _css(numeric: bool) -> str:
    return ' class="number"' if numeric else ""


def _swatch(label: str) -> str:
    if len(find_affects(label)) != 1:
        return ""
    return f'<span class="swatch" style="background:{find_label_colours(label)[0]}"></span>'
