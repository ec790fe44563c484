"""Where things go in a picture of a performance."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Layout:
    """Places in a picture of ``width`` × ``height`` pixels: panel left, faces right of it, timeline under both.

    Parameters
    ----------
    width, height
        Pixels.
    columns
        Number of faces side by side.
    curves
        Whether panel and timeline are there.
    captions
        Whether a line over the faces says what they are.
    scale_bar
        Whether the heat map's scale stands at the right.
    """

    width: int
    height: int
    columns: int = 1
    curves: bool = True
    captions: bool = False
    scale_bar: bool = False

    @property
    def scale(self) -> float:
        """Size of text and gaps, 1 at 960 × 540."""
        return min(self.width / 960, self.height / 540)

    @property
    def panel_width(self) -> int:
        """Pixels that the panel takes at the left."""
        return round(self.width * 0.25) if self.curves else 0

    @property
    def strip_height(self) -> int:
        """Pixels that the timeline takes at the bottom."""
        return round(self.height * 0.2) if self.curves else 0

    @property
    def caption_height(self) -> int:
        """Pixels that the captions take at the top."""
        return max(round(26 * self.scale), 10) if self.captions else 0

    @property
    def scale_width(self) -> int:
        """Pixels that the heat map's scale takes at the right."""
        return max(round(76 * self.scale), 30) if self.scale_bar else 0

    @property
    def faces(self) -> tuple[int, int, int, int]:
        """Left, bottom, right, top of all faces in pixels from the lower left corner."""
        return self.panel_width, self.strip_height, self.width - self.scale_width, self.height - self.caption_height

    def column(self, number: int) -> tuple[int, int, int, int]:
        """Return left, bottom, right, top of one face."""
        left, bottom, right, top = self.faces
        borders = [left + round((right - left) * i / self.columns) for i in (number, number + 1)]
        return borders[0], bottom, borders[1], top

    def share(self, box: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        """Return a box of pixels as shares of the picture."""
        left, bottom, right, top = box
        return left / self.width, bottom / self.height, right / self.width, top / self.height
