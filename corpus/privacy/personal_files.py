"""Files beside the repository that can hold something of a person: finished work kept for reuse, databases of edits."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

from ...errors import CorpusError
from .redaction import Redactor

__all__ = ["ICECHUNK_ENTRIES", "clean_beside", "copy_extra_files", "is_database", "purge_database", "review_beside"]

ICECHUNK_ENTRIES = frozenset(("chunks", "config.yaml", "manifests", "refs", "snapshots", "transactions"))
"""What Icechunk keeps in a repository's folder."""


def is_database(path: Path) -> bool:
    """Return whether a file is an SQLite database."""
    try:
        with path.open("rb") as file:
            return file.read(16) == b"SQLite format 3\x00"
    except OSError:
        return False


def purge_database(path: Path, redactor: Redactor) -> int:
    """Delete all rows that have one of the names in them, overwrite where they were, and return how many they were.

    Raises
    ------
    CorpusError
        If the database cannot be changed, say because it is open elsewhere.
    """
    removed = 0
    try:
        with closing(sqlite3.connect(path, timeout=10)) as database:
            database.execute("PRAGMA secure_delete = ON")
            database.create_function("names_somebody", 1, lambda value: _names(value, redactor), deterministic=True)
            tables = database.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
            for (table,) in tables:
                if table.startswith("sqlite_"):
                    continue
                columns = [row[1] for row in database.execute(f"PRAGMA table_info({_quote(table)})")]
                where = " OR ".join(f"names_somebody({_quote(column)})" for column in columns)
                removed += database.execute(f"DELETE FROM {_quote(table)} WHERE {where}").rowcount
            database.commit()
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            database.execute("VACUUM")
    except sqlite3.Error as error:
        raise CorpusError(
            f"{path}: the database cannot be changed ({error}); close what uses it, then again"
        ) from error
    return removed


def clean_beside(corpus: Path, redactor: Redactor) -> None:
    """Delete the scratch folder beside a corpus, and a person's rows in databases named after the corpus."""
    shutil.rmtree(corpus.parent / f"{corpus.name}.scratch", ignore_errors=True)
    for path in _files_beside(corpus):
        if is_database(path):
            purge_database(path, redactor)


def copy_extra_files(source: Path, target: Path, redactor: Redactor, *, leave: frozenset[str]) -> list[str]:
    """Copy what lies in a corpus's folder and is not Icechunk's, databases without a person's rows.

    Parameters
    ----------
    source, target
        Folders.
    redactor
        Finds the names.
    leave
        Entries that are not copied.

    Returns
    -------
    list
        The names of the entries that were copied and are no databases; nobody looked into them.
    """
    copied = []
    for entry in sorted(source.iterdir()):
        if entry.name in leave or entry.name.endswith(("-wal", "-shm", "-journal")):
            continue
        place = target / entry.name
        if is_database(entry):
            with closing(sqlite3.connect(entry)) as old, closing(sqlite3.connect(place)) as new:
                old.backup(new)
            purge_database(place, redactor)
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.copytree(entry, place, symlinks=True, dirs_exist_ok=True)
        else:
            shutil.copy2(entry, place, follow_symlinks=False)
        copied.append(entry.name)
    for path in target.rglob("*"):
        if path.is_file() and path.parent != target and is_database(path):
            purge_database(path, redactor)
    return copied


def review_beside(corpus: Path) -> Path:
    """Return the folder in which a corpus's review keeps its edits, whether or not it is there."""
    return corpus.parent / f"{corpus.name}.review"


def _files_beside(corpus: Path) -> list[Path]:
    """Return the files in entries beside the corpus that are named after it, such as ``corpus.notes.sqlite``.

    The review's own folder is left to the review: a row of it that names nobody can belong to one that does.
    """
    files: list[Path] = []
    for entry in sorted(corpus.parent.glob(f"{_escape(corpus.name)}.*")):
        if entry == review_beside(corpus):
            continue
        files += [path for path in entry.rglob("*") if path.is_file()] if entry.is_dir() else [entry]
    return files


def _escape(name: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


def _names(value: object, redactor: Redactor) -> bool:
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    return isinstance(value, str) and redactor.finds(value)


def _quote(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'
