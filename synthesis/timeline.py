"""The pictures beside the face: a panel with take, labels and time, and a timeline with a moving cursor.

Both are plain arrays, so that the window and the film show the very same thing. What does not change from frame to
frame is drawn once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw, ImageFont

from .affect_colours import find_affects, find_label_colours, find_text_colour
from .performance import Performance

Box = tuple[float, float, float, float]

BACKGROUND = "#171b21"
_GROOVE = "#232931"
_RULE = "#39424d"
_QUIET = "#8b96a3"
_TEXT = "#eef1f4"
_CURVE = "#f2a65a"
_CURSOR = "#ffffff"
_SMOOTHING = 3  # the static part is drawn this many times larger and reduced: smooth edges without a plotting library


@dataclass(frozen=True)
class Layout:
    """Where things go in a picture of ``width`` × ``height`` pixels: panel left, face right, timeline under both."""

    width: int
    height: int

    @property
    def scale(self) -> float:
        """Size of text and gaps, 1 at 960 × 540."""
        return min(self.width / 960, self.height / 540)

    @property
    def panel_width(self) -> int:
        """Pixels that the panel takes at the left."""
        return round(self.width * 0.25)

    @property
    def strip_height(self) -> int:
        """Pixels that the timeline takes at the bottom."""
        return round(self.height * 0.2)


@lru_cache(maxsize=64)
def _font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return DejaVu Sans, which Matplotlib brings along, so that every machine draws the same letters."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


def _shorten(text: str, font: ImageFont.FreeTypeFont, width: float) -> str:
    """Return ``text``, cut with an ellipsis where it is wider than ``width`` pixels."""
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(text + "…") > width:
        text = text[:-1]
    return text.rstrip() + "…"


def _fit(text: str, size: int, width: float) -> ImageFont.FreeTypeFont:
    """Return the largest bold font up to ``size`` in which ``text`` is no wider than ``width``, at least half size."""
    while size > 8 and _font(size, True).getlength(text) > width:
        size -= 1
    return _font(size, True)


class Timeline:
    """Panel and timeline of one performance at one picture size.

    Parameters
    ----------
    performance
        What is shown.
    layout
        Size of the whole picture.
    """

    def __init__(self, performance: Performance, layout: Layout) -> None:
        self.performance = performance
        self.layout = layout
        k = layout.scale
        widest = max((_font(round(11 * k)).getlength(name) for name in performance.tiers), default=0)
        self._left = round(min(max(widest + 26 * k, 40 * k), 0.2 * layout.width))
        self._right = layout.width - round(18 * k)
        self._strip = self._draw_strip()

    def frame_at(self, x: float) -> int:
        """Return the frame under the horizontal pixel ``x`` of the timeline, from the first to the last frame."""
        share = (x - self._left) / (self._right - self._left)
        return int(np.clip(share * self.performance.n_frames, 0, self.performance.n_frames - 1))

    def position_of(self, frame: float) -> float:
        """Return the horizontal pixel where ``frame`` begins."""
        return self._left + (self._right - self._left) * frame / self.performance.n_frames

    def draw_timeline(self, frame: int) -> NDArray[np.uint8]:
        """Return the timeline with its cursor on ``frame``, (strip_height, width, 3)."""
        strip = self._strip.copy()
        k = self.layout.scale
        x, top, bottom = self.position_of(frame + 0.5), 8 * k, strip.height - 19 * k
        pen = ImageDraw.Draw(strip)
        pen.line([(x, top), (x, bottom)], fill=_CURSOR, width=max(1, round(1.6 * k)))
        pen.ellipse([x - 4.5 * k, top - 4.5 * k, x + 4.5 * k, top + 4.5 * k], fill=_CURSOR)
        return np.asarray(strip)

    def draw_panel(self, frame: int) -> NDArray[np.uint8]:
        """Return the panel for ``frame``: take, note, current label of every tier, time; (height, panel_width, 3)."""
        p, k = self.performance, self.layout.scale
        width, height = self.layout.panel_width, self.layout.height - self.layout.strip_height
        panel = Image.new("RGB", (width, height), BACKGROUND)
        pen = ImageDraw.Draw(panel)
        left, room = 20 * k, width - 32 * k
        pen.text((left, 20 * k), p.title, font=_fit(p.title, round(17 * k), room), fill=_TEXT)
        small = _font(round(11 * k))
        pen.text((left, 45 * k), _shorten(p.note, small, room), font=small, fill=_QUIET)
        y = 88 * k
        for name in list(p.tiers)[:3]:
            self._draw_label(pen, name, p.label_at(name, frame), (left, y, left + room, y + 62 * k))
            y += 82 * k
        seconds = f"{frame / p.rate:.2f}"
        large = _font(round(30 * k), True)
        pen.text((left, height - 62 * k), seconds, font=large, fill=_TEXT)
        pen.text(
            (left + large.getlength(seconds) + 6 * k, height - 46 * k),
            f"s of {p.duration:.1f} s",
            font=_font(round(12 * k)),
            fill=_QUIET,
        )
        lost = not np.isfinite(p.weights[frame]).all()
        state = "no weights in this frame" if lost else f"frame {frame}, {p.rate:g} Hz"
        pen.text((left, height - 22 * k), state, font=small, fill="#ff8a65" if lost else _QUIET)
        return np.asarray(panel)

    def _draw_label(self, pen: ImageDraw.ImageDraw, tier: str, label: str, box: Box) -> None:
        """Draw a tier's name over its current label, on the label's colour."""
        k = self.layout.scale
        left, top, right, bottom = box
        small = _font(round(11 * k))
        pen.text((left, top), _shorten(tier, small, right - left), font=small, fill=_QUIET)
        chip = (left, top + 18 * k, right, bottom)
        if not label:
            pen.rounded_rectangle(chip, 5 * k, outline=_RULE)
            pen.text((left + 12 * k, (chip[1] + bottom) / 2), "–", font=_font(round(18 * k)), fill=_QUIET, anchor="lm")
            return
        colours = find_label_colours(label)
        affects = find_affects(label)
        pen.rounded_rectangle(chip, 5 * k, fill=colours[0])
        if len(colours) == 2:
            pen.rounded_rectangle((right - 26 * k, chip[1], right, bottom), 5 * k, fill=colours[1])
            pen.rectangle((right - 26 * k, chip[1], right - 18 * k, bottom), fill=colours[1])
        text = " → ".join(affects) if affects else label
        room = right - left - 22 * k - (26 * k if len(colours) == 2 else 0)
        font = _fit(text, round(22 * k), room)
        pen.text(
            (left + 12 * k, (chip[1] + bottom) / 2), text, font=font, fill=find_text_colour(colours[0]), anchor="lm"
        )

    def _draw_strip(self) -> Image.Image:
        """Return everything in the timeline but the cursor."""
        p, k = self.performance, self.layout.scale
        width, height = self.layout.width, self.layout.strip_height
        tiers = list(p.tiers)[:3]
        top, bottom = 10 * k, height - 21 * k
        gap = 4 * k
        curve_share = (0.45 if tiers else 1.0) if p.energy is not None else 0.0
        row_top = top + (bottom - top) * curve_share
        row_height = min((bottom - row_top) / max(len(tiers), 1), 30 * k)
        rows: dict[str, Box] = {}
        for i, name in enumerate(tiers):
            y = bottom - (len(tiers) - i) * row_height
            rows[name] = (self._left, y + gap / 2, self._right, y + row_height - gap / 2)
        curve = (self._left, top, self._right, bottom - len(tiers) * row_height - gap / 2)

        f = _SMOOTHING
        large = Image.new("RGB", (width * f, height * f), BACKGROUND)
        pen = ImageDraw.Draw(large)
        if p.energy is not None:
            self._draw_curve(pen, curve)
        for name, row in rows.items():
            pen.rectangle([v * f for v in row], fill=_GROOVE)
            for onset, offset, label in self._segments(name):
                self._draw_segment(pen, (self.position_of(onset), row[1], self.position_of(offset), row[3]), label)
        if not rows and p.energy is None:
            middle = (top + bottom) / 2
            pen.rectangle([v * f for v in (self._left, middle - k, self._right, middle + k)], fill=_RULE)
        strip = large.resize((width, height), Image.Resampling.BOX)
        self._write_strip(ImageDraw.Draw(strip), rows, curve, bottom)
        return strip

    def _segments(self, tier: str) -> list[tuple[int, int, str]]:
        table = self.performance.tiers[tier]
        return [
            (int(a), int(b), str(c)) for a, b, c in zip(table["onset"], table["offset"], table["label"], strict=True)
        ]

    def _draw_segment(self, pen: ImageDraw.ImageDraw, box: Box, label: str) -> None:
        """Fill a box with the label's colour; a transition is cut along the diagonal, from and to."""
        left, top, right, bottom = (v * _SMOOTHING for v in box)
        right = max(right - _SMOOTHING * 0.8, left + 1)  # a hairline between neighbours
        colours = find_label_colours(label)
        pen.rectangle((left, top, right, bottom), fill=colours[0])
        if len(colours) == 2:
            pen.polygon([(left, bottom), (right, top), (right, bottom)], fill=colours[1])

    def _draw_curve(self, pen: ImageDraw.ImageDraw, box: Box) -> None:
        """Draw the energy, from zero to its 99.5th percentile; one column of pixels shows its largest value."""
        f = _SMOOTHING
        left, top, right, bottom = (v * f for v in box)
        energy = np.asarray(self.performance.energy, dtype=float)
        finite = energy[np.isfinite(energy)]
        pen.line([(left, bottom), (right, bottom)], fill=_RULE, width=f)
        ceiling = float(np.percentile(finite, 99.5)) if finite.size else 0.0
        if ceiling <= 0:
            return
        n_columns = int(min(len(energy), right - left))
        groups = np.array_split(np.nan_to_num(energy, nan=0.0), n_columns)
        values = np.clip([group.max() / ceiling for group in groups], 0, 1)
        x = left + (right - left) * (np.arange(n_columns) + 0.5) / n_columns
        points = list(zip(x.tolist(), (bottom - values * (bottom - top)).tolist(), strict=True))
        shade = tuple(
            (3 * b + c) // 4 for b, c in zip(ImageColor.getrgb(BACKGROUND), ImageColor.getrgb(_CURVE), strict=True)
        )
        pen.polygon([(left, bottom), *points, (right, bottom)], fill=shade)
        pen.line(points, fill=_CURVE, width=round(1.3 * f * self.layout.scale), joint="curve")

    def _write_strip(self, pen: ImageDraw.ImageDraw, rows: dict[str, Box], curve: Box, bottom: float) -> None:
        """Write the names of the rows, the labels of segments wide enough for them, and the seconds."""
        p, k = self.performance, self.layout.scale
        small, tiny = _font(round(11 * k)), _font(round(10 * k))
        room = self._left - 20 * k
        if p.energy is not None:
            pen.text((12 * k, (curve[1] + curve[3]) / 2), "energy", font=small, fill=_QUIET, anchor="lm")
        for name, row in rows.items():
            middle = (row[1] + row[3]) / 2
            pen.text((12 * k, middle), _shorten(name, small, room), font=small, fill=_QUIET, anchor="lm")
            for onset, offset, label in self._segments(name):
                start, stop = self.position_of(onset), self.position_of(offset)
                if len(find_label_colours(label)) == 1 and small.getlength(label) + 6 * k < stop - start:
                    ink = find_text_colour(find_label_colours(label)[0])
                    pen.text(((start + stop) / 2, middle), label, font=small, fill=ink, anchor="mm")
        step = choose_tick(p.duration, (self._right - self._left) / (52 * k))
        for i in range(int(p.duration / step + 1e-9) + 1):
            x = self.position_of(i * step * p.rate)
            pen.line([(x, bottom + 2 * k), (x, bottom + 5 * k)], fill=_QUIET)
            text = f"{i * step:g}" + (" s" if i == 0 else "")
            pen.text((x, bottom + 7 * k), text, font=tiny, fill=_QUIET, anchor="ma" if i else "la")


def choose_tick(duration: float, n_ticks: float) -> float:
    """Return the least of 0.1, 0.2, 0.5, 1, 2, 5 … (s) that cuts ``duration`` into at most ``n_ticks`` parts."""
    exponent = -1
    while True:
        for factor in (1, 2, 5):
            step = factor * 10.0**exponent
            if duration / step <= max(n_ticks, 1):
                return step
        exponent += 1
