"""A signer who is forgotten leaves the review too: edits of their takes, plans and readings, and what was shown.

Edits live beside the corpus before they are published, and they hold a person's data as the corpus does. What goes are
the drafts of the signer's recordings with all their history. Drafts of others' takes are somebody's work and stay; they
only say no more that a model which learned from the signer proposed something in them.
"""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...corpus.privacy.personal_data import PersonalData
from ...corpus.privacy.redaction import Redactor
from ...corpus.store.location import Location
from ...errors import CorpusError
from .context import open_database, review_folder
from .server.server_lock import lock_server

__all__ = ["ReviewPurge", "purge_review", "reviews_closed"]

PLACES = ("activity", "coding", "coding_readings")
"""Tables that name takes, besides those of drafts."""


@dataclass
class ReviewPurge:
    """Purges the review of a corpus when it is called, and then tells what it did.

    Parameters
    ----------
    location
        The corpus; None where it has no review.
    drafts
        How many drafts went.
    namesake
        Somebody who reviews and is called like the signer's code, so that nobody can tell whether it is the signer:
        their account and their work on others' takes stay. "" where there is nobody.
    """

    location: Location | None
    drafts: int = 0
    namesake: str = ""

    def __call__(self, data: PersonalData, redactor: Redactor) -> None:
        """Delete what is the signer's."""
        if self.location is not None:
            self.drafts, self.namesake = purge_review(self.location, data, redactor)


@contextmanager
def reviews_closed(location: Location) -> Iterator[ReviewPurge]:
    """Keep a corpus from being reviewed within the block, and yield what purges its review.

    Raises
    ------
    CorpusError
        If it is being reviewed: the server keeps edits in its memory and would write them again.
    """
    folder = review_folder(location)
    if not folder.is_dir():
        yield ReviewPurge(None)
        return
    with lock_server(folder):
        yield ReviewPurge(location)


def purge_review(location: Location, data: PersonalData, redactor: Redactor) -> tuple[int, str]:
    """Delete what the review of a corpus keeps of a signer, and overwrite where it was.

    To be called within :func:`reviews_closed`.

    Returns
    -------
    (drafts, namesake)
        As :class:`ReviewPurge` has them.

    Raises
    ------
    CorpusError
        If the database or the folder cannot be written, or another process has the database open.
    """
    folder = review_folder(location)
    theirs = data.takes - data.kept_takes
    database = open_database(location)
    try:
        with database.write() as connection:
            connection.execute("PRAGMA secure_delete = ON")
            drafts = [
                row["draft"]
                for row in connection.execute("SELECT draft, take, recording FROM drafts").fetchall()
                if row["take"] in theirs or row["recording"] in data.recordings
            ]
            for table in (
                "publications",
                "requests",
                "edits",
                "draft_tiers",
                "drafts",
            ):  # those that refer to others first
                connection.executemany(f"DELETE FROM {table} WHERE draft = ?", [(draft,) for draft in drafts])
            for table in PLACES:
                # A reading has no recording of its own: one of a take that was theirs once may be of them.
                takes = data.takes if table == "coding_readings" else theirs
                connection.executemany(f"DELETE FROM {table} WHERE take = ?", [(take,) for take in sorted(takes)])
            _redact_sources(connection, data, redactor)
            _redact_settings(connection, theirs, redactor)
            namesake = _find_namesake(connection, data.signer)
        _vacuum(database.path)
    finally:
        database.close()
    try:
        shutil.rmtree(folder / "shown", ignore_errors=False)
    except FileNotFoundError:
        pass
    except OSError as error:
        raise CorpusError(f"{folder / 'shown'}: cannot be deleted ({error.strerror or error}); see to it") from error
    return len(drafts), namesake


def _find_namesake(connection: sqlite3.Connection, signer: str) -> str:
    people = "SELECT person FROM accounts UNION SELECT person FROM drafts UNION SELECT person FROM activity"
    return next((row[0] for row in connection.execute(people).fetchall() if row[0] == signer), "")


def _redact_sources(connection: sqlite3.Connection, data: PersonalData, redactor: Redactor) -> None:
    """Take the names of the signer's models, and the fingerprints of what these proposed, out of others' drafts."""
    for row in connection.execute("SELECT rowid, source, inputs FROM draft_tiers WHERE source IS NOT NULL").fetchall():
        source, inputs = redactor.text(row["source"]), json.loads(row["inputs"])
        kept = {name: value for name, value in inputs.items() if value not in data.derived}
        if (source, kept) != (row["source"], inputs):
            change = (source, json.dumps(kept), row["rowid"])
            connection.execute("UPDATE draft_tiers SET source = ?, inputs = ? WHERE rowid = ?", change)
    for row in connection.execute("SELECT edit, operation FROM edits WHERE kind = 'take-over'").fetchall():
        said = json.loads(row["operation"])
        author = redactor.text(str(said.get("author")))
        if author != said.get("author"):
            operation = json.dumps({**said, "author": author})
            connection.execute("UPDATE edits SET operation = ? WHERE edit = ?", (operation, row["edit"]))


def _redact_settings(connection: sqlite3.Connection, takes: Collection[str], redactor: Redactor) -> None:
    """Take names of takes out of what people chose; all else there is theirs, be it a word like the signer's code."""

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {clean(key): clean(item) for key, item in value.items()}
        if isinstance(value, list):
            return [clean(item) for item in value]
        return redactor.replacement if isinstance(value, str) and value in takes else value

    for row in connection.execute("SELECT person, settings FROM settings").fetchall():
        settings = json.loads(row["settings"])
        if clean(settings) != settings:
            change = (json.dumps(clean(settings)), row["person"])
            connection.execute("UPDATE settings SET settings = ? WHERE person = ?", change)


def _vacuum(path: Path) -> None:
    """Write the database anew without what was deleted, and empty its log."""
    connection = sqlite3.connect(path, timeout=10, isolation_level=None)
    try:
        connection.execute("PRAGMA secure_delete = ON")
        connection.execute("VACUUM")
        busy, _, _ = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
        if busy:
            raise CorpusError(f"{path}: open in another process; end it, then try again")
    except sqlite3.Error as error:
        raise CorpusError(f"{path}: cannot be cleared ({error}); end what uses it, then try again") from error
    finally:
        connection.close()
