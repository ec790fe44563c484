"""What the server says of a take that is shown; ``page/src/api/messages.ts`` has the same names."""

from __future__ import annotations

from pydantic import BaseModel

__all__ = ["Curve", "Problem", "Residual", "Scene", "Video"]


class Curve(BaseModel):
    """A curve of the take besides those of its shapes."""

    name: str
    unit: str


class Residual(BaseModel):
    """Frames whose residual stands out: mm, and stretches [onset, offset)."""

    threshold: float | None
    stretches: list[tuple[int, int]]


class Video(BaseModel):
    """A linked video; the problem says why it cannot be shown."""

    index: int
    name: str
    rate: float | None
    offset: float
    problem: str | None


class Problem(BaseModel):
    """What is missing, and the command that helps."""

    message: str
    command: str | None


class Scene(BaseModel):
    """All that the page needs to know of a take before it asks for numbers."""

    take: str
    signer: str | None
    protocol: str | None
    simulated: bool
    rate: float
    frames: int
    seconds: float
    solve: str | None
    solves: list[str]
    rig: str | None
    shapes: list[str]
    strongest: list[str]
    markers: list[str]
    curves: list[Curve]
    residual: Residual
    videos: list[Video]
    problem: Problem | None
