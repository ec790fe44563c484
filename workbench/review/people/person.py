"""Who is asking."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Person"]


@dataclass(frozen=True)
class Person:
    """Somebody with a session."""

    name: str
    """The author of this person's tiers and commits."""
    is_lead: bool
    """Whether they may plan, settle disagreements and manage accounts."""
