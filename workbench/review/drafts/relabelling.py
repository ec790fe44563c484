"""Drafts follow a coding scheme that changes: labels are renamed or merged in all that people did and may undo.

What the corpus has of a draft is relabelled just as the corpus was, so that nothing of it counts as a person's edit.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ....corpus.annotations.label_vocabulary import LabelVocabulary
from ....corpus.annotations.vocabulary_change import change_labels
from ....corpus.versions.segment_rows import Columns, Row, key_of_row, split_table
from . import storage
from .records import DraftKey, TierChange
from .segment_table import make_table

if TYPE_CHECKING:
    from .drafts import Drafts

__all__ = ["relabel_drafts"]


def relabel_drafts(
    drafts: Drafts,
    tiers: set[str],
    vocabulary: LabelVocabulary,
    mapping: Mapping[str, str],
    *,
    merged: bool = False,
    keys: Collection[DraftKey],
) -> int:
    """Relabel tiers of all edited drafts, with their history, and return how many changed.

    Parameters
    ----------
    drafts
        All drafts of a review.
    tiers
        Names of the tiers.
    vocabulary, mapping, merged
        As for :func:`mimique.corpus.annotations.vocabulary_change.change_labels`: the vocabulary as it was, old label
        to new label, whether the old labels become another one's meaning.
    keys
        The drafts; those that begin later start from the corpus as it is by then.
    """
    if not mapping:
        return 0
    n_changed = 0
    with drafts.locked(*keys):
        try:
            with drafts.database.write() as connection:
                for record in storage.read_records(connection):
                    if record.key not in keys:
                        continue  # begun this moment, from the corpus as it is by now
                    changed = _relabel_draft(connection, record.draft, tiers, vocabulary, mapping, merged)
                    if changed:
                        storage.update_draft(connection, replace(record, version=record.version + 1))
                        n_changed += 1
        finally:
            for key in keys:
                drafts.forget(key)
    return n_changed


def _relabel_draft(
    connection: sqlite3.Connection,
    draft: int,
    tiers: set[str],
    vocabulary: LabelVocabulary,
    mapping: Mapping[str, str],
    merged: bool,
) -> bool:
    starts = storage.read_starts(connection, draft)
    history = storage.read_history(connection, draft)
    changed = False
    relabelled: dict[str, Callable[[Sequence[Row]], tuple[Row, ...]]] = {}
    for name, tier in starts.items():
        if name not in tiers:
            continue
        sets = [tier.rows]
        sets += [rows for _, changes in history for one in changes if one.tier == name for rows in _both(one)]
        columns, table = _make_map(tier.columns, sets, vocabulary, mapping, merged)
        known = tier.known
        if known is not None:
            known = split_table(change_labels(make_table(*known), vocabulary, mapping, merged=merged)[0])
        if not table and known == tier.known:
            continue
        changed = True
        relabelled[name] = lambda rows, table=table: tuple(table.get(key_of_row(row), row) for row in rows)  # type: ignore[misc]
        rows = relabelled[name](tier.rows)
        storage.write_tiers(connection, draft, [replace(tier, columns=columns, rows=rows, known=known)])
    for edit, changes in history:
        if not any(one.tier in relabelled for one in changes):
            continue
        new = [
            TierChange(one.tier, relabelled[one.tier](one.removed), relabelled[one.tier](one.added))
            if one.tier in relabelled
            else one
            for one in changes
        ]
        storage.rewrite_edit(connection, edit, new)
    return changed


def _make_map(
    columns: Columns,
    sets: Iterable[Sequence[Row]],
    vocabulary: LabelVocabulary,
    mapping: Mapping[str, str],
    merged: bool,
) -> tuple[Columns, dict[str, Row]]:
    """Return the columns afterwards, and each row that changes by what it was."""
    rows = list({key_of_row(row): row for rows in sets for row in rows}.values())
    # One segment has many states in a history; a table needs each row's id to be its own.
    numbered: list[Mapping[str, Any]] = [{**row, "id": place} for place, row in enumerate(rows)]
    changed, _ = change_labels(make_table(columns, numbered), vocabulary, mapping, merged=merged)
    new_columns, after = split_table(changed)
    table: dict[str, Row] = {}
    for row in after:
        before = rows[row["id"]]
        now = {**row, "id": before["id"]}
        if key_of_row(now) != key_of_row(before):
            table[key_of_row(before)] = now
    return new_columns, table


def _both(change: TierChange) -> tuple[tuple[Row, ...], tuple[Row, ...]]:
    return change.removed, change.added
