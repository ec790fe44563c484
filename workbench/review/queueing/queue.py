"""The segments that a person may review, most useful to look at first."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..coding.modes import modes_of
from .corpus_facts import CorpusFacts, TakeFacts, get_facts
from .judgements import Judged, Place, get_judgements
from .usefulness import Judgement, expect_gains

if TYPE_CHECKING:
    from ..context import Review
    from ..drafts.records import Look

__all__ = ["Counts", "count_held", "count_takes", "list_queue"]

Item = dict[str, Any]
"""A ``QueueItem`` as the page gets it."""

_MOST_KEPT = 4096


@dataclass(frozen=True)
class Counts:
    """Held segments of a person: those in the queue, by status; and ``done``, reviewed ones of blind takes too."""

    remaining: int
    reviewed: int
    done: int


@dataclass(frozen=True)
class _Held:
    """The held segments of one draft by tier: items still without gain and second, and how many are reviewed."""

    items: Mapping[str, tuple[Item, ...]]
    reviewed: int
    number: int


def list_queue(review: Review, person: str) -> dict[str, Any]:
    """Return a person's queue: the held segments of the takes that they review, whatever their status.

    Transitions follow from what they lie between and are not asked about; takes that are coded blind, or whose signer's
    consent does not cover looking at them, have no part in it.

    Returns
    -------
    ``items`` in order of expected usefulness: proposals about which nothing is known, the others from the greatest gain
    to the least, then what was reviewed; of equals in order of take, tier and time. ``ready``: whether the models'
    probabilities are in.
    """
    facts = get_facts(review)
    judged, ready = get_judgements(review).get(review.corpus())
    modes = modes_of(review, person)
    by_tier: dict[str, list[Item]] = {}
    for take, one in facts.takes.items():
        if one.refusal is None and modes.get(take, "review") == "review":
            for tier, some in _find_held(review, facts, person, one, "review").items.items():
                by_tier.setdefault(tier, []).extend(some)
    models = _by_take(judged)
    listed: list[Item] = []
    for tier, items in sorted(by_tier.items()):
        gains, seconds = expect_gains(
            [item["label"] for item in items],
            [math.nan if item["confidence"] is None else item["confidence"] for item in items],
            [item["status"] != "proposed" for item in items],
            [_find_judgement(models.get((item["take"], tier), ()), item) for item in items],
        )
        known = np.isfinite(gains)
        for item, gain, second, is_known in zip(items, gains.tolist(), seconds, known.tolist(), strict=True):
            listed.append({**item, "second": second, "gain": gain if is_known else None})
    listed.sort(key=_usefulness)
    return {"items": listed, "ready": ready}


def count_held(review: Review, person: str) -> Counts:
    """Return how many held segments a person has before them and behind them."""
    facts, modes = get_facts(review), modes_of(review, person)
    remaining = reviewed = done = 0
    for take, one in facts.takes.items():
        mode = modes.get(take, "review")
        if one.refusal is not None or mode == "none":
            continue
        held = _find_held(review, facts, person, one, mode)
        done += held.reviewed
        if mode == "review":
            reviewed += held.reviewed
            remaining += held.number - held.reviewed
    return Counts(remaining, reviewed, done)


def count_takes(review: Review, person: str) -> dict[str, tuple[int, int]]:
    """Return of each take how many held segments a person has there that are proposed, and that are reviewed.

    Takes that are not the person's, or whose signer's consent does not cover looking at them, are left out.
    """
    facts, modes = get_facts(review), modes_of(review, person)
    counts = {}
    for take, one in facts.takes.items():
        mode = modes.get(take, "review")
        if one.refusal is None and mode != "none":
            held = _find_held(review, facts, person, one, mode)
            counts[take] = (held.number - held.reviewed, held.reviewed)
    return counts


def _usefulness(item: Item) -> tuple[bool, float, str, str, int]:
    gain = math.inf if item["gain"] is None else item["gain"]
    return item["status"] != "proposed", -gain, item["take"], item["tier"], item["onset"]


def _find_held(review: Review, facts: CorpusFacts, person: str, take: TakeFacts, mode: str) -> _Held:
    """Return the held segments of a draft, made anew only where the draft or the corpus changed."""
    look = review.drafts.look(person, take.take)
    kept: dict[tuple[str, str], tuple[Any, _Held]] = review.part("queue", dict)
    stamp = (facts.snapshot, look.version, look.begun, mode)
    found = kept.get((person, take.take))
    if found is None or found[0] != stamp:
        if len(kept) >= _MOST_KEPT:
            kept.clear()
        found = kept[(person, take.take)] = (stamp, _collect_held(facts, take, look))
    return found[1]


def _collect_held(facts: CorpusFacts, take: TakeFacts, look: Look) -> _Held:
    items: dict[str, tuple[Item, ...]] = {}
    for tier, rows in look.tiers.items():
        items[tier] = tuple(
            {
                "take": take.take,
                "tier": tier,
                "id": str(row["id"]),
                "onset": row["onset"],
                "offset": row["offset"],
                "seconds": (row["offset"] - row["onset"]) / take.rate,
                "label": row["label"],
                "confidence": row.get("confidence"),
                "second": "",
                "gain": None,
                "status": row["status"],
                "signer": take.signer,
                "protocol": take.protocol,
            }
            for row in rows
            if not facts.is_transition(tier, row)
        )
    every = [item for some in items.values() for item in some]
    return _Held(items, sum(item["status"] != "proposed" for item in every), len(every))


def _by_take(judged: Mapping[Place, Judged]) -> dict[tuple[str, str], list[Judged]]:
    found: dict[tuple[str, str], list[Judged]] = {}
    for (take, tier, _), one in judged.items():
        found.setdefault((take, tier), []).append(one)
    return found


def _find_judgement(models: Iterable[Judged], item: Item) -> Judgement | None:
    for judged in models:
        row = judged.rows.get(int(item["id"]))
        if row is not None:
            return judged.probabilities[row], judged.classes
    return None
