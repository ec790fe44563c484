"""What each request was answered with: one that is sent again, as after a lost connection, counts once."""

from __future__ import annotations

import sqlite3

from ....errors import ConflictError, InputError
from ..database import Database
from . import storage
from .records import DraftKey, EditOutcome

__all__ = ["find_answer", "keep_answer"]


def find_answer(database: Database, key: DraftKey, request: str) -> EditOutcome | None:
    """Return what a request was answered with, None where it is new.

    Raises
    ------
    InputError
        If it is no UUID, or another text of at most 100 ASCII characters.
    ConflictError
        If it was one about another draft.
    """
    if not isinstance(request, str) or not 1 <= len(request) <= 100 or not request.isascii():
        raise InputError("request: expected a UUID, so that an edit that is sent twice counts once")
    with database.read() as connection:
        row = connection.execute(
            "SELECT requests.*, person, take, purpose FROM requests JOIN drafts USING (draft) WHERE request = ?",
            (request,),
        ).fetchone()
        if row is None:
            return None
        if (row["person"], row["take"], row["purpose"]) != (key.person, key.take, key.purpose):
            raise ConflictError("request: another draft's edit has this UUID; give each edit its own")
        changes = storage.read_changes(connection, row["edit"])
    if row["step"] == "undo":
        changes = tuple(change.reversed() for change in changes)
    return EditOutcome(row["version"], row["undo"], row["redo"], row["unpublished"], changes)


def keep_answer(
    connection: sqlite3.Connection, draft: int, request: str, step: str, edit: int, outcome: EditOutcome
) -> None:
    """Keep what a request about a draft is answered with, within the write that does what it asks for."""
    connection.execute(
        "INSERT INTO requests (request, draft, step, edit, version, undo, redo, unpublished) "
        "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        (request, draft, step, edit, outcome.version, outcome.undo, outcome.redo, outcome.unpublished),
    )
