"""The figures of a layout study: error against the number of markers, by region, and when something goes wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..reports.figure_style import INK, STYLE, make_figure, soften
from .looks import Look, find_look
from .numbers import sort_methods, summarise_curves

__all__ = [
    "draw_curves",
    "draw_labels",
    "draw_losses",
    "draw_reconstructions",
    "draw_response",
    "draw_stability",
    "draw_symmetry",
]

WIDTH = 9.2  # inches
_RECONSTRUCTIONS = {
    "sogp": Look("#cc79a7", (0, (4, 1.5)), "s"),
    "solver": Look("#0072b2", "-", "o", 2.0),
    "thin shell": Look("#009e73", (0, (6, 2, 1, 2)), "^"),
}
_HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "++++")
_GREYS = ("#35567a", "#c9d6e4", "#8aa7c4", "#e9e4d8", "#7a7a7a", "#d0d0d0")


@rc_context(STYLE)
def draw_curves(errors: pd.DataFrame) -> Figure:
    """Draw mean error against K for all methods, a panel for actors in the training and one for unseen ones."""
    panels = [(known, rows) for known, rows in errors.groupby("same_actor", sort=True)][::-1]
    figure, axes = make_figure(WIDTH, 4.7, 1, len(panels), sharey=True)
    for axis, (known, rows) in zip(axes[0], panels, strict=True):
        found = summarise_curves(rows)
        for number, method in enumerate(sort_methods(found["method"])):
            _draw_curve(axis, found[found["method"] == method], method, number)
        actors = ", ".join(sorted(rows["tested_on"].astype(str).unique()))
        kind = "actors in the training" if known else "unseen actors"
        axis.set_title(_fit(f"{kind}: {actors}", 48), loc="left", fontsize=10, fontweight="bold")
        axis.set_xlabel("markers")
        soften(axis)
    axes[0, 0].set_ylim(bottom=0)  # at last: the limits of shared axes are then those of all panels
    axes[0, 0].set_ylabel("mean vertex error (mm)")
    _share_legend(figure, axes[0], 4)
    return figure


def _draw_curve(axis: Axes, rows: pd.DataFrame, method: str, number: int) -> None:
    look = find_look(method, number)
    rows = rows.sort_values("K")
    x, y = rows["K"].to_numpy(), rows["value"].to_numpy()
    around = np.stack([y - rows["low"].to_numpy(), rows["high"].to_numpy() - y])
    if look.line == "none" or len(rows) == 1:
        axis.errorbar(
            x, y, np.clip(np.nan_to_num(around), 0, None), fmt="none", ecolor=look.colour, elinewidth=1, zorder=2
        )
    else:
        axis.fill_between(x, y - around[0], y + around[1], color=look.colour, alpha=0.13, linewidth=0, zorder=1)
    axis.plot(x, y, label=method, zorder=4 if look.width > 1.6 else 3, **look.style())


@rc_context(STYLE)
def draw_reconstructions(errors: pd.DataFrame, methods: list[str]) -> Figure:
    """Draw the same layouts' error by the three ways to make a face of markers, a panel a method."""
    figure, axes = make_figure(WIDTH, 3.4, 1, len(methods), sharey=True)
    for axis, method in zip(axes[0], methods, strict=True):
        rows = errors[errors["method"] == method]
        for number, (name, some) in enumerate(rows.groupby("reconstruction", sort=True)):
            found = summarise_curves(some)
            look = _RECONSTRUCTIONS.get(str(name)) or find_look(str(name), number)
            axis.fill_between(found["K"], found["low"], found["high"], color=look.colour, alpha=0.13, linewidth=0)
            axis.plot(found["K"], found["value"], label=str(name), **look.style())
        axis.set_title(method, loc="left", fontsize=10, fontweight="bold")
        axis.set_xlabel("markers")
        soften(axis)
    axes[0, 0].set_ylim(bottom=0)  # at last: the limits of shared axes are then those of all panels
    axes[0, 0].set_ylabel("mean vertex error (mm)")
    _share_legend(figure, axes[0], 3)
    return figure


@rc_context(STYLE)
def draw_response(tables: list[tuple[pd.DataFrame, str, str]], recommended: str) -> Figure:
    """Draw error against what goes wrong, a panel a table: ``layout, K, <column>, mean_mm``, its column and words."""
    figure, axes = make_figure(WIDTH, 3.7, 1, len(tables), sharey=True)
    names = _order_layouts(pd.concat([table for table, _, _ in tables]), recommended, 8)
    looks = _looks_of_layouts(names, recommended)
    for axis, (table, column, words) in zip(axes[0], tables, strict=True):
        for name in names:
            rows = table[table["layout"].astype(str) == name].groupby(column)["mean_mm"].mean()
            if len(rows):
                axis.plot(rows.index.to_numpy(dtype=float), rows.to_numpy(), label=name, **looks[name].style())
        axis.set_xlabel(words)
        soften(axis)
    axes[0, 0].set_ylim(bottom=0)
    axes[0, 0].set_ylabel("mean vertex error (mm)")
    _share_legend(figure, axes[0], 3)
    return figure


@rc_context(STYLE)
def draw_losses(losses: pd.DataFrame, recommended: str) -> Figure:
    """Draw the mean error with one or two markers lost: averaged over which, and with the worst choice of them."""
    names = _order_layouts(losses, recommended)
    kinds = sorted(losses["lost"].unique())
    figure, axes = make_figure(WIDTH, 1.1 + 0.42 * len(names), 1, len(kinds), sharex=True, sharey=True)
    for axis, lost in zip(axes[0], kinds, strict=True):
        rows = losses[losses["lost"] == lost].drop_duplicates("layout").set_index("layout").reindex(names)
        y = np.arange(len(names))
        axis.hlines(y, rows["mean_mm"], rows["worst_mm"], color="#6b6b6b", linewidth=2)
        axis.plot(rows["mean_mm"], y, "o", color="#0072b2", markersize=6, label="mean over the markers lost")
        axis.plot(
            rows["worst_mm"], y, "D", color="#d55e00", markerfacecolor="white", markersize=6, label="the worst lost"
        )
        axis.set_title(f"{int(lost)} marker{'s' if lost > 1 else ''} lost", loc="left", fontsize=10, fontweight="bold")
        axis.set_yticks(y, names)
        axis.set_xlabel("mean vertex error (mm)")
        soften(axis, along="x")
        axis.tick_params(axis="y", length=0)
    axes[0, 0].set_xlim(left=0)
    axes[0, 0].invert_yaxis()
    _share_legend(figure, axes[0], 2)
    return figure


@rc_context(STYLE)
def draw_stability(stability: pd.DataFrame) -> Figure:
    """Draw how alike a method's layouts are over seeds, takes and actors (Jaccard, vertices within 10 mm as one)."""
    kinds = list(dict.fromkeys(stability["over"].astype(str)))
    figure, axes = make_figure(WIDTH, 3.2, 1, len(kinds), sharey=True)
    for axis, over in zip(axes[0], kinds, strict=True):
        rows = stability[stability["over"].astype(str) == over]
        for number, method in enumerate(sort_methods(rows["method"])):
            some = rows[rows["method"].astype(str) == method].sort_values("K")
            look = find_look(method, number)
            axis.plot(some["K"], some["jaccard_near"], label=method, **look.style())
        axis.set_title(f"over {over}", loc="left", fontsize=10, fontweight="bold")
        axis.set_xlabel("markers")
        axis.set_ylim(0, 1.02)
        soften(axis)
    axes[0, 0].set_ylabel("Jaccard, within 10 mm")
    _share_legend(figure, axes[0], 4)
    return figure


@rc_context(STYLE)
def draw_symmetry(symmetry: pd.DataFrame) -> Figure:
    """Draw how far layouts are from their mirror image, by the number of actors they were learned from."""
    figure, axes = make_figure(4.6, 3.0)
    axis = axes[0, 0]
    if "method" in symmetry:  # the same method, learned from more or fewer actors
        clustered = symmetry["method"].astype(str).str.startswith("k-means")
        symmetry = symmetry[clustered] if clustered.any() else symmetry
    counts = sorted(symmetry["trained_on_n_actors"].unique())
    sizes = sorted(symmetry["K"].unique())
    width = 0.8 / len(counts)
    for i, count in enumerate(counts):
        rows = symmetry[symmetry["trained_on_n_actors"] == count].groupby("K")["asymmetry_mm"].median().reindex(sizes)
        axis.bar(
            np.arange(len(sizes)) - 0.4 + (i + 0.5) * width,
            rows,
            0.92 * width,
            label=f"{int(count)} actor{'s' if count > 1 else ''}",
            **_bar(i),
        )
    axis.set_xticks(np.arange(len(sizes)), [str(int(k)) for k in sizes])
    axis.set_xlabel("markers")
    axis.set_ylabel("from its mirror image (mm)")
    soften(axis)
    figure.legend(loc="outside upper left", ncols=3, frameon=False)
    return figure


@rc_context(STYLE)
def draw_labels(labels: pd.DataFrame, recommended: str) -> Figure:
    """Draw accuracy of labels when only a layout's markers exist, as bars."""
    names = _order_layouts(labels, recommended)
    rows = labels.drop_duplicates("layout").set_index("layout").reindex(names)
    figure, axes = make_figure(WIDTH, 0.9 + 0.4 * len(names))
    axis = axes[0, 0]
    y = np.arange(len(names))
    for i, (column, words) in enumerate((("accuracy", "accuracy"), ("macro_f1", "macro F1"))):
        axis.barh(y + 0.2 * (2 * i - 1), rows[column].astype(float), 0.36, label=words, **_bar(i))
    axis.set_yticks(y, names)
    axis.invert_yaxis()
    axis.set_xlim(0, 1)
    axis.tick_params(axis="y", length=0)
    soften(axis, along="x")
    figure.legend(loc="outside upper left", ncols=2, frameon=False)
    return figure


def _bar(number: int) -> dict[str, Any]:
    """Return fill and hatching of the bars of one kind."""
    return {
        "color": _GREYS[number % len(_GREYS)],
        "hatch": _HATCHES[number % len(_HATCHES)],
        "edgecolor": INK,
        "linewidth": 0.6,
        "zorder": 2,
    }


def _order_layouts(table: pd.DataFrame, recommended: str, most: int = 14) -> list[str]:
    """Return layout names, the recommended first, then those of its size; no more than can be told apart."""
    sizes = table.drop_duplicates("layout").set_index("layout")["K"]
    same = sizes.get(recommended)
    names = [str(name) for name in sizes.index]
    return sorted(names, key=lambda name: (name != recommended, sizes[name] != same))[:most]


def _looks_of_layouts(names: list[str], recommended: str) -> dict[str, Look]:
    """Return a look for each layout; the recommended one is thick and whole."""
    colours = ("#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a4a9e", "#6b6b6b")
    lines: tuple[Any, ...] = ((0, (5, 2)), (0, (6, 2, 1, 2)), (0, (1, 1.5)))
    looks = {
        name: Look(colours[k % len(colours)], lines[k % len(lines)], "sD^v<>PX"[k % 8]) for k, name in enumerate(names)
    }
    if recommended in looks:
        looks[recommended] = Look("#0072b2", "-", "o", 2.2, 6.0)
    return looks


def _share_legend(figure: Figure, axes: Any, n_columns: int) -> None:
    known: dict[str, Any] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            known.setdefault(label, handle)
    if known:
        figure.legend(known.values(), known.keys(), loc="outside upper left", ncols=n_columns, frameon=False)


def _fit(text: str, longest: int) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"
