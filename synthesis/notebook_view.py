"""A performance in a notebook, with the window's controls: pictures drawn here, shown by ipywidgets.

As in the window, the clock decides which frame is due: what cannot be drawn in time is left out, and time is kept.
"""

from __future__ import annotations

import asyncio
import io
import sys
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any

from PIL import Image

from .performance import Performance
from .player import SPEED_NAMES, SPEEDS, Player
from .scene import Scene
from .view import CAMERAS, View

__all__ = ["NotebookView", "has_widgets"]

_REST = 0.005  # s between pictures, in which the notebook hears what is pressed
_QUALITY = 85  # of the JPEG pictures, which are sent one by one


def has_widgets() -> bool:
    """Whether a notebook runs this, and ipywidgets is there."""
    return "ipykernel" in sys.modules and find_spec("ipywidgets") is not None


class NotebookView:
    """A cell's last value that plays; :meth:`close` frees what it holds.

    Parameters
    ----------
    performance, view, beside
        What is shown.
    size
        Of the picture, pixels.
    segments
        Frames ``(onset, offset)``, half-open, to jump between and to loop.
    clock
        Function that returns seconds and never goes back.

    Raises
    ------
    ImportError
        Without ipywidgets.
    MimiqueError
        If this machine cannot draw.
    """

    def __init__(
        self,
        performance: Performance,
        *,
        size: tuple[int, int] = (640, 360),
        view: View | None = None,
        beside: Performance | None = None,
        segments: Sequence[tuple[int, int]] = (),
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        import ipywidgets as widgets

        self.scene = Scene(performance, size, view=view, beside=beside)
        self.player = Player(self.scene.n_frames, performance.rate, clock, segments)
        self._task: asyncio.Task[None] | None = None
        self._drawing = False

        def button(icon: str, says: str, action: Callable[[], None]) -> Any:
            made = widgets.Button(icon=icon, tooltip=says, layout=widgets.Layout(width="40px"))
            made.on_click(lambda _: self._do(action))
            return made

        self.picture = widgets.Image(format="jpeg", width=size[0], height=size[1])
        self.slider = widgets.IntSlider(
            min=0, max=self.scene.n_frames - 1, readout=False, layout=widgets.Layout(width=f"{size[0]}px")
        )
        self.speed = widgets.Dropdown(
            options=[(f"{name} ×", number) for number, name in enumerate(SPEED_NAMES)],
            value=SPEEDS.index(1.0), tooltip="speed", layout=widgets.Layout(width="70px"),
        )  # fmt: skip
        self.camera = widgets.Dropdown(
            options=list(CAMERAS), value=self.scene.view.camera, tooltip="camera", layout=widgets.Layout(width="130px")
        )
        self.buttons = {
            "play": button("play", "play and pause", self.player.toggle),
            "back": button("step-backward", "one frame back", lambda: self.player.step(-1)),
            "forward": button("step-forward", "one frame forward", lambda: self.player.step(1)),
            "previous": button("fast-backward", "previous segment", lambda: self.player.jump(-1)),
            "next": button("fast-forward", "next segment", lambda: self.player.jump(1)),
            "loop": button("repeat", "loop this segment", self.player.toggle_loop),
        }
        self.slider.observe(self._on_slide, "value")
        self.speed.observe(lambda change: self._do(lambda: self.player.set_speed(change["new"])), "value")
        self.camera.observe(lambda change: self._do(lambda: self.scene.aim(change["new"])), "value")
        controls = widgets.HBox([*self.buttons.values(), self.speed, self.camera])
        self.widget = widgets.VBox([self.picture, self.slider, controls])
        self.draw()

    def draw(self) -> None:
        """Draw the frame that is due, and bring the controls to it."""
        told = (self.scene.state, self.scene.loop) != (self.player.state, self.player.loop)
        self.scene.state, self.scene.loop = self.player.state, self.player.loop
        self.scene.show(self.player.frame)
        if told:
            self.scene.refresh_panel()
        buffer = io.BytesIO()
        Image.fromarray(self.scene.image()).save(buffer, format="jpeg", quality=_QUALITY)
        self.picture.value = buffer.getvalue()
        self._drawing = True
        try:
            self.slider.value = self.scene.frame
            self.buttons["play"].icon = "pause" if self.player.playing else "play"
        finally:
            self._drawing = False

    async def run(self) -> None:
        """Draw while it plays."""
        while self.player.playing:
            self.draw()
            await asyncio.sleep(_REST)
        self.draw()

    def close(self) -> None:
        """Stop, and free what draws."""
        self.player.pause()
        self.widget.close()
        self.scene.close()

    def _do(self, action: Callable[[], None]) -> None:
        action()
        self.draw()
        if self.player.playing and (self._task is None or self._task.done()):
            self._task = asyncio.get_event_loop().create_task(self.run())

    def _on_slide(self, change: dict[str, Any]) -> None:
        if not self._drawing:  # a person moved it, not the playing
            self._do(lambda: self.player.seek(change["new"]))

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.widget._repr_mimebundle_(**options)
