"""The file that keeps annotators' edits until they are published: SQLite, durable when a block ends.

Every change is one transaction that is on disk before the block that made it ends (write-ahead log,
``synchronous=FULL``: https://www.sqlite.org/pragma.html#pragma_synchronous), so that what was told to be saved
survives the end of the process or of the machine's power. One writer at a time in this process; readers see the last
finished state and never wait.
"""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ...errors import CorpusError

__all__ = ["Database"]

_FORMAT = 1
"""Kept in the file; a file with a higher number was written by a newer mimique."""

_LONGEST_WAIT = 10.0
"""How long a change waits for another process that writes, in s."""


class Database:
    """Tables of the review, shared by all threads of one process.

    Parameters
    ----------
    path
        The file; it is made where there is none, and so is its folder.
    schemas
        ``CREATE TABLE IF NOT EXISTS …`` of each package, several statements each where needed.

    Raises
    ------
    CorpusError
        If the file cannot be opened or written, is damaged, or was written by a newer mimique.
    """

    def __init__(self, path: Path | str, schemas: Sequence[str] = ()) -> None:
        self.path = Path(path)
        self._lock = threading.RLock()
        self._writing = False
        self._idle: list[sqlite3.Connection] = []
        self._idle_lock = threading.Lock()
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CorpusError(f"{self.path.parent}: the folder cannot be made ({error.strerror or error})") from error
        with self._explained():
            self._writer = self._connect()
            if self._writer.execute("PRAGMA user_version").fetchone()[0] > _FORMAT:
                self._writer.close()
                raise CorpusError(f"{self.path}: written by a newer mimique; update mimique to open it")
        try:
            with self.write() as connection:
                for schema in schemas:
                    for statement in _split(schema):
                        connection.execute(statement)
                connection.execute(f"PRAGMA user_version = {_FORMAT}")
        except BaseException:
            self._writer.close()
            raise

    @contextmanager
    def write(self) -> Iterator[sqlite3.Connection]:
        """Yield the connection that writes, in a transaction that is on disk when the block ends.

        An error within the block takes everything of it back. A block within a block of the same thread belongs to the
        outer one.

        Raises
        ------
        CorpusError
            If it cannot be written: the disk is full, the file locked by another process, damaged or read-only.
            Nothing of the block is kept then.
        """
        with self._lock:
            if self._writing:
                yield self._writer
                return
            with self._explained():
                self._writer.execute("BEGIN IMMEDIATE")
                self._writing = True
                try:
                    yield self._writer
                    self._writer.execute("COMMIT")
                except BaseException:
                    with suppress(sqlite3.Error):
                        if self._writer.in_transaction:
                            self._writer.execute("ROLLBACK")
                    raise
                finally:
                    self._writing = False

    @contextmanager
    def read(self) -> Iterator[sqlite3.Connection]:
        """Yield a connection that sees one finished state throughout the block; within a write, that of the write.

        Raises
        ------
        CorpusError
            If the file cannot be read.
        """
        if self._writing and self._lock.acquire(blocking=False):
            try:
                if self._writing:  # by this very thread: another one holds the lock while it writes
                    yield self._writer
                    return
            finally:
                self._lock.release()
        with self._explained():
            connection = self._take()
            try:
                connection.execute("BEGIN")
                yield connection
            finally:
                with suppress(sqlite3.Error):
                    if connection.in_transaction:
                        connection.execute("ROLLBACK")
                with self._idle_lock:
                    self._idle.append(connection)

    def close(self) -> None:
        """Close the file; what was written stays."""
        with self._lock, self._idle_lock:
            for connection in (*self._idle, self._writer):
                connection.close()
            self._idle.clear()

    def _take(self) -> sqlite3.Connection:
        with self._idle_lock:
            if self._idle:
                return self._idle.pop()
        return self._connect()

    def _connect(self) -> sqlite3.Connection:
        connection = sqlite3.connect(
            self.path, timeout=_LONGEST_WAIT, isolation_level=None, check_same_thread=False, cached_statements=256
        )
        connection.row_factory = sqlite3.Row
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        return connection

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Tell trouble with the file as one clear line; a broken rule of a table is the caller's to see."""
        try:
            yield
        except sqlite3.IntegrityError:
            raise
        except sqlite3.DatabaseError as error:
            raise CorpusError(f"{self.path}: {_explain(error)}") from error


def _explain(error: sqlite3.DatabaseError) -> str:
    text = str(error)
    if "full" in text or "disk I/O" in text:
        return f"nothing more can be saved ({text}); make room on the disk, then try again"
    if "locked" in text or "busy" in text:
        return "another process holds the file; end it, then try again"
    if "readonly" in text or "unable to open" in text:
        return f"the file cannot be written ({text}); see to its rights"
    if "not a database" in text or "malformed" in text:
        return f"the file is damaged ({text}); restore it from a backup, or move it away to begin anew"
    return f"the edits cannot be read or saved ({text})"


def _split(schema: str) -> Iterator[str]:
    """Yield the statements of a schema: ``executescript`` would end the transaction."""
    statement = ""
    for piece in schema.split(";"):
        statement += piece + ";"
        if sqlite3.complete_statement(statement):
            if statement.strip("; \n"):
                yield statement
            statement = ""
