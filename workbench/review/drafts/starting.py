"""What drafts start from and are shown beside: the tiers that the corpus has of a take, whoever made them."""

from __future__ import annotations

import hashlib
import json
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import pandas as pd

from ....corpus import Corpus
from ....corpus.annotations.label_vocabulary import AFFECT_TIER, LabelVocabulary
from ....corpus.annotations.tier_table import make_tier
from ....corpus.annotations.vocabulary_change import tiers_of_vocabulary
from ....corpus.versions.segment_rows import Columns, Row, key_of_row, split_table
from ....errors import InputError, NotFoundError
from ...pipeline.tier_makers import SEGMENT_TIER, is_machine_made
from .records import ADJUDICATED, DraftKey, TierState
from .snapshot_facts import TakeFacts, read_snapshot_facts

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["EMPTY_COLUMNS", "Start", "Starts", "StoredTier"]

MadeBy = Literal["person", "model", "import"]
Value = TypeVar("Value")

EMPTY_COLUMNS: Columns = split_table(make_tier(pd.DataFrame({"onset": [], "offset": [], "label": []}).astype(str)))[0]
"""Of a tier that nobody made yet."""

_KEPT = 4096


@dataclass(frozen=True)
class StoredTier:
    """A tier of the corpus."""

    tier: str
    author: str
    fingerprint: str
    made_by: MadeBy
    columns: Columns
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Start:
    """What a draft would start from.

    Parameters
    ----------
    base
        The snapshot.
    recording, n_frames
        Fingerprint and length of the take's recording.
    tiers
        By name.
    fingerprint
        The same whenever the rows are.
    """

    base: str
    recording: str
    n_frames: int
    tiers: Mapping[str, TierState]
    fingerprint: str


class Starts:
    """Reads what drafts start from, and keeps what it read as long as it is true.

    Parameters
    ----------
    review
        The review.
    """

    def __init__(self, review: Review) -> None:
        self._review = review
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = threading.Lock()

    def start(self, corpus: Corpus, key: DraftKey, mode: str) -> Start:
        """Return what a draft starts from: the author's own tiers, else (mode review) proposals, else nothing.

        Raises
        ------
        NotFoundError
            If there is no such take.
        """
        if key.purpose == "adjudication":  # follows what coders said, which the corpus does not tell
            return self._make_start(corpus, key, mode)
        facts = self._find_facts(corpus, key.take)
        known = (key, mode, facts.digest, self.offered(corpus), self._models(corpus))
        return replace(self._keep(known, lambda: self._make_start(corpus, key, mode)), base=corpus.snapshot)

    def recording(self, corpus: Corpus, take: str) -> str | None:
        """Return the fingerprint of a take's recording, None where there is no such take."""
        facts = self._read_facts(corpus).get(take)
        return None if facts is None else facts.recording

    def stored(self, corpus: Corpus, take: str) -> tuple[StoredTier, ...]:
        """Return all tiers that the corpus has of a take, by name and author.

        Raises
        ------
        NotFoundError
            If there is no such take.
        """
        facts = self._find_facts(corpus, take)

        def read() -> tuple[StoredTier, ...]:
            return tuple(
                self._read_tier(corpus, take, tier, author, fingerprint, provenance)
                for (tier, author), (fingerprint, provenance) in sorted(facts.tiers.items(), key=lambda one: one[0])
            )

        return self._keep((take, facts.digest), read)

    def find_own(self, corpus: Corpus, key: DraftKey) -> dict[str, StoredTier]:
        """Return the tiers that the draft's author has in the corpus."""
        return {one.tier: one for one in self.stored(corpus, key.take) if one.author == key.author}

    def offered(self, corpus: Corpus) -> tuple[str, ...]:
        """Return the tiers that the coding scheme is for, `affect` first."""

        def read() -> tuple[str, ...]:
            names = [AFFECT_TIER]
            for name in corpus.vocabularies():
                try:
                    names += tiers_of_vocabulary(name, LabelVocabulary.from_stored(corpus.vocabulary(name)))
                except InputError:  # damaged by hand: its own name is still that of a tier
                    names.append(name)
            return tuple(dict.fromkeys(name for name in names if name != SEGMENT_TIER))

        return self._keep((corpus.snapshot, "offered"), read)

    def _make_start(self, corpus: Corpus, key: DraftKey, mode: str) -> Start:
        facts, stored = self._find_facts(corpus, key.take), self.stored(corpus, key.take)
        own = {one.tier: one for one in stored if one.author == key.author and one.tier != SEGMENT_TIER}
        tiers = {}
        for name in dict.fromkeys((*self.offered(corpus), *own)):
            if name in own:
                known = (own[name].columns, own[name].rows)
                tiers[name] = TierState(name, None, {}, *known, known)
            elif key.purpose == "adjudication":
                tiers[name] = self._start_adjudication(key, name)
            else:
                source = self._find_proposals(corpus, stored, name) if mode == "review" else None
                tiers[name] = (
                    TierState(name, None, {}, EMPTY_COLUMNS, (), None)
                    if source is None
                    else TierState(
                        name, source.author, {"proposals": source.fingerprint}, source.columns, source.rows, None
                    )
                )
        said = json.dumps(
            [(name, tier.source, sorted(key_of_row(row) for row in tier.rows)) for name, tier in tiers.items()]
        )
        digest = hashlib.sha256(f"{facts.recording}{said}".encode()).hexdigest()
        return Start(corpus.snapshot, facts.recording, facts.n_frames, tiers, digest)

    def _start_adjudication(self, key: DraftKey, tier: str) -> TierState:
        from ..coding.adjudication import start_adjudication  # it asks for drafts itself

        columns, rows = split_table(start_adjudication(self._review, key.take, tier), name=tier)
        return TierState(tier, None, {}, columns, rows, None)

    def _find_proposals(self, corpus: Corpus, stored: tuple[StoredTier, ...], tier: str) -> StoredTier | None:
        """Return a model's tier (those of the corpus's models first, then by name), else an imported one."""
        models = self._models(corpus)
        found = [
            one
            for one in stored
            if one.tier == tier and one.made_by != "person" and one.rows and one.author != ADJUDICATED
        ]
        return min(found, key=lambda one: (one.made_by != "model", one.author not in models, one.author), default=None)

    def _models(self, corpus: Corpus) -> frozenset[str]:
        return self._keep((corpus.snapshot, "models"), lambda: frozenset(map(str, corpus.models())))

    def _read_facts(self, corpus: Corpus) -> dict[str, TakeFacts]:
        return self._keep((corpus.snapshot, "facts"), lambda: read_snapshot_facts(corpus))

    def _find_facts(self, corpus: Corpus, take: str) -> TakeFacts:
        facts = self._read_facts(corpus).get(take)
        if facts is None:
            corpus.take_attributes(take)  # which says what is wrong with the name
            raise NotFoundError(f"take {take!r}: the corpus has no such take")
        return facts

    def _read_tier(
        self, corpus: Corpus, take: str, tier: str, author: str, fingerprint: str, provenance: Mapping[str, Any]
    ) -> StoredTier:
        said = json.dumps(provenance, sort_keys=True)

        def read() -> StoredTier:
            table = corpus.tier(take, tier, author)
            columns, rows = split_table(table, name=f"take {take!r}, tier {tier!r} by {author!r}")
            return StoredTier(tier, author, fingerprint, _tell_maker(provenance, table), columns, rows)

        return self._keep((take, tier, author, fingerprint, said), read)

    def _keep(self, key: Hashable, read: Callable[[], Value]) -> Value:
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        value = read()  # twice where two ask at once, which is better than one waiting for all
        with self._lock:
            self._kept[key] = value
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        return value


def _tell_maker(provenance: Mapping[str, Any], table: pd.DataFrame) -> MadeBy:
    if is_machine_made(provenance, table):
        return "model"
    return "import" if len(table) and bool((table["origin"] == "import").all()) else "person"
