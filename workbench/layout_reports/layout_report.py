"""The report of a layout study: one HTML file to read, send and print; and the same as A4 pages in a PDF."""

from __future__ import annotations

import base64
from html import escape
from importlib import resources
from pathlib import Path

import pandas as pd

from .. import reports
from ..reports.figure_style import to_svg
from ..reports.tables import make_parameter_table, make_table
from ..text_files import write_text
from . import words
from .numbers import LayoutStudyLike
from .parts import LayoutFacts, Part, Section, Sections, flatten, gather_sections
from .pdf import draw_pages
from .placement_sheet import PlacementSheet

__all__ = ["LayoutFacts", "build_layout_report", "write_layout_pdf", "write_layout_report"]

_STYLE = """
dl.facts dd { white-space: normal; font-size: 1.2rem; }
.picture { background: #ffffff; border-radius: 6px; }
.picture svg { max-width: 46rem; margin: 0 auto; }
table.sheet td:first-child, table.sheet td.tick { white-space: nowrap; }
table.sheet td.number b { font-size: 1rem; }
td.tick::before { content: "☐"; font-size: 1.15em; }
ul.downloads { columns: 2; font-size: .92rem; }
@media print {
  .picture svg { max-height: 20.5cm; }
  #layout h2 { margin-top: .6rem; }
  section.study { break-before: page; }
  nav, ul.downloads, .screen { display: none; }
}
"""


REM_PER_INCH = 7.1  # so that letters are as large in every figure


def write_layout_report(study: LayoutStudyLike, path: Path, *, facts: LayoutFacts) -> Path:
    """Write a study as one HTML file that needs nothing else.

    Parameters
    ----------
    study
        What was found.
    path
        The file.
    facts
        Where it comes from.

    Raises
    ------
    InputError
        If the recommended layout is not among the layouts.
    MimiqueError
        If the file cannot be written.
    """
    write_text(Path(path), build_layout_report(study, facts=facts))
    return Path(path)


def write_layout_pdf(study: LayoutStudyLike, path: Path, *, facts: LayoutFacts) -> Path:
    """Write a study as A4 pages: pictures and placement sheet first, to be taken to the studio.

    Parameters and errors are those of :func:`write_layout_report`.
    """
    draw_pages(study, gather_sections(study, facts), facts, Path(path))
    return Path(path)


def build_layout_report(study: LayoutStudyLike, *, facts: LayoutFacts) -> str:
    """Return the report as the text of one HTML page; see :func:`write_layout_report`."""
    found = gather_sections(study, facts)
    page = _Page(facts)
    badge = '<span class="badge">simulated</span>' if facts.simulated else ""
    pictures = "".join(page.show(part) for part in found.pictures)
    body = [
        f'<section id="layout"><h2>The recommended layout{badge}</h2>{pictures}</section>',
        f'<section id="sheet" class="sheet"><h2>Placement sheet</h2>{_show_sheet(found.sheet)}</section>',
    ]
    body += [
        f'<section id="{s.anchor}" class="{"" if k else "study"}"><h2>{escape(s.title)}{badge}</h2>'
        f"{page.fill(s)}</section>"
        for k, s in enumerate(found.sections)
    ]
    body.append(f'<section id="provenance"><h2>Provenance</h2>{_show_provenance(study, facts, found)}</section>')
    anchors = [("layout", "The recommended layout"), ("sheet", "Placement sheet")]
    anchors += [(s.anchor, s.title) for s in found.sections] + [("provenance", "Provenance")]
    contents = "".join(f'<li><a href="#{anchor}">{escape(title)}</a></li>' for anchor, title in anchors)
    absent = "".join(f'<p class="absent">Not in this report: {escape(line)}</p>' for line in found.absent)
    style = resources.files(reports).joinpath("report.css").read_text(encoding="utf-8")
    title = f"Marker layouts for {facts.rig_name}"
    cells = "".join(f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in found.highlights)
    notice = (
        '<p class="notice">The performances are simulated. The numbers say how the methods work, and nothing about '
        "people.</p>"
        if facts.simulated
        else ""
    )
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="mimique {escape(facts.version)}">
<title>{escape(title)}{" (simulated)" if facts.simulated else ""}</title>
<style>
{style}{_STYLE}</style>
</head>
<body>
<header>
<h1>{escape(title)}{badge}</h1>
<p class="byline">Corpus {escape(facts.corpus)}, {escape(facts.created)} ·
snapshot <code>{escape(facts.snapshot)}</code> · mimique {escape(facts.version)}</p>
</header>
{notice}<dl class="facts">{cells}</dl>
<nav aria-label="Contents"><ol>{contents}</ol></nav>
{absent}
{"".join(body)}
<footer>Made by mimique {escape(facts.version)} from snapshot <code>{escape(facts.snapshot)}</code>.
Curves differ by line and sign as well as by colour (after Okabe and Ito).</footer>
</body>
</html>
"""


class _Page:
    """Figures numbered as they come."""

    def __init__(self, facts: LayoutFacts) -> None:
        self._n_figures = 0
        self._mark = "Simulated data. " if facts.simulated else ""

    def fill(self, section: Section) -> str:
        """Return a section's body."""
        before = f"<p>{escape(section.before)}</p>" if section.before else ""
        after = "".join(f"<li>{escape(line)}</li>" for line in section.after)
        return before + "".join(self.show(part) for part in section.parts) + (f"<ul>{after}</ul>" if after else "")

    def show(self, part: Part) -> str:
        """Return a figure or a table."""
        if part.figure is None:
            assert part.table is not None
            return make_table(part.table, self._mark + part.caption)
        self._n_figures += 1
        svg = to_svg(part.figure, f"Figure {self._n_figures}", paper=part.picture)
        wide = float(part.figure.get_size_inches()[0])
        look = 'class="picture"' if part.picture else f'style="max-width: {wide * REM_PER_INCH:.1f}rem"'
        svg = f"<div {look}>{svg}</div>"
        return (
            f"<figure>{svg}<figcaption><b>Figure {self._n_figures}.</b> {self._mark}{escape(part.caption)}"
            "</figcaption></figure>"
        )


def _show_sheet(sheet: PlacementSheet) -> str:
    links = _link(sheet.markers, "placement.csv") + ", " + _link(sheet.head, "head_markers.csv")
    return (
        f"<p>{escape(words.SHEET)}</p>"
        + _tabulate(sheet.markers, ("number", "marker", "place", "region", "partner", "nearest"))
        + "<h3>Rigid head markers</h3>"
        + f"<p>{escape(words.HEAD)}</p>"
        + (_tabulate(sheet.head, ("number", "marker", "place")) if len(sheet.head) else "")
        + f'<p class="screen">As tables: {links}</p>'
    )


def _tabulate(table: pd.DataFrame, columns: tuple[str, ...]) -> str:
    names = {"nearest": "nearest marker", "number": "no."}
    head = "<th></th>" + "".join(f'<th scope="col">{escape(names.get(c, c))}</th>' for c in columns)
    rows = []
    for values in table[list(columns)].astype(str).itertuples(index=False, name=None):
        cells = f'<td class="number"><b>{escape(values[0])}</b></td>'
        cells += "".join(f"<td>{escape(value)}</td>" for value in values[1:])
        rows.append(f'<tr><td class="tick"></td>{cells}</tr>')
    return (
        f'<div class="scroll"><table class="sheet"><thead><tr>{head}</tr></thead><tbody>'
        + "\n".join(rows)
        + "</tbody></table></div>"
    )


def _show_provenance(study: LayoutStudyLike, facts: LayoutFacts, found: Sections) -> str:
    notes = "".join(f"<li>{escape(note)}</li>" for note in found.notes)
    tables = {"layouts": study.layouts, **study.tables}
    links = "".join(f"<li>{_link(t, f'{n}.csv')}, {len(t)} rows</li>" for n, t in tables.items() if len(t))
    return (
        f"<p>Everything above was computed from snapshot <code>{escape(facts.snapshot)}</code> of the corpus "
        f"“{escape(facts.corpus)}” with mimique {escape(facts.version)}, {escape(facts.created)}.</p>"
        + (f"<h3>Notes</h3><ul>{notes}</ul>" if notes else "")
        + "<h3>Parameters</h3>"
        + make_parameter_table(flatten({**study.parameters, **facts.parameters}))
        + f'<h3 class="screen">Tables</h3><ul class="downloads">{links}</ul>'
    )


def _link(table: pd.DataFrame, name: str) -> str:
    text = table.to_csv(index=False, float_format="%.6g", lineterminator="\n")
    encoded = base64.b64encode(text.encode()).decode("ascii")
    return f'<a download="{escape(name)}" href="data:text/csv;charset=utf-8;base64,{encoded}">{escape(name)}</a>'
