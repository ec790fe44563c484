"""The pictures of the study of labels; markers, dashes and hatches tell the methods apart without colour."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd

mpl.use("Agg")
import matplotlib.pyplot as plt

DIFFICULTIES = ("easy", "medium", "hard")
MARKERS = {"easy": ("^", "#9ecae1"), "medium": ("o", "#08519c"), "hard": ("s", "#000000")}
HATCHES = ("", "//", "..", "xx", "--", "\\\\", "++", "oo")
DASHES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)))
GREYS = ("#ffffff", "#d9d9d9", "#969696")


def draw(results: dict[str, dict[str, Any]], folder: Path) -> list[str]:
    """Draw what the finished pieces allow; return the names of the files."""
    drawn = []
    with plt.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        for name, plot in (
            ("labels_f1.png", _draw_f1),
            ("labels_borders.png", _draw_borders),
            ("labels_figure_4_4.png", _draw_figure),
        ):
            figure = plot(results)
            if figure is not None:
                figure.savefig(folder / name, dpi=110)
                plt.close(figure)
                drawn.append(name)
    return drawn


def of_all_takes(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the labels from scratch on all takes."""
    return table[(table["reading"] == "from scratch") & (table["takes"] == "all")]


def _draw_f1(results: dict[str, dict[str, Any]]) -> Any:
    """F1@50 of every rater, with its interval, at each difficulty."""
    tables = {
        name: of_all_takes(results[f"labellers-{name}"]["tables"]["segments"]).set_index("rater")
        for name in DIFFICULTIES
        if f"labellers-{name}" in results
    }
    if not tables:
        return None
    first = tables.get("medium", next(iter(tables.values())))
    order = list(first["f1_50"].sort_values().index)
    figure, axes = plt.subplots(figsize=(8.0, 0.42 * len(order) + 1.3), layout="constrained")
    for k, (name, table) in enumerate(tables.items()):
        marker, colour = MARKERS[name]
        some = table.reindex(order)
        y = np.arange(len(order)) + 0.22 * ((len(tables) - 1) / 2 - k)
        ends = np.abs(some[["f1_50_low", "f1_50_high"]].to_numpy(dtype=float).T - some["f1_50"].to_numpy(dtype=float))
        axes.errorbar(some["f1_50"], y, xerr=ends, fmt=marker, ms=5, lw=1.2, color=colour, mec="black", label=name)
    axes.set_yticks(
        range(len(order)),
        [f"{rater} (person)" if first.loc[rater, "kind"] == "person" else rater for rater in order],
    )
    axes.set_xlabel("segmental F1@50 on signers that were not trained on; 95 % over takes (simulated)")
    axes.grid(axis="x", lw=0.3)
    axes.legend(frameon=False, title="difficulty", loc="lower right")
    return figure


def _draw_borders(results: dict[str, dict[str, Any]]) -> Any:
    """F1 of borders over the tolerance, at the middle difficulty."""
    if "labellers-medium" not in results:
        return None
    table = of_all_takes(results["labellers-medium"]["tables"]["borders"])
    figure, axes = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
    raters = table[table["within_frames"] == 10].sort_values("f1", ascending=False)["rater"].tolist()
    for k, rater in enumerate(raters):
        some = table[table["rater"] == rater]
        person = some["kind"].iloc[0] == "person"
        axes.plot(
            some["within_frames"],
            some["f1"],
            color="black" if person else plt.get_cmap("viridis")(k / max(len(raters), 1)),
            ls=DASHES[k % len(DASHES)],
            lw=2.6 if person else 1.3,
            marker="ovs^Dx*Pp"[k % 9],
            ms=5,
            label=f"{rater} (person)" if person else rater,
        )
    axes.set_xscale("log")
    axes.set_xticks([1, 2, 5, 10], ["1", "2", "5", "10"])
    axes.xaxis.set_minor_locator(mpl.ticker.NullLocator())
    axes.set_xlabel("tolerance, frames at 200 Hz (simulated, medium)")
    axes.set_ylabel("F1 of borders")
    axes.set_ylim(0, None)
    axes.grid(lw=0.3)
    axes.legend(frameon=False, fontsize=8)
    return figure


def _draw_figure(results: dict[str, dict[str, Any]]) -> Any:
    """Accuracy per segment of the five classifiers, by hand and automatic, as Figure 4.4 shows it."""
    found = {name: results[f"reverdy2019-{name}"] for name in DIFFICULTIES if f"reverdy2019-{name}" in results}
    if not found:
        return None
    figure, panels = plt.subplots(
        1, len(found), figsize=(3.2 * len(found) + 1, 3.6), sharey=True, squeeze=False, layout="constrained"
    )
    for axes, (name, record) in zip(panels[0], found.items(), strict=True):
        table = record["tables"]["scores"].query("signer == 'all'")
        classifiers = list(dict.fromkeys(table["classifier"]))
        for k, segmentation in enumerate(dict.fromkeys(table["segmentation"])):
            some = table[table["segmentation"] == segmentation].set_index("classifier").reindex(classifiers)
            value = some["accuracy"].to_numpy(dtype=float)
            ends = np.abs(some[["accuracy_low", "accuracy_high"]].to_numpy(dtype=float).T - value)
            axes.bar(
                np.arange(len(classifiers)) + 0.4 * (k - 0.5),
                value,
                0.38,
                yerr=ends,
                color=GREYS[k],
                hatch=HATCHES[k],
                edgecolor="black",
                capsize=2,
                label=segmentation,
            )
        axes.axhline(float(table["majority"].max()), color="black", ls=":", lw=1, label="best constant answer")
        axes.set_xticks(range(len(classifiers)), classifiers, rotation=30, ha="right")
        axes.set_title(f"{name} (simulated)", fontsize=9)
    panels[0][0].set_ylabel("accuracy per segment of EU")
    panels[0][0].set_ylim(0, 1)
    figure.legend(
        *panels[0][0].get_legend_handles_labels(), frameon=False, fontsize=8, ncols=3, loc="outside upper center"
    )
    return figure
