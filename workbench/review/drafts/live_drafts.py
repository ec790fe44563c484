"""Edited drafts as they are on disk, kept in memory, and changed by one thread at a time."""

from __future__ import annotations

import json
import sqlite3
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

from ....corpus import Corpus
from ..coding.modes import mode_of
from ..database import Database
from . import storage
from .records import DraftKey, Look, TierChange, TierState, make_key
from .starting import Starts
from .storage import Record

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["Live", "LiveDrafts"]

_KEPT = 1024


@dataclass(frozen=True)
class Live:
    """An edited draft as it is: what the database says, kept in memory."""

    record: Record
    tiers: Mapping[str, TierState]
    edits: tuple[tuple[int, int, str], ...]
    """Number, identifier and kind of those that are applied or can be redone."""
    made: int
    """Edits ever, those included that were undone and overtaken."""

    @property
    def undo(self) -> str | None:
        """Kind of the edit that would be undone."""
        return self.edits[self.record.head - 1][2] if self.record.head > 0 else None

    @property
    def redo(self) -> str | None:
        """Kind of the edit that would be redone."""
        return self.edits[self.record.head][2] if self.record.head < len(self.edits) else None


class LiveDrafts:
    """All drafts, to look at; and what editing, publishing and relabelling share.

    Parameters
    ----------
    review
        The review: its database, and the corpus at its newest snapshot.
    """

    def __init__(self, review: Review) -> None:
        self._review = review
        self.starts = Starts(review)
        self._kept: OrderedDict[DraftKey, Live] = OrderedDict()
        # Gone when nobody holds them: whoever asks for takes that never were must not fill the memory.
        self._locks: WeakValueDictionary[DraftKey, threading.RLock] = WeakValueDictionary()
        self._lock = threading.Lock()

    def look(self, person: str, take: str, purpose: str = "own") -> Look:
        """Return a draft as it is, or as it would start; nothing is written, and what is asked again is quick.

        Raises
        ------
        NotFoundError
            If there is neither a draft nor such a take.
        """
        key = make_key(person, take, purpose)
        return self._look(key, self._review.corpus(), mode_of(self._review, person, take))

    def unpublished(self, person: str) -> dict[str, int]:
        """Return how many edits, and undone ones, of a person's own drafts are not published, by take."""
        with self.database.read() as connection:
            records = storage.read_records(connection, person=person, purpose="own")
        return {record.key.take: record.unpublished for record in records}

    def begun(self, *, person: str | None = None, take: str | None = None) -> list[DraftKey]:
        """Return the drafts in which something was edited, in order of take and person."""
        with self.database.read() as connection:
            return [record.key for record in storage.read_records(connection, person=person, take=take)]

    def settled(self, take: str) -> list[tuple[str, int, int, str | None]]:
        """Return ``(tier, onset, offset, label)`` of each disagreement of a take that a lead settled, in that order."""
        found = []
        with self.database.read() as connection:
            for record in storage.read_records(connection, take=take, purpose="adjudication"):
                for row in connection.execute(
                    "SELECT operation FROM edits WHERE draft = ? AND cut = 0 AND number <= ? AND kind = 'settle' "
                    "ORDER BY number",
                    (record.draft, record.head),
                ):
                    said = json.loads(row["operation"])
                    found.append((said["tier"], said["onset"], said["offset"], said["label"]))
        return found

    @property
    def database(self) -> Database:
        """Where drafts are kept."""
        return self._review.database

    @contextmanager
    def locked(self, *keys: DraftKey) -> Iterator[None]:
        """Keep drafts from being changed by others within the block."""
        with ExitStack() as stack:
            for key in sorted(set(keys), key=lambda key: (key.person, key.take, key.purpose)):
                with self._lock:
                    lock = self._locks.get(key)
                    if lock is None:
                        lock = self._locks[key] = threading.RLock()
                stack.enter_context(lock)
            yield

    def live(self, key: DraftKey) -> Live | None:
        """Return an edited draft; None where there is no edit."""
        with self._lock:
            live = self._kept.get(key)
            if live is not None:
                self._kept.move_to_end(key)
                return live
        with self.database.read() as connection:
            record = storage.read_record(connection, key)
            if record is None or not record.edited:
                return None
            live = _read_live(connection, record)
        self.keep(live)
        return live

    def keep(self, live: Live) -> None:
        """Remember a draft as it now is on disk."""
        with self._lock:
            self._kept[live.record.key] = live
            self._kept.move_to_end(live.record.key)
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)

    def forget(self, key: DraftKey) -> None:
        """Read a draft from disk when it is next asked for."""
        with self._lock:
            self._kept.pop(key, None)

    def find_gone(self, record: Record, corpus: Corpus) -> str | None:
        """Return why a draft's take cannot be worked on, None where it can."""
        recording = self.starts.recording(corpus, record.key.take)
        if recording is None:
            return (
                f"take {record.key.take!r}: it was deleted from the corpus; your edits are kept here and can be "
                "exported"
            )
        if recording != record.recording:
            return (
                f"take {record.key.take!r}: its recording is another one by now; your edits are kept here and can be "
                "exported"
            )
        return None

    def append(
        self,
        connection: sqlite3.Connection,
        live: Live,
        kind: str,
        operation: Mapping[str, Any],
        changes: Sequence[TierChange],
    ) -> Live:
        """Add an edit to a draft, within a write; what it comes to is to be kept once that is on disk."""
        storage.cut_redo(connection, live.record)
        number = live.record.head + 1
        edit = storage.insert_edit(connection, live.record.draft, number, kind, operation, changes)
        record = live.record.moved(number, length=number)
        storage.update_draft(connection, record)
        return Live(
            record,
            storage.apply_changes(live.tiers, changes),
            (*live.edits[: number - 1], (number, edit, kind)),
            live.made + 1,
        )

    def _look(self, key: DraftKey, corpus: Corpus, mode: str) -> Look:
        if mode == "none":
            return Look({}, 0, 0, False, 0)
        live = self.live(key)
        if live is None:
            tiers = self.starts.start(corpus, key, mode).tiers
            return Look({name: tier.rows for name, tier in tiers.items()}, 0, 0, False, 0)
        rows = {name: tier.rows for name, tier in live.tiers.items()}
        return Look(rows, live.record.version, live.record.unpublished, True, live.made)


def _read_live(connection: sqlite3.Connection, record: Record) -> Live:
    made = connection.execute("SELECT COUNT(*) FROM edits WHERE draft = ?", (record.draft,)).fetchone()[0]
    edits = tuple(storage.read_edits(connection, record.draft))
    return Live(record, storage.read_tiers(connection, record), edits, int(made))
