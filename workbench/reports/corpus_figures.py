"""The report's figures, as SVG that takes its ink from the page and so follows light, dark and print."""

from __future__ import annotations

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...synthesis.affect_colours import find_label_colours, find_text_colour
from .corpus_data import SegmentationExample
from .figure_style import INK, STYLE, make_figure, soften, to_svg

_CURVES = ("#1fa5a0", "#e07b1a", "#8a63c9", "#777777")  # turquoise and orange, as in Figure 4.3
_SEGMENTATIONS = ("#4a7fae", "#abcbe3", "#8a9a60", "#c5cf9f")


def wilson_interval(accuracy: ArrayLike, n: ArrayLike, z: float = 1.959964) -> tuple[NDArray, NDArray]:
    """Return the Wilson score interval of a proportion (Wilson 1927, JASA 22(158)).

    ``(p + z²/2n ± z √(p(1−p)/n + z²/4n²)) / (1 + z²/n)``; unlike p ± z·σ it stays in [0, 1] and makes sense for few
    segments. It takes them as independent, which neighbours in one sentence are not quite.

    Parameters
    ----------
    accuracy
        Proportion of successes, in [0, 1].
    n
        Number of trials; with none the bounds are NaN.
    z
        Quantile of the standard normal, 95 % by default.

    Returns
    -------
    Lower and upper bound.

    Raises
    ------
    InputError
        If a proportion is outside [0, 1].
    """
    p, n = np.asarray(accuracy, dtype=float), np.asarray(n, dtype=float)
    if ((p < 0) | (p > 1)).any():
        raise InputError(f"accuracy: expected values from 0 to 1, but got {np.nanmin(p):g} to {np.nanmax(p):g}")
    n = np.where(n > 0, n, np.nan)
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2)) / (1 + z**2 / n)
    return np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)


@matplotlib.rc_context(STYLE)
def draw_evaluation(evaluation: pd.DataFrame, people: pd.DataFrame | None = None) -> str:
    """Return Figure 4.4: accuracy by classifier and segmentation, a panel a signer, as SVG.

    Whiskers are the table's own 95 % intervals, or Wilson's where it has none; a diamond is the accuracy weighted by
    duration, a red line what always naming the most frequent label would reach, a dotted one across the panel what a
    second annotator reaches on the same segments (``people``: ``signer, segmentation, kind, accuracy``).
    """
    signers = list(dict.fromkeys(evaluation["signer"]))
    classifiers = list(dict.fromkeys(evaluation["classifier"]))
    segmentations = list(dict.fromkeys(evaluation["segmentation"]))
    n_columns = min(2, len(signers))
    n_rows = -(-len(signers) // n_columns)
    figure, axes = make_figure(9.2, 0.7 + 2.6 * n_rows, n_rows, n_columns, sharey=True)
    width = 0.8 / len(segmentations)
    for axis, signer in zip(axes.flat, signers, strict=False):
        of_signer = evaluation[evaluation["signer"] == signer]
        for i, segmentation in enumerate(segmentations):
            rows = of_signer[of_signer["segmentation"] == segmentation].drop_duplicates("classifier")
            rows = rows.set_index("classifier").reindex(classifiers)
            x = np.arange(len(classifiers)) - 0.4 + (i + 0.5) * width
            colour = _SEGMENTATIONS[i % len(_SEGMENTATIONS)]
            _draw_bars(axis, x, rows, width, colour, str(segmentation))
            for accuracy in _find_people(people, signer, segmentation):
                axis.axhline(accuracy, color=colour, linewidth=1.6, linestyle=":", zorder=1, label="second annotator")
        axis.set_title(str(signer), loc="left", fontsize=10.5, fontweight="bold")
        axis.set_xticks(np.arange(len(classifiers)), [str(c).replace(" ", "\n") for c in classifiers])
        axis.tick_params(axis="x", length=0)
        axis.set_ylim(0, 1)
        axis.set_yticks(np.arange(0, 1.01, 0.2), [f"{v} %" for v in range(0, 101, 20)])
        soften(axis)
    for axis in axes.flat[len(signers) :]:
        axis.set_visible(False)
    axes[0, 0].set_ylabel("accuracy per segment")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    bars = [str(s) for s in segmentations]
    unique = {name: known[name] for name in [*bars, *(n for n in known if n not in bars)]}
    figure.legend(unique.values(), unique.keys(), loc="outside upper left", ncols=len(unique), frameon=False)
    return to_svg(figure, "Accuracy by classifier, segmentation and signer")


def _find_people(people: pd.DataFrame | None, signer: str, segmentation: str) -> list[float]:
    """Return what people reach who labelled from scratch; answers with proposals are in the table alone."""
    if people is None or people.empty:
        return []
    alike = (people["signer"] == signer) & (people["segmentation"] == segmentation) & (people["kind"] == "person")
    if "reading" in people:
        alike &= people["reading"] == "from scratch"
    return [float(value) for value in people.loc[alike, "accuracy"].dropna()]


def _draw_bars(axis: Axes, x: NDArray, rows: pd.DataFrame, width: float, colour: str, name: str) -> None:
    accuracy = rows["accuracy"].to_numpy(dtype=float)
    axis.bar(x, np.nan_to_num(accuracy), width * 0.92, color=colour, label=name, zorder=2)
    low, high = wilson_interval(accuracy, rows["n_segments"].to_numpy(dtype=float))
    if {"accuracy_low", "accuracy_high"} <= set(rows.columns):
        own = rows[["accuracy_low", "accuracy_high"]].to_numpy(dtype=float)
        low, high = np.where(np.isnan(own).any(axis=1), (low, high), own.T)
    axis.vlines(x, low, high, color=INK, linewidth=1.1, zorder=4, label="95 % interval")
    if "accuracy_duration" in rows:
        axis.plot(
            x,
            rows["accuracy_duration"].to_numpy(dtype=float),
            marker="D",
            markersize=4.2,
            linestyle="none",
            markerfacecolor="#ffffff",
            markeredgecolor=INK,
            markeredgewidth=0.9,
            zorder=5,
            label="by duration",
        )
    if "majority" in rows:
        majority = rows["majority"].to_numpy(dtype=float)
        axis.hlines(
            majority, x - width / 2, x + width / 2, color="#c0392b", linewidth=1.6, zorder=3, label="majority label"
        )


@matplotlib.rc_context(STYLE)
def draw_recording_times(times: pd.DataFrame) -> str:
    """Return Table B.1 as stacked bars, a bar a row, as SVG."""
    figure, axes = make_figure(9.2, 0.9 + 0.3 * len(times), 1, 1)
    axis = axes[0, 0]
    left = np.zeros(len(times))
    y = np.arange(len(times))
    for column in times.columns:
        seconds = np.nan_to_num(times[column].to_numpy(dtype=float))
        colour = _find_column_colour(str(column))
        axis.barh(y, seconds, left=left, height=0.68, color=colour, label=str(column), linewidth=0)
        left += seconds
    axis.set_yticks(y, [str(name) for name in times.index])
    axis.invert_yaxis()
    axis.set_xlim(0, max(left.max() * 1.02, 1e-9) if len(left) else 1)
    axis.set_xlabel("seconds")
    axis.tick_params(axis="y", length=0)
    soften(axis, along="x")
    figure.legend(loc="outside upper left", ncols=9, frameon=False, handlelength=1, handleheight=1, columnspacing=1.3)
    return to_svg(figure, "Recorded seconds per label, by signer and protocol")


def _find_column_colour(column: str) -> str:
    known = {"transitions": "#3c4650", "gap": "#e9e4d8", "unannotated": "#e9e4d8"}
    return known.get(column.lower()) or find_label_colours(column)[0]


@matplotlib.rc_context(STYLE)
def draw_residuals(residuals: pd.DataFrame) -> str:
    """Return mean and 95th percentile of the marker residuals of every take, as SVG; a dot a take beyond 30 takes."""
    table = residuals.reset_index(drop=True)
    many = len(table) > 30
    figure, axes = make_figure(9.2, 3.0 if many else 0.8 + 0.23 * len(table), 1, 1)
    axis = axes[0, 0]
    mean, p95 = (table[c].to_numpy(dtype=float) for c in ("mean", "p95"))
    if many:
        order = np.argsort(mean, kind="stable")
        place = np.arange(len(table))
        axis.vlines(place, mean[order], p95[order], color="#8fb7d6", linewidth=1.4)
        axis.plot(place, p95[order], "o", color="#8fb7d6", markersize=3.2, label="95th percentile")
        axis.plot(place, mean[order], "o", color="#4a7fae", markersize=3.2, label="mean")
        axis.set_xlabel("takes, by mean residual")
        axis.set_xticks([])
        axis.set_ylabel("marker residual (mm)")
        axis.set_ylim(bottom=0)
        soften(axis)
    else:
        place = np.arange(len(table))
        axis.hlines(place, mean, p95, color="#8fb7d6", linewidth=2.2)
        axis.plot(p95, place, "o", color="#8fb7d6", markersize=5, label="95th percentile")
        axis.plot(mean, place, "o", color="#4a7fae", markersize=5, label="mean")
        axis.set_yticks(place, [str(name) for name in table["take"]], fontsize=8.5)
        axis.invert_yaxis()
        axis.set_ylim(len(table) - 0.4, -0.6)
        axis.set_xlabel("marker residual (mm)")
        axis.set_xlim(left=0)
        axis.tick_params(axis="y", length=0)
        soften(axis, along="x")
    figure.legend(loc="outside upper left", ncols=2, frameon=False)
    return to_svg(figure, "Marker residuals of the solve, take by take")


@matplotlib.rc_context(STYLE)
def draw_segmentation(example: SegmentationExample) -> str:
    """Return Figure 4.3: the energies of a take over its manual and automatic segments in colour, as SVG."""
    names = list(example.tiers)
    stop = len(next(iter(example.energies.values()))) if example.stop is None else example.stop
    heights = [2.0] + [0.34] * len(names)
    figure, axes = make_figure(9.2, 1.2 + sum(heights), len(heights), 1, sharex=True, height_ratios=heights)
    seconds = np.arange(example.start, stop) / example.rate
    top = axes[0, 0]
    for (name, curve), colour in zip(example.energies.items(), _CURVES * len(example.energies), strict=False):
        top.plot(seconds, np.asarray(curve)[example.start : stop], color=colour, linewidth=1.3, label=name)
    top.set_ylim(bottom=0)
    top.set_ylabel(f"energy ({example.unit})")
    soften(top)
    for axis, name in zip(axes[1:, 0], names, strict=True):
        table = example.tiers[name]
        for onset, offset, label in zip(table["onset"], table["offset"], table["label"], strict=True):
            if offset > example.start and onset < stop:
                _draw_segment(axis, max(onset, example.start), min(offset, stop), str(label), example)
        axis.set_ylim(0, 1)
        axis.set_yticks([0.5], [str(name)])
        axis.tick_params(length=0)
        axis.spines[:].set_visible(False)
    if names:  # boundaries of the last tier, the automatic one, through the curves
        table = example.tiers[names[-1]]
        edges = np.unique(np.concatenate([table["onset"], table["offset"]]))
        inside = edges[(edges > example.start) & (edges < stop)] / example.rate
        top.vlines(inside, 0, 1, transform=top.get_xaxis_transform(), color="#8c6a4f", linewidth=0.8, alpha=0.7)
    axes[-1, 0].set_xlabel("seconds")
    axes[-1, 0].tick_params(axis="x", length=3)
    top.set_xlim(example.start / example.rate, stop / example.rate)
    figure.legend(loc="outside upper left", ncols=len(example.energies), frameon=False)
    return to_svg(figure, f"Energies and segments of take {example.take}")


def _draw_segment(axis: Axes, onset: int, offset: int, label: str, example: SegmentationExample) -> None:
    start, stop = onset / example.rate, offset / example.rate
    colours = find_label_colours(label)
    axis.fill([start, stop, stop, start], [0.04, 0.04, 0.96, 0.96], color=colours[0], linewidth=0)
    if len(colours) == 2:
        axis.fill([start, stop, stop], [0.04, 0.96, 0.04], color=colours[1], linewidth=0)
    axis.plot([start, start], [0.04, 0.96], color=INK, linewidth=0.5)
    whole = (len(next(iter(example.energies.values()))) if example.stop is None else example.stop) - example.start
    if len(colours) == 1 and (offset - onset) / whole > 0.0095 * (len(label) + 1):
        ink = find_text_colour(colours[0])
        axis.text((start + stop) / 2, 0.47, label, ha="center", va="center", fontsize=8.5, color=ink)
