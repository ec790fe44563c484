"""Drafts become one commit of the corpus: shown first, merged with what others published, then put.

Nothing is lost where a process ends in the middle. The commit is whole or not there. What is about to be committed is
written down before; where it is there, but the drafts do not know it yet, the next plan finds the corpus as it was to
become, takes over what conflicts were settled with, and asks about nothing a second time.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from ....corpus import Corpus
from ....corpus.store.provenance import describe_step
from ....corpus.versions.segment_changes import SegmentChange, compare_tables, describe_change
from ....corpus.versions.segment_merging import SegmentConflict, TierMerge, merge_tables
from ....corpus.versions.segment_rows import Columns, Row, format_segment, key_of_row
from ....errors import InputError, MimiqueError
from ...pipeline.tier_makers import REVIEW_STEP
from . import storage
from .operations import difference
from .records import DraftKey, StaleDraftError, TierChange, TierState
from .segment_table import fit_columns, make_table
from .starting import StoredTier

if TYPE_CHECKING:
    from .drafts import Drafts, Live

__all__ = ["LOCK_TIMEOUT", "Plan", "Published", "TierPlan", "describe_words", "plan_publishing", "publish"]

LOCK_TIMEOUT = 10.0
"""How long publishing waits for others that write the corpus, in s."""

_SEARCHED = 200
"""So many commits are looked through for the one that a conflict is with."""


@dataclass(frozen=True)
class TierPlan:
    """What publishing makes of one tier.

    Parameters
    ----------
    state
        The tier of the draft.
    theirs
        What the corpus has of the author by now; None for no such tier.
    before
        What changes are told against: the corpus, or the proposals where the author has no tier there yet.
    merge
        Of what the draft last knew, the draft, and the corpus; None where there is nothing to merge with.
    """

    key: DraftKey
    state: TierState
    theirs: StoredTier | None
    before: tuple[Row, ...]
    merge: TierMerge | None

    @cached_property
    def conflicts(self) -> dict[str, SegmentConflict]:
        """Conflicts by a key that no other tier's conflict has."""
        return {_hash([*_name(self), one.key])[:16]: one for one in (self.merge.conflicts if self.merge else ())}

    @cached_property
    def changes(self) -> tuple[SegmentChange, ...]:
        """What publishing changes, besides the conflicts."""
        return self._compare(self.settle(dict.fromkeys(self.conflicts, "theirs")))

    def settle(self, choices: Mapping[str, str]) -> tuple[Columns, tuple[Row, ...]]:
        """Return the tier as it is published."""
        if self.merge is None:
            return self.state.columns, self.state.rows
        rows = [row for key, one in self.conflicts.items() for row in one.settle(choices[key])]
        return self.merge.columns, (*self.merge.rows, *rows)

    def count_changes(self, choices: Mapping[str, str]) -> int:
        """Return how many changes are published."""
        return len(self._compare(self.settle(choices)) if self.conflicts else self.changes)

    def _compare(self, after: tuple[Columns, tuple[Row, ...]]) -> tuple[SegmentChange, ...]:
        columns = self.theirs.columns if self.theirs is not None else self.state.columns
        return compare_tables(make_table(columns, self.before), make_table(*after)).changes


@dataclass(frozen=True)
class Plan:
    """What publishing would do.

    Parameters
    ----------
    plan
        The same only for the same plan.
    snapshot
        The corpus's newest.
    tiers
        Those that change, with conflicts or without.
    held_back
        Take and reason where it cannot be published.
    """

    plan: str
    snapshot: str
    tiers: tuple[TierPlan, ...]
    held_back: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Published:
    """What was published."""

    snapshot: str
    changes: int
    takes: int


def plan_publishing(drafts: Drafts, person: str, *, is_lead: bool, corpus: Corpus) -> Plan:
    """Return what publishing a person's drafts would do to a corpus at its newest snapshot.

    Drafts that the corpus is already like are marked as published.
    """
    keys = drafts.begun(person=person)
    with drafts.locked(*keys):
        return _plan(drafts, person, keys, is_lead, corpus)[0]


def publish(
    drafts: Drafts,
    person: str,
    *,
    is_lead: bool,
    corpus: Corpus,
    plan: str,
    message: str,
    choices: Mapping[str, str],
) -> Published:
    """Publish a person's drafts as one commit.

    Parameters
    ----------
    drafts, person
        Whose.
    is_lead
        Whether tiers that settle disagreements are published too.
    corpus
        Opened for this alone, at the newest snapshot.
    plan
        That the person saw.
    message
        Of the commit.
    choices
        How each conflict is settled, by its key.

    Raises
    ------
    StaleDraftError
        If what publishing would do is something else by now.
    InputError
        If a conflict is not settled.
    CorpusError
        If the corpus is locked or cannot be written; the edits stay.
    """
    keys = drafts.begun(person=person)
    with drafts.locked(*keys):
        now, lives = _plan(drafts, person, keys, is_lead, corpus)
        if now.plan != plan:
            raise StaleDraftError("publishing would do something else by now; look at the changes again")
        choices = _check_choices(now, choices)
        takes = {tier.key.take for tier in now.tiers}
        count = sum(tier.count_changes(choices) for tier in now.tiers)
        if not now.tiers:
            return Published(corpus.snapshot, 0, 0)
        text = message.strip() or ("Review a take" if len(takes) == 1 else f"Review {len(takes)} takes")
        parameters = {"takes": sorted(takes), "choices": dict(choices)}
        _note(drafts, now, lives, choices)
        with corpus.transaction(text, command="review", parameters=parameters, author=person) as edit:
            for tier in now.tiers:
                table = make_table(*tier.settle(choices))
                provenance = describe_step(
                    REVIEW_STEP,
                    inputs={},  # a person's work is not derived again where a proposal changed
                    parameters={"source": tier.state.source, **tier.state.inputs, "purpose": tier.key.purpose},
                )
                edit.put_tier(tier.key.take, tier.state.tier, table, author=tier.key.author, provenance=provenance)
        _mark(drafts, [lives[key] for key in dict.fromkeys(tier.key for tier in now.tiers)], corpus)
        return Published(corpus.snapshot, count, len(takes))


def describe_words(change: SegmentChange) -> str:
    """Return what a change did, in words."""
    old, new = (" + ".join(format_segment(row) for row in rows) for rows in (change.before, change.after))
    if change.kind != "edited":
        return f"{old or new} {change.kind}" + (f" into {new}" if change.before and change.after else "")
    facts = list(describe_change(change))
    told = [fact for fact in facts if fact["change"] in ("relabelled", "onset moved", "offset moved")]
    if told:
        return f"{old} " + ", ".join(f"{fact['change']} {fact['from']} to {fact['to']}" for fact in told)
    status = next((fact["to"] for fact in facts if fact["change"] == "status"), None)
    if status is not None:
        return f"{old} {'accepted' if status == 'reviewed' else status}"
    return f"{old} " + ", ".join(f"{fact['change']} {fact['from']} to {fact['to']}" for fact in facts)


def find_commit(corpus: Corpus, key: DraftKey, tier: str) -> tuple[str, str]:
    """Return author and message of the commit that last changed an author's tier."""
    history = corpus.history().head(_SEARCHED)
    newest = corpus.fingerprint(key.take, "tier", tier, key.author)
    rows = list(history.itertuples())
    for row, older in zip(rows, [*rows[1:], None], strict=True):
        try:
            before = (
                ""
                if older is None
                else Corpus.open(corpus.path, at=str(older.snapshot)).fingerprint(key.take, "tier", tier, key.author)
            )
        except MimiqueError:
            before = ""
        if before != newest:
            return str(row.author), str(row.message)
    return "", ""


def _plan(
    drafts: Drafts, person: str, keys: Collection[DraftKey], is_lead: bool, corpus: Corpus
) -> tuple[Plan, dict[DraftKey, Live]]:
    """Return the plan of the drafts of ``keys``, which are locked, and these; those begun since are left out."""
    with drafts.database.read() as connection:
        records = [
            record
            for record in storage.read_records(connection, person=person)
            if record.unpublished and record.key in keys and (is_lead or record.key.purpose == "own")
        ]
        under_way = {record.key: storage.read_publications(connection, record.draft) for record in records}
        starts = {record.key: storage.read_starts(connection, record.draft) for record in records}
    tiers: list[TierPlan] = []
    held_back: list[tuple[str, str]] = []
    lives: dict[DraftKey, Live] = {}
    like: list[Live] = []
    for record in records:
        live = drafts.live(record.key)
        gone = drafts.find_gone(record, corpus)
        if live is None:
            continue
        if gone is not None:
            held_back.append((record.key.take, gone))
            continue
        lives[record.key] = live
        found = list(_plan_draft(drafts, live, starts[record.key], under_way[record.key], corpus))
        changing = [tier for tier in found if tier.conflicts or tier.changes]
        tiers += changing
        if not changing:
            like.append(live)
    if like:
        _mark(drafts, like, corpus)
    said = [
        [*_name(tier), lives[tier.key].record.version, tier.theirs.fingerprint if tier.theirs else ""] for tier in tiers
    ]
    return Plan(_hash([person, said, held_back]), corpus.snapshot, tuple(tiers), tuple(held_back)), lives


def _plan_draft(
    drafts: Drafts,
    live: Live,
    starts: Mapping[str, TierState],
    under_way: Mapping[str, tuple[Columns, tuple[Row, ...], str]],
    corpus: Corpus,
) -> Iterable[TierPlan]:
    key = live.record.key
    own = drafts.starts.find_own(corpus, key)
    for name, state in live.tiers.items():
        theirs = own.get(name)
        if theirs is None:
            start = starts[name].rows
            if state.known is None and _same(state.rows, start):
                continue  # proposals that nobody touched are nobody's tier
            # Deleted meanwhile: what the person has of it is put again.
            yield TierPlan(key, state, None, start if state.known is None else (), None)
        elif not _same(state.rows, theirs.rows):
            known = state.known
            if name in under_way and under_way[name][2] == _digest(theirs.rows):
                # That commit was made and the process ended. What the corpus has else was chosen by the person then.
                known = under_way[name][:2]
            base = None if known is None else make_table(*known)
            merge = merge_tables(base, make_table(state.columns, state.rows), make_table(theirs.columns, theirs.rows))
            yield TierPlan(key, state, theirs, theirs.rows, merge)


def _note(drafts: Drafts, plan: Plan, lives: Mapping[DraftKey, Live], choices: Mapping[str, str]) -> None:
    """Write down what is about to be committed."""
    with drafts.database.write() as connection:
        for tier in plan.tiers:
            draft = lives[tier.key].record.draft
            storage.write_publication(connection, draft, tier.state, _digest(tier.settle(choices)[1]))


def _mark(drafts: Drafts, lives: Iterable[Live], corpus: Corpus) -> None:
    """Let drafts know that the corpus is as they are; what others published becomes part of them."""
    kept = []
    with drafts.database.write() as connection:
        for live in lives:
            key = live.record.key
            own = drafts.starts.find_own(corpus, key)
            changes = []
            for name, state in live.tiers.items():
                if name not in own:
                    continue
                stored = own[name]
                change = difference(state.rows, stored.rows)
                if change:
                    changes.append(TierChange(name, change.removed, change.added))
                columns = fit_columns(state.columns, stored.rows)
                state = replace(state, columns=columns, known=(stored.columns, stored.rows))
                storage.write_known(connection, live.record.draft, state)
                live = replace(live, tiers={**live.tiers, name: state})
            if changes:
                live = drafts.append(connection, live, "merge-in", {"kind": "merge-in"}, changes)
            live = replace(live, record=live.record.as_published(corpus.snapshot))
            storage.update_draft(connection, live.record)
            storage.drop_publications(connection, live.record.draft)
            kept.append(live)
    for live in kept:
        drafts.keep(live)


def _check_choices(plan: Plan, choices: Mapping[str, str]) -> dict[str, str]:
    checked = {}
    for tier in plan.tiers:
        for key, conflict in tier.conflicts.items():
            choice = choices.get(key)
            if choice not in conflict.choices:
                where = f"take {tier.key.take!r}, tier {tier.state.tier!r}"
                raise InputError(
                    f"{where}: expected {', '.join(conflict.choices)} for its conflict {key}, but got {choice!r}"
                )
            checked[key] = choice
    return checked


def _same(first: Iterable[Row], second: Iterable[Row]) -> bool:
    return sorted(map(key_of_row, first)) == sorted(map(key_of_row, second))


def _digest(rows: Iterable[Row]) -> str:
    return _hash(sorted(map(key_of_row, rows)))


def _name(tier: TierPlan) -> list[str]:
    return [tier.key.person, tier.key.take, tier.key.purpose, tier.state.tier]


def _hash(value: object) -> str:
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()
