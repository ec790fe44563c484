"""Playback in a window: the clock decides which frame is due, however slow the drawing is; and in a notebook.

The keys are those of :data:`.captions.KEYS`. A press or drag on the timeline seeks, a drag elsewhere turns the face.
"""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .movie import write_movie
from .notebook_view import NotebookView, has_widgets
from .performance import Performance
from .player import Player
from .scene import Scene
from .view import View

__all__ = ["Player", "play", "show"]

_TICK = 10  # ms between looks at the clock
_HELP = "{} – mimique (space: play and pause, h: all keys)"
_CAMERA_KEYS = {"f": "front", "q": "three-quarter", "s": "side"}
_FILM_SECONDS = 30.0  # a notebook keeps its films within its own file


def play(
    performance: Performance,
    *,
    size: tuple[int, int] = (1280, 720),
    autoplay: bool = True,
    view: View | None = None,
    beside: Performance | None = None,
) -> None:
    """Show a performance in a window, until it is closed.

    Parameters
    ----------
    performance
        What is shown.
    size
        First size of the window, pixels.
    autoplay
        Whether it begins to play at once.
    view
        What is shown of it, and from where.
    beside
        Shown beside it on the same clock: another take, or another solve.

    Raises
    ------
    MimiqueError
        If there is no display or no OpenGL.
    """
    with Scene(performance, size, off_screen=False, view=view, beside=beside) as scene:
        player = Player(scene.n_frames, performance.rate, segments=find_segments(performance))
        window = _Window(scene, player)
        if autoplay:
            player.play()
        window.run()


def find_segments(performance: Performance) -> list[tuple[int, int]]:
    """Return onset and offset of the segments of a performance's first tier."""
    for table in performance.tiers.values():
        return [(int(a), int(b)) for a, b in zip(table["onset"], table["offset"], strict=True)]
    return []


def show(
    performance: Performance,
    *,
    size: tuple[int, int] = (640, 360),
    fps: float = 25.0,
    start: float = 0.0,
    seconds: float = _FILM_SECONDS,
    view: View | None = None,
    beside: Performance | None = None,
    film: bool | None = None,
) -> NotebookFilm | NotebookView:
    """Show a performance in a notebook: with the window's controls, or as a short film with the browser's own.

    Parameters
    ----------
    performance, view, beside
        What is shown.
    size, fps
        Of the film, pixels and pictures per second.
    start, seconds
        The part of a film to show; half a minute at most unless told otherwise, for it is kept in the notebook.
    film
        Whether it is a film, which a notebook that is kept or sent still plays; by default only where no notebook runs
        or ipywidgets (``pip install 'mimique[notebook]'``) is missing.

    Returns
    -------
    NotebookView or NotebookFilm
        What a notebook shows when it is a cell's last value; a film is MP4, or a GIF where there is no ffmpeg.

    Raises
    ------
    MimiqueError
        If this machine cannot draw.
    """
    if not (film if film is not None else not has_widgets()):
        return NotebookView(performance, size=size, view=view, beside=beside, segments=find_segments(performance))
    first = min(max(round(start * performance.rate), 0), performance.n_frames - 1)
    with tempfile.TemporaryDirectory() as folder:
        path = write_movie(
            performance,
            Path(folder) / "film.mp4",
            fps=fps,
            size=size,
            start=first,
            stop=min(first + max(round(seconds * performance.rate), 1), performance.n_frames),
            view=view,
            beside=beside,
        )
        return NotebookFilm(path.read_bytes(), "video/mp4" if path.suffix == ".mp4" else "image/gif", size[0])


class NotebookFilm:
    """A film as a notebook shows it.

    Parameters
    ----------
    data, mime
        The file's bytes, and ``video/mp4`` or ``image/gif``.
    width
        Pixels.
    """

    def __init__(self, data: bytes, mime: str, width: int) -> None:
        self.data, self.mime, self.width = data, mime, width

    def _repr_html_(self) -> str:
        source = f"data:{self.mime};base64,{base64.b64encode(self.data).decode()}"
        if self.mime.startswith("image"):
            return f'<img src="{source}" width="{self.width}">'
        return f'<video src="{source}" width="{self.width}" controls loop muted></video>'


class _Window:
    """Connects a player to the window's clock, keys and mouse."""

    def __init__(self, scene: Scene, player: Player) -> None:
        self.scene = scene
        self.player = player
        self._dragging = False
        self._helping = False
        self._at_rest = False
        self._resume = False
        self._failure: BaseException | None = None

    def run(self) -> None:
        """Show the window and return when it is closed."""
        plotter = self.scene.plotter
        interactor = plotter.iren.interactor
        plotter.reset_key_events()
        # The faces share a camera whose range holds all of them; the style would fit it to the one under the mouse.
        interactor.GetInteractorStyle().SetAutoAdjustCameraClippingRange(False)
        for event, handler in (
            ("KeyPressEvent", self._on_key),
            ("CharEvent", self._swallow),  # VTK's own letters (wireframe, 3D …) would surprise here
            ("LeftButtonPressEvent", self._on_press),
            ("MouseMoveEvent", self._on_move),
            ("LeftButtonReleaseEvent", self._on_release),
        ):
            self._observe(interactor, event, handler)
        for event in ("TimerEvent", "ConfigureEvent"):
            self._observe(interactor, event, self._on_time)
        interactor.Initialize()
        interactor.CreateRepeatingTimer(_TICK)
        plotter.show(auto_close=False, interactive=True, title=_HELP.format(self.scene.performance.title))
        if self._failure is not None:
            raise self._failure

    def _observe(self, interactor: Any, event: str, handler: Callable[[Any], bool]) -> None:
        """Call ``handler`` before anyone else; where it returns true, nobody else hears of the event."""
        tag = 0

        def call(caller: Any, _event: str) -> None:
            try:
                caller.GetCommand(tag).SetAbortFlag(1 if handler(caller) else 0)
            except BaseException as failure:
                # VTK would print it and go on: Ctrl-C in the terminal has to end the loop, and so has an error.
                self._failure = self._failure or failure
                caller.ExitCallback()

        tag = interactor.AddObserver(event, call, 10.0)

    def _advance(self) -> None:
        """Draw the frame that is due, if it is not the one that shows; edges are smoothed once it stands."""
        width, height = self.scene.plotter.render_window.GetSize()
        if min(width, height) < 64:
            return
        before = self.scene.frame
        resized = self.scene.fit()
        frame = self.player.frame
        told = (self.scene.state, self.scene.loop) != (self.player.state, self.player.loop)
        self.scene.state, self.scene.loop = self.player.state, self.player.loop
        self.scene.show(frame)
        if told:
            self.scene.refresh_panel()
        rests = not self.player.playing
        if resized or told or frame != before or (rests and not self._at_rest):
            self.scene.render(smooth=rests)
        self._at_rest = rests

    def _on_time(self, _interactor: Any) -> bool:
        self._advance()
        return False

    def _on_key(self, interactor: Any) -> bool:
        key = interactor.GetKeySym()
        if key == "Escape":
            interactor.ExitCallback()
        elif key.lower() in _CAMERA_KEYS:
            self.scene.aim(_CAMERA_KEYS[key.lower()])
            self._at_rest = False
        elif key.lower() == "h":
            self._helping = not self._helping
            self.scene.show_help(self._helping)
            self._at_rest = False
        elif not self.player.press(key, bool(interactor.GetShiftKey())):
            return False
        self._advance()
        return True

    def _swallow(self, _interactor: Any) -> bool:
        return True

    def _on_press(self, interactor: Any) -> bool:
        x, y = interactor.GetEventPosition()
        if y >= self.scene.timeline.layout.strip_height:
            return False
        self._dragging, self._resume = True, self.player.playing
        self.player.pause()
        self._seek(x)
        return True

    def _on_move(self, interactor: Any) -> bool:
        if self._dragging:
            self._seek(interactor.GetEventPosition()[0])
        return self._dragging

    def _on_release(self, _interactor: Any) -> bool:
        if not self._dragging:
            return False
        self._dragging = False
        if self._resume:
            self.player.play()
        return True

    def _seek(self, x: int) -> None:
        self.player.seek(self.scene.timeline.frame_at(x))
        self._advance()
