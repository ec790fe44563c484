"""What a snapshot holds of each take, read at once from the metadata documents: recordings and tiers."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ....corpus import Corpus
from ....corpus.store.inventory import parse_facts, read_inventory

__all__ = ["TakeFacts", "read_snapshot_facts"]


@dataclass(frozen=True)
class TakeFacts:
    """What is known of a take without reading any of it.

    Parameters
    ----------
    recording, n_frames
        Fingerprint and length of its recording.
    tiers
        By tier and author: the tier's fingerprint, and where it comes from.
    digest
        The same only where all this is the same.
    """

    recording: str
    n_frames: int
    tiers: Mapping[tuple[str, str], tuple[str, Mapping[str, Any]]]
    digest: str


def read_snapshot_facts(corpus: Corpus) -> dict[str, TakeFacts]:
    """Return what a corpus holds of each take."""
    takes: dict[str, tuple[str, int]] = {}
    tiers: dict[str, dict[tuple[str, str], tuple[str, Mapping[str, Any]]]] = {}
    digests: dict[str, Any] = {}
    for unit, document in sorted(read_inventory(corpus).items()):
        if unit.kind not in ("take", "tier") or unit.take is None:
            continue
        facts = parse_facts(document) or {}
        digest = digests.setdefault(unit.take, hashlib.sha256())
        if unit.kind == "take":
            takes[unit.take] = str(facts["fingerprint"]), int(facts["n_frames"])
            digest.update(f"{facts['fingerprint']}\n".encode())
        else:
            known = str(facts["fingerprint"]), dict(facts.get("provenance") or {})
            tiers.setdefault(unit.take, {})[str(unit.name), str(unit.author)] = known
            digest.update(unit.path.encode() + document)
    return {take: TakeFacts(*facts, tiers.get(take, {}), digests[take].hexdigest()) for take, facts in takes.items()}
