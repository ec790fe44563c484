"""What page and server say to each other of publishing, as ``page/src/api/messages.ts`` has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from .messages import Message, PurposeName, Segment, segment_messages
from .publishing import Plan, TierPlan, describe_words

__all__ = ["PublishAnswer", "PublishPlan", "PublishRequest", "plan_message"]

Choice = Literal["ours", "theirs", "base", "both"]
DraftTierName = tuple[str, PurposeName, str]
"""Take, purpose and tier."""


class PublishChange(Message):
    """One change that publishing makes."""

    take: str
    purpose: PurposeName
    tier: str
    kind: Literal["added", "removed", "edited", "split", "merged"]
    words: str
    onset: int
    before: list[Segment]
    after: list[Segment]


class PublishConflict(Message):
    """A stretch that somebody else published in another state."""

    key: str
    take: str
    purpose: PurposeName
    tier: str
    onset: int
    offset: int
    author: str
    message: str
    base: list[Segment]
    ours: list[Segment]
    theirs: list[Segment]
    choices: list[Choice]


class HeldBack(Message):
    """A take whose edits cannot be published now."""

    take: str
    message: str


class PublishPlan(Message):
    """What publishing would do."""

    plan: str
    snapshot: str
    changes: list[PublishChange]
    conflicts: list[PublishConflict]
    held_back: list[HeldBack]


class PublishRequest(Message):
    """Publish just this plan."""

    plan: Annotated[str, Field(max_length=200)]
    message: Annotated[str, Field(max_length=2000)]
    choices: Annotated[dict[str, str], Field(max_length=100_000)]


class PublishAnswer(Message):
    """It is in the corpus."""

    snapshot: str
    changes: int
    takes: int


def plan_message(plan: Plan, blame: Mapping[DraftTierName, tuple[str, str]]) -> PublishPlan:
    """Return a plan as a message; ``blame`` says by take, purpose and tier who published last, with what message."""
    return PublishPlan(
        plan=plan.plan,
        snapshot=plan.snapshot,
        changes=[change for tier in plan.tiers for change in _changes(tier)],
        conflicts=[conflict for tier in plan.tiers for conflict in _conflicts(tier, blame)],
        held_back=[HeldBack(take=take, message=message) for take, message in plan.held_back],
    )


def _changes(tier: TierPlan) -> list[PublishChange]:
    return [
        PublishChange(
            take=tier.key.take,
            purpose=tier.key.purpose,
            tier=tier.state.tier,
            kind=change.kind,  # type: ignore[arg-type]
            words=describe_words(change),
            onset=min(row["onset"] for row in (*change.before, *change.after)),
            before=segment_messages(change.before),
            after=segment_messages(change.after),
        )
        for change in tier.changes
    ]


def _conflicts(tier: TierPlan, blame: Mapping[DraftTierName, tuple[str, str]]) -> list[PublishConflict]:
    author, message = blame.get((tier.key.take, tier.key.purpose, tier.state.tier), ("", ""))
    found = []
    for key, one in tier.conflicts.items():
        rows = (*one.base, *one.ours, *one.theirs)
        found.append(
            PublishConflict(
                key=key,
                take=tier.key.take,
                purpose=tier.key.purpose,
                tier=tier.state.tier,
                onset=min(row["onset"] for row in rows),
                offset=max(row["offset"] for row in rows),
                author=author,
                message=message,
                base=segment_messages(one.base),
                ours=segment_messages(one.ours),
                theirs=segment_messages(one.theirs),
                choices=list(one.choices),  # type: ignore[arg-type]
            )
        )
    return found
