"""What the server says of an ELAN file; ``page/src/api/messages.ts`` has the same names."""

from __future__ import annotations

from pydantic import BaseModel

__all__ = ["ElanPreview", "ElanTier"]


class ElanTier(BaseModel):
    """A tier of the file, the draft's tier that it is proposed for (null: left out), and what to know before."""

    name: str
    tier: str | None
    segments: int
    problems: list[str]


class ElanPreview(BaseModel):
    """What an import would bring."""

    tiers: list[ElanTier]
    warnings: list[str]
