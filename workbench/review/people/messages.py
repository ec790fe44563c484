"""What people routes and the page say to each other; see ``page/src/api/messages.ts``."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict

__all__ = ["AccountRequest", "AccountRow", "NameLogin", "PasswordRequest", "SessionMessage", "TokenLogin"]


class TokenLogin(BaseModel):
    """The token in the address that mimique opened."""

    model_config = ConfigDict(extra="forbid")

    token: str


class NameLogin(BaseModel):
    """A name and its password."""

    model_config = ConfigDict(extra="forbid")

    person: str
    password: str


class PasswordRequest(BaseModel):
    """Another password for oneself."""

    model_config = ConfigDict(extra="forbid")

    old: str
    new: str


class SessionMessage(BaseModel):
    """Who is logged in, and what the page needs to begin."""

    person: str
    is_lead: bool
    named: bool
    csrf: str
    corpus: str
    snapshot: str
    place: str
    version: str
    settings: dict[str, Any]


class AccountRow(BaseModel):
    """Somebody who may log in, or might once."""

    person: str
    is_lead: bool
    is_active: bool


class AccountRequest(BaseModel):
    """A new account; or, for one that is there, its rights and, unless null, another password."""

    person: str
    password: str | None
    is_lead: bool
