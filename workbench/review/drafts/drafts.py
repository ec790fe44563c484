"""All drafts of a review: shown, edited, undone and redone; every answer is given after it is on disk."""

from __future__ import annotations

import secrets
import sqlite3
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ....corpus import Corpus
from ....corpus.annotations.label_vocabulary import LabelVocabulary
from ....corpus.versions.segment_rows import Row
from ....errors import InputError, NotFoundError
from ..coding.modes import mode_of
from ..queueing.corpus_facts import get_facts
from . import storage
from .answers import find_answer, keep_answer
from .live_drafts import Live, LiveDrafts
from .operations import Change, apply_operation, difference
from .records import (
    ADJUDICATED,
    DraftKey,
    DraftState,
    EditOutcome,
    ForbiddenDraftError,
    StaleDraftError,
    TakeGoneError,
    TierChange,
    TierState,
    make_key,
)
from .relabelling import relabel_drafts
from .replacing import replace_rows
from .starting import Start
from .storage import Record
from .tier_labels import TierLabels, read_tier_labels

__all__ = ["ADJUDICATED", "DraftKey", "DraftState", "Drafts", "EditOutcome", "Live", "TierState", "make_key"]

_NO_SEGMENTS: tuple[Row, ...] = ()


class Drafts(LiveDrafts):
    """All drafts of a review, for all threads of the server.

    Parameters
    ----------
    review
        The review: its database, and the corpus at its newest snapshot.
    """

    _labels: tuple[str, dict[str, TierLabels]] = ("", {})

    def open(self, key: DraftKey) -> DraftState:
        """Return a draft to work on; one that is not edited yet follows the corpus.

        Raises
        ------
        ForbiddenDraftError
            If the take is not this person's, its coders are not done, or its signer's consent does not cover it.
        NotFoundError
            If there is neither a draft nor such a take.
        """
        corpus = self._review.corpus()
        mode = self._require_mode(key)
        with self.locked(key):
            live = self.live(key)
            if live is not None:
                live = self._catch_up(live, corpus, mode)
                return self._describe(live, corpus)
            start = self.starts.start(corpus, key, mode)
            with self.database.read() as connection:
                record = storage.read_record(connection, key)
            if record is None or record.start != start.fingerprint:
                with self.database.write() as connection:
                    record = _begin(connection, key, record, start)
            return _describe_start(key, record, start)

    def edit(self, key: DraftKey, operation: Mapping[str, Any], *, request: str, version: int) -> EditOutcome:
        """Apply an operation to a draft.

        Parameters
        ----------
        key
            Whose draft.
        operation
            As the page sends it (``kind``, ``tier`` and what belongs to the kind), ids as whole numbers.
        request
            A text of the caller's; what comes again with the same one is answered again, and counts once.
        version
            Of the draft as the person saw it.

        Raises
        ------
        StaleDraftError
            If the draft has another version by now.
        TakeGoneError
            If the take was deleted or recorded anew.
        InputError
            If the operation cannot be done, see :func:`.operations.apply_operation`.
        CorpusError
            If it cannot be saved; then it is not done.
        """
        kind, tier = str(operation.get("kind")), operation.get("tier")

        def make(tiers: Mapping[str, TierState], n_frames: int) -> list[TierChange]:
            if not isinstance(tier, str) or tier not in tiers:
                raise InputError(f"tier {tier!r}: expected one of {', '.join(tiers) or 'none'}")
            if kind == "settle" and key.purpose != "adjudication":
                raise InputError("settle: only an adjudication settles; open the take for that")
            rows = tiers[tier].rows
            if kind == "take-over":
                change = self._take_over(key, tier, str(operation.get("author")), rows, n_frames)
            else:
                labels = self._find_labels(tier)
                new_id = _make_id_source(rows)
                change = apply_operation(rows, operation, n_frames, new_id, status=key.status, labels=labels)
            # That nothing holds somewhere is a decision, though no row tells of it.
            settled = kind == "settle"
            return [TierChange(tier, change.removed, change.added)] if change or settled else []

        return self._change(key, kind, operation, make, request=request, version=version)

    def replace_tiers(
        self,
        key: DraftKey,
        tiers: Mapping[str, Sequence[Row]],
        *,
        kind: str = "import",
        request: str,
        version: int,
    ) -> EditOutcome:
        """Put whole tiers in place of a draft's, as one edit; see :func:`.replacing.replace_rows`.

        Raises as :meth:`edit`.
        """

        def make(known: Mapping[str, TierState], n_frames: int) -> list[TierChange]:
            changes = []
            for tier, new in tiers.items():
                if tier not in known:
                    raise InputError(f"tier {tier!r}: expected one of {', '.join(known) or 'none'}")
                rows = known[tier].rows
                change = replace_rows(rows, new, n_frames, _make_id_source(rows), edited=key.status)
                if change:
                    changes.append(TierChange(tier, change.removed, change.added))
            return changes

        return self._change(key, kind, {"kind": kind, "tiers": list(tiers)}, make, request=request, version=version)

    def undo(self, key: DraftKey, *, request: str, version: int) -> EditOutcome:
        """Take the last edit back. Raises as :meth:`edit`; InputError where there is none."""
        return self._step(key, -1, request=request, version=version)

    def redo(self, key: DraftKey, *, request: str, version: int) -> EditOutcome:
        """Apply again what was undone last. Raises as :meth:`edit`; InputError where there is nothing."""
        return self._step(key, 1, request=request, version=version)

    def change_labels(
        self,
        tiers: Iterable[str],
        vocabulary: LabelVocabulary,
        mapping: Mapping[str, str],
        *,
        merged: bool = False,
        keys: Collection[DraftKey] | None = None,
    ) -> int:
        """Relabel tiers in all drafts, as the coding scheme was changed in the corpus; see :mod:`.relabelling`.

        To be called once the corpus has it, within :meth:`locked` for ``keys`` where these are given: all drafts that
        were begun before. Returns how many drafts changed.
        """
        return relabel_drafts(
            self, set(tiers), vocabulary, mapping, merged=merged, keys=self.begun() if keys is None else keys
        )

    def _find_labels(self, tier: str) -> TierLabels:
        """Return what the labels of a tier mean, read once a snapshot."""
        corpus = self._review.corpus()
        snapshot, known = self._labels
        if snapshot != corpus.snapshot:
            known = read_tier_labels(corpus)
            self._labels = (corpus.snapshot, known)
        return known.get(tier) or TierLabels(LabelVocabulary.usual(tier))

    def _require_mode(self, key: DraftKey) -> str:
        mode = mode_of(self._review, key.person, key.take)
        if mode == "none":
            raise ForbiddenDraftError(f"take {key.take!r}: others code it blind; it opens to all when they are done")
        if mode == "blind" and key.purpose == "adjudication":
            raise ForbiddenDraftError(f"take {key.take!r}: its coders are not all done; settle it afterwards")
        fact = get_facts(self._review).takes.get(key.take)
        if fact is not None and fact.refusal is not None:
            raise ForbiddenDraftError(f"take {key.take!r} is not shown: {fact.refusal}; edits of it are kept")
        return mode

    def _require_same_mode(self, key: DraftKey, mode: str) -> None:
        """Refuse what was begun before the take was drawn, or opened to all; within the write that it belongs to.

        A plan of double coding is kept by a write too, so that an edit is either there when takes are drawn, or comes
        too late for one that was.
        """
        if mode_of(self._review, key.person, key.take) != mode:
            raise StaleDraftError(f"take {key.take!r}: who codes it has just changed; load it again")

    def _catch_up(self, live: Live, corpus: Corpus, mode: str) -> Live:
        """Take over what the corpus has by now, where that takes nothing from the person."""
        key = live.record.key
        if self.find_gone(live.record, corpus) is not None:
            return live
        start = self.starts.start(corpus, key, mode)
        missing = [tier for name, tier in start.tiers.items() if name not in live.tiers]
        own = self.starts.find_own(corpus, key)
        newer = [
            replace(tier, known=(own[name].columns, own[name].rows))
            for name, tier in live.tiers.items()
            if name in own and (tier.known is None or tier.known[1] != own[name].rows)
        ]
        if live.record.unpublished or live.redo is not None:
            newer = []  # publishing merges
        if not missing and not newer:
            return live
        changes = []
        for tier in newer:
            rows = tier.known[1] if tier.known is not None else _NO_SEGMENTS
            change = difference(live.tiers[tier.tier].rows, rows)
            if change:
                changes.append(TierChange(tier.tier, change.removed, change.added))
        with self.database.write() as connection:
            storage.write_tiers(connection, live.record.draft, missing)
            live = replace(live, tiers={**live.tiers, **{tier.tier: tier for tier in missing}})
            for tier in newer:
                storage.write_known(connection, live.record.draft, tier)
            live = replace(live, tiers={**live.tiers, **{tier.tier: tier for tier in newer}})
            if changes:
                live = self.append(connection, live, "merge-in", {"kind": "merge-in"}, changes)
                live = replace(live, record=live.record.as_published(corpus.snapshot))
                storage.update_draft(connection, live.record)
        self.keep(live)
        return live

    def _take_over(self, key: DraftKey, tier: str, author: str, rows: Sequence[Row], n_frames: int) -> Change:
        corpus = self._review.corpus()
        if self._require_mode(key) != "review":
            raise ForbiddenDraftError(f"take {key.take!r}: it is coded blind; nobody's tiers can be taken over")
        stored = [one for one in self.starts.stored(corpus, key.take) if (one.tier, one.author) == (tier, author)]
        if not stored:
            raise NotFoundError(f"take {key.take!r}: no tier {tier!r} by {author!r}")
        # Somebody else's word is a proposal to this person.
        proposed = [{**row, "status": "proposed"} for row in stored[0].rows]
        return replace_rows(rows, proposed, n_frames, _make_id_source(rows))

    def _change(
        self,
        key: DraftKey,
        kind: str,
        operation: Mapping[str, Any],
        make: Callable[[Mapping[str, TierState], int], list[TierChange]],
        *,
        request: str,
        version: int,
    ) -> EditOutcome:
        mode = self._require_mode(key)
        with self.locked(key):
            known = find_answer(self.database, key, request)
            if known is not None:
                return known
            corpus = self._review.corpus()
            live = self.live(key)
            start: Start | None = None
            record: Record | None = None
            if live is not None:
                self._require_current(live.record.version, version)
                self._require_take(live.record, corpus)
                tiers, n_frames = live.tiers, live.record.frames
            else:
                with self.database.read() as connection:
                    record = storage.read_record(connection, key)
                if record is not None:
                    self._require_take(record, corpus)
                start = self.starts.start(corpus, key, mode)
                self._require_current(record.version if record else 0, version)
                if record is not None and record.start != start.fingerprint:
                    raise StaleDraftError(f"take {key.take!r}: the corpus has other proposals by now; load it again")
                tiers, n_frames = start.tiers, start.n_frames
            changes = make(tiers, n_frames)
            if not changes:
                return _outcome(live, (), version=version)
            with self.database.write() as connection:
                self._require_same_mode(key, mode)
                if start is not None:
                    if record is None:
                        record = _begin(connection, key, None, start)
                    storage.write_tiers(connection, record.draft, start.tiers.values())
                    live = Live(replace(record, base=start.base), start.tiers, (), 0)
                if live is None:
                    raise StaleDraftError(f"take {key.take!r}: load it again")
                live = self.append(connection, live, kind, operation, changes)
                outcome = _outcome(live, changes)
                keep_answer(connection, live.record.draft, request, "edit", live.edits[-1][1], outcome)
            self.keep(live)
            return outcome

    def _step(self, key: DraftKey, step: int, *, request: str, version: int) -> EditOutcome:
        mode = self._require_mode(key)
        word = "undo" if step < 0 else "redo"
        with self.locked(key):
            known = find_answer(self.database, key, request)
            if known is not None:
                return known
            live = self.live(key)
            if live is None or (live.undo if step < 0 else live.redo) is None:
                raise InputError(f"take {key.take!r}: there is nothing to {word}")
            self._require_current(live.record.version, version)
            self._require_take(live.record, self._review.corpus())
            _, edit, _ = live.edits[live.record.head - 1 if step < 0 else live.record.head]
            with self.database.write() as connection:
                self._require_same_mode(key, mode)
                changes = storage.read_changes(connection, edit)
                if step < 0:
                    changes = tuple(change.reversed() for change in changes)
                live = replace(
                    live,
                    record=live.record.moved(live.record.head + step),
                    tiers=storage.apply_changes(live.tiers, changes),
                )
                storage.update_draft(connection, live.record)
                outcome = _outcome(live, changes)
                keep_answer(connection, live.record.draft, request, word, edit, outcome)
            self.keep(live)
            return outcome

    def _require_current(self, version: int, seen: int) -> None:
        if version != seen:
            raise StaleDraftError(
                f"the draft is at version {version} by now, not {seen}: it was edited in another window, or published"
            )

    def _require_take(self, record: Record, corpus: Corpus) -> None:
        gone = self.find_gone(record, corpus)
        if gone is not None:
            raise TakeGoneError(gone)

    def _describe(self, live: Live, corpus: Corpus) -> DraftState:
        record = live.record
        return DraftState(
            record.key,
            record.version,
            record.base,
            record.recording,
            record.frames,
            live.tiers,
            live.made,
            record.unpublished,
            live.undo,
            live.redo,
            self.find_gone(record, corpus),
            edited=True,
        )


def _begin(connection: sqlite3.Connection, key: DraftKey, record: Record | None, start: Start) -> Record:
    """Keep what an unedited draft shows, so that an edit of anything else is refused."""
    base, recording, n_frames, digest = start.base, start.recording, start.n_frames, start.fingerprint
    if record is None:
        return storage.insert_draft(connection, key, base=base, recording=recording, n_frames=n_frames, start=digest)
    version = record.version + 1
    record = replace(record, base=base, recording=recording, frames=n_frames, start=digest, version=version)
    storage.update_draft(connection, record)
    return record


def _describe_start(key: DraftKey, record: Record, start: Start) -> DraftState:
    return DraftState(key, record.version, start.base, start.recording, start.n_frames, start.tiers)


def _outcome(live: Live | None, changes: Sequence[TierChange], *, version: int = 0) -> EditOutcome:
    if live is None:
        return EditOutcome(version, None, None, 0, ())
    return EditOutcome(live.record.version, live.undo, live.redo, live.record.unpublished, tuple(changes))


def _make_id_source(rows: Sequence[Row]) -> Callable[[], int]:
    used = {row["id"] for row in rows}

    def new_id() -> int:
        while True:
            drawn = secrets.randbits(64)
            if drawn and drawn not in used:
                used.add(drawn)
                return drawn

    return new_id
