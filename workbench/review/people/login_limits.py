"""How often somebody may be wrong about a password."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Hashable

__all__ = ["LoginLimits"]

WINDOW = 300.0
"""How long a wrong password counts, in s."""

PER_PERSON_AND_ADDRESS = 5
PER_ADDRESS = 30
PER_PERSON = 50
"""Wrong passwords within the window. Few for one name from one computer; many more for a name altogether, so that a
stranger elsewhere does not easily lock somebody out."""


class LoginLimits:
    """Counts wrong passwords, in memory and by a clock that does not jump."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._wrong: dict[Hashable, deque[float]] = {}

    def begin(self, person: str, address: str) -> float:
        """Count a try as wrong before it is known, so that many at once count too; return 0, or the seconds to wait.

        A try that has to wait is not counted.
        """
        with self._lock:
            now = self._clock()
            self._forget(now)
            wait = 0.0
            for key, limit in _name_limits(person, address):
                times = self._wrong.get(key, ())
                if len(times) >= limit:
                    wait = max(wait, times[-limit] + WINDOW - now)
            if wait <= 0:
                for key, _ in _name_limits(person, address):
                    self._wrong.setdefault(key, deque()).append(now)
            return max(wait, 0.0)

    def succeed(self, person: str, address: str) -> None:
        """Take back what :meth:`begin` counted, and what the person had got wrong from here before."""
        with self._lock:
            for key, _ in _name_limits(person, address):
                if times := self._wrong.get(key):
                    times.pop()
            self._wrong.pop((person, address), None)

    def _forget(self, now: float) -> None:
        for key in [key for key, times in self._wrong.items() if not times or times[-1] <= now - WINDOW]:
            del self._wrong[key]
        for times in self._wrong.values():
            while times and times[0] <= now - WINDOW:
                times.popleft()


def _name_limits(person: str, address: str) -> tuple[tuple[Hashable, int], ...]:
    return (
        ((person, address), PER_PERSON_AND_ADDRESS),
        (("address", address, None), PER_ADDRESS),
        (("person", person, None), PER_PERSON),
    )
