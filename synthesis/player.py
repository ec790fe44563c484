"""The player: which frame is due, whatever the clock and the user do. It draws nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from ..errors import InputError

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0)
SPEED_NAMES = ("¼", "½", "1", "2", "4")

_GRACE = 0.5  # seconds after an onset in which a press still goes to the segment before, while it plays


class Player:
    """Which frame is due: play, pause, step, seek, at a speed, in a loop.

    While it plays, the frame is ``start + floor(elapsed · rate · speed)``: frames are dropped when drawing is slow, and
    time is kept. At the last frame it pauses; in a loop it goes on at the loop's first frame.

    Parameters
    ----------
    n_frames
        Number of frames, at least one.
    rate
        Frames per second, Hz.
    clock
        Function that returns seconds and never goes back.
    segments
        Frames ``(onset, offset)``, half-open, to jump between and to loop.

    Raises
    ------
    InputError
        If there are no frames or the rate is not positive.
    """

    def __init__(
        self,
        n_frames: int,
        rate: float,
        clock: Callable[[], float] = time.perf_counter,
        segments: Sequence[tuple[int, int]] = (),
    ) -> None:
        if n_frames < 1:
            raise InputError(f"player: expected at least one frame, but got {n_frames}")
        if not rate > 0:
            raise InputError(f"player: expected a positive rate, but got {rate}")
        self.n_frames = n_frames
        self.rate = rate
        clipped = ((max(int(a), 0), min(int(b), n_frames)) for a, b in segments)
        self.segments = sorted({(a, b) for a, b in clipped if a < b})
        """Within the take, by onset."""
        self.loop: tuple[int, int] | None = None
        """Frames that are played again and again, half-open; None: to the end."""
        self._clock = clock
        self._speed = SPEEDS.index(1.0)
        self._frame = 0
        self._started: float | None = None

    @property
    def speed(self) -> float:
        """How much faster than in reality it plays, one of :data:`SPEEDS`."""
        return SPEEDS[self._speed]

    @property
    def state(self) -> str:
        """What is not as usual, in words: speed and loop."""
        words = [] if self.speed == 1 else [f"speed {SPEED_NAMES[self._speed]}"]
        return ", ".join(words + (["loop"] if self.loop else []))

    @property
    def playing(self) -> bool:
        """Whether time runs; a look at it also notices that the end was reached."""
        return self._started is not None and (self.loop is not None or self.frame < self.n_frames - 1)

    @property
    def frame(self) -> int:
        """The frame that is due now."""
        if self._started is not None:
            # The small part keeps a clock that shows exactly one frame's time from falling short by rounding.
            due = self._frame + int((self._clock() - self._started) * self.rate * self.speed + 1e-6)
            if self.loop is not None:
                onset, offset = self.loop
                return due if due < offset else onset + (due - onset) % (offset - onset)
            if due < self.n_frames - 1:
                return due
            self._frame, self._started = self.n_frames - 1, None
        return self._frame

    def play(self) -> None:
        """Let time run from the present frame; from the start if it stands on the last one."""
        if self.playing:
            return
        self._frame = 0 if self._frame == self.n_frames - 1 and self.loop is None else self._frame
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
        """Jump to ``frame``, or to the nearest there is; what was playing plays on from there, a loop left is over."""
        playing = self.playing
        self._frame = min(max(int(frame), 0), self.n_frames - 1)
        self._started = self._clock() if playing else None
        if self.loop is not None and not self.loop[0] <= self._frame < self.loop[1]:
            self.loop = None

    def set_speed(self, number: int) -> None:
        """Play at ``SPEEDS[number]``, or at the nearest there is, from the present frame on."""
        frame, playing = self.frame, self._started is not None
        self._speed = min(max(number, 0), len(SPEEDS) - 1)
        self._frame, self._started = frame, self._clock() if playing else None

    def jump(self, way: int) -> None:
        """Go to the next segment (1), or to the previous one (-1); a loop goes along.

        Back from within a segment is to its own onset first, as music players have it; soon after that, farther back.
        """
        frame = self.frame - (round(_GRACE * self.rate * self.speed) if way < 0 and self.playing else 0)
        onsets = np.array([onset for onset, _ in self.segments])
        found = np.flatnonzero(onsets > frame) if way > 0 else np.flatnonzero(onsets < frame)[::-1]
        if not len(found):
            return
        looping, segment = self.loop is not None, self.segments[int(found[0])]
        self.loop = segment if looping else None
        self.seek(segment[0])

    def toggle_loop(self) -> None:
        """Play the present segment again and again, or the whole take where there is none; or no longer."""
        frame, playing = self.frame, self.playing
        if self.loop is not None:
            self.loop = None
        else:
            holding = [(onset, offset) for onset, offset in self.segments if onset <= frame < offset]
            self.loop = holding[-1] if holding else (0, self.n_frames)
        self._frame, self._started = frame, self._clock() if playing else None

    def press(self, key: str, shift: bool = False) -> bool:
        """Do what a key stands for (VTK's key names); return whether it is one of this player's."""
        stride = max(1, round(self.rate)) if shift else 1
        actions: dict[str, Callable[[], None]] = {
            "space": self.toggle,
            "Left": lambda: self.step(-stride),
            "Right": lambda: self.step(stride),
            "Home": lambda: self.seek(0),
            "End": lambda: self.seek(self.n_frames - 1),
            "n": lambda: self.jump(1),
            "p": lambda: self.jump(-1),
            "l": self.toggle_loop,
            "minus": lambda: self.set_speed(self._speed - 1),
            "plus": lambda: self.set_speed(self._speed + 1),
            **{str(i + 1): (lambda i=i: self.set_speed(i)) for i in range(len(SPEEDS))},  # type: ignore[misc]
        }
        # With shift or on the number block the same keys have other names.
        key = {"equal": "plus", "KP_Add": "plus", "KP_Subtract": "minus"}.get(key, key)
        key = key.lower() if len(key) == 1 else key
        if key not in actions:
            return False
        actions[key]()
        return True
