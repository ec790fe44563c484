"""The pictures beside the face: a panel with take, labels and time, and a timeline with a moving cursor.

Both are plain arrays, so that the window and the film show the very same thing. What does not change from frame to
frame is drawn once.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw

from .affect_colours import find_affects, find_label_colours, find_text_colour
from .lettering import BACKGROUND, QUIET, RULE, TEXT, fit, font, shorten
from .performance import Performance, count_clock_frames
from .screen_layout import Layout

Box = tuple[float, float, float, float]

_GROOVE = "#232931"
_CURVES = ("#f2a65a", "#7fd1c7")  # the second one belongs to the performance beside
_CURSOR = "#ffffff"
_SMOOTHING = 3  # the static part is drawn this many times larger and reduced: smooth edges without a plotting library
_ROWS = 3


class Row(NamedTuple):
    """A tier that is shown: its name, and whose."""

    name: str
    tier: str
    performance: Performance


class Timeline:
    """Panel and timeline of one performance at one picture size.

    Parameters
    ----------
    performance
        What is shown; the timeline counts its frames.
    layout
        Size of the whole picture.
    beside
        What is shown beside it, on the same clock.
    """

    def __init__(self, performance: Performance, layout: Layout, beside: Performance | None = None) -> None:
        self.performance = performance
        self.beside = beside
        self.layout = layout
        self.n_frames = count_clock_frames(performance, beside)
        """Frames from the start to the end of both."""
        k = layout.scale
        self._rows = self._choose_rows()
        names = [row.name for row in self._rows] + ["energy"] * bool(self._list_curves())
        widest = max((font(round(11 * k)).getlength(name) for name in names), default=0)
        self._left = round(min(max(widest + 26 * k, 40 * k), 0.2 * layout.width))
        self._right = layout.width - round(18 * k)

    @property
    def duration(self) -> float:
        """Seconds that the timeline shows."""
        return self.n_frames / self.performance.rate

    def frame_at(self, x: float) -> int:
        """Return the frame under the horizontal pixel ``x`` of the timeline, from the first to the last frame."""
        share = (x - self._left) / (self._right - self._left)
        return int(np.clip(share * self.n_frames, 0, self.n_frames - 1))

    def position_of(self, frame: float) -> float:
        """Return the horizontal pixel where ``frame`` begins."""
        return self._left + (self._right - self._left) * frame / self.n_frames

    def draw_timeline(self, frame: int, loop: tuple[int, int] | None = None) -> NDArray[np.uint8]:
        """Return the timeline with its cursor on ``frame``, (strip_height, width, 3); a loop is underlined."""
        strip = self._strip.copy()
        k = self.layout.scale
        x, top, bottom = self.position_of(frame + 0.5), 8 * k, strip.height - 19 * k
        pen = ImageDraw.Draw(strip)
        if loop is not None:
            ends = [(self.position_of(border), bottom + 2 * k) for border in loop]
            pen.line(ends, fill=_CURSOR, width=max(1, round(3 * k)))
        pen.line([(x, top), (x, bottom)], fill=_CURSOR, width=max(1, round(1.6 * k)))
        pen.ellipse([x - 4.5 * k, top - 4.5 * k, x + 4.5 * k, top + 4.5 * k], fill=_CURSOR)
        return np.asarray(strip)

    def draw_panel(self, frame: int, state: str = "") -> NDArray[np.uint8]:
        """Return the panel for ``frame``: take, note, current label of every tier, time; (height, panel_width, 3).

        ``state`` says what else the player does, such as its speed.
        """
        p, k = self.performance, self.layout.scale
        width, height = self.layout.panel_width, self.layout.height - self.layout.strip_height
        panel = Image.new("RGB", (width, height), BACKGROUND)
        pen = ImageDraw.Draw(panel)
        left, room = 20 * k, width - 32 * k
        pen.text((left, 20 * k), p.title, font=fit(p.title, round(17 * k), room), fill=TEXT)
        small = font(round(11 * k))
        pen.text((left, 45 * k), shorten(p.note, small, room), font=small, fill=QUIET)
        y = 88 * k
        for row in self._rows:
            here = row.performance.frame_at(frame / p.rate)
            label = row.performance.label_at(row.tier, here)
            self._draw_label(pen, row.name, label, (left, y, left + room, y + 62 * k))
            y += 82 * k
        seconds = f"{frame / p.rate:.2f}"
        large = font(round(30 * k), True)
        if state:
            pen.text((left, height - 80 * k), shorten(state, small, room), font=small, fill=TEXT)
        pen.text((left, height - 62 * k), seconds, font=large, fill=TEXT)
        pen.text(
            (left + large.getlength(seconds) + 6 * k, height - 46 * k),
            f"s of {self.duration:.1f} s",
            font=font(round(12 * k)),
            fill=QUIET,
        )
        lost = p.is_lost(min(frame, p.n_frames - 1))
        here_or_lost = "no weights in this frame" if lost else f"frame {frame}, {p.rate:g} Hz"
        pen.text((left, height - 22 * k), here_or_lost, font=small, fill="#ff8a65" if lost else QUIET)
        return np.asarray(panel)

    def _choose_rows(self) -> list[Row]:
        """Choose the tiers to show: the performance's own; of another take, its first one after the first of these."""
        rows = [Row(name, name, self.performance) for name in self.performance.tiers][:_ROWS]
        other = self.beside
        if other is not None and other.title != self.performance.title and other.tiers:
            first = next(iter(other.tiers))
            rows = [*rows[:1], Row(f"{first} · {other.title}", first, other), *rows[1:]][:_ROWS]
        return rows

    def _draw_label(self, pen: ImageDraw.ImageDraw, tier: str, label: str, box: Box) -> None:
        """Draw a tier's name over its current label, on the label's colour."""
        k = self.layout.scale
        left, top, right, bottom = box
        small = font(round(11 * k))
        pen.text((left, top), shorten(tier, small, right - left), font=small, fill=QUIET)
        chip = (left, top + 18 * k, right, bottom)
        if not label:
            pen.rounded_rectangle(chip, 5 * k, outline=RULE)
            pen.text((left + 12 * k, (chip[1] + bottom) / 2), "–", font=font(round(18 * k)), fill=QUIET, anchor="lm")
            return
        colours = find_label_colours(label)
        affects = find_affects(label)
        pen.rounded_rectangle(chip, 5 * k, fill=colours[0])
        if len(colours) == 2:
            pen.rounded_rectangle((right - 26 * k, chip[1], right, bottom), 5 * k, fill=colours[1])
            pen.rectangle((right - 26 * k, chip[1], right - 18 * k, bottom), fill=colours[1])
        text = " → ".join(affects) if affects else label
        room = right - left - 22 * k - (26 * k if len(colours) == 2 else 0)
        letters = fit(text, round(22 * k), room)
        pen.text(
            (left + 12 * k, (chip[1] + bottom) / 2), text, font=letters, fill=find_text_colour(colours[0]), anchor="lm"
        )

    @cached_property
    def _strip(self) -> Image.Image:
        """Return everything in the timeline but the cursor."""
        k = self.layout.scale
        width, height = self.layout.width, max(self.layout.strip_height, 1)
        tiers = self._rows
        curves = self._list_curves()
        top, bottom = 10 * k, height - 21 * k
        gap = 4 * k
        curve_share = (0.45 if tiers else 1.0) if curves else 0.0
        row_top = top + (bottom - top) * curve_share
        row_height = min((bottom - row_top) / max(len(tiers), 1), 30 * k)
        rows: list[tuple[Row, Box]] = []
        for i, tier in enumerate(tiers):
            y = bottom - (len(tiers) - i) * row_height
            rows.append((tier, (self._left, y + gap / 2, self._right, y + row_height - gap / 2)))
        curve = (self._left, top, self._right, bottom - len(tiers) * row_height - gap / 2)

        f = _SMOOTHING
        large = Image.new("RGB", (width * f, height * f), BACKGROUND)
        pen = ImageDraw.Draw(large)
        ceiling = max((find_ceiling(values) for values, _ in curves), default=0.0)
        for number, (values, end) in enumerate(curves):
            self._draw_curve(pen, curve, values, end, ceiling, _CURVES[number])
        for row, box in rows:
            pen.rectangle([v * f for v in box], fill=_GROOVE)
            for onset, offset, label in self._segments(row):
                self._draw_segment(pen, (self.position_of(onset), box[1], self.position_of(offset), box[3]), label)
        if not rows and not curves:
            middle = (top + bottom) / 2
            pen.rectangle([v * f for v in (self._left, middle - k, self._right, middle + k)], fill=RULE)
        strip = large.resize((width, height), Image.Resampling.BOX)
        self._write_strip(ImageDraw.Draw(strip), rows, curve, bottom)
        return strip

    def _list_curves(self) -> list[tuple[NDArray[np.float64], float]]:
        """Return the curves to draw and where each ends, in frames of the clock."""
        shown = [p for p in (self.performance, self.beside) if p is not None and p.energy is not None]
        return [(np.asarray(p.energy, dtype=float), p.duration * self.performance.rate) for p in shown]

    def _segments(self, row: Row) -> list[tuple[float, float, str]]:
        """Return onset, offset and label of a tier's segments, in frames of the clock."""
        table, ratio = row.performance.tiers[row.tier], self.performance.rate / row.performance.rate
        columns = (table["onset"], table["offset"], table["label"])
        return [(int(a) * ratio, int(b) * ratio, str(c)) for a, b, c in zip(*columns, strict=True)]

    def _draw_segment(self, pen: ImageDraw.ImageDraw, box: Box, label: str) -> None:
        """Fill a box with the label's colour; a transition is cut along the diagonal, from and to."""
        left, top, right, bottom = (v * _SMOOTHING for v in box)
        right = max(right - _SMOOTHING * 0.8, left + 1)  # a hairline between neighbours
        colours = find_label_colours(label)
        pen.rectangle((left, top, right, bottom), fill=colours[0])
        if len(colours) == 2:
            pen.polygon([(left, bottom), (right, top), (right, bottom)], fill=colours[1])

    def _draw_curve(
        self, pen: ImageDraw.ImageDraw, box: Box, values: NDArray[np.float64], end: float, ceiling: float, colour: str
    ) -> None:
        """Draw a curve from zero to ``ceiling``; one column of pixels shows its largest value."""
        f = _SMOOTHING
        left, top, right, bottom = (v * f for v in box)
        pen.line([(left, bottom), (right, bottom)], fill=RULE, width=f)
        if ceiling <= 0:
            return
        right = self.position_of(end) * f
        n_columns = int(max(min(len(values), right - left), 1))
        groups = np.array_split(np.nan_to_num(values, nan=0.0), n_columns)
        heights = np.clip([group.max() / ceiling for group in groups], 0, 1)
        x = left + (right - left) * (np.arange(n_columns) + 0.5) / n_columns
        points = list(zip(x.tolist(), (bottom - heights * (bottom - top)).tolist(), strict=True))
        shade = tuple(
            (3 * b + c) // 4 for b, c in zip(ImageColor.getrgb(BACKGROUND), ImageColor.getrgb(colour), strict=True)
        )
        if colour == _CURVES[0]:
            pen.polygon([(left, bottom), *points, (right, bottom)], fill=shade)
        pen.line(points, fill=colour, width=round(1.3 * f * self.layout.scale), joint="curve")

    def _write_strip(self, pen: ImageDraw.ImageDraw, rows: list[tuple[Row, Box]], curve: Box, bottom: float) -> None:
        """Write the names of the rows, the labels of segments wide enough for them, and the seconds."""
        p, k = self.performance, self.layout.scale
        small, tiny = font(round(11 * k)), font(round(10 * k))
        room = self._left - 20 * k
        if self._list_curves():
            pen.text((12 * k, (curve[1] + curve[3]) / 2), "energy", font=small, fill=QUIET, anchor="lm")
        for row, box in rows:
            middle = (box[1] + box[3]) / 2
            pen.text((12 * k, middle), shorten(row.name, small, room), font=small, fill=QUIET, anchor="lm")
            for onset, offset, label in self._segments(row):
                start, stop = self.position_of(onset), self.position_of(offset)
                if len(find_label_colours(label)) == 1 and small.getlength(label) + 6 * k < stop - start:
                    ink = find_text_colour(find_label_colours(label)[0])
                    pen.text(((start + stop) / 2, middle), label, font=small, fill=ink, anchor="mm")
        step = choose_tick(self.duration, (self._right - self._left) / (52 * k))
        for i in range(int(self.duration / step + 1e-9) + 1):
            x = self.position_of(i * step * p.rate)
            pen.line([(x, bottom + 2 * k), (x, bottom + 5 * k)], fill=QUIET)
            text = f"{i * step:g}" + (" s" if i == 0 else "")
            pen.text((x, bottom + 7 * k), text, font=tiny, fill=QUIET, anchor="ma" if i else "la")


def find_ceiling(values: NDArray[np.float64]) -> float:
    """Return the 99.5th percentile of what is known of a curve, 0 where nothing is."""
    finite = values[np.isfinite(values)]
    return float(np.percentile(finite, 99.5)) if finite.size else 0.0


def choose_tick(duration: float, n_ticks: float) -> float:
    """Return the least of 0.1, 0.2, 0.5, 1, 2, 5 … (s) that cuts ``duration`` into at most ``n_ticks`` parts."""
    exponent = -1
    while True:
        for factor in (1, 2, 5):
            step = factor * 10.0**exponent
            if duration / step <= max(n_ticks, 1):
                return step
        exponent += 1
