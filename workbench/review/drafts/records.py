"""What a draft is: whose work on which take, its tiers as they are now, and why an edit may be refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ....corpus.versions.segment_rows import Columns, Row
from ....errors import ConflictError, InputError, MimiqueError

__all__ = [
    "ADJUDICATED",
    "DraftKey",
    "DraftState",
    "EditOutcome",
    "ForbiddenDraftError",
    "Look",
    "Purpose",
    "StaleDraftError",
    "TakeGoneError",
    "TierChange",
    "TierState",
    "make_key",
]

Purpose = Literal["own", "adjudication"]

ADJUDICATED = "adjudicated"
"""Author of the tiers that settle disagreements."""


class StaleDraftError(ConflictError):
    """The draft is not as the person saw it: edited in another window, or published meanwhile."""

    status = 409
    kind = "stale"


class TakeGoneError(ConflictError):
    """The take was deleted, or its recording is another one."""

    status = 409
    kind = "take-gone"


class ForbiddenDraftError(MimiqueError):
    """The take is not this person's to work on."""

    status = 403
    kind = "forbidden"


@dataclass(frozen=True)
class DraftKey:
    """Whose work on which take, and what it is for."""

    person: str
    take: str
    purpose: Purpose = "own"

    @property
    def author(self) -> str:
        """Whose tiers in the corpus it becomes."""
        return ADJUDICATED if self.purpose == "adjudication" else self.person

    @property
    def status(self) -> str:
        """What a segment becomes that is accepted or edited."""
        return "adjudicated" if self.purpose == "adjudication" else "reviewed"


@dataclass(frozen=True)
class TierState:
    """One tier of a draft.

    Parameters
    ----------
    tier
        Its name.
    source
        Whose proposals it started from; None where from nothing, or from the author's own.
    inputs
        Fingerprint of what it started from, by what that is; for the account of where the tier comes from.
    columns
        As :func:`mimique.corpus.versions.segment_rows.split_table` returns them.
    rows
        In order of onset.
    known
        The author's own tier in the corpus as the draft last knew it, columns and rows; None for no such tier.
    """

    tier: str
    source: str | None
    inputs: Mapping[str, str]
    columns: Columns
    rows: tuple[Row, ...]
    known: tuple[Columns, tuple[Row, ...]] | None


@dataclass(frozen=True)
class DraftState:
    """A draft as it is now.

    Parameters
    ----------
    key
        Whose it is.
    version
        Rises with every edit, undo and redo; 0 where nothing was stored yet.
    base
        The snapshot that it started from, or was last published as.
    recording, n_frames
        Fingerprint and length of the take's recording.
    tiers
        By name, in the order in which they are offered.
    edits
        How many were made ever.
    unpublished
        Edits, and undone ones, since it last was as the corpus is.
    undo, redo
        Kind of the operation that would be undone or redone.
    gone
        Why the take cannot be worked on any more.
    edited
        Whether there was any edit: before, the tiers follow the corpus.
    """

    key: DraftKey
    version: int
    base: str
    recording: str
    n_frames: int
    tiers: Mapping[str, TierState]
    edits: int = 0
    unpublished: int = 0
    undo: str | None = None
    redo: str | None = None
    gone: str | None = None
    edited: bool = False


@dataclass(frozen=True)
class Look:
    """A draft as lists and queues need it: of one that is not begun, what it would start from."""

    tiers: Mapping[str, Sequence[Row]]
    version: int
    unpublished: int
    begun: bool
    edits: int


@dataclass(frozen=True)
class TierChange:
    """Rows that an edit took out of a tier and put in."""

    tier: str
    removed: tuple[Row, ...]
    added: tuple[Row, ...]

    def reversed(self) -> TierChange:
        """Return the change back."""
        return TierChange(self.tier, self.added, self.removed)


@dataclass(frozen=True)
class EditOutcome:
    """What an edit, undo or redo came to; it is on disk."""

    version: int
    undo: str | None
    redo: str | None
    unpublished: int
    changes: tuple[TierChange, ...]


def make_key(person: str, take: str, purpose: str = "own") -> DraftKey:
    """Return a checked key.

    Raises
    ------
    InputError
        If the purpose is none.
    """
    if purpose not in ("own", "adjudication"):
        raise InputError(f"purpose: expected own or adjudication, but got {purpose!r}")
    return DraftKey(person, take, "adjudication" if purpose == "adjudication" else "own")
