"""What the server and the page say to each other about the queue and the pace."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, Field

__all__ = ["Activity", "ActivityAnswer", "Pace", "Queue", "QueueItem"]


class QueueItem(BaseModel):
    """A segment to look at; the id is a decimal text, the gain is in units of macro F1."""

    take: str
    tier: str
    id: str
    onset: int
    offset: int
    seconds: float
    label: str
    confidence: float | None
    second: str
    gain: float | None
    status: Literal["proposed", "reviewed", "adjudicated"]
    signer: str | None
    protocol: str | None


class Queue(BaseModel):
    """All of a person's held segments, most useful first."""

    items: list[QueueItem]
    ready: bool


class Pace(BaseModel):
    """How far and how fast a person is."""

    reviewed: int
    remaining: int
    per_minute: float | None
    minutes_left: float | None
    active_seconds: float


class Activity(BaseModel):
    """Time of looking and working on a take since the last message, in s."""

    take: Annotated[str, Field(max_length=1000)]
    seconds: Annotated[float, Field(ge=0, le=86_400, allow_inf_nan=False)]


class ActivityAnswer(BaseModel):
    """How much of it was counted, in s."""

    seconds: float
