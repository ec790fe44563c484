"""What an annotator does to a tier, as functions of its rows: each says which rows go and which come.

Rows are those of :mod:`mimique.corpus.versions.segment_rows`, side by side. A segment keeps its id through every edit;
``parents`` names the ids (comma separated) that a part of a split or the outcome of a merge comes from. What somebody
edits is reviewed by that, and its origin human; a confidence stays as long as the label does. A neighbour that merely
gives way stays proposed, if it was, and so does a transition that is renamed with its neighbour (:mod:`.tier_labels`).
The revision rises wherever a row changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ....corpus.annotations.vocabulary import Transition, parse_label
from ....corpus.versions.segment_rows import Row, format_segment, key_of_row, sort_rows
from ....errors import InputError
from .tier_labels import TierLabels

__all__ = ["LONGEST_LABEL", "Change", "apply_operation", "check_label", "difference"]

LONGEST_LABEL = 1000
"""Characters of a label."""

_MEANINGS = ("from_label", "to_label")


@dataclass(frozen=True)
class Change:
    """Whole rows that an operation takes out of a tier, and those that it puts in; both in order of onset."""

    removed: tuple[Row, ...]
    added: tuple[Row, ...]

    def __bool__(self) -> bool:
        return bool(self.removed or self.added)

    def reversed(self) -> Change:
        """Return the change back."""
        return Change(self.added, self.removed)


@dataclass(frozen=True)
class _Tier:
    rows: tuple[Row, ...]
    n_frames: int
    new_id: Callable[[], int]
    status: str
    labels: TierLabels

    def find(self, name: int) -> Row:
        for row in self.rows:
            if row["id"] == name:
                return row
        raise InputError(f"segment {name}: it is not in the tier any more; load the take again")


def apply_operation(
    rows: Sequence[Row],
    operation: Mapping[str, Any],
    n_frames: int,
    new_id: Callable[[], int],
    *,
    status: str = "reviewed",
    labels: TierLabels | None = None,
) -> Change:
    """Return what an operation does to a tier.

    Parameters
    ----------
    rows
        The tier, segments side by side within [0, n_frames).
    operation
        ``kind`` accept, relabel, move, split, merge, add, delete or settle, and what belongs to it; ids are whole
        numbers.
    n_frames
        Length of the take.
    new_id
        Gives an id that no segment has.
    status
        What an edited segment becomes: reviewed or adjudicated.
    labels
        What the tier's labels mean; free ones if left out.

    Returns
    -------
    Change
        Empty where the tier is as it would be already.

    Raises
    ------
    InputError
        If a segment is not there, or segments would overlap, be empty or leave the take.
    """
    kind = str(operation.get("kind"))
    if kind not in _OPERATIONS:
        raise InputError(f"operation: expected one of {', '.join(_OPERATIONS)}, but got {kind!r}")
    tier = _Tier(tuple(sort_rows(rows)), n_frames, new_id, status, labels or TierLabels())
    try:
        after = sort_rows(_OPERATIONS[kind](tier, operation))
        return difference(tier.rows, _rename_transitions(tier, after) if kind in _RELABELLING else after)
    except KeyError as error:
        raise InputError(f"operation {kind}: expected {error.args[0]!r}, but it is missing") from error


def difference(before: Iterable[Row], after: Iterable[Row]) -> Change:
    """Return what leads from one state of a tier to another; rows that stay as they are count as neither."""
    old, new = ({row["id"]: row for row in rows} for rows in (before, after))
    return Change(
        tuple(sort_rows(row for name, row in old.items() if not _is_same(row, new.get(name)))),
        tuple(sort_rows(row for name, row in new.items() if not _is_same(row, old.get(name)))),
    )


def check_label(label: Any) -> str:
    """Return a label that every store can hold.

    Raises
    ------
    InputError
        If it is no text, too long, or holds what is no character.
    """
    if not isinstance(label, str):
        raise InputError(f"label: expected a text, but got {type(label).__name__}")
    if len(label) > LONGEST_LABEL:
        raise InputError(f"label: expected at most {LONGEST_LABEL} characters, but got {len(label)}")
    if "\0" in label or any(0xD800 <= ord(one) < 0xE000 for one in label):
        raise InputError("label: it holds a character that is none (NUL or half a pair); leave it out")
    return label


def _is_same(row: Row, other: Row | None) -> bool:
    return row is other or (other is not None and key_of_row(row) == key_of_row(other))


def _accept(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    chosen = _choose(tier, operation["segments"])
    return _replace(tier.rows, [_touch(row, status=tier.status) for row in chosen if row["status"] == "proposed"])


def _relabel(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    label = tier.labels.spell(check_label(operation["label"]), tier.rows)
    chosen = _choose(tier, operation["segments"])
    wanted = tier.labels.canonical(label)
    same = [row for row in chosen if tier.labels.canonical(row["label"]) == wanted]
    accepted = [_touch(row, status=tier.status) for row in same if row["status"] == "proposed"]
    others = {row["id"] for row in chosen} - {row["id"] for row in same}
    changed = [_edit(tier, row, label=label) for row in chosen if row["id"] in others]
    return _replace(tier.rows, [*accepted, *changed])


def _rename_transitions(tier: _Tier, after: Sequence[Row]) -> list[Row]:
    """Return the rows with transitions named after the neighbours that an edit gave them."""
    renamed = tier.labels.follow(tier.rows, after)
    before = {row["id"]: row for row in tier.rows}
    rows = list(after)
    for row in after:
        if row["id"] not in renamed:
            continue
        label = renamed[row["id"]]
        place = [one["id"] for one in rows].index(row["id"])
        if label is not None:
            told = {**_without(row, "confidence", *_MEANINGS), **_meaning(tier.rows, label), "label": label}
            rows[place] = _touch(told, origin="human")
            continue
        del rows[place]
        # The neighbour that the edit made so takes its time.
        beside = [at for at in (place - 1, place) if 0 <= at < len(rows) and _touches(rows[at], row)]
        grown = next((at for at in beside if rows[at] != before.get(rows[at]["id"])), beside[0])
        edges = {"onset": min(rows[grown]["onset"], row["onset"]), "offset": max(rows[grown]["offset"], row["offset"])}
        rows[grown] = {**rows[grown], **edges, "parents": f"{rows[grown]['id']},{row['id']}"}
    return rows


def _move(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    row = tier.find(operation["segment"])
    onset, offset = (operation.get(name) for name in ("onset", "offset"))
    if row.get("kind") == "point":
        onset = onset if onset is not None else offset - 1 if offset is not None else row["onset"]
        offset = onset + 1
    onset = row["onset"] if onset is None else onset
    offset = row["offset"] if offset is None else offset
    _check_span(tier, onset, offset)
    if (onset, offset) == (row["onset"], row["offset"]):
        return list(tier.rows)
    place = [one["id"] for one in tier.rows].index(row["id"])
    moved = [_edit(tier, row, onset=onset, offset=offset)]
    together = operation.get("together", True) and row.get("kind") != "point"
    if place > 0:
        moved += _follow(tier.rows[place - 1], "offset", row["onset"], onset, together=together)
    if place + 1 < len(tier.rows):
        moved += _follow(tier.rows[place + 1], "onset", row["offset"], offset, together=together)
    result = sort_rows(_replace(tier.rows, moved))
    for first, second in pairwise(result):
        if first["offset"] > second["onset"]:
            other = first if second["id"] == row["id"] else second
            raise InputError(f"segment {format_segment(other)}: no room for it would be left; delete it, or move less")
    return result


def _follow(neighbour: Row, side: str, before: int, now: int, *, together: bool) -> list[Row]:
    """Return the neighbour as it gives way to a boundary that moved from ``before`` to ``now``."""
    if neighbour.get("kind") == "point":
        return []
    shared = neighbour[side] == before
    covered = neighbour[side] > now if side == "offset" else neighbour[side] < now
    if not covered and not (shared and together):
        return []
    changed = {**neighbour, side: now}
    if changed["onset"] >= changed["offset"]:
        raise InputError(f"segment {format_segment(neighbour)}: no frame of it would be left; delete it, or move less")
    return [_touch(changed)] if changed[side] != neighbour[side] else []


def _split(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    row, frame = tier.find(operation["segment"]), operation["frame"]
    if not row["onset"] < frame < row["offset"]:
        raise InputError(
            f"segment {format_segment(row)}: expected a frame within it to split at, but got {frame}; at least one "
            "frame is left on each side"
        )
    first = _edit(tier, row, offset=frame)
    second = {**_edit(tier, row, onset=frame), "id": tier.new_id(), "parents": str(row["id"])}
    return [*_replace(tier.rows, [first]), second]


def _merge(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    chosen = sort_rows(_choose(tier, operation["segments"]))
    if len(chosen) < 2:
        raise InputError("merge: expected two segments or more; choose neighbours")
    if any(row.get("kind") == "point" for row in chosen):
        raise InputError("merge: a point takes one frame and cannot be merged")
    first, last = chosen[0], chosen[-1]
    within = [row for row in tier.rows if row["onset"] >= first["onset"] and row["offset"] <= last["offset"]]
    if len(within) > len(chosen):
        names = {row["id"] for row in chosen}
        other = next(row for row in within if row["id"] not in names)
        raise InputError(f"merge: expected neighbours, but {format_segment(other)} lies between them")
    named = operation.get("label")
    label = first["label"] if named is None else tier.labels.spell(check_label(named), tier.rows)
    merged = _edit(tier, first, offset=last["offset"], label=label)
    if any(row["label"] != label for row in chosen):
        merged = _without(merged, "confidence")  # it said how sure the label of a part was
    merged = {**merged, "parents": ",".join(str(row["id"]) for row in chosen)}
    gone = {row["id"] for row in chosen}
    return [merged, *(row for row in tier.rows if row["id"] not in gone)]


def _add(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    onset, offset = operation["onset"], operation["offset"]
    label = tier.labels.spell(check_label(operation["label"]), tier.rows)
    _check_span(tier, onset, offset)
    same = [row for row in tier.rows if (row["onset"], row["offset"]) == (onset, offset)]
    if same:
        return _relabel(tier, {"segments": [same[0]["id"]], "label": label})
    return [*_clear(tier, onset, offset), _make(tier, onset, offset, label)]


def _delete(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    gone = {row["id"] for row in _choose(tier, operation["segments"])}
    return [row for row in tier.rows if row["id"] not in gone]


def _settle(tier: _Tier, operation: Mapping[str, Any]) -> list[Row]:
    onset, offset, label = operation["onset"], operation["offset"], operation["label"]
    _check_span(tier, onset, offset)
    if label is None:
        return _clear(tier, onset, offset)
    label = tier.labels.spell(check_label(label), tier.rows)
    rows = _clear(tier, onset, offset)
    # What both readers said beside it goes on here: one segment, not pieces of it.
    before = [row for row in rows if row["offset"] == onset and _continues(row, label)]
    after = [row for row in rows if row["onset"] == offset and _continues(row, label)]
    onset = before[0]["onset"] if before else onset
    offset = after[0]["offset"] if after else offset
    joined = [*before, *after]
    if joined:
        settled = {**_edit(tier, joined[0], onset=onset, offset=offset), "status": "adjudicated"}
        if len(joined) > 1:
            settled["parents"] = ",".join(str(row["id"]) for row in joined)
    else:
        settled = {**_make(tier, onset, offset, label), "status": "adjudicated"}
    gone = {row["id"] for row in joined}
    return [*(row for row in rows if row["id"] not in gone), settled]


_RELABELLING = ("relabel", "merge", "add")

_OPERATIONS: dict[str, Callable[[_Tier, Mapping[str, Any]], list[Row]]] = {
    "accept": _accept,
    "relabel": _relabel,
    "move": _move,
    "split": _split,
    "merge": _merge,
    "add": _add,
    "delete": _delete,
    "settle": _settle,
}


def _clear(tier: _Tier, onset: int, offset: int) -> list[Row]:
    """Return the rows with [onset, offset) free: what lies there is cut, split or removed."""
    kept: list[Row] = []
    for row in tier.rows:
        if row["offset"] <= onset or row["onset"] >= offset:
            kept.append(row)
            continue
        parts = [(row["onset"], onset), (offset, row["offset"])]
        parts = [(begin, end) for begin, end in parts if begin < end]
        for number, (begin, end) in enumerate(parts):
            part = _touch({**row, "onset": begin, "offset": end})
            kept.append(part if number == 0 else {**part, "id": tier.new_id(), "parents": str(row["id"])})
    return kept


def _make(tier: _Tier, onset: int, offset: int, label: str) -> Row:
    row: Row = {
        "id": tier.new_id(),
        "onset": onset,
        "offset": offset,
        "label": label,
        "status": tier.status,
        "origin": "human",
        "revision": 0,
        "kind": "interval",
    }
    return {**row, **_meaning(tier.rows, label)}


def _edit(tier: _Tier, row: Row, **changes: Any) -> Row:
    """Return a row that a person edited."""
    edited = {**row, **changes, "status": tier.status, "origin": "human"}
    if edited["label"] != row["label"]:
        edited = {**_without(edited, "confidence", *_MEANINGS), **_meaning(tier.rows, edited["label"])}
    return _touch(edited)


def _touch(row: Row, **changes: Any) -> Row:
    return {**row, **changes, "revision": int(row.get("revision", 0)) + 1}


def _meaning(rows: Sequence[Row], label: str) -> dict[str, str]:
    """Return what a label means, in a tier that says so: as its other segments have it, else as an affect's name."""
    telling = [row for row in rows if _MEANINGS[0] in row and _MEANINGS[1] in row]
    if not telling:
        return {}
    for row in telling:
        if row["label"] == label:
            return {name: row[name] for name in _MEANINGS}
    try:
        meaning = parse_label(label)
    except InputError:
        return {}  # better nothing than the meaning of another label
    pair = meaning if isinstance(meaning, Transition) else (meaning, meaning)
    return dict(zip(_MEANINGS, pair, strict=True))


def _touches(row: Row, other: Row) -> bool:
    return bool(row["offset"] == other["onset"] or other["offset"] == row["onset"])


def _continues(row: Row, label: str) -> bool:
    return row["label"] == label and row.get("kind") != "point"


def _choose(tier: _Tier, names: Sequence[int]) -> list[Row]:
    if not names:
        raise InputError("operation: expected at least one segment")
    return [tier.find(name) for name in dict.fromkeys(names)]


def _replace(rows: Sequence[Row], changed: Sequence[Row]) -> list[Row]:
    by_id = {row["id"]: row for row in changed}
    return [by_id.get(row["id"], row) for row in rows]


def _without(row: Row, *names: str) -> Row:
    return {name: value for name, value in row.items() if name not in names}


def _check_span(tier: _Tier, onset: int, offset: int) -> None:
    if not 0 <= onset < offset <= tier.n_frames:
        raise InputError(
            f"segment [{onset}, {offset}): expected at least one frame within the take, which has {tier.n_frames}"
        )
