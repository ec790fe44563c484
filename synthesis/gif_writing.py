"""Films as GIF files (GIF89a), written picture by picture: the length of a film does not matter to the memory.

One table of 256 colours serves the whole film, so that what does not move does not flicker; of each picture only the
box that changed is written.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import GifImagePlugin, Image

LARGEST_GIF_FPS = 50.0
"""Pictures per second; players show faster ones much slower, since time is counted in hundredths of a second."""


class GifWriter:
    """A GIF file that plays without end.

    Parameters
    ----------
    path
        File to write.
    size
        Width and height, pixels.
    fps
        Pictures per second, at most 50. Durations are whole hundredths of a second, chosen so that the film keeps time.
    """

    def __init__(self, path: str | os.PathLike[str], size: tuple[int, int], fps: float) -> None:
        self._path, self._size, self._fps = Path(path), size, fps
        self._palette: Image.Image | None = None
        self._last: NDArray[np.uint8] | None = None
        self._waiting: tuple[NDArray[np.uint8], tuple[int, int]] | None = None
        self._n_pictures = 0
        self._begun = 0  # number of the picture that waits

    def __enter__(self) -> GifWriter:
        self._file = self._path.open("wb")
        return self

    def choose_colours(self, pictures: Sequence[NDArray[np.uint8]]) -> None:
        """Choose the film's 256 colours from some of its pictures; without, the first one's serve."""
        mosaic = Image.fromarray(np.concatenate([np.ascontiguousarray(p[::2, ::2]) for p in pictures]))
        self._palette = mosaic.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)

    def write(self, image: NDArray[np.uint8]) -> None:
        """Add a picture (height, width, 3)."""
        if self._palette is None:
            self.choose_colours([image])
        assert self._palette is not None
        if self._n_pictures == 0:
            self._write_header()
        indices = np.asarray(Image.fromarray(image).quantize(palette=self._palette, dither=Image.Dither.NONE))
        changed = np.ones_like(indices, dtype=bool) if self._last is None else indices != self._last
        if changed.any():
            # A picture is written once it is known how long it lasts: what does not change lengthens it.
            self._flush()
            rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
            top, left = int(rows[0]), int(columns[0])
            self._waiting = indices[top : rows[-1] + 1, left : columns[-1] + 1], (left, top)
            self._begun = self._n_pictures
            self._last = indices
        self._n_pictures += 1

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            if kind is None:
                self._flush()
                self._file.write(b";")
        finally:
            self._file.close()

    def _flush(self) -> None:
        if self._waiting is None:
            return
        indices, offset = self._waiting
        start, stop = (round(100 * n / self._fps) for n in (self._begun, self._n_pictures))
        picture: Any = Image.fromarray(np.ascontiguousarray(indices), mode="P")
        for duration in _split(stop - start):
            for block in GifImagePlugin.getdata(picture, offset, duration=10 * duration, include_color_table=False):
                self._file.write(block)
        self._waiting = None

    def _write_header(self) -> None:
        """Write what stands before the pictures: size, colours, and that it plays without end."""
        assert self._palette is not None
        colours = bytes(self._palette.getpalette() or [])[:768].ljust(768, b"\0")
        width, height = (n.to_bytes(2, "little") for n in self._size)
        self._file.write(b"GIF89a" + width + height + b"\xf7\0\0" + colours)
        self._file.write(b"!\xff\x0bNETSCAPE2.0\x03\x01\0\0\0")


def _split(hundredths: int) -> list[int]:
    """Return a duration as parts of what two bytes hold."""
    largest = 65000
    return [largest] * (hundredths // largest) + ([hundredths % largest] if hundredths % largest else [])
