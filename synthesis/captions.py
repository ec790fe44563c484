"""What is written round the faces: captions, the heat map's scale, the keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from .heat import colour_table
from .lettering import BACKGROUND, QUIET, RULE, TEXT, fit, font, shorten
from .screen_layout import Layout

KEYS = (
    ("space", "play, pause"),
    ("← →", "one frame (shift: one second)"),
    ("home end", "first, last frame"),
    ("n p", "next, previous segment"),
    ("l", "loop the segment"),
    ("1 … 5", "speed ¼ ½ 1 2 4"),
    ("- +", "slower, faster"),
    ("f q s", "front, three-quarter, side"),
    ("h", "this help"),
    ("escape", "close"),
)
"""What the window's keys do."""


@dataclass(frozen=True)
class Caption:
    """What stands over one face: a text, and the kinds of markers in their colours."""

    text: str
    legend: tuple[tuple[str, str], ...] = ()


def draw_captions(captions: Sequence[Caption], layout: Layout) -> NDArray[np.uint8]:
    """Return the line over the faces, (caption_height, width of all faces, 3)."""
    left, _, right, _ = layout.faces
    k, height = layout.scale, layout.caption_height
    line = Image.new("RGB", (right - left, height), BACKGROUND)
    pen, small = ImageDraw.Draw(line), font(round(11 * k))
    for number, caption in enumerate(captions):
        start, _, stop, _ = layout.column(number)
        x, end = start - left + 10 * k, stop - left - 8 * k
        if number:
            pen.line([(start - left, 4 * k), (start - left, height - 4 * k)], fill=RULE)
        for colour, word in reversed(caption.legend):
            width = small.getlength(word) + 20 * k
            if end - width < x:
                break
            end -= width
            pen.ellipse([end, height / 2 - 3.5 * k, end + 7 * k, height / 2 + 3.5 * k], fill=colour)
            pen.text((end + 11 * k, height / 2), word, font=small, fill=TEXT, anchor="lm")
        pen.text((x, height / 2), shorten(caption.text, small, end - x - 8 * k), font=small, fill=QUIET, anchor="lm")
    return np.asarray(line)


def draw_scale_bar(what: str, ceiling: float, layout: Layout) -> NDArray[np.uint8]:
    """Return the heat map's scale from 0 to ``ceiling`` mm, (height of the faces with captions, scale_width, 3)."""
    k, width = layout.scale, layout.scale_width
    height = layout.height - layout.strip_height
    picture = Image.new("RGB", (width, height), BACKGROUND)
    pen, small = ImageDraw.Draw(picture), font(max(round(10 * k), 7))
    top, bottom, left = round(58 * k), height - round(26 * k), round(14 * k)
    bar = np.repeat(colour_table()[::-1, None], max(round(14 * k), 4), axis=1)
    picture.paste(Image.fromarray(bar).resize((bar.shape[1], max(bottom - top, 1))), (left, top))
    pen.text((width / 2, 14 * k), what, font=fit(what, round(11 * k), width - 6), fill=TEXT, anchor="mm")
    pen.text((width / 2, 30 * k), "mm", font=small, fill=QUIET, anchor="mm")
    for i in range(6 if ceiling not in (1.5, 3, 7.5, 15, 30) else 4):
        share = i / (5 if ceiling not in (1.5, 3, 7.5, 15, 30) else 3)
        y = bottom - 1 - share * (bottom - top - 1)
        x = left + bar.shape[1]
        pen.line([(x, y), (x + 4 * k, y)], fill=QUIET)
        pen.text((x + 7 * k, y), f"{ceiling * share:.3g}", font=small, fill=TEXT, anchor="lm")
    return np.asarray(picture)


def draw_help(layout: Layout) -> NDArray[np.uint8]:
    """Return the list of keys, (height, width, 3), no larger than the picture."""
    k = layout.scale
    width, height = round(330 * k), round((22 * len(KEYS) + 28) * k)
    picture = Image.new("RGB", (min(width, layout.width), min(height, layout.height)), BACKGROUND)
    pen = ImageDraw.Draw(picture)
    pen.rectangle([0, 0, picture.width - 1, picture.height - 1], outline=QUIET)
    for row, (keys, what) in enumerate(KEYS):
        y = (24 + 22 * row) * k
        pen.text((18 * k, y), keys, font=font(round(12 * k), True), fill=TEXT, anchor="lm")
        pen.text((112 * k, y), what, font=font(round(12 * k)), fill=TEXT, anchor="lm")
    return np.asarray(picture)
