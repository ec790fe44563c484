"""What ``/api/corpus`` says; see ``page/src/api/messages.ts``."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel

__all__ = ["CorpusMessage", "Problem", "TakeRow"]


class TakeRow(BaseModel):
    """One take, as far as this person is concerned."""

    take: str
    signer: str | None
    protocol: str | None
    rate: float
    frames: int
    seconds: float
    simulated: bool
    solve: str | None
    mode: Literal["review", "blind", "none"]
    refusal: str | None
    proposed: int
    reviewed: int
    unpublished: int
    done: bool


class Problem(BaseModel):
    """What stands in the way, and the command that helps."""

    message: str
    command: str | None


class CorpusMessage(BaseModel):
    """The corpus and its takes."""

    name: str
    snapshot: str
    takes: list[TakeRow]
    rigs: list[str]
    problems: list[Problem]
