"""A contact sheet: the face once a second on one page, with time and label (as Figures 5.4 to 5.6 of Reverdy 2019)."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from ..errors import InputError
from .affect_colours import find_affects, find_label_colours, find_text_colour
from .captions import draw_scale_bar
from .lettering import BACKGROUND, QUIET, TEXT, font, shorten
from .partial_files import partial_file
from .performance import Performance, count_clock_frames
from .scene import Scene
from .screen_layout import Layout
from .view import View

TILE = (192, 208)
"""Width and height of one face, pixels."""

_CAPTION = 26
_GAP = 6
_LARGEST = 800  # faces; more make a picture that few programs open


def choose_sheet_frames(n_frames: int, rate: float, every: float) -> NDArray[np.int64]:
    """Return the frames that are due at 0, ``every``, 2 ``every`` … seconds.

    Raises
    ------
    InputError
        If ``every`` is not positive, or so small that the sheet would have more than 800 faces.
    """
    if not (np.isfinite(every) and every > 0):
        raise InputError(f"sheet: expected a positive number of seconds from face to face, but got {every:g}")
    n_faces = int(np.ceil((n_frames / rate) / every - 1e-9))
    if n_faces > _LARGEST:
        raise InputError(
            f"sheet: {n_faces} faces are too many for one page ({_LARGEST} at most); "
            f"show one every {np.ceil(n_frames / rate / _LARGEST * 10) / 10:g} s or fewer"
        )
    due = np.floor(np.arange(max(n_faces, 1)) * every * rate + 1e-6).astype(np.int64)
    return np.unique(np.minimum(due, n_frames - 1))


def draw_sheet(
    performance: Performance,
    *,
    every: float = 1.0,
    tile: tuple[int, int] = TILE,
    view: View | None = None,
    beside: Performance | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> NDArray[np.uint8]:
    """Return the sheet as a picture (height, width, 3).

    Parameters
    ----------
    performance, view, beside
        What is shown; panel and timeline are left out.
    every
        Seconds from one face to the next.
    tile
        Width and height of one face, pixels.
    progress
        Called with the number of faces done and of all.

    Raises
    ------
    InputError
        If ``every`` does not suit the take.
    MimiqueError
        If this machine cannot draw.
    """
    frames = choose_sheet_frames(count_clock_frames(performance, beside), performance.rate, every)
    view = replace(view or View(), curves=False)
    columns = _choose_columns(len(frames))
    width, height = tile
    head = 40
    rows = -(-len(frames) // columns)
    # One scale for all faces, where a page of usual size has it.
    margin = Layout(960, min(head + rows * (height + _CAPTION + _GAP), 540), 1, False, False, view.heat is not None)
    faces_width = columns * (width + _GAP) + _GAP
    size = (faces_width + margin.scale_width, head + rows * (height + _CAPTION + _GAP))
    sheet = Image.new("RGB", size, BACKGROUND)
    pen = ImageDraw.Draw(sheet)
    title = font(15, True)
    room = size[0] - 2 * _GAP - 8
    pen.text((_GAP + 4, head / 2), shorten(performance.title, title, room), font=title, fill=TEXT, anchor="lm")
    used = title.getlength(shorten(performance.title, title, room)) + 14
    note = shorten(performance.note, font(11), max(room - used, 0))
    if room - used > 40:
        pen.text((_GAP + 4 + used, head / 2 + 1), note, font=font(11), fill=QUIET, anchor="lm")
    tier = next(iter(performance.tiers), None)
    with Scene(performance, tile, view=view, beside=beside, bare=True) as scene:
        if view.heat is not None:
            sheet.paste(Image.fromarray(draw_scale_bar(view.heat, scene.ceiling, margin)), (faces_width, 0))
        for number, frame in enumerate(frames):
            x = _GAP + (number % columns) * (width + _GAP)
            y = head + (number // columns) * (height + _CAPTION + _GAP)
            sheet.paste(Image.fromarray(scene.image(int(frame))), (x, y))
            label = performance.label_at(tier, int(frame)) if tier is not None else ""
            lost = performance.is_lost(min(int(frame), performance.n_frames - 1))
            _write_caption(pen, (x, y + height), width, f"{frame / performance.rate:.2f} s", label, lost)
            if progress is not None:
                progress(number + 1, len(frames))
    return np.asarray(sheet)


def write_sheet(
    performance: Performance,
    path: str | os.PathLike[str],
    *,
    every: float = 1.0,
    tile: tuple[int, int] = TILE,
    view: View | None = None,
    beside: Performance | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Path:
    """Write :func:`draw_sheet` to a PNG file, complete or not at all.

    Raises
    ------
    InputError
        As there, and if the folder does not exist or the name does not end in .png.
    """
    path = Path(path)
    if path.suffix.lower() != ".png":
        raise InputError(f"sheet: expected a file name ending in .png, but got {path.name!r}")
    if not path.parent.is_dir():
        raise InputError(f"sheet: there is no folder {path.parent}; make it first")
    picture = draw_sheet(performance, every=every, tile=tile, view=view, beside=beside, progress=progress)
    with partial_file(path) as partial:
        Image.fromarray(picture).save(partial, format="png", optimize=True)
    return path


def _choose_columns(n_faces: int) -> int:
    """Return how many faces stand in a row: up to eight, and more only where the page would grow too long."""
    return min(n_faces, max(8, round(np.sqrt(n_faces * 1.5)))) if n_faces > 5 else n_faces


def _write_caption(
    pen: ImageDraw.ImageDraw, corner: tuple[int, int], width: int, time: str, label: str, lost: bool
) -> None:
    """Write the time and, on its colour, the label under a face."""
    x, y = corner
    middle, small = y + _CAPTION / 2, font(12)
    pen.text((x + 4, middle), time, font=small, fill="#ff8a65" if lost else TEXT, anchor="lm")
    left = x + 12 + small.getlength(time)
    if not label or left + 20 > x + width:
        return
    colours, affects = find_label_colours(label), find_affects(label)
    text = shorten(" → ".join(affects) or label, small, x + width - left - 12)
    right = min(left + small.getlength(text) + 12, x + width)
    pen.rounded_rectangle([left, y + 4, right, y + _CAPTION - 4], 3, fill=colours[0])
    if len(colours) == 2:
        pen.rectangle([left + 4, y + _CAPTION - 7, right - 4, y + _CAPTION - 5], fill=colours[1])
    pen.text((left + 6, middle), text, font=small, fill=find_text_colour(colours[0]), anchor="lm")
