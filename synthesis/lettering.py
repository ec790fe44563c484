"""Text in pictures: fonts, and text that fits its room."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import matplotlib
from PIL import ImageFont

BACKGROUND = "#171b21"
RULE = "#39424d"
QUIET = "#8b96a3"
TEXT = "#eef1f4"


@lru_cache(maxsize=64)
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return DejaVu Sans, which Matplotlib brings along, so that every machine draws the same letters."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), max(size, 1))


def shorten(text: str, letters: ImageFont.FreeTypeFont, width: float) -> str:
    """Return ``text``, cut with an ellipsis where it is wider than ``width`` pixels."""
    if letters.getlength(text) <= width:
        return text
    while text and letters.getlength(text + "…") > width:
        text = text[:-1]
    return text.rstrip() + "…"


def fit(text: str, size: int, width: float) -> ImageFont.FreeTypeFont:
    """Return the largest bold font up to ``size`` in which ``text`` is no wider than ``width``, at least 8 pixels."""
    while size > 8 and font(size, True).getlength(text) > width:
        size -= 1
    return font(size, True)
