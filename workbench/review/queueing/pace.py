"""How long people worked, and how fast they are going.

A page says now and then how long its person has been looking and working. No more is counted than has gone by since
the person's last message, by a clock that nobody can set: two tabs do not double the time, and neither does a page
whose own clock jumps.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from ....errors import NotFoundError
from .corpus_facts import get_facts
from .queue import count_held

if TYPE_CHECKING:
    from ..context import Review

__all__ = [
    "LONGEST",
    "ActivityClock",
    "WorkPace",
    "compute_pace",
    "get_activity_clock",
    "measure_pace",
    "record_activity",
]

LONGEST = 120.0
"""The most that one message can say, in s: who is silent for longer was away."""
WINDOW = 600.0
"""The pace is that of the last active stretch of this length, in s."""
SHORTEST = 60.0
"""Before so much active time, in s, there is nothing to say about the pace."""
_SLACK = 1.0
"""Messages are not sent quite evenly, in s."""
_MOST_KEPT = 200
"""Messages kept for the pace; they reach back further than the window unless they come every 3 s."""


@dataclass(frozen=True)
class WorkPace:
    """How far and how fast a person is; ``per_minute`` and ``minutes_left`` are None while nothing can be said."""

    reviewed: int
    remaining: int
    per_minute: float | None
    minutes_left: float | None
    active_seconds: float


class ActivityClock:
    """When each person was last heard of, by a clock that only goes forward."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._counted: dict[str, float] = {}
        """Until when each person's time is counted; a little ahead where messages came early."""

    def grant(self, person: str, seconds: float) -> float:
        """Return how much of the seconds that a person claims has gone by since their last message."""
        with self._lock:
            now = self._now()
            counted = max(self._counted.get(person, -math.inf), now - LONGEST)
            granted = max(min(seconds, LONGEST, now + _SLACK - counted), 0.0)
            self._counted[person] = max(now, counted + granted)
        return granted


def get_activity_clock(review: Review) -> ActivityClock:
    """Return the clock of a review."""
    return review.part("activity clock", ActivityClock)


def record_activity(review: Review, person: str, take: str, seconds: float) -> float:
    """Add time that a person spent on a take; on disk on return.

    Parameters
    ----------
    review
        The review.
    person, take
        Who worked on what.
    seconds
        At least 0; no more is counted than :data:`LONGEST`, nor than has gone by since the person's last message.

    Returns
    -------
    Seconds that were counted.

    Raises
    ------
    NotFoundError
        If there is no such take.
    """
    if take not in get_facts(review).takes:
        raise NotFoundError(f"there is no take {take[:100]!r} any more; its edits are kept")
    granted = get_activity_clock(review).grant(person, seconds)
    done = count_held(review, person).done
    moment = datetime.now(UTC).isoformat(timespec="seconds")
    with review.database.write() as connection:
        connection.execute(
            "INSERT INTO activity (person, take, seconds, turn, moment) "
            "VALUES (?, ?, ?, (SELECT COALESCE(MAX(turn), 0) + 1 FROM activity), ?) "
            "ON CONFLICT (person, take) DO UPDATE SET "
            "seconds = seconds + excluded.seconds, turn = excluded.turn, moment = excluded.moment",
            (person, take, granted, moment),
        )
        connection.execute("INSERT INTO pace (person, seconds, reviewed) VALUES (?, ?, ?)", (person, granted, done))
        connection.execute(
            "DELETE FROM pace WHERE person = ? AND number <= "
            "(SELECT number FROM pace WHERE person = ? ORDER BY number DESC LIMIT 1 OFFSET ?)",
            (person, person, _MOST_KEPT),
        )
    return granted


def measure_pace(review: Review, person: str) -> WorkPace:
    """Return how far and how fast a person is.

    The pace is what was reviewed between two messages of the page, over the active time between them, for the messages
    of the last :data:`WINDOW` active seconds. What was undone counts backwards; it is never below 0.
    """
    counts = count_held(review, person)
    with review.database.read() as connection:
        total = connection.execute("SELECT SUM(seconds) FROM activity WHERE person = ?", (person,)).fetchone()[0]
        rows = connection.execute(
            "SELECT seconds, reviewed FROM pace WHERE person = ? ORDER BY number DESC LIMIT ?", (person, _MOST_KEPT)
        ).fetchall()
    per_minute = compute_pace([(float(row[0]), int(row[1])) for row in reversed(rows)])
    return WorkPace(
        reviewed=counts.reviewed,
        remaining=counts.remaining,
        per_minute=per_minute,
        minutes_left=counts.remaining / per_minute if per_minute else (0.0 if not counts.remaining else None),
        active_seconds=float(total or 0.0),
    )


def compute_pace(messages: list[tuple[float, int]]) -> float | None:
    """Return segments a minute from messages in order: active seconds before each, segments reviewed at each.

    None where the messages after the first stand for less than :data:`SHORTEST`.
    """
    seconds, last = 0.0, len(messages) - 1
    first = last
    while first > 0 and seconds < WINDOW:
        seconds += messages[first][0]
        first -= 1
    if seconds < SHORTEST:
        return None
    return max(messages[last][1] - messages[first][1], 0) * 60.0 / seconds
