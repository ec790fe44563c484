"""The picture of a performance: the faces, their markers, the panel and the timeline. Window and film draw this one.

Drawn with VTK through PyVista. Off screen it needs no display, only an OpenGL library: EGL with a driver, or OSMesa.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..errors import InputError
from .captions import Caption, draw_captions, draw_help, draw_scale_bar
from .drawing import Picture, open_plotter, read_pixels, set_smooth
from .face_picture import SKIN, FacePicture, find_face_box
from .heat import Heat
from .marker_balls import MARKER_COLOURS
from .performance import Performance, count_clock_frames
from .screen_layout import Layout
from .timeline import Timeline
from .view import View

__all__ = ["SKIN", "Scene", "find_face_box"]


class Scene:
    """One performance or two on one clock, drawn one frame at a time.

    Parameters
    ----------
    performance
        What is shown; frames are counted in its own.
    size
        Width and height of the picture, pixels.
    off_screen
        Whether to draw without a window.
    view
        What is shown of it.
    beside
        What is shown beside it.
    bare
        Whether captions and the heat map's scale are left out.

    Raises
    ------
    MimiqueError
        If this machine has no way to draw, or no display to open a window on.
    """

    def __init__(
        self,
        performance: Performance,
        size: tuple[int, int] = (960, 540),
        *,
        off_screen: bool = True,
        view: View | None = None,
        beside: Performance | None = None,
        bare: bool = False,
    ) -> None:
        if min(size) < 64:
            raise InputError(f"size: expected at least 64 × 64 pixels, but got {size[0]} × {size[1]}")
        self.performance, self.beside, self.view = performance, beside, view or View()
        self.n_frames = count_clock_frames(performance, beside)
        """Frames until both have ended."""
        self.frame = -1
        self._bare = bare
        self.state = ""
        """What the player does beside playing, written in the panel."""
        self.loop: tuple[int, int] | None = None
        """Frames that are played again and again, marked in the timeline."""
        shown = [p for p in (performance, beside) if p is not None]
        heats = self._measure_heat(shown)
        split = self.view.markers == "beside"
        self._plotter: Any = open_plotter(size, off_screen, len(shown) * (2 if split else 1))
        self._columns = self._add_columns(shown, heats, split)
        self._pictures = {name: Picture(self._plotter) for name in ("panel", "timeline", "captions", "scale", "help")}
        self._pictures["help"].hide()
        self._layout = Layout(0, 0)
        self._smooth = True
        self.show(0)

    @property
    def plotter(self) -> Any:
        """The PyVista plotter that draws."""
        return self._plotter

    @property
    def timeline(self) -> Timeline:
        """The panel and timeline at the picture's present size."""
        return self._timeline

    @property
    def ceiling(self) -> float:
        """Upper end of the heat map's scale, mm; 0 where there is none."""
        return max((column.heat.ceiling for column in self._columns if column.heat is not None), default=0.0)

    def show(self, frame: int) -> None:
        """Bring everything to ``frame``; :meth:`render` draws it.

        Raises
        ------
        InputError
            If there is no such frame.
        """
        if not 0 <= frame < self.n_frames:
            raise InputError(f"frame: expected 0 to {self.n_frames - 1}, but got {frame}")
        self.fit()
        if frame == self.frame:
            return
        for column in self._columns:
            column.show(column.performance.frame_at(frame / self.performance.rate))
        self.frame = frame
        self.refresh_panel()

    def refresh_panel(self) -> None:
        """Draw panel and timeline of the present frame again, after :attr:`state` or :attr:`loop` changed."""
        if self.view.curves:
            self._pictures["panel"].show(self._timeline.draw_panel(self.frame, self.state))
            self._pictures["timeline"].show(self._timeline.draw_timeline(self.frame, self.loop))

    def render(self, *, smooth: bool = True) -> None:
        """Draw the present frame; edges that are not smooth take less time."""
        if smooth != self._smooth:
            self._smooth = smooth
            set_smooth(self._plotter, smooth)
        # Not the plotter's own render(), which does nothing before it has shown a window.
        self._plotter.render_window.Render()

    def image(self, frame: int | None = None) -> NDArray[np.uint8]:
        """Return the picture of ``frame`` (the present one by default), (height, width, 3)."""
        if frame is not None:
            self.show(frame)
        self.render()
        return read_pixels(self._plotter.render_window)

    def png(self, frame: int | None = None) -> bytes:
        """Return the picture of ``frame`` (the present one by default) as a PNG file's bytes."""
        buffer = io.BytesIO()
        Image.fromarray(self.image(frame)).save(buffer, format="png", optimize=True)
        return buffer.getvalue()

    def aim(self, camera: str) -> None:
        """Point the cameras as one of :data:`.view.CAMERAS` says."""
        for number, column in enumerate(self._columns):
            left, bottom, right, top = self._layout.column(number)
            column.aim(camera, (right - left) / max(top - bottom, 1))

    def show_help(self, shown: bool) -> None:
        """Show the list of keys, or hide it."""
        self._pictures["help"].hide(not shown)

    def close(self) -> None:
        """Free the window and what it holds."""
        self._plotter.close()

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def fit(self) -> bool:
        """Fit faces, panel and timeline into the window's present size; return whether it had changed."""
        width, height = self._plotter.render_window.GetSize()
        if (width, height) == (self._layout.width, self._layout.height):
            return False
        captions = self._list_captions()
        layout = Layout(
            width,
            height,
            len(self._columns),
            self.view.curves,
            not self._bare and (len(self._columns) > 1 or any(len(caption.legend) > 1 for caption in captions)),
            not self._bare and self.view.heat is not None,
        )
        self._layout, self.frame = layout, -1
        self._timeline = Timeline(self.performance, layout, self.beside)
        for number, column in enumerate(self._columns):
            column.renderer.SetViewport(*layout.share(layout.column(number)))
        self.aim(self.view.camera)
        left, bottom, right, top = layout.faces
        self._place("panel", (0, bottom, left, height))
        self._place("timeline", (0, 0, width, bottom))
        self._place("captions", (left, top, right, height))
        self._place("scale", (right, bottom, width, height))
        if layout.captions:
            self._pictures["captions"].show(draw_captions(captions, layout))
        if layout.scale_bar and self.view.heat is not None:
            self._pictures["scale"].show(draw_scale_bar(self.view.heat, self.ceiling, layout))
        keys = draw_help(layout)
        x, y = max(left + right - keys.shape[1], 0) // 2, max(bottom + top - keys.shape[0], 0) // 2
        self._pictures["help"].place(*layout.share((x, y, x + keys.shape[1], y + keys.shape[0])))
        self._pictures["help"].show(keys)
        return True

    def _place(self, name: str, box: tuple[float, float, float, float]) -> None:
        """Give a picture its box in pixels; one without room is not drawn."""
        empty = box[2] <= box[0] or box[3] <= box[1]
        self._pictures[name].hide(empty)
        if not empty:
            self._pictures[name].place(*self._layout.share(box))

    def _measure_heat(self, shown: list[Performance]) -> list[Heat | None]:
        if self.view.heat is None:
            return [None for _ in shown]
        heats = [Heat(p, self.view.heat) for p in shown]
        for heat in heats:
            heat.ceiling = max(h.ceiling for h in heats)
        return list(heats)

    def _add_columns(self, shown: list[Performance], heats: list[Heat | None], split: bool) -> list[FacePicture]:
        """Make the faces; those of one face share a camera, so that all turn together."""
        columns: list[FacePicture] = []
        renderers = iter(self._plotter.renderers)
        kinds = () if self.view.markers == "none" else self.view.show
        for p, heat in zip(shown, heats, strict=True):
            columns.append(FacePicture(next(renderers), p, kinds=() if split else kinds, heat=heat))
            if split:
                columns.append(FacePicture(next(renderers), p, skin=False, kinds=kinds))
        for column in columns[1:]:
            same = column.performance.rig.neutral.shape == shown[0].rig.neutral.shape
            if same and np.array_equal(column.performance.rig.neutral, shown[0].rig.neutral):
                column.renderer.camera = columns[0].renderer.camera
        return columns

    def _list_captions(self) -> list[Caption]:
        captions = []
        same = self.beside is not None and self.beside.title == self.performance.title
        for column in self._columns:
            p, kinds = column.performance, column.markers.kinds
            # Of one take the solves differ; their names stand last in the note.
            text = p.note.rpartition(", ")[2] if same else f"{p.title}  {p.note}"
            text = text if column.has_skin and self.beside is not None else ""
            if not column.has_skin and not kinds:
                text = "no markers"
            captions.append(Caption(text, tuple((MARKER_COLOURS[kind], kind) for kind in kinds)))
        return captions
