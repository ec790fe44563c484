"""The people of one review: their accounts, sessions and settings."""

from __future__ import annotations

import hmac
import json
import math
import secrets
from typing import Any

from ....errors import ConflictError, InputError
from ..database import Database
from ..server.errors import Refusal
from .accounts import Accounts, fold_name
from .login_limits import LoginLimits
from .passwords import check_password_form
from .person import Person
from .sessions import Session, Sessions

__all__ = ["LONGEST_SETTINGS", "People"]

_DEEPEST_SETTINGS = 20

LONGEST_SETTINGS = 64 * 1024
"""Bytes of JSON that are kept of what a person chose."""


class People:
    """Who may come in, and what they chose.

    Parameters
    ----------
    database
        The review's.
    owner
        The one person who reviews, let in by :attr:`token`; None where people log in by name.
    """

    def __init__(self, database: Database, *, owner: Person | None = None) -> None:
        self.owner = owner
        self.token = secrets.token_urlsafe(32)
        """Of this run of the server: in the opened address, where nobody else sees it."""
        self.accounts = Accounts(database)
        self._sessions = Sessions(database, owner)
        self._limits = LoginLimits()
        self._database = database

    @property
    def are_named(self) -> bool:
        """Whether people log in by name."""
        return self.owner is None

    def log_in_by_token(self, token: str) -> str:
        """Return the secret of a new session of the owner.

        Raises
        ------
        Refusal
            401 where it is not the token of this run, or people log in by name.
        """
        given = token.encode("utf-8", "surrogatepass")
        if self.owner is None or not hmac.compare_digest(given, self.token.encode()):
            how = "log in by name" if self.owner is None else "open the address that mimique printed last"
            raise Refusal(401, "no-session", f"that address is not this server's; {how}")
        return self._sessions.begin(self.owner.name)

    def log_in_by_name(self, person: str, password: str, address: str) -> str:
        """Return the secret of a new session.

        Raises
        ------
        Refusal
            401 where name or password are wrong, or nobody logs in by name; 429 after too many of these from
            ``address``.
        """
        if not self.are_named:
            raise Refusal(401, "no-session", "nobody logs in by name here; open the address that mimique printed")
        person = fold_name(person)  # else a blank more would be another person with as many tries
        if (wait := math.ceil(self._limits.begin(person, address))) > 0:
            raise Refusal(
                429, "too-many", f"too many wrong passwords; try again in {wait} s", {"Retry-After": str(wait)}
            )
        found = self.accounts.check_password(person, password)
        if found is None:
            raise Refusal(401, "no-session", "name or password are wrong; a lead can give you another password")
        self._limits.succeed(person, address)
        return self._sessions.begin(found.name)

    def change_own_password(self, person: str, old: str, new: str, address: str) -> str:
        """Give a person another password, end all their sessions, and return the secret of a new one.

        Raises
        ------
        ConflictError
            If nobody logs in by name.
        InputError
            If the new password cannot be one.
        Refusal
            As :meth:`log_in_by_name`, whoever sits down at a page that somebody left open.
        """
        if not self.are_named:
            raise ConflictError("nobody logs in by name here, so there is no password")
        check_password_form(new)
        self.log_out(self.log_in_by_name(person, old, address))
        self.accounts.change(person, password=new)
        return self._sessions.begin(person)

    def find_session(self, secret: str) -> Session | None:
        """Return the session that a cookie means, None where there is none."""
        return self._sessions.find(secret)

    def log_out(self, secret: str) -> None:
        """End a session."""
        self._sessions.end(secret)

    def settings(self, person: str) -> dict[str, Any]:
        """Return what a person chose; empty at first."""
        with self._database.read() as connection:
            row = connection.execute("SELECT settings FROM settings WHERE person = ?", (person,)).fetchone()
        return {} if row is None else dict(json.loads(row[0]))

    def put_settings(self, person: str, settings: dict[str, Any]) -> None:
        """Keep what a person chose, in place of what was there.

        Raises
        ------
        InputError
            If it is more than :data:`LONGEST_SETTINGS` bytes of JSON, or no JSON.
        """
        _check_depth(settings)
        try:
            text = json.dumps(settings, allow_nan=False, ensure_ascii=False)
            size = len(text.encode())
        except (ValueError, RecursionError) as error:
            raise InputError("settings: expected JSON of numbers that are finite and texts in Unicode") from error
        if size > LONGEST_SETTINGS:
            raise InputError(f"settings: expected at most {LONGEST_SETTINGS} bytes, but got {size}")
        with self._database.write() as connection:
            connection.execute(
                "INSERT INTO settings (person, settings) VALUES (?, ?) "
                "ON CONFLICT (person) DO UPDATE SET settings = excluded.settings",
                (person, text),
            )


def _check_depth(settings: dict[str, Any]) -> None:
    """Refuse what is nested so deeply that it could not be written as JSON again."""
    level: list[Any] = [settings]
    for _ in range(_DEEPEST_SETTINGS):
        level = [
            inner
            for one in level
            if isinstance(one, dict | list)
            for inner in (one.values() if isinstance(one, dict) else one)
        ]
    if any(isinstance(one, dict | list) for one in level):
        raise InputError(f"settings: expected at most {_DEEPEST_SETTINGS} levels, one within the other")
