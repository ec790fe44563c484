"""What page and server say to each other of drafts, as ``page/src/api/messages.ts`` has it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ....corpus.versions.segment_rows import Row
from .records import DraftState, EditOutcome
from .starting import StoredTier

__all__ = [
    "Draft",
    "DraftTier",
    "EditAnswer",
    "EditRequest",
    "Message",
    "OtherTier",
    "Segment",
    "StepRequest",
    "draft_message",
    "operation_of",
    "outcome_message",
    "segment_message",
    "segment_messages",
]

PurposeName = Literal["own", "adjudication"]
Status = Literal["proposed", "reviewed", "adjudicated"]
SegmentId = Annotated[str, Field(pattern=r"^(0|[1-9][0-9]{0,19})$", description="A 64-bit number in decimal digits.")]
Frame = Annotated[int, Field(strict=True, ge=0, le=2**53 - 1)]
Version = Annotated[int, Field(strict=True, ge=0, le=2**53 - 1)]
Identifiers = Annotated[list[SegmentId], Field(min_length=1, max_length=100_000)]
RequestId = Annotated[str, Field(pattern=r"^[A-Za-z0-9-]{8,64}$", description="A UUID; sent twice, it counts once.")]


class Message(BaseModel):
    """A message with the fields that are named, and no others."""

    model_config = ConfigDict(extra="forbid")


class Segment(Message):
    """One segment of a tier."""

    id: SegmentId
    onset: int
    offset: int
    label: str
    confidence: float | None
    status: Status
    origin: Literal["human", "model", "import"]
    revision: int
    kind: Literal["interval", "point"]


class DraftTier(Message):
    """One tier of a draft."""

    tier: str
    source: str | None
    segments: list[Segment]


class OtherTier(Message):
    """A tier of somebody else, to look at."""

    tier: str
    author: str
    made_by: Literal["person", "model", "import"]
    segments: list[Segment]


class Draft(Message):
    """A person's work on a take."""

    take: str
    purpose: PurposeName
    author: str
    version: int
    base: str
    mode: Literal["review", "blind", "none"]
    tiers: list[DraftTier]
    others: list[OtherTier]
    unpublished: int
    done: bool
    undo: str | None
    redo: str | None
    gone: str | None


class Accept(Message):
    """The segments are right."""

    kind: Literal["accept"]
    tier: str
    segments: Identifiers


class Relabel(Message):
    """The segments have another label."""

    kind: Literal["relabel"]
    tier: str
    segments: Identifiers
    label: str


class Move(Message):
    """A segment begins or ends elsewhere."""

    kind: Literal["move"]
    tier: str
    segment: SegmentId
    onset: Frame | None = None
    offset: Frame | None = None
    together: bool = True


class Split(Message):
    """A segment becomes two."""

    kind: Literal["split"]
    tier: str
    segment: SegmentId
    frame: Frame


class Merge(Message):
    """Neighbours become one."""

    kind: Literal["merge"]
    tier: str
    segments: Identifiers
    label: str | None = None


class Add(Message):
    """A new segment; what lies below gives way."""

    kind: Literal["add"]
    tier: str
    onset: Frame
    offset: Frame
    label: str


class Delete(Message):
    """Segments go."""

    kind: Literal["delete"]
    tier: str
    segments: Identifiers


class Settle(Message):
    """What holds where readers disagreed."""

    kind: Literal["settle"]
    tier: str
    onset: Frame
    offset: Frame
    label: str | None


class TakeOver(Message):
    """The whole tier as another author has it."""

    kind: Literal["take-over"]
    tier: str
    author: str


Operation = Annotated[
    Accept | Relabel | Move | Split | Merge | Add | Delete | Settle | TakeOver, Field(discriminator="kind")
]


class EditRequest(Message):
    """An edit of a draft."""

    take: str
    purpose: PurposeName
    request: RequestId
    version: Version
    operation: Operation


class StepRequest(Message):
    """An undo or redo."""

    take: str
    purpose: PurposeName
    request: RequestId
    version: Version


class TierChangeMessage(Message):
    """What an edit took out of a tier and put in."""

    tier: str
    removed: list[SegmentId]
    added: list[Segment]


class EditAnswer(Message):
    """An edit is on disk."""

    version: int
    undo: str | None
    redo: str | None
    unpublished: int
    changes: list[TierChangeMessage]


def segment_message(row: Row) -> Segment:
    """Return a row as a message."""
    confidence = row.get("confidence")
    return Segment.model_construct(
        id=str(row["id"]),
        onset=int(row["onset"]),
        offset=int(row["offset"]),
        label=str(row["label"]),
        confidence=None if confidence is None or confidence != confidence else float(confidence),
        status=row["status"],
        origin=row["origin"],
        revision=int(row.get("revision", 0)),
        kind=row.get("kind", "interval"),
    )


def draft_message(state: DraftState, others: Iterable[StoredTier], *, mode: str, done: bool) -> Draft:
    """Return a draft as a message."""
    return Draft.model_construct(
        take=state.key.take,
        purpose=state.key.purpose,
        author=state.key.author,
        version=state.version,
        base=state.base,
        mode=mode,
        tiers=[
            DraftTier.model_construct(tier=tier.tier, source=tier.source, segments=segment_messages(tier.rows))
            for tier in state.tiers.values()
        ],
        others=[
            OtherTier.model_construct(
                tier=one.tier, author=one.author, made_by=one.made_by, segments=segment_messages(one.rows)
            )
            for one in others
        ],
        unpublished=state.unpublished,
        done=done,
        undo=state.undo,
        redo=state.redo,
        gone=state.gone,
    )


def outcome_message(outcome: EditOutcome) -> EditAnswer:
    """Return what an edit came to as a message."""
    return EditAnswer(
        version=outcome.version,
        undo=outcome.undo,
        redo=outcome.redo,
        unpublished=outcome.unpublished,
        changes=[
            TierChangeMessage(
                tier=change.tier,
                removed=[str(row["id"]) for row in change.removed],
                added=segment_messages(change.added),
            )
            for change in outcome.changes
        ],
    )


def operation_of(message: Message) -> Mapping[str, Any]:
    """Return an operation as drafts know it: ids as whole numbers, what was not given left out."""
    said = message.model_dump()
    if "segments" in said:
        said["segments"] = [int(name) for name in said["segments"]]
    if "segment" in said:
        said["segment"] = int(said["segment"])
    return said


def segment_messages(rows: Iterable[Row]) -> list[Segment]:
    """Return rows as messages."""
    return [segment_message(row) for row in rows]
