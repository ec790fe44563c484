"""Drafts in the tables of the database: read, written, and nothing decided."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

from ....corpus.versions.segment_rows import Columns, Row, decode_row, encode_row, sort_rows
from .records import DraftKey, TierChange, TierState, make_key

__all__ = [
    "Record",
    "apply_changes",
    "cut_redo",
    "drop_publications",
    "insert_draft",
    "insert_edit",
    "pack_tier",
    "read_changes",
    "read_edits",
    "read_history",
    "read_publications",
    "read_record",
    "read_records",
    "read_starts",
    "read_tiers",
    "rewrite_edit",
    "update_draft",
    "write_known",
    "write_publication",
    "write_tiers",
]


@dataclass(frozen=True)
class Record:
    """One row of the table ``drafts``."""

    draft: int
    key: DraftKey
    base: str
    recording: str
    frames: int
    start: str
    edited: bool
    version: int
    head: int
    length: int
    published: int
    common: int

    @property
    def unpublished(self) -> int:
        """How many edits, and undone ones, lead from what the corpus has to the draft."""
        common = min(self.common, self.head)
        return (self.published - common) + (self.head - common)

    def moved(self, head: int, *, length: int | None = None) -> Record:
        """Return the record with another last edit; ``length`` where later ones were cut."""
        common = self.common if length is None else min(self.common, head - 1)
        return replace(
            self,
            head=head,
            length=self.length if length is None else length,
            common=common,
            version=self.version + 1,
            edited=True,
        )

    def as_published(self, base: str) -> Record:
        """Return the record of a draft that is as the corpus is."""
        return replace(self, published=self.head, common=self.head, base=base)


_COLUMNS = "draft, person, take, purpose, base, recording, frames, start, edited, version, head, length, published, common"  # fmt: skip  # noqa: E501


def read_record(connection: sqlite3.Connection, key: DraftKey) -> Record | None:
    """Return a draft's record, None where there is none."""
    found = connection.execute(
        f"SELECT {_COLUMNS} FROM drafts WHERE person = ? AND take = ? AND purpose = ?",
        (key.person, key.take, key.purpose),
    ).fetchone()
    return None if found is None else _make_record(found)


def read_records(
    connection: sqlite3.Connection,
    *,
    person: str | None = None,
    take: str | None = None,
    purpose: str | None = None,
    edited: bool = True,
) -> list[Record]:
    """Return the records of drafts, in order of take, person and purpose."""
    rows = connection.execute(
        f"SELECT {_COLUMNS} FROM drafts WHERE (?1 IS NULL OR person = ?1) AND (?2 IS NULL OR take = ?2) "
        "AND (?3 IS NULL OR purpose = ?3) AND edited >= ?4 ORDER BY take, person, purpose",
        (person, take, purpose, int(edited)),
    ).fetchall()
    return [_make_record(row) for row in rows]


def insert_draft(
    connection: sqlite3.Connection, key: DraftKey, *, base: str, recording: str, n_frames: int, start: str
) -> Record:
    """Begin a draft."""
    connection.execute(
        "INSERT INTO drafts (person, take, purpose, base, recording, frames, start) VALUES (?, ?, ?, ?, ?, ?, ?)",
        (key.person, key.take, key.purpose, base, recording, n_frames, start),
    )
    record = read_record(connection, key)
    if record is None:
        raise sqlite3.DatabaseError("a draft that was just written is not there")
    return record


def update_draft(connection: sqlite3.Connection, record: Record) -> None:
    """Keep what changed of a draft's record."""
    connection.execute(
        "UPDATE drafts SET base = ?, recording = ?, frames = ?, start = ?, edited = ?, version = ?, head = ?, "
        "length = ?, published = ?, common = ? WHERE draft = ?",
        (
            record.base, record.recording, record.frames, record.start, int(record.edited), record.version,
            record.head, record.length, record.published, record.common, record.draft,
        ),
    )  # fmt: skip


def read_starts(connection: sqlite3.Connection, draft: int) -> dict[str, TierState]:
    """Return a draft's tiers as they were before its first edit."""
    tiers = {}
    for row in connection.execute("SELECT * FROM draft_tiers WHERE draft = ? ORDER BY rowid", (draft,)):
        known = None if row["known"] is None else json.loads(row["known"])
        tiers[str(row["tier"])] = TierState(
            str(row["tier"]),
            row["source"],
            json.loads(row["inputs"]),
            _unpack_columns(json.loads(row["columns"])),
            _unpack_rows(json.loads(row["rows"])),
            None if known is None else (_unpack_columns(known["columns"]), _unpack_rows(known["rows"])),
        )
    return tiers


def read_tiers(connection: sqlite3.Connection, record: Record) -> dict[str, TierState]:
    """Return a draft's tiers as they are after its applied edits."""
    tiers = read_starts(connection, record.draft)
    for row in connection.execute(
        "SELECT changes FROM edits WHERE draft = ? AND cut = 0 AND number <= ? ORDER BY number",
        (record.draft, record.head),
    ):
        tiers = apply_changes(tiers, _unpack_changes(row["changes"]))
    return tiers


def read_history(connection: sqlite3.Connection, draft: int) -> list[tuple[int, tuple[TierChange, ...]]]:
    """Return identifier and changes of all edits of a draft, those included that were undone and overtaken."""
    rows = connection.execute("SELECT edit, changes FROM edits WHERE draft = ? ORDER BY edit", (draft,))
    return [(int(row["edit"]), _unpack_changes(row["changes"])) for row in rows]


def rewrite_edit(connection: sqlite3.Connection, edit: int, changes: Sequence[TierChange]) -> None:
    """Keep other rows for an edit, as labels were renamed."""
    connection.execute("UPDATE edits SET changes = ? WHERE edit = ?", (_pack_changes(changes), edit))


def apply_changes(tiers: Mapping[str, TierState], changes: Iterable[TierChange]) -> dict[str, TierState]:
    """Return the tiers after changes."""
    result = dict(tiers)
    for change in changes:
        tier = result[change.tier]
        gone = {row["id"] for row in change.removed}
        rows = [row for row in tier.rows if row["id"] not in gone]
        result[change.tier] = replace(tier, rows=tuple(sort_rows([*rows, *change.added])))
    return result


def write_tiers(connection: sqlite3.Connection, draft: int, tiers: Iterable[TierState]) -> None:
    """Keep what tiers start from, in place of what was kept of them."""
    for tier in tiers:
        connection.execute(
            "INSERT INTO draft_tiers (draft, tier, source, inputs, columns, rows, known) VALUES (?, ?, ?, ?, ?, ?, ?) "
            "ON CONFLICT (draft, tier) DO UPDATE SET source = excluded.source, inputs = excluded.inputs, "
            "columns = excluded.columns, rows = excluded.rows, known = excluded.known",
            (draft, tier.tier, tier.source, json.dumps(dict(tier.inputs)), *pack_tier(tier)),
        )


def pack_tier(tier: TierState) -> tuple[str, str, str | None]:
    """Return columns, rows and what is known of the corpus as the JSON that is kept."""
    known = None
    if tier.known is not None:
        columns, rows = tier.known
        known = json.dumps({"columns": columns, "rows": [encode_row(row) for row in rows]})
    return json.dumps(tier.columns), json.dumps([encode_row(row) for row in tier.rows]), known


def write_known(connection: sqlite3.Connection, draft: int, tier: TierState) -> None:
    """Keep what a draft now knows of the corpus's tier, and the columns that this brought."""
    columns, _, known = pack_tier(tier)
    connection.execute(
        "UPDATE draft_tiers SET known = ?, columns = ? WHERE draft = ? AND tier = ?",
        (known, columns, draft, tier.tier),
    )


def write_publication(connection: sqlite3.Connection, draft: int, tier: TierState, outcome: str) -> None:
    """Keep what a draft's tier is while it is published, and what tells the outcome."""
    columns, rows, _ = pack_tier(tier)
    connection.execute(
        "INSERT OR REPLACE INTO publications (draft, tier, columns, rows, outcome) VALUES (?, ?, ?, ?, ?)",
        (draft, tier.tier, columns, rows, outcome),
    )


def read_publications(connection: sqlite3.Connection, draft: int) -> dict[str, tuple[Columns, tuple[Row, ...], str]]:
    """Return columns, rows and outcome of the tiers whose publication the draft does not know to have ended."""
    return {
        str(row["tier"]): (
            _unpack_columns(json.loads(row["columns"])),
            _unpack_rows(json.loads(row["rows"])),
            row["outcome"],
        )
        for row in connection.execute("SELECT * FROM publications WHERE draft = ?", (draft,))
    }


def drop_publications(connection: sqlite3.Connection, draft: int) -> None:
    """Forget what was being published: it ended."""
    connection.execute("DELETE FROM publications WHERE draft = ?", (draft,))


def insert_edit(
    connection: sqlite3.Connection,
    draft: int,
    number: int,
    kind: str,
    operation: Mapping[str, Any],
    changes: Sequence[TierChange],
) -> int:
    """Keep an edit and return its identifier."""
    made = datetime.now(UTC).isoformat(timespec="milliseconds")
    cursor = connection.execute(
        "INSERT INTO edits (draft, number, kind, operation, changes, made) VALUES (?, ?, ?, ?, ?, ?)",
        (draft, number, kind, json.dumps(operation), _pack_changes(changes), made),
    )
    return int(cursor.lastrowid or 0)


def cut_redo(connection: sqlite3.Connection, record: Record) -> None:
    """Give up the edits that were undone; they stay in the table."""
    if record.length > record.head:
        connection.execute(
            "UPDATE edits SET cut = 1 WHERE draft = ? AND cut = 0 AND number > ?", (record.draft, record.head)
        )


def read_changes(connection: sqlite3.Connection, edit: int) -> tuple[TierChange, ...]:
    """Return what an edit changed."""
    row = connection.execute("SELECT changes FROM edits WHERE edit = ?", (edit,)).fetchone()
    return _unpack_changes(row["changes"])


def read_edits(connection: sqlite3.Connection, draft: int) -> list[tuple[int, int, str]]:
    """Return ``(number, edit, kind)`` of the edits that are applied or can be redone, in order."""
    return [
        (int(row["number"]), int(row["edit"]), str(row["kind"]))
        for row in connection.execute(
            "SELECT number, edit, kind FROM edits WHERE draft = ? AND cut = 0 ORDER BY number", (draft,)
        )
    ]


def _make_record(row: sqlite3.Row) -> Record:
    key = make_key(row["person"], row["take"], row["purpose"])
    return Record(
        row["draft"], key, row["base"], row["recording"], row["frames"], row["start"], bool(row["edited"]),
        row["version"], row["head"], row["length"], row["published"], row["common"],
    )  # fmt: skip


def _pack_changes(changes: Sequence[TierChange]) -> str:
    return json.dumps(
        [
            {
                "tier": change.tier,
                "removed": [encode_row(row) for row in change.removed],
                "added": [encode_row(row) for row in change.added],
            }
            for change in changes
        ]
    )


def _unpack_changes(text: str) -> tuple[TierChange, ...]:
    return tuple(
        TierChange(one["tier"], _unpack_rows(one["removed"]), _unpack_rows(one["added"])) for one in json.loads(text)
    )


def _unpack_rows(rows: Sequence[Mapping[str, Any]]) -> tuple[Row, ...]:
    return tuple(decode_row(row) for row in rows)


def _unpack_columns(columns: Sequence[Sequence[Any]]) -> Columns:
    return tuple((str(name), spelled) for name, spelled in columns)
