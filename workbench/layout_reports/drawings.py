"""Figures that show the face itself: a layout with its numbers, and the error of several layouts by region."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ...errors import MimiqueError
from ...synthesis.face_regions import face_regions
from ...synthesis.landmarks import FaceLandmarks
from ...synthesis.rig import Rig
from ..reports.figure_style import STYLE
from .pictures import (
    FRONT,
    SIDES,
    FaceView,
    blank_views,
    draw_marks,
    draw_view,
    number_layout,
    render_views,
)

__all__ = ["LayoutPictures", "draw_layout_pictures", "draw_region_faces"]

WIDTH = 7.0  # inches; an A4 page without its margins
TALLEST = 9.3  # inches; so that a picture and its caption fit on one page
_PALE = (0.93, 0.92, 0.90)


@dataclass(frozen=True)
class LayoutPictures:
    """The pictures of a layout.

    Parameters
    ----------
    front, sides
        The figures.
    unseen
        Numbers of markers that are in none of them.
    blank
        Why no face is drawn, empty where one is.
    """

    front: Figure
    sides: Figure
    unseen: tuple[str, ...]
    blank: str = ""


@rc_context(STYLE)
def draw_layout_pictures(rig: Rig, vertices: Sequence[int], head: Mapping[str, int]) -> LayoutPictures:
    """Draw a layout on the face from the front and from both sides, with numbers that can be read.

    Parameters
    ----------
    rig
        The face.
    vertices
        Of the markers, in the order of their numbers.
    head
        The rigid markers, numbered H1, H2 …
    """
    marks = number_layout(vertices, head)
    where = [mark.vertex for mark in marks]
    reason = ""
    try:
        views = render_views(rig, (FRONT, *SIDES), vertices=where)
    except MimiqueError as error:
        views, reason = blank_views(rig, (FRONT, *SIDES), vertices=where), str(error)
    drawn: set[str] = set()
    width = min(WIDTH, TALLEST / views[0].aspect)
    front = Figure(figsize=(width, width * views[0].aspect), facecolor="white")
    axis = front.add_axes((0, 0, 1, 1))
    draw_view(axis, views[0])
    drawn |= set(draw_marks(axis, views[0], rig, marks, font=9.0))
    tall = max(view.aspect for view in views[1:]) * WIDTH / 2
    sides = Figure(figsize=(WIDTH, tall), facecolor="white")
    for k, view in enumerate(views[1:]):
        axis = sides.add_axes((0.5 * k, 0, 0.495, 1))
        draw_view(axis, view)
        drawn |= set(draw_marks(axis, view, rig, marks, font=7.5))
    return LayoutPictures(front, sides, tuple(m.text for m in marks if m.text not in drawn), reason)


@rc_context(STYLE)
def draw_region_faces(rig: Rig, errors: pd.DataFrame, *, landmarks: FaceLandmarks | None = None) -> Figure | None:
    """Draw the error of some layouts by region on the face (after Figure 3.4), one face a layout, one scale for all.

    Parameters
    ----------
    rig
        The face.
    errors
        mm, a row a layout, a column a region of :func:`.face_regions`.
    landmarks
        The rig's landmarks, where they were found before.

    Returns
    -------
    None where this machine cannot draw, or the rig's regions cannot be found.
    """
    try:
        regions = face_regions(rig, landmarks=landmarks)
        scale = Normalize(0.0, float(np.nanmax(errors.to_numpy(dtype=float))))
        views = [
            render_views(rig, (FRONT,), colours=_colour(rig, regions, row, scale), pixels=620)[0]
            for _, row in errors.iterrows()
        ]
    except MimiqueError:
        return None
    n = len(views)
    wide = min(2.6, 9.2 / n)
    tall = wide * views[0].aspect
    figure = Figure(figsize=(wide * n, tall + 0.85), facecolor="white")
    share = tall / (tall + 0.85)
    for k, (view, (name, row)) in enumerate(zip(views, errors.iterrows(), strict=True)):
        axis = figure.add_axes((k / n, 1 - share - 0.25 / (tall + 0.85), 1 / n, share))
        draw_view(axis, view)
        axis.set_title(str(name), fontsize=9, fontweight="bold", pad=4)
        _print_values(axis, view, rig, regions, row)
    bar = figure.add_axes((0.3, 0.40 / (tall + 0.85), 0.4, 0.10 / (tall + 0.85)))
    figure.colorbar(mpl.cm.ScalarMappable(scale, "cividis_r"), cax=bar, orientation="horizontal")
    bar.set_xlabel("mean vertex error (mm)", fontsize=8.5)
    bar.tick_params(labelsize=8)
    return figure


def _colour(
    rig: Rig, regions: Mapping[str, NDArray[np.int64]], row: pd.Series, scale: Normalize
) -> NDArray[np.float64]:
    colours = np.tile(np.array(_PALE), (rig.n_vertices, 1))
    shades = mpl.colormaps["cividis_r"]
    for name, members in regions.items():
        value = float(row.get(name, np.nan))
        if np.isfinite(value):
            colours[members] = shades(scale(value))[:3]
    return colours


def _print_values(
    axis: Axes, view: FaceView, rig: Rig, regions: Mapping[str, NDArray[np.int64]], row: pd.Series
) -> None:
    """Print each region's value on it, on the subject's left."""
    for name, members in regions.items():
        value = float(row.get(name, np.nan))
        here = members[view.visible[members]]
        own = here[rig.neutral[here, 0] > 0]
        if not len(own) or not np.isfinite(value):
            continue
        middle = np.median(rig.neutral[own] @ view.axes, axis=0)
        if name in ("nose", "lips", "chin"):  # across the midline
            middle = np.median(rig.neutral[here] @ view.axes, axis=0)
        elif name == "cheeks":  # they reach round to the ears; the front of them is meant
            middle = np.array([np.percentile(rig.neutral[own] @ view.axes[:, 0], 30), middle[1]])
        axis.text(
            float(middle[0]),
            float(middle[1]),
            f"{value:.2f}",
            fontsize=7.5,
            fontweight="bold",
            color="black",
            ha="center",
            va="center",
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
        )
