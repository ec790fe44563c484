"""Sessions: who a browser was let in as.

The browser keeps a secret of 256 bits in a cookie, the database its hash alone, so that whoever reads the database
cannot come in by it. What a page must send back with every change (CSRF) is another hash of that secret.
"""

from __future__ import annotations

import hashlib
import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from ....errors import CorpusError
from ..database import Database
from .person import Person

__all__ = ["LIFETIME", "Session", "Sessions"]

LIFETIME = 30 * 24 * 3600
"""How long somebody stays logged in without coming back, in s."""

_MARK_AGAIN = 3600
"""How often it is written down that a session is in use, in s: each time would be a write a request."""


@dataclass(frozen=True)
class Session:
    """A browser in which somebody is logged in."""

    person: Person
    csrf: str


class Sessions:
    """The sessions of one review.

    Parameters
    ----------
    database
        The review's.
    owner
        The one person that a token lets in; None where people log in by name. The two kinds do not mix: who had a
        session by token has none any more once the server asks for names.
    clock
        Seconds since some epoch that outlives the process. A clock that jumps ahead logs people out, no more.
    """

    def __init__(self, database: Database, owner: Person | None, clock: Callable[[], float] = time.time) -> None:
        self._database = database
        self._owner = owner
        self._clock = clock

    def begin(self, person: str) -> str:
        """Return the secret of a new session."""
        secret, now = secrets.token_urlsafe(32), self._clock()
        with self._database.write() as connection:
            connection.execute("DELETE FROM sessions WHERE seen < ?", (now - LIFETIME,))
            connection.execute(
                "INSERT INTO sessions (hash, person, is_named, seen) VALUES (?, ?, ?, ?)",
                (_hash(secret), person, self._owner is None, now),
            )
        return secret

    def find(self, secret: str) -> Session | None:
        """Return the session of a secret, None where it is over or never was."""
        if not secret:
            return None
        with self._database.read() as connection:
            row = connection.execute(
                "SELECT sessions.person, sessions.is_named, sessions.seen, accounts.is_lead, accounts.is_active "
                "FROM sessions LEFT JOIN accounts ON accounts.person = sessions.person WHERE hash = ?",
                (_hash(secret),),
            ).fetchone()
        if row is None or bool(row["is_named"]) is not (self._owner is None):
            return None
        now = self._clock()
        if row["seen"] < now - LIFETIME:
            return None
        if self._owner is not None:
            if row["person"] != self._owner.name:
                return None
            person = self._owner
        elif row["is_active"]:
            person = Person(row["person"], bool(row["is_lead"]))
        else:
            return None
        if abs(now - row["seen"]) > _MARK_AGAIN:
            # Only how long it lasts; whoever is logged in goes on reading where the disk is full.
            with suppress(CorpusError), self._database.write() as connection:
                connection.execute("UPDATE sessions SET seen = ? WHERE hash = ?", (now, _hash(secret)))
        return Session(person, hashlib.sha256(b"csrf:" + _encode(secret)).hexdigest())

    def end(self, secret: str) -> None:
        """Forget a session."""
        with self._database.write() as connection:
            connection.execute("DELETE FROM sessions WHERE hash = ?", (_hash(secret),))


def _hash(secret: str) -> str:
    return hashlib.sha256(_encode(secret)).hexdigest()


def _encode(secret: str) -> bytes:
    return secret.encode("utf-8", "surrogatepass")
