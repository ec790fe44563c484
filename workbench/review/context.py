"""What one running review holds: the corpus, the edits' database, the people, and what each package keeps."""

from __future__ import annotations

import hashlib
import importlib
import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import icechunk

from ...corpus import Corpus
from ...corpus.store.location import Location, locate
from ...corpus.store.locking import describe_error
from ...errors import CorpusError
from .database import Database
from .people.accounts import check_free_name, check_name
from .people.people import People
from .people.person import Person

if TYPE_CHECKING:
    from .drafts.drafts import Drafts

__all__ = ["PACKAGES", "Review", "open_database", "open_review", "review_folder"]

Part = TypeVar("Part")

PACKAGES = ("people", "drafts", "showing", "elan", "queueing", "coding", "scheme")
"""The parts of the review; each may have a ``SCHEMA`` of its tables and a ``routes.router``."""

_LOOK_AGAIN = 1.0
"""How often a corpus in S3 is asked for its newest snapshot, in s; one in a folder is asked each time (30 µs)."""


@dataclass
class Review:
    """One corpus under review, shared by all requests (they run in several threads)."""

    location: Location
    folder: Path
    """Where edits and caches are; see :func:`review_folder`."""
    database: Database
    people: People
    closing: threading.Event = field(default_factory=threading.Event)
    """Set when the server ends: threads in the background look at it and stop."""
    _parts: dict[str, Any] = field(default_factory=dict)
    _making: dict[str, threading.RLock] = field(default_factory=dict)
    _corpus: Corpus | None = None
    _asked: float = 0.0
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @property
    def place(self) -> str:
        """Tells this corpus from another of the same name, and does not tell where it lies."""
        return hashlib.sha256(str(self.location).encode("utf-8", "surrogateescape")).hexdigest()[:12]

    @property
    def cookie(self) -> str:
        """The name of the session's cookie; browsers share cookies between ports, so each corpus has its own."""
        return f"mimique-{self.place}"

    @property
    def drafts(self) -> Drafts:
        """What people changed and have not published."""
        from .drafts.drafts import Drafts

        return self.part("drafts", lambda: Drafts(self))

    def corpus(self) -> Corpus:
        """Return the corpus at the newest snapshot of its branch, to read only: requests share it.

        The same object as long as nobody committed, another one afterwards: what is in use never moves on. Whoever
        commits opens a corpus of their own, ``Corpus.open(review.location)``.

        Raises
        ------
        CorpusError
            If it cannot be opened any more.
        """
        with self._lock:
            if self._corpus is None:
                self._corpus = Corpus.open(self.location)
            elif isinstance(self.location, Path) or time.monotonic() - self._asked > _LOOK_AGAIN:
                self._corpus = _find_newest(self._corpus)
            self._asked = time.monotonic()
            return self._corpus

    def part(self, name: str, make: Callable[[], Part]) -> Part:
        """Return what was kept under ``name``, made once: a package's own caches and threads live here.

        ``make`` must not change the database: somebody who is just changing it may be waiting for the part.

        ::

            queue = review.part("queue", lambda: QueueCache(review))
        """
        with self._lock:
            making = self._making.setdefault(name, threading.RLock())
        with making:
            if name not in self._parts:
                self._parts[name] = make()
            kept: Part = self._parts[name]
            return kept

    def without_places(self, text: str) -> str:
        """Return a message without where the corpus lies, for people who log in from elsewhere.

        It is nothing to them, and more than a stranger to the computer needs to know of it. Whoever sits at the server
        is told, since commands need it.
        """
        if not self.people.are_named or not isinstance(self.location, Path):
            return text
        for place in (self.folder, review_folder(self.location), self.location, self.location.resolve()):
            text = text.replace(str(place), place.name)
        return text

    def close(self) -> None:
        """Tell the threads in the background to stop, and close the database."""
        self.closing.set()
        self.database.close()


def review_folder(location: Location) -> Path:
    """Return the folder of a corpus's edits: ``<corpus>.review`` beside its folder.

    That of a corpus in S3 is among the user's data (``XDG_DATA_HOME``, else ``~/.local/share``), under ``mimique``:
    edits are not in the corpus before they are published, so nothing may clear them away as it may a cache.
    """
    location = locate(location)
    if isinstance(location, Path):
        location = location.resolve()  # by whatever link it is reached, it is one corpus with one server
        return location.parent / f"{location.name}.review"
    data = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    return data / "mimique" / f"{hashlib.sha256(location.encode()).hexdigest()[:16]}.review"


def open_database(location: Location) -> Database:
    """Open the database of a corpus's edits; it and its folder are made where there are none, for this user's eyes.

    Raises
    ------
    CorpusError
        If it cannot be made or read, is locked, or was written by a newer mimique.
    """
    folder = review_folder(location)
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise CorpusError(f"{folder}: the folder of the edits cannot be made ({error.strerror or error})") from error
    return Database(folder / "edits.sqlite", [schema for name in PACKAGES if (schema := _find_schema(name))])


def open_review(location: Location | str, *, owner: str | None = None) -> Review:
    """Open a corpus for review.

    Parameters
    ----------
    location
        The corpus: its folder, or its address in S3.
    owner
        The one person who reviews, a lead, let in by a token; None where people log in by name.

    Raises
    ------
    InputError
        If the owner has a name that nobody can have, as that of a model.
    CorpusError
        If there is no corpus, a newer mimique wrote it, or its edits cannot be read.
    """
    location = locate(location)
    corpus = Corpus.open(location)
    if owner is not None:
        owner = check_name(owner)
        check_free_name(corpus, owner)
    database = open_database(location)
    people = People(database, owner=None if owner is None else Person(owner, is_lead=True))
    return Review(location, review_folder(location), database, people, _corpus=corpus)


def _find_newest(corpus: Corpus) -> Corpus:
    repository, branch = corpus._repository, str(corpus.branch)
    try:
        newest = corpus.branches()[branch] if branch != "main" else repository.lookup_branch(branch)
        if newest == corpus.snapshot:
            return corpus
        return Corpus(corpus.path, repository, newest, branch)
    except (icechunk.IcechunkError, KeyError):
        # The folder may have been replaced as a whole, as when a signer was forgotten.
        try:
            return Corpus.open(corpus.path)
        except icechunk.IcechunkError as error:
            raise CorpusError(f"{corpus.path}: cannot be read: {describe_error(error)}") from error


def _find_schema(package: str) -> str:
    return str(getattr(importlib.import_module(f".{package}", __package__), "SCHEMA", ""))
