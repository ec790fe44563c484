"""What the server and the page say to each other about double coding, its agreement and its settlement."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from ..drafts.messages import Segment

__all__ = [
    "Adjudication",
    "Agreement",
    "CodedTake",
    "CodingDone",
    "CodingPlan",
    "CodingRequest",
    "Disagreement",
    "Overview",
    "OverviewPerson",
    "OverviewTake",
    "Reading",
    "ToSettle",
    "WorkOnTake",
]

Name = Annotated[str, Field(min_length=1, max_length=1000)]


class CodingRequest(BaseModel):
    """What share of the takes which people code, blind to each other; ``takes`` of a plan are not read."""

    tier: Name
    share: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
    coders: Annotated[list[Name], Field(max_length=100)]
    coders_per_take: Annotated[int, Field(ge=2, le=100)]
    seed: Annotated[int, Field(ge=0, lt=2**53)]


class CodedTake(BaseModel):
    """A take that was drawn, its coders, and those of them who said that they are done."""

    take: str
    coders: list[str]
    done: list[str]


class CodingPlan(BaseModel):
    """The plan of double coding, and what was drawn by it."""

    tier: str
    share: float
    coders: list[str]
    coders_per_take: int
    seed: int
    takes: list[CodedTake]


class CodingDone(BaseModel):
    """Whether the person has finished coding a take blind."""

    take: Annotated[str, Field(max_length=1000)]
    done: bool


class OverviewPerson(BaseModel):
    """What one person did."""

    person: str
    is_lead: bool
    takes: int
    reviewed: int
    edits: int
    unpublished: int
    active_seconds: float
    seconds_per_minute: float | None
    last_active: str | None


class WorkOnTake(BaseModel):
    """What one person did on one take."""

    person: str
    mode: Literal["review", "blind", "none"]
    segments: int
    reviewed: int
    done: bool
    unpublished: int


class OverviewTake(BaseModel):
    """A take, and who worked on it."""

    take: str
    signer: str | None
    protocol: str | None
    seconds: float
    by: list[WorkOnTake]


class Agreement(BaseModel):
    """How much two people agree on a tier, over all takes that both read on their own."""

    tier: str
    first: str
    second: str
    takes: int
    seconds: float
    kappa: float | None
    alpha: float | None
    agreement: float | None
    f1_50: float | None


class ToSettle(BaseModel):
    """A take on which two people disagree."""

    take: str
    tier: str
    first: str
    second: str
    disagreements: int
    seconds: float
    settled: int


class Overview(BaseModel):
    """All of it, for leads."""

    people: list[OverviewPerson]
    takes: list[OverviewTake]
    agreement: list[Agreement]
    to_settle: list[ToSettle]


class Reading(BaseModel):
    """What one person says of a take."""

    author: str
    segments: list[Segment]


class Disagreement(BaseModel):
    """Frames [onset, offset) that two people label differently; None is no label."""

    onset: int
    offset: int
    first: str | None
    second: str | None
    settled: bool


class Adjudication(BaseModel):
    """Two readings side by side."""

    take: str
    tier: str
    first: Reading
    second: Reading
    disagreements: list[Disagreement]
