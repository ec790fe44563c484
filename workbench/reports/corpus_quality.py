"""The report's section on quality: what was found, and where which marker is missing, take by take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import pandas as pd

from .tables import format_value

LEVELS = (0.0, 0.002, 0.01, 0.05, 0.2, 0.5, 1.0)
"""Shares of frames at which the shade deepens."""

CELL, ROW, GAP = 15, 16, 2
"""Pixels of the picture, before it is scaled to the page."""

LABEL, NAMES = 132, 104
"""Pixels beside the rows and above the columns for the names."""

FAULT_COLUMNS = ("spikes", "jumps", "swaps")
MOST_FINDINGS = 12
"""Findings that are shown at once; the rest unfolds."""

_NAMES = {"error": "errors", "warning": "warnings", "note": "notes"}


@dataclass(frozen=True)
class Quality:
    """What the section shows.

    Parameters
    ----------
    findings
        One row a finding: ``take, where, what, severity`` (error, warning, note), ``onset`` (frame, -1 for none),
        ``advice``; the gravest first.
    markers
        One row per take and marker: ``take, marker, missing`` (share), ``longest_gap_s, spikes, jumps, swaps``.
    """

    findings: pd.DataFrame
    markers: pd.DataFrame


def make_quality_summary(quality: Quality) -> str:
    """Return how much was found, a sentence."""
    counts = quality.findings["severity"].value_counts()
    badges = "".join(
        f'<span class="severity {severity}">{int(counts.get(severity, 0))} '
        f"{severity if counts.get(severity, 0) == 1 else _NAMES[severity]}</span>"
        for severity in _NAMES
    )
    n_takes = quality.markers["take"].nunique()
    n_clean = n_takes - quality.findings.loc[quality.findings["severity"] != "note", "take"].nunique()
    clean = f"{n_clean} of {n_takes} takes have neither errors nor warnings."
    return f"<p>{badges} {clean}</p>"


def make_findings_table(findings: pd.DataFrame) -> str:
    """Return the findings, errors and warnings open, notes folded away behind them."""
    if findings.empty:
        return ""
    grave = findings[findings["severity"] != "note"]
    notes = findings[findings["severity"] == "note"]
    shown = grave.head(MOST_FINDINGS)
    text = _tabulate(shown) if len(shown) else ""
    if len(grave) > len(shown):
        rest = grave.iloc[len(shown) :]
        text += f"<details><summary>More errors and warnings ({len(rest)})</summary>{_tabulate(rest)}</details>"
    if len(notes):
        text += f"<details><summary>Notes ({len(notes)})</summary>{_tabulate(notes)}</details>"
    return text


def _tabulate(findings: pd.DataFrame) -> str:
    rows = []
    for row in findings.itertuples():
        frame = "" if int(row.onset) < 0 else str(int(row.onset))
        rows.append(
            f'<tr><td><span class="severity {escape(str(row.severity))}">{escape(str(row.severity))}</span></td>'
            f"<td>{escape(str(row.take))}</td><td>{escape(str(row.where))}</td>"
            f'<td class="number">{frame}</td><td><b>{escape(str(row.what))}.</b> {escape(str(row.advice))}</td></tr>'
        )
    head = "".join(f'<th scope="col">{name}</th>' for name in ("", "take", "marker or tier", "frame", "finding"))
    return (
        f'<div class="scroll"><table class="findings"><thead><tr>{head}</tr></thead><tbody>'
        + "\n".join(rows)
        + "</tbody></table></div>"
    )


def draw_gaps(markers: pd.DataFrame) -> str:
    """Return takes by markers, shaded by the share of frames that miss the marker, as SVG.

    A dot marks a spike or jump, a ring a swap; what exactly is said where the pointer rests. Each marker set has a
    block of its own, so that every column is one marker.
    """
    blocks = []
    for names, takes in _group_by_markers(markers):
        blocks.append(_draw_block(markers, names, takes))
    return "".join(blocks)


def _group_by_markers(markers: pd.DataFrame) -> list[tuple[tuple[str, ...], list[str]]]:
    groups: dict[tuple[str, ...], list[str]] = {}
    for take, rows in markers.groupby("take", sort=False):
        groups.setdefault(tuple(rows["marker"].astype(str)), []).append(str(take))
    return list(groups.items())


def _draw_block(markers: pd.DataFrame, names: Sequence[str], takes: Sequence[str]) -> str:
    width = LABEL + CELL * len(names) + 8
    height = NAMES + ROW * len(takes) + 4
    parts = [
        f'<svg class="gaps" role="img" viewBox="0 0 {width} {height}" style="max-width:{width}px">'
        "<title>Share of missing frames by take and marker</title>"
    ]
    for column, name in enumerate(names):
        x = LABEL + CELL * column + CELL / 2 + 2
        parts.append(
            f'<text class="column" transform="translate({x:g} {NAMES - 5}) rotate(-90)">'
            f"{escape(_shorten(name, 20))}</text>"
        )
    table = markers[markers["take"].isin(set(takes))]
    for line, take in enumerate(takes):
        y = NAMES + ROW * line
        parts.append(f'<text class="row" x="{LABEL - 6}" y="{y + ROW - 5}">{escape(_shorten(take, 24))}</text>')
        for column, row in enumerate(table[table["take"] == take].itertuples()):
            parts.append(_draw_cell(row, LABEL + CELL * column, y))
    parts.append("</svg>")
    return "".join(parts)


def _draw_cell(row: object, x: float, y: float) -> str:
    missing = float(row.missing)  # type: ignore[attr-defined]
    faults = {name: int(getattr(row, name)) for name in FAULT_COLUMNS}
    words = f"{row.take}, {row.marker}: {100 * missing:.1f} % missing"  # type: ignore[attr-defined]
    if missing > 0:
        words += f", at the longest {format_value(float(row.longest_gap_s))} s"  # type: ignore[attr-defined]
    words += "".join(f", {n} {name}" for name, n in faults.items() if n)
    size = CELL - GAP
    cell = (
        f'<rect class="g{shade(missing)}" x="{x:g}" y="{y:g}" width="{size}" height="{ROW - GAP}" rx="2">'
        f"<title>{escape(words)}</title></rect>"
    )
    middle = f'cx="{x + size / 2:g}" cy="{y + (ROW - GAP) / 2:g}"'
    if faults["swaps"]:
        cell += f'<circle class="swap" {middle} r="4"/>'
    if faults["spikes"] + faults["jumps"]:
        cell += f'<circle class="spike" {middle} r="1.9"/>'
    return cell


def shade(missing: float) -> int:
    """Return the step of the shading, 0 for nothing missing to 6 for everything."""
    if missing <= 0:
        return 0
    return int(np.clip(np.searchsorted(LEVELS, missing, side="left"), 1, len(LEVELS) - 1))


def make_shade_legend() -> str:
    """Return what the shades mean."""
    names = ["none", *(f"to {100 * level:g} %" for level in LEVELS[1:])]
    keys = [
        _draw_key(f'<rect class="g{step}" width="11" height="13" rx="2"/>', name) for step, name in enumerate(names)
    ]
    keys.append(_draw_key('<circle class="spike" cx="5.5" cy="6.5" r="1.9"/>', "spikes or jumps"))
    keys.append(_draw_key('<circle class="swap" cx="5.5" cy="6.5" r="4"/>', "swap"))
    return f'<p class="keys">missing: {"".join(keys)}</p>'


def _draw_key(shape: str, name: str) -> str:
    return f'<span class="key"><svg viewBox="0 0 11 13">{shape}</svg>{name}</span>'


def _shorten(name: str, longest: int) -> str:
    return name if len(name) <= longest else name[: longest - 1] + "…"
