"""What lists ask of a snapshot again and again: its takes, whose faces may be shown, which labels are transitions."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ....corpus.annotations.label_vocabulary import LabelVocabulary
from ....corpus.annotations.vocabulary_change import vocabularies_by_tier
from ....corpus.privacy.consent import explain_refusal
from ....corpus.store.view import CorpusView
from ....corpus.versions.segment_rows import Row

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["CorpusFacts", "TakeFacts", "collect_facts", "get_facts"]


@dataclass(frozen=True)
class TakeFacts:
    """One take: ``rate`` in Hz, ``seconds`` its duration, ``refusal`` why its face may not be shown (else None)."""

    take: str
    signer: str | None
    protocol: str | None
    rate: float
    frames: int
    seconds: float
    refusal: str | None


@dataclass(frozen=True)
class CorpusFacts:
    """Of one snapshot; takes in order of their names."""

    snapshot: str
    takes: Mapping[str, TakeFacts]
    vocabularies: Mapping[str, LabelVocabulary]
    """By tier."""
    _splits: dict[tuple[str, str], bool] = field(default_factory=dict, repr=False)

    def vocabulary(self, tier: str) -> LabelVocabulary | None:
        """Return the labels of a tier, the usual ones where the corpus declares none; None where none are usual."""
        return self.vocabularies.get(tier) or LabelVocabulary.usual(tier)

    def is_transition(self, tier: str, row: Row) -> bool:
        """Return whether a segment leads from one label to another, by what it says itself or by its label."""
        before, after = row.get("from_label") or "", row.get("to_label") or ""
        if before and after:
            return bool(before != after)
        key = (tier, str(row["label"]))
        if key not in self._splits:
            vocabulary = self.vocabulary(tier)
            self._splits[key] = vocabulary is not None and vocabulary.split(key[1]) is not None
        return self._splits[key]


def collect_facts(corpus: CorpusView, snapshot: str) -> CorpusFacts:
    """Read what lists need of a snapshot."""
    refusals: dict[str | None, str | None] = {}
    takes = {}
    for row in corpus.takes().itertuples():
        signer = None if row.signer is None else str(row.signer)
        if signer not in refusals:
            refusals[signer] = explain_refusal(corpus, signer, "project")
        protocol = None if row.protocol is None else str(row.protocol)
        takes[str(row.take)] = TakeFacts(
            str(row.take), signer, protocol, float(row.rate), int(row.frames), float(row.seconds), refusals[signer]
        )
    return CorpusFacts(snapshot, takes, vocabularies_by_tier(corpus))


def get_facts(review: Review) -> CorpusFacts:
    """Return the facts of the newest snapshot, read once for each."""
    corpus = review.corpus()
    kept: _Newest = review.part("corpus facts", _Newest)
    with kept.lock:
        if kept.facts is None or kept.facts.snapshot != corpus.snapshot:
            kept.facts = collect_facts(corpus, corpus.snapshot)
        return kept.facts


@dataclass
class _Newest:
    facts: CorpusFacts | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)
