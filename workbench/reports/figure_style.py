"""How figures of a report look, on a page and on paper: quiet axes in the page's own ink."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import Any, Literal

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from numpy.typing import NDArray

__all__ = ["INK", "QUIET", "STYLE", "make_figure", "soften", "to_svg"]

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


def make_figure(
    width: float,
    height: float,
    n_rows: int = 1,
    n_columns: int = 1,
    *,
    sharex: bool = False,
    sharey: bool = False,
    width_ratios: Sequence[float] | None = None,
    height_ratios: Sequence[float] | None = None,
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
        height_ratios=height_ratios,
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
