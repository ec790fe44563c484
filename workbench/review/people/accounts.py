"""Accounts: who may log in by name."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass

from ....corpus.store.view import CorpusView
from ....errors import ConflictError, InputError, NotFoundError
from ..database import Database
from .passwords import hash_password, is_outdated, verify_password
from .person import Person

__all__ = ["ADJUDICATED", "Account", "Accounts", "check_free_name", "check_name", "fold_name"]

ADJUDICATED = "adjudicated"
"""The author of settled tiers; nobody is called that."""

PROGRAM = "mimique"
"""Nor that."""

_LONGEST = 100


@dataclass(frozen=True)
class Account:
    """Somebody who may log in, or might once."""

    person: str
    is_lead: bool
    is_active: bool
    """Nobody is deleted, as their edits are not either; who was removed cannot log in."""


class Accounts:
    """The accounts of one review."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def list(self) -> list[Account]:
        """Return all accounts by name, those that were removed too."""
        with self._database.read() as connection:
            rows = connection.execute("SELECT person, is_lead, is_active FROM accounts ORDER BY person").fetchall()
        return [Account(row[0], bool(row[1]), bool(row[2])) for row in rows]

    def add(self, person: str, password: str, *, is_lead: bool = False) -> Account:
        """Make an account; one that was removed comes back, with this password.

        Raises
        ------
        InputError
            If the name or the password cannot be one.
        ConflictError
            If there is an account of that name, be it in other capitals.
        """
        name, kept = check_name(person), hash_password(password)
        with self._database.write() as connection:
            for there, is_active in connection.execute("SELECT person, is_active FROM accounts").fetchall():
                if there.casefold() == name.casefold() and (is_active or there != name):
                    raise ConflictError(f"there is an account {there!r} already; change its password, or choose a name")
            connection.execute(
                "INSERT INTO accounts (person, password, is_lead, is_active) VALUES (?, ?, ?, 1) "
                "ON CONFLICT (person) DO UPDATE "
                "SET password = excluded.password, is_lead = excluded.is_lead, is_active = 1",
                (name, kept, is_lead),
            )
        return Account(name, is_lead, True)

    def change(self, person: str, *, password: str | None = None, is_lead: bool | None = None) -> Account:
        """Change password or rights; a new password ends the person's sessions.

        Raises
        ------
        NotFoundError
            If there is no such account.
        InputError
            If the password cannot be one.
        ConflictError
            If nobody would be lead any more.
        """
        kept = None if password is None else hash_password(password)
        with self._database.write() as connection:
            account = self.find(person)
            if is_lead is False:
                self._keep_a_lead(account)
            if kept is not None:
                connection.execute("UPDATE accounts SET password = ? WHERE person = ?", (kept, account.person))
                connection.execute("DELETE FROM sessions WHERE person = ? AND is_named = 1", (account.person,))
            if is_lead is not None:
                connection.execute("UPDATE accounts SET is_lead = ? WHERE person = ?", (is_lead, account.person))
            return self.find(person)

    def remove(self, person: str) -> None:
        """Let somebody in no more; their edits stay.

        Raises
        ------
        NotFoundError
            If there is no such account.
        ConflictError
            If nobody would be lead any more while others are left.
        """
        with self._database.write() as connection:
            account = self.find(person)
            self._keep_a_lead(account)
            connection.execute("UPDATE accounts SET is_active = 0 WHERE person = ?", (account.person,))
            connection.execute("DELETE FROM sessions WHERE person = ? AND is_named = 1", (account.person,))

    def check_password(self, person: str, password: str) -> Person | None:
        """Return who that is, None where name or password are wrong."""
        name = fold_name(person)
        with self._database.read() as connection:
            row = connection.execute(
                "SELECT password, is_lead FROM accounts WHERE person = ? AND is_active = 1", (name,)
            ).fetchone()
        if not verify_password(row[0] if row else None, password):
            return None
        if is_outdated(row[0]):
            with self._database.write() as connection:
                again = (hash_password(password), name, row[0])
                connection.execute("UPDATE accounts SET password = ? WHERE person = ? AND password = ?", again)
        return Person(name, bool(row[1]))

    def find(self, person: str) -> Account:
        """Return somebody's account.

        Raises
        ------
        NotFoundError
            If there is none, or it was removed.
        """
        name = fold_name(person)
        found = next((one for one in self.list() if one.person == name and one.is_active), None)
        if found is None:
            names = ", ".join(one.person for one in self.list() if one.is_active) or "none"
            raise NotFoundError(f"no account {name!r}; accounts: {names}")
        return found

    def _keep_a_lead(self, leaving: Account) -> None:
        others = [one for one in self.list() if one.is_active and one.person != leaving.person]
        if leaving.is_lead and others and not any(one.is_lead for one in others):
            raise ConflictError(f"{leaving.person} is the only lead; make somebody else a lead first")


def fold_name(person: str) -> str:
    """Return a name as it is looked up: in composed form (NFC), without blanks around it, no longer than any is."""
    return unicodedata.normalize("NFC", person[: 10 * _LONGEST]).strip()[: _LONGEST + 1]


def check_free_name(corpus: CorpusView, person: str) -> None:
    """Refuse a name that an author of the corpus has who is nobody: what the two publish would be one tier.

    Raises
    ------
    InputError
        If a model of the corpus is called so, be it in other capitals.
    """
    if person.casefold() in {str(model).casefold() for model in corpus.models()}:
        raise InputError(f"name: {person!r} is a model of the corpus, the author of what it labels; choose another")


def check_name(person: str) -> str:
    """Return a person's name as it is kept: in composed form (NFC), without blanks around it.

    Raises
    ------
    InputError
        If it is empty, too long, holds characters that cannot be seen or is kept for other authors.
    """
    name = unicodedata.normalize("NFC", person).strip()
    if not 0 < len(name) <= _LONGEST:
        raise InputError(f"name: expected 1 to {_LONGEST} characters, but got {len(name)}")
    if odd := next((one for one in name if unicodedata.category(one)[0] == "C"), None):
        raise InputError(f"name: {name!r} holds {odd!r}, which cannot be seen; leave it out")
    if name.casefold() in (ADJUDICATED, PROGRAM):
        whose = "settled tiers" if name.casefold() == ADJUDICATED else "what the program makes itself"
        raise InputError(f"name: {name!r} is the author of {whose}; choose another")
    return name
