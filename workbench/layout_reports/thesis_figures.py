"""Figures 3.3, 3.5, 3.7 and 3.8 of Reverdy 2019, drawn for the corpus at hand.

Their error is the RMSE as printed (3.5): over frames, not over vertices, so it grows with the mesh. Beside it stands
what it is in millimetres, divided by √P.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from ..reports.figure_style import INK, STYLE, make_figure, soften
from .looks import find_look
from .numbers import pool_by_actor, sort_methods

__all__ = ["draw_actors", "draw_man_sets", "draw_star_sets", "draw_training"]

WIDTH = 9.2
PRINTED = "RMSE as printed, (3.5) (mm)"
MOST_PANELS = 8


@rc_context(STYLE)
def draw_star_sets(errors: pd.DataFrame) -> Figure | None:
    """Draw Figure 3.3: RMSE of the STAR sets, training and test by the same actor."""
    rows = _same(errors[errors["method"] == "STAR"])
    if rows.empty:
        return None
    pooled = pool_by_actor(rows)
    sets = pooled.drop_duplicates("set").sort_values("K")["set"].tolist()
    actors = sorted(pooled["tested_on"].unique())[:MOST_PANELS]
    figure, axes = make_figure(WIDTH, 3.3)
    axis = axes[0, 0]
    width = 0.8 / len(actors)
    greys = np.linspace(0.30, 0.88, len(actors))
    for i, actor in enumerate(actors):
        some = pooled[pooled["tested_on"] == actor].set_index("set")["value"].reindex(sets)
        x = np.arange(len(sets)) - 0.4 + (i + 0.5) * width
        axis.bar(
            x,
            some,
            0.92 * width,
            color=str(greys[i]),
            edgecolor=INK,
            linewidth=0.6,
            hatch=("", "////", "....", "xxxx")[i % 4],
            label=str(actor),
            zorder=2,
        )
    axis.set_xticks(np.arange(len(sets)), sets)
    axis.tick_params(axis="x", length=0)
    axis.set_ylabel(PRINTED)
    soften(axis)
    _add_millimetres(axis, rows)
    figure.legend(loc="outside upper left", ncols=6, frameon=False, title=None)
    return figure


@rc_context(STYLE)
def draw_man_sets(errors: pd.DataFrame) -> Figure | None:
    """Draw Figure 3.5 (a): RMSE of the MAN sets against their size, training and test by the same actor."""
    rows = _same(errors[errors["method"] == "MAN"])
    if rows.empty:
        return None
    pooled = pool_by_actor(rows)
    figure, axes = make_figure(WIDTH / 1.5, 3.2)
    axis = axes[0, 0]
    lines = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))
    for i, (actor, some) in enumerate(list(pooled.groupby("tested_on", sort=True))[:MOST_PANELS]):
        some = some.sort_values("K")
        axis.plot(some["K"], some["value"], color=INK, linestyle=lines[i % 4], marker="osD^v<>P"[i], label=str(actor))
    axis.set_xticks(sorted(pooled["K"].unique()))
    axis.set_xlabel("markers")
    axis.set_ylabel(PRINTED)
    axis.set_ylim(bottom=0)
    soften(axis)
    _add_millimetres(axis, rows)
    figure.legend(loc="outside upper left", ncols=6, frameon=False)
    return figure


@rc_context(STYLE)
def draw_training(errors: pd.DataFrame) -> Figure | None:
    """Draw Figure 3.7: k-means learned from one actor and from several, a panel for each tested actor."""
    rows = errors[errors["method"].isin(["k-means one actor", "k-means several actors"])]
    return None if rows.empty else _draw_panels(rows)


@rc_context(STYLE)
def draw_actors(errors: pd.DataFrame) -> Figure | None:
    """Draw Figure 3.8: STAR, MAN and k-means, a panel for each actor."""
    learned = "k-means several actors" if (errors["method"] == "k-means several actors").any() else "k-means median"
    rows = errors[errors["method"].isin(["STAR", "MAN", learned])]
    return None if rows.empty or rows["method"].nunique() < 2 else _draw_panels(rows)


def _draw_panels(rows: pd.DataFrame) -> Figure:
    pooled = pool_by_actor(rows)
    actors = sorted(pooled["tested_on"].unique())[:MOST_PANELS]
    n_columns = 2 if len(actors) == 4 else min(3, len(actors))
    n_rows = -(-len(actors) // n_columns)
    figure, axes = make_figure(
        WIDTH if n_columns > 1 else WIDTH / 1.5, 0.7 + 2.7 * n_rows, n_rows, n_columns, sharey=True
    )
    for number, (axis, actor) in enumerate(zip(axes.flat, actors, strict=False)):
        here = pooled[pooled["tested_on"] == actor]
        for k, method in enumerate(sort_methods(here["method"])):
            some = here[here["method"] == method].sort_values("K")
            axis.plot(some["K"], some["value"], label=method, **find_look(method, k).style())
        seen = rows.loc[rows["tested_on"] == actor, "same_actor"]
        unseen = " (unseen)" if not seen.any() else ""
        axis.set_title(f"{actor}{unseen}", loc="left", fontsize=10, fontweight="bold")
        soften(axis)
        if number + n_columns >= len(actors):
            axis.set_xlabel("markers")
        if number % n_columns == 0:
            axis.set_ylabel(PRINTED)
        if number % n_columns == n_columns - 1 or number == len(actors) - 1:
            _add_millimetres(axis, rows)
    axes[0, 0].set_ylim(bottom=0)  # at last: the limits of shared axes are then those of all panels
    for axis in axes.flat[len(actors) :]:
        axis.set_visible(False)
    known = dict(zip(*reversed(axes.flat[0].get_legend_handles_labels()), strict=True))
    figure.legend(known.values(), known.keys(), loc="outside upper left", ncols=3, frameon=False)
    return figure


def _same(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of actors that took part in the training; all where none did."""
    same = rows[rows["same_actor"].astype(bool)]
    return same if len(same) else rows


def _add_millimetres(axis: Axes, rows: pd.DataFrame) -> None:
    """Add the scale in mm beside, where all rows have the same number of vertices."""
    ratio = (rows["rmse_mm"] / rows["rmse_printed"]).dropna()
    if ratio.empty or float(np.ptp(ratio)) > 1e-6 * float(ratio.mean()):
        return
    factor = float(ratio.mean())

    def to_millimetres(y: ArrayLike) -> NDArray[Any]:
        return np.asarray(y) * factor

    def to_printed(y: ArrayLike) -> NDArray[Any]:
        return np.asarray(y) / factor

    beside = axis.secondary_yaxis("right", functions=(to_millimetres, to_printed))
    beside.set_ylabel("RMSE ÷ √P (mm)")
    beside.spines["right"].set_visible(False)
    beside.tick_params(length=0)
