"""The one door through which every commit goes.

On a local disk Icechunk loses commits without a word when several processes commit at once: measured with four
processes at a barrier, 224 of 374 commits that had been reported as done were absent from the history (1.1.21). An
exclusive lock on one file around the commit cures it: 600 of 600 present.
"""

from __future__ import annotations

import json
import os
import re
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import icechunk
from filelock import FileLock, Timeout

from ..errors import CorpusError
from .nodes import copy_node, delete_node, read_document

__all__ = ["DEFAULT_TIMEOUT", "commit_session", "describe_error", "lock_corpus"]

DEFAULT_TIMEOUT = 60.0
"""Seconds to wait for another process before giving up."""

LOCAL_FOLDER = ".mimique"


@contextmanager
def lock_corpus(folder: Path, *, timeout: float = DEFAULT_TIMEOUT, purpose: str = "") -> Iterator[None]:
    """Hold the corpus for writing; nobody else on this machine commits meanwhile.

    The lock is the operating system's, so it ends with the process that holds it, however that ends. A note beside
    the lock file says who holds it, for the message of those who wait in vain.

    Raises
    ------
    CorpusError
        If the folder cannot be written, or another process holds the lock for longer than ``timeout`` seconds.
    """
    local = folder / LOCAL_FOLDER
    note = local / "holder.json"
    lock = FileLock(local / "commit.lock", timeout=timeout, poll_interval=0.005)
    try:
        local.mkdir(exist_ok=True)
        lock.acquire()
    except Timeout:
        holder = _describe_holder(note)
        raise CorpusError(f"{folder}: locked by {holder} for more than {timeout:g} s; wait, or end it") from None
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written ({error.strerror or error}); check its permissions") from error
    try:
        with suppress(OSError):  # only a help for messages
            facts = {"pid": os.getpid(), "host": socket.gethostname(), "since": time.time(), "purpose": purpose}
            note.write_text(json.dumps(facts), encoding="utf-8")
        yield
    finally:
        lock.release()


def commit_session(
    session: icechunk.Session,
    message: str,
    metadata: Mapping[str, Any],
    *,
    folder: Path,
    timeout: float = DEFAULT_TIMEOUT,
    repository: icechunk.Repository | None = None,
    check: Callable[[str], None] | None = None,
) -> str:
    """Commit a session under the lock and return the new snapshot.

    Parameters
    ----------
    session
        A writable session with changes.
    message, metadata
        What the commit records.
    folder
        The corpus.
    timeout
        Seconds to wait for the lock.
    repository
        The session's repository; needed to commit when the branch has moved on in a way that Icechunk cannot rebase.
    check
        Called under the lock with the branch's newest snapshot; raises if what others did there stands in the way.

    Raises
    ------
    CorpusError
        If the corpus is locked or cannot be written. Nothing was committed then.
    ConflictError
        Whatever ``check`` raises.
    """
    with lock_corpus(folder, timeout=timeout, purpose=message):
        try:
            if repository is not None and check is not None and session.branch is not None:
                check(repository.lookup_branch(session.branch))
            changes = session.status()
            try:
                return session.commit(message, dict(metadata), rebase_with=icechunk.ConflictDetector(), rebase_tries=5)
            except (icechunk.RebaseFailedError, icechunk.ConflictError):
                if repository is None or check is None or session.branch is None:
                    raise
                return _replay(session, changes, repository).commit(
                    message, dict(metadata), rebase_with=icechunk.ConflictDetector(), rebase_tries=5
                )
        except (icechunk.IcechunkError, OSError) as error:
            if isinstance(error, CorpusError):
                raise
            raise CorpusError(f"{folder}: the commit failed, nothing changed: {describe_error(error)}") from error


def describe_error(error: BaseException) -> str:
    """Return the gist of an error in one line; Icechunk's own run over many."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    lines = [line.strip(" |x`->×│╰─▶") for line in text.splitlines()]
    return next((line for line in lines if line), type(error).__name__)


def _replay(session: icechunk.Session, changes: icechunk.Diff, repository: icechunk.Repository) -> icechunk.Session:
    """Return a fresh session on the branch's newest snapshot with the same changes.

    Icechunk refuses to rebase when both sides made the same group, which here is only a container: two first tiers
    of one author in one take both make ``tiers/<author>``. That nothing else collides was checked before.
    """
    fresh = repository.writable_session(str(session.branch))
    for path in sorted(changes.deleted_groups | changes.deleted_arrays):
        delete_node(fresh.store, path.strip("/"))
    containers = {path.strip("/") for path in changes.new_groups}
    touched = containers | {path.strip("/") for path in changes.new_arrays | changes.updated_arrays}
    touched |= {path.strip("/") for path in changes.updated_groups} | {p.strip("/") for p in changes.updated_chunks}
    existing = {path for path in sorted(touched) if read_document(fresh.store, path) is not None}
    for path in sorted(touched, key=lambda p: p.count("/")):
        if path in containers and path in existing:
            continue
        copy_node(session.store, fresh.store, path)
    return fresh


def _describe_holder(note: Path) -> str:
    try:
        holder = json.loads(note.read_text(encoding="utf-8"))
        return f"process {holder['pid']} on {holder['host']} ({holder['purpose']})"
    except (OSError, ValueError, KeyError, TypeError):
        return "another process"
