"""Playback in a window: the clock decides which frame is due, however slow the drawing is.

Keys: space plays and pauses; left and right step one frame, with shift one second; home and end jump; Q or escape
closes. A press or drag on the timeline seeks.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from ..errors import InputError
from .performance import Performance
from .scene import Scene

_TICK = 10  # ms between looks at the clock
_HELP = "{} – mimique (space: play and pause, arrows: frame, shift + arrows: second, Q: close)"


class Player:
    """Which frame is due: play, pause, step, seek. It draws nothing.

    While it plays, the frame is ``start + floor(elapsed · rate)``: frames are dropped when drawing is slow, and time
    is kept. At the last frame it pauses.

    Parameters
    ----------
    n_frames
        Number of frames, at least one.
    rate
        Frames per second, Hz.
    clock
        Function that returns seconds and never goes back.

    Raises
    ------
    InputError
        If there are no frames or the rate is not positive.
    """

    def __init__(self, n_frames: int, rate: float, clock: Callable[[], float] = time.perf_counter) -> None:
        if n_frames < 1:
            raise InputError(f"player: expected at least one frame, but got {n_frames}")
        if not rate > 0:
            raise InputError(f"player: expected a positive rate, but got {rate}")
        self.n_frames = n_frames
        self.rate = rate
        self._clock = clock
        self._frame = 0
        self._started: float | None = None

    @property
    def playing(self) -> bool:
        """Whether time runs; a look at it also notices that the end was reached."""
        return self._started is not None and self.frame < self.n_frames - 1

    @property
    def frame(self) -> int:
        """The frame that is due now."""
        if self._started is not None:
            # The small part keeps a clock that shows exactly one frame's time from falling short by rounding.
            due = self._frame + int((self._clock() - self._started) * self.rate + 1e-6)
            if due < self.n_frames - 1:
                return due
            self._frame, self._started = self.n_frames - 1, None
        return self._frame

    def play(self) -> None:
        """Let time run from the present frame; from the start if it stands on the last one."""
        if self.playing:
            return
        self._frame = 0 if self._frame == self.n_frames - 1 else self._frame
        self._started = self._clock()

    def pause(self) -> None:
        """Stop on the present frame."""
        self._frame, self._started = self.frame, None

    def toggle(self) -> None:
        """Pause if it plays, else play."""
        if self.playing:
            self.pause()
        else:
            self.play()

    def step(self, n_frames: int) -> None:
        """Pause and move by some frames, back if negative, within the take."""
        self.pause()
        self.seek(self._frame + n_frames)

    def seek(self, frame: int) -> None:
        """Jump to ``frame``, or to the nearest there is; what was playing plays on from there."""
        playing = self.playing
        self._frame = min(max(int(frame), 0), self.n_frames - 1)
        self._started = self._clock() if playing else None

    def press(self, key: str, shift: bool = False) -> bool:
        """Do what a key stands for (VTK's key names); return whether it is one of this player's."""
        stride = max(1, round(self.rate)) if shift else 1
        actions: dict[str, Callable[[], None]] = {
            "space": self.toggle,
            "Left": lambda: self.step(-stride),
            "Right": lambda: self.step(stride),
            "Home": lambda: self.seek(0),
            "End": lambda: self.seek(self.n_frames - 1),
        }
        if key not in actions:
            return False
        actions[key]()
        return True


def play(performance: Performance, *, size: tuple[int, int] = (1280, 720), autoplay: bool = True) -> None:
    """Show a performance in a window, until it is closed.

    Parameters
    ----------
    performance
        What is shown.
    size
        First size of the window, pixels.
    autoplay
        Whether it begins to play at once.

    Raises
    ------
    MimiqueError
        If there is no display or no OpenGL.
    """
    with Scene(performance, size, off_screen=False) as scene:
        player = Player(performance.n_frames, performance.rate)
        window = _Window(scene, player)
        if autoplay:
            player.play()
        window.run()


class _Window:
    """Connects a player to the window's clock, keys and mouse."""

    def __init__(self, scene: Scene, player: Player) -> None:
        self.scene = scene
        self.player = player
        self._dragging = False
        self._resume = False
        self._failure: BaseException | None = None

    def run(self) -> None:
        """Show the window and return when it is closed."""
        plotter = self.scene.plotter
        interactor = plotter.iren.interactor
        plotter.reset_key_events()
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
        """Draw the frame that is due, if it is not the one that shows."""
        width, height = self.scene.plotter.render_window.GetSize()
        if min(width, height) < 64:
            return
        before = self.scene.frame
        resized = self.scene.fit()
        frame = self.player.frame
        self.scene.show(frame)
        if resized or frame != before:
            self.scene.render()

    def _on_time(self, _interactor: Any) -> bool:
        self._advance()
        return False

    def _on_key(self, interactor: Any) -> bool:
        key = interactor.GetKeySym()
        if key in ("q", "Q", "Escape"):
            interactor.ExitCallback()
            return True
        if self.player.press(key, bool(interactor.GetShiftKey())):
            self._advance()
            return True
        return False

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
