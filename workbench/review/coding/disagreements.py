"""Where readings of one take agree and where they do not.

Two people never set a border at the same frame. Where all readers go from the same label to the same other one, and
their borders lie less than 40 ms apart (8 frames at 200 Hz, less than one frame of a 25 Hz video, by which many learned
to code), that is no disagreement: the border is put in the middle. A label that only one of them has is one, however
short.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from ....corpus.versions.segment_rows import Row

__all__ = ["JITTER", "Agreed", "Difference", "find_agreed", "find_differences", "jitter_frames"]

JITTER = 0.04
"""Borders that are less far apart are the same border, in s."""


@dataclass(frozen=True)
class Difference:
    """Frames ``[onset, offset)`` that two readings label differently; None is no label."""

    onset: int
    offset: int
    first: str | None
    second: str | None


@dataclass(frozen=True)
class Agreed:
    """Frames ``[onset, offset)`` that all readings label alike; ``row`` is the first reading's segment there."""

    onset: int
    offset: int
    label: str
    row: Row


@dataclass(frozen=True)
class _Piece:
    """Frames within which no reading has a border: each reading's segment there, or None."""

    onset: int
    offset: int
    rows: tuple[Row | None, ...]
    labels: tuple[str | None, ...]

    @property
    def is_common(self) -> bool:
        return len(set(self.labels)) == 1


def jitter_frames(rate: float) -> float:
    """Return :data:`JITTER` in frames of a rate in Hz."""
    return JITTER * rate


def find_differences(
    first: Sequence[Row], second: Sequence[Row], *, jitter: float, canonical: Callable[[str], str] = str
) -> list[Difference]:
    """Return the stretches on which two readings differ.

    Parameters
    ----------
    first, second
        Segments, each reading's side by side.
    jitter
        Borders less than so many frames apart are the same, see :func:`jitter_frames`; 0 leaves nothing out.
    canonical
        Which label a spelling stands for.

    Returns
    -------
    In order of time: the longest stretches of one pair of labels; a remainder that is shorter than the jitter, and
    holds no whole segment, belongs to its longer neighbour.
    """
    found = []
    for stretch, is_common in _split_stretches(_cut([first, second], canonical), jitter):
        if not is_common:
            found += _join_remainders(stretch, jitter)
    return found


def find_agreed(
    readings: Sequence[Sequence[Row]], *, jitter: float, canonical: Callable[[str], str] = str
) -> list[Agreed]:
    """Return what all readings say alike, as segments side by side.

    Neighbours of one label stay apart only where every reading has a border between them. Parameters are those of
    :func:`find_differences`; of several borders that are the same the median is taken, of two their middle.
    """
    agreed: list[Agreed] = []
    before: _Piece | None = None
    for stretch, is_common in _split_stretches(_cut(readings, canonical), jitter):
        for piece in stretch if is_common else ():
            label, row = piece.labels[0], piece.rows[0]
            last = agreed[-1] if agreed else None
            if label is not None and row is not None:
                touches = before is not None and last is not None and last.offset == piece.onset
                if touches and last is not None and last.label == label and not _all_change(before, piece):
                    agreed[-1] = Agreed(last.onset, piece.offset, label, last.row)
                else:
                    agreed.append(Agreed(piece.onset, piece.offset, label, row))
            before = piece
    return agreed


def _cut(readings: Sequence[Sequence[Row]], canonical: Callable[[str], str]) -> list[_Piece]:
    """Cut the time from the first border to the last at every border."""
    ordered = [sorted(rows, key=lambda row: row["onset"]) for rows in readings]
    borders = sorted({int(row[end]) for rows in ordered for row in rows for end in ("onset", "offset")})
    places = [0] * len(ordered)
    pieces = []
    for onset, offset in pairwise(borders):
        here: list[Row | None] = []
        for number, rows in enumerate(ordered):
            while places[number] < len(rows) and rows[places[number]]["offset"] <= onset:
                places[number] += 1
            row = rows[places[number]] if places[number] < len(rows) else None
            here.append(row if row is not None and row["onset"] <= onset else None)
        labels = tuple(None if row is None else canonical(str(row["label"])) for row in here)
        pieces.append(_Piece(onset, offset, tuple(here), labels))
    return pieces


def _split_stretches(pieces: list[_Piece], jitter: float) -> Iterator[tuple[list[_Piece], bool]]:
    """Yield stretches on which all agree (True), or not; the same border set twice is made one."""
    groups = [(list(some), is_common) for is_common, some in groupby(pieces, key=lambda piece: piece.is_common)]
    for number, (stretch, is_common) in enumerate(groups):
        before = groups[number - 1][0][-1] if number else None
        after = groups[number + 1][0][0] if number + 1 < len(groups) else None
        border = None if is_common else _find_border(stretch, before, after, jitter)
        if border is None:
            yield stretch, is_common
            continue
        onset, offset = stretch[0].onset, stretch[-1].offset
        # What lies before the border goes on before it, what lies after begins at it; beyond the ends there is nothing.
        some = []
        if before is not None and onset < border:
            some.append(_Piece(onset, border, before.rows, before.labels))
        if after is not None and border < offset:
            some.append(_Piece(border, offset, after.rows, after.labels))
        yield some, True


def _find_border(stretch: list[_Piece], before: _Piece | None, after: _Piece | None, jitter: float) -> int | None:
    """Return the one border that all readers mean, None where they do not."""
    onset, offset = stretch[0].onset, stretch[-1].offset
    if offset - onset >= jitter:
        return None
    old = before.labels[0] if before is not None else None
    new = after.labels[0] if after is not None else None
    if old == new:
        return None
    changes = []
    for reader in range(len(stretch[0].labels)):
        steps = [(piece.onset, piece.labels[reader]) for piece in stretch]
        later = [place for place, label in steps if label == new]
        change = later[0] if later else offset
        if any(label != (old if place < change else new) for place, label in steps):
            return None
        changes.append(change)
    changes.sort()
    middle = len(changes) // 2
    return changes[middle] if len(changes) % 2 else (changes[middle - 1] + changes[middle]) // 2


def _join_remainders(stretch: list[_Piece], jitter: float) -> list[Difference]:
    """Return the differences of a stretch, remainders of borders joined to their longer neighbours."""
    pairs: list[tuple[Difference, bool]] = []  # with whether it holds a whole segment of a reader
    for (first, second), some in groupby(stretch, key=lambda piece: (piece.labels[0], piece.labels[1])):
        pieces = list(some)
        onset, offset = pieces[0].onset, pieces[-1].offset
        whole = any(
            row is not None and row["onset"] >= onset and row["offset"] <= offset
            for piece in pieces
            for row in piece.rows
        )
        pairs.append((Difference(onset, offset, first, second), whole))
    found: list[Difference] = []
    pending: int | None = None  # where a remainder begins that goes to what follows
    for number, (one, whole) in enumerate(pairs):
        onset = one.onset if pending is None else pending
        pending = None
        following = pairs[number + 1][0] if number + 1 < len(pairs) else None
        if not whole and one.offset - one.onset < jitter and len(pairs) > 1:
            ahead = following.offset - following.onset if following is not None else 0
            behind = found[-1].offset - found[-1].onset if found and found[-1].offset == onset else 0
            if behind and behind >= ahead:
                found[-1] = Difference(found[-1].onset, one.offset, found[-1].first, found[-1].second)
                continue
            if ahead:
                pending = onset
                continue
        found.append(Difference(onset, one.offset, one.first, one.second))
    return found


def _all_change(before: _Piece | None, piece: _Piece) -> bool:
    return before is not None and all(old is not new for old, new in zip(before.rows, piece.rows, strict=True))
