"""How figures of a report look, on a page and on paper: quiet axes, and curves that are told apart without colour."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from numpy.typing import NDArray

__all__ = ["INK", "QUIET", "STYLE", "Look", "find_look", "make_figure", "soften", "to_svg"]

INK, QUIET = "#010203", "#040506"  # as good as black on paper; on a page replaced by its own colours
STYLE: Any = {  # Matplotlib types its keys as a closed list
    "svg.fonttype": "none",
    "svg.hashsalt": "mimique",
    "pdf.fonttype": 42,
    "font.size": 9.5,
    "font.family": "sans-serif",
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": QUIET,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.parse_math": False,
    "legend.handlelength": 2.8,
}


@dataclass(frozen=True)
class Look:
    """Colour (after Okabe and Ito), line and sign of a curve: line and sign differ wherever colours do."""

    colour: str
    line: Any
    sign: str
    width: float = 1.4
    size: float = 5.0

    def style(self) -> dict[str, Any]:
        """Return what :meth:`Axes.plot` needs."""
        hollow = self.sign in "sv<>D"
        return {
            "color": self.colour,
            "linestyle": self.line,
            "marker": self.sign,
            "linewidth": self.width,
            "markersize": self.size,
            "markerfacecolor": "white" if hollow else self.colour,
            "markeredgecolor": self.colour,
            "markeredgewidth": 1.1,
        }


_LOOKS = {
    "greedy + swaps": Look("#0072b2", "-", "o", 2.2, 6.0),
    "greedy": Look("#56b4e9", (0, (5, 2)), "s"),
    "pivoted QR": Look("#009e73", (0, (6, 2, 1, 2)), "^"),
    "k-means median": Look("#d55e00", "-", "D", 1.8),
    "k-means best inertia": Look("#e69f00", (0, (1, 1.5)), "v"),
    "k-means one actor": Look("#cc79a7", (0, (4, 1.5)), "<"),
    "k-means several actors": Look("#7a4a9e", "-", ">"),
    "k-means": Look("#d55e00", "-", "D", 1.8),
    "STAR": Look("#6b6b6b", "none", "*", 0.0, 10.0),
    "MAN": Look("#6b6b6b", (0, (8, 3)), "P", 1.2, 6.0),
}
_OTHERS = (Look("#8c564b", (0, (3, 1, 1, 1)), "X"), Look("#117733", (0, (2, 2)), "p"), Look("#332288", "-", "h"))


def find_look(name: str, number: int = 0) -> Look:
    """Return the look of a method, the same in every figure; ``number`` tells those without one of their own apart."""
    return _LOOKS.get(name) or _OTHERS[number % len(_OTHERS)]


def make_figure(
    width: float,
    height: float,
    n_rows: int = 1,
    n_columns: int = 1,
    *,
    sharex: bool = False,
    sharey: bool = False,
    width_ratios: Sequence[float] | None = None,
) -> tuple[Figure, NDArray[Any]]:
    """Return a transparent figure of ``width`` × ``height`` inches and its axes, (n_rows, n_columns)."""
    figure = Figure(figsize=(width, height), layout="constrained", facecolor="none")
    axes = figure.subplots(
        n_rows,
        n_columns,
        squeeze=False,
        sharex=sharex,
        sharey=sharey,
        width_ratios=width_ratios,
        subplot_kw={"facecolor": "none"},
    )
    return figure, axes


def soften(axis: Axes, along: Literal["x", "y"] = "y") -> None:
    """Leave only the base line and faint rules across the values."""
    axis.spines[["top", "right", "left" if along == "y" else "bottom"]].set_visible(False)
    axis.grid(axis=along, color=QUIET, linewidth=0.5, alpha=0.25, zorder=0)
    axis.set_axisbelow(True)
    axis.tick_params(axis=along, length=0)


def to_svg(figure: Figure, title: str, *, paper: bool = False) -> str:
    """Return the figure as an SVG element to put into a page, which gives it its ink.

    A figure on ``paper`` of its own keeps its black on white, whatever the page's colours are.
    """
    buffer = io.StringIO()
    with matplotlib.rc_context(STYLE | {"svg.hashsalt": title}):
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None, "Creator": None, "Title": title})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'width="[\d.]+pt" height="[\d.]+pt"', 'role="img"', text, count=1)
    text = re.sub(r"font:\s*([^;\"]*?)'[^;\"]*", r"font: \1inherit", text)
    if paper:
        return text
    return text.replace(INK, "var(--ink)").replace(QUIET, "var(--quiet)")
