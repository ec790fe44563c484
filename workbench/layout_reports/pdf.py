"""A layout study on A4 pages.

The layout's pictures and the placement sheet are drawn as vectors, a page each. The study's figures follow as they fit,
as images fine enough for print, because Matplotlib cannot put one figure into another.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...errors import MimiqueError
from ..reports.figure_style import STYLE
from ..reports.tables import format_value
from . import words
from .numbers import LayoutStudyLike
from .parts import LayoutFacts, Part, Sections, flatten

__all__ = ["draw_pages"]

PAGE = (8.27, 11.69)  # inches
LEFT, RIGHT, TOP, BOTTOM = 0.62, 7.65, 11.05, 0.75
WIDTH = RIGHT - LEFT
DPI = 220
MOST_ROWS = 20  # of a table; the page on the screen has them all
LINE = 1.32  # of the type's size
_TYPE = 0.545  # mean width of a letter, of its size


class _Pages:
    """Pages that are filled from above."""

    def __init__(self, book: PdfPages, footer: str) -> None:
        self._book, self._footer, self._number = book, footer, 0
        self._page: Figure | None = None
        self.y = 0.0

    def begin(self, page: Figure | None = None) -> None:
        """Begin a new page."""
        self.end()
        self._number += 1
        self._page = Figure(figsize=PAGE, facecolor="white") if page is None else page
        self._page.text(LEFT / PAGE[0], 0.42 / PAGE[1], self._footer, fontsize=7.5, color="#555555")
        self._page.text(RIGHT / PAGE[0], 0.42 / PAGE[1], str(self._number), fontsize=7.5, color="#555555", ha="right")
        self.y = TOP

    def end(self) -> None:
        """Finish the present page."""
        if self._page is not None:
            self._book.savefig(self._page)
            self._page = None

    def need(self, height: float) -> None:
        """Begin a new page unless ``height`` inches are free."""
        if self._page is None or self.y - height < BOTTOM:
            self.begin()

    @property
    def page(self) -> Figure:
        """The present page."""
        assert self._page is not None
        return self._page

    def write(
        self, text: str, size: float = 9.0, *, bold: bool = False, gap: float = 0.06, indent: float = 0.0
    ) -> None:
        """Write a paragraph."""
        step = size * LINE / 72
        for line in textwrap.wrap(text, int((WIDTH - indent) * 72 / (size * _TYPE))) or [""]:
            self.need(step)
            self.y -= step
            self.put(LEFT + indent, line, size, bold=bold)
        self.y -= gap

    def put(self, x: float, text: str, size: float, *, bold: bool = False, ha: str = "left") -> None:
        """Write one line at the present height."""
        weight = "bold" if bold else "normal"
        self.page.text(x / PAGE[0], self.y / PAGE[1], text, fontsize=size, fontweight=weight, ha=ha, va="baseline")

    def rule(self, width: float = 0.5, below: float = 0.05) -> None:
        """Draw a line across the page a little below the present one."""
        y = (self.y - below) / PAGE[1]
        self.page.add_artist(Line2D([LEFT / PAGE[0], RIGHT / PAGE[0]], [y, y], color="black", linewidth=width))

    def show(self, figure: Figure, caption: str) -> None:
        """Show a figure no wider than the page, with its caption below."""
        wide, tall = (float(v) for v in figure.get_size_inches())
        scale = min(1.0, WIDTH / wide)
        wide, tall = wide * scale, tall * scale
        size = 8.0
        lines = textwrap.wrap(caption, int(WIDTH * 72 / (size * _TYPE)))
        self.need(tall + len(lines) * size * LINE / 72 + 0.1)
        figure.set_facecolor("white")
        figure.set_dpi(DPI * scale)
        canvas = FigureCanvasAgg(figure)
        with rc_context(STYLE):
            canvas.draw()
        image = np.asarray(canvas.buffer_rgba())[..., :3]
        self.y -= tall
        axis = self.page.add_axes((LEFT / PAGE[0], self.y / PAGE[1], wide / PAGE[0], tall / PAGE[1]))
        axis.imshow(image, interpolation="none", aspect="auto")
        axis.set_axis_off()
        self.y -= 0.03
        self.write(caption, size, gap=0.2)

    def tabulate(self, table: pd.DataFrame, caption: str, size: float = 7.6) -> None:
        """Write a table, as wide as its words need; its head is repeated on every page."""
        cells = [[format_value(v, str(c)) for c, v in zip(table.columns, row, strict=True)] for row in table.to_numpy()]
        head = [str(c).replace("_", " ") for c in table.columns]
        letters = [max([1.3 * len(head[k]), *(len(row[k]) for row in cells)]) for k in range(len(head))]
        size = min(size, WIDTH * 72 / ((sum(letters) + 2 * len(letters)) * _TYPE))
        edges = LEFT + np.cumsum([0, *(n + 2 for n in letters)]) * size * _TYPE / 72
        step = size * LINE * 1.12 / 72
        self.need(5 * step)
        self.write(caption, 8.0, bold=True, gap=0.04)
        self._row(head, edges, size, step, bold=True)
        self._rule_head()
        for row in cells:
            if self.y - step < BOTTOM:
                self.begin()
                self._row(head, edges, size, step, bold=True)
                self._rule_head()
            self._row(row, edges, size, step)
        self.y -= 0.25

    def _rule_head(self) -> None:
        self.rule(0.8, 0.02)
        self.y -= 0.04

    def _row(self, row: list[str], edges: np.ndarray, size: float, step: float, *, bold: bool = False) -> None:
        self.y -= step
        for x, text in zip(edges, row, strict=False):
            self.put(float(x), text, size, bold=bold)
        self.y -= 0.02


def draw_pages(study: LayoutStudyLike, found: Sections, facts: LayoutFacts, path: Path) -> None:
    """Write everything that was found as A4 pages.

    Raises
    ------
    MimiqueError
        If the file cannot be written.
    """
    mark = " (simulated data)" if facts.simulated else ""
    title = f"Marker layouts for {facts.rig_name}{mark}"
    footer = f"{title} · corpus {facts.corpus}, snapshot {facts.snapshot} · mimique {facts.version}, {facts.created}"
    about = {"Title": title, "Creator": f"mimique {facts.version}", "CreationDate": None}
    try:
        with rc_context(STYLE | {"pdf.compression": 9}), PdfPages(path, metadata=about) as book:
            pages = _Pages(book, footer)
            pages.begin()
            _write_first(pages, title, found, facts)
            for part in found.pictures:
                _show_picture(pages, part)
            _write_sheet(pages, found)
            _write_study(pages, study, found)
            pages.end()
    except OSError as error:
        raise MimiqueError(f"{path}: cannot write the pages: {error}") from error


def _write_first(pages: _Pages, title: str, found: Sections, facts: LayoutFacts) -> None:
    pages.write(title, 17, bold=True, gap=0.05)
    pages.write(f"Corpus {facts.corpus}, snapshot {facts.snapshot}. {facts.created}, mimique {facts.version}.", 9)
    pages.rule(1.0, 0.0)
    pages.y -= 0.15
    for name, value in found.highlights:
        pages.need(0.25)
        pages.y -= 0.22
        pages.put(LEFT, name, 10)
        pages.put(LEFT + 2.9, value, 11, bold=True)
    pages.y -= 0.25
    first = next((p for s in found.sections if s.anchor == "curves" for p in s.parts if p.figure is not None), None)
    if first is not None and first.figure is not None:
        pages.show(first.figure, first.caption)
    if found.notes:
        pages.write("Notes", 11, bold=True)
        for note in found.notes:
            pages.write(f"· {note}", 8.5, gap=0.03)


def _show_picture(pages: _Pages, part: Part) -> None:
    """Show a picture as vectors: its figure becomes the page."""
    figure = part.figure
    assert figure is not None
    wide, tall = (float(v) for v in figure.get_size_inches())
    left, bottom = (PAGE[0] - wide) / 2, TOP - tall
    figure.set_size_inches(*PAGE)
    for axis in figure.axes:
        box = axis.get_position(original=True)  # before its aspect shrinks it
        axis.set_position(
            (
                (left + box.x0 * wide) / PAGE[0],
                (bottom + box.y0 * tall) / PAGE[1],
                box.width * wide / PAGE[0],
                box.height * tall / PAGE[1],
            )
        )
    pages.begin(figure)
    pages.y = bottom - 0.05
    pages.write(part.caption, 8.5)


def _write_sheet(pages: _Pages, found: Sections) -> None:
    pages.begin()
    pages.write("Placement sheet", 15, bold=True, gap=0.04)
    pages.write(words.SHEET, 8.2, gap=0.08)
    columns = (("", 0.0), ("no.", 0.24), ("where", 0.62), ("partner", 5.02), ("nearest", 5.82), ("marker", 6.52))
    _head(pages, columns)
    for row in found.sheet.markers.itertuples():
        place = list(_wrap(str(row.place), 4.35, 8.4))
        if pages.y - 0.16 * len(place) - 0.05 < BOTTOM:
            pages.begin()
            _head(pages, columns)
        pages.y -= 0.178
        pages.put(LEFT, "☐", 10)
        pages.put(LEFT + 0.5, str(row.number), 9.5, bold=True, ha="right")
        for x, text in ((5.02, row.partner), (5.82, row.nearest), (6.52, row.marker)):
            pages.put(LEFT + x, _cut(str(text), 0.8 if x < 6 else 0.6, 7.6), 7.6)
        for k, line in enumerate(place):
            pages.y -= 0.13 if k else 0
            pages.put(LEFT + 0.62, line, 8.4)
        pages.rule(0.25, 0.045)
    pages.y -= 0.3
    pages.need(1.2)
    pages.write("Rigid head markers", 12, bold=True, gap=0.04)
    pages.write(words.HEAD, 8.2, gap=0.06)
    for row in found.sheet.head.itertuples():
        pages.need(0.2)
        pages.y -= 0.17
        pages.put(LEFT, "☐", 10)
        pages.put(LEFT + 0.5, str(row.number), 9.5, bold=True, ha="right")
        pages.put(LEFT + 0.62, str(row.place), 8.4)
        pages.put(RIGHT, str(row.marker), 7.6, ha="right")
        pages.rule(0.25, 0.045)


def _head(pages: _Pages, columns: tuple[tuple[str, float], ...]) -> None:
    pages.y -= 0.17
    for name, x in columns:
        pages.put(LEFT + x, name, 8, bold=True)
    pages.rule(0.9, 0.045)
    pages.y -= 0.03


def _write_study(pages: _Pages, study: LayoutStudyLike, found: Sections) -> None:
    pages.begin()
    for section in found.sections:
        parts = section.parts
        if section.anchor == "curves":  # its figure is on the first page
            parts = tuple(p for p in parts if p.caption != parts[0].caption)
        pages.need(1.6)
        pages.write(section.title, 13, bold=True, gap=0.08)
        if section.before:
            pages.write(section.before, 8.5, gap=0.1)
        for part in parts:
            if part.figure is not None:
                pages.show(part.figure, part.caption)
            elif part.table is not None:
                more = f" (first {MOST_ROWS} of {len(part.table)})" if len(part.table) > MOST_ROWS else ""
                pages.tabulate(part.table.head(MOST_ROWS), part.caption + more)
        for line in section.after:
            pages.write(f"· {line}", 8.2, gap=0.03)
        pages.y -= 0.15
    pages.need(1.5)
    pages.write("Parameters", 13, bold=True)
    for name, value in flatten(study.parameters).items():
        pages.write(f"{name}: {value}", 8, gap=0.0)
    for line in found.absent:
        pages.write(f"Not in this report: {line}", 8, gap=0.0)


def _wrap(text: str, width: float, size: float) -> Iterator[str]:
    yield from textwrap.wrap(text, int(width * 72 / (size * _TYPE))) or [""]


def _cut(text: str, width: float, size: float) -> str:
    longest = max(4, int(width * 72 / (size * _TYPE)))
    return text if len(text) <= longest else text[: longest - 1] + "…"
