"""What is said about the coding scheme; the same names as in the page's ``messages.ts``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["Change", "Scheme", "SchemeLabel", "SchemeRequest", "Vocabulary"]

Name = Annotated[str, Field(min_length=1, max_length=200)]


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid")


class SchemeLabel(_Message):
    """A label as people see it."""

    label: str
    colour: str
    key: str
    note: str
    aliases: list[str]
    retired: bool
    segments: int


class Vocabulary(_Message):
    """The labels of some tiers."""

    name: str
    tiers: list[str]
    labels: list[SchemeLabel]
    transitions: bool
    manual: str


class Scheme(_Message):
    """All vocabularies of a corpus."""

    snapshot: str
    vocabularies: list[Vocabulary]


class AddLabel(_Message):
    """A new label."""

    kind: Literal["add"]
    vocabulary: Name
    label: Name
    colour: str = ""
    key: str = ""
    note: str = ""


class RenameLabel(_Message):
    """Another name for a label; its segments follow."""

    kind: Literal["rename"]
    vocabulary: Name
    label: Name
    to: Name


class MergeLabels(_Message):
    """Labels that become another one; their segments follow."""

    kind: Literal["merge"]
    vocabulary: Name
    labels: Annotated[list[Name], Field(min_length=1, max_length=1000)]
    into: Name


class RetireLabel(_Message):
    """A label that is no longer to be used; its segments stay."""

    kind: Literal["retire"]
    vocabulary: Name
    label: Name


class RestoreLabel(_Message):
    """A retired label that comes back."""

    kind: Literal["restore"]
    vocabulary: Name
    label: Name


class DescribeLabel(_Message):
    """Another colour, key or meaning; what is left out stays."""

    kind: Literal["describe"]
    vocabulary: Name
    label: Name
    colour: str | None = None
    key: str | None = None
    note: str | None = None


class OrderLabels(_Message):
    """The labels in another order."""

    kind: Literal["order"]
    vocabulary: Name
    labels: Annotated[list[Name], Field(max_length=1000)]


class AddTier(_Message):
    """A tier with the labels of a vocabulary, or with labels of its own."""

    kind: Literal["add-tier"]
    tier: Name
    vocabulary: Name | None = None


class RemoveTier(_Message):
    """A tier that a vocabulary is no longer for; its segments stay."""

    kind: Literal["remove-tier"]
    tier: Name
    vocabulary: Name


class WriteManual(_Message):
    """How the tier is coded, in Markdown."""

    kind: Literal["manual"]
    vocabulary: Name
    text: str


Change = Annotated[
    AddLabel
    | RenameLabel
    | MergeLabels
    | RetireLabel
    | RestoreLabel
    | DescribeLabel
    | OrderLabels
    | AddTier
    | RemoveTier
    | WriteManual,
    Field(discriminator="kind"),
]


class SchemeRequest(_Message):
    """A change to the scheme that the person saw."""

    snapshot: str
    change: Change
