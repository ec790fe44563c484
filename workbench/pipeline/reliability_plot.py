"""The reliability diagram: how often answers are right, against how sure they are."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ...errors import InputError

__all__ = ["draw_reliability"]

STYLES = (("o", "-"), ("s", "--"), ("^", "-."), ("D", ":"))
"""Marker and line, so that methods are told apart without colour."""
LEAST = 5
"""Answers in a bin that is drawn; what is right of fewer says nothing."""


def draw_reliability(table: pd.DataFrame, path: str | Path, *, segmentation: str = "manual") -> None:
    """Draw one panel before and one after calibration, with how many answers are in each bin.

    Parameters
    ----------
    table
        ``method, segmentation, calibration`` (before, after) ``, n, confidence, accuracy``; bins with fewer
        than :data:`LEAST` answers have no point.
    path
        PNG to write.
    segmentation
        Which segments.

    Raises
    ------
    InputError
        If the table has no such segments, or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    some = table[(table["segmentation"] == segmentation) & (table["n"] > 0)]
    if not len(some):
        raise InputError(f"reliability: expected bins of {segmentation} segments, but there are none")
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, sharex=True, height_ratios=[3, 1])
    for column, when in enumerate(("before", "after")):
        curve, counts = axes[0][column], axes[1][column]
        curve.plot([0, 1], [0, 1], color="0.7", linewidth=1)
        for (name, own), (marker, line) in zip(
            some[some["calibration"] == when].groupby("method", sort=False), STYLES, strict=False
        ):
            grey = "black" if line == "-" else "0.4"
            full = own[own["n"] >= LEAST]
            curve.plot(
                full["confidence"], full["accuracy"], marker=marker, linestyle=line, color=grey, label=str(name),
                fillstyle="full" if line == "-" else "none",
            )  # fmt: skip
            counts.step((own["low"] + own["high"]) / 2, own["n"], where="mid", linestyle=line, color=grey)
        curve.set(title=f"{when} calibration", xlim=(0, 1), ylim=(0, 1.02), ylabel="part that is right")
        counts.set(xlabel="probability of the answer", ylabel="segments")
        curve.legend(loc="upper left", frameon=False)
    try:
        figure.savefig(path, dpi=120, format="png")
    except OSError as error:
        raise InputError(f"{path}: the picture cannot be written ({error.strerror or error})") from error
