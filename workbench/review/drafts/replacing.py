"""A whole tier in place of another: what stays the same segment, and what becomes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise

from ....corpus.versions.segment_rows import Row, format_segment, key_of_row, sort_rows
from ....errors import InputError
from .operations import Change, check_label, difference

__all__ = ["replace_rows"]

_SAME = ("onset", "offset", "label", "kind")


def replace_rows(
    rows: Sequence[Row], new: Iterable[Row], n_frames: int, new_id: Callable[[], int], *, edited: str | None = None
) -> Change:
    """Return what makes a tier another one.

    A new segment with the frames and the label of an old one is that one, with all that is known of it. One with the
    id of an old one, but other frames or another label, is that one edited.

    Parameters
    ----------
    rows
        The tier as it is.
    new
        What it shall be: at least ``onset, offset, label``; whatever else a row lacks is filled in.
    n_frames
        Length of the take.
    new_id
        Gives an id that no segment has.
    edited
        The status of what differs from a segment that was there, where a person made it differ; as the new row says
        if left out.

    Raises
    ------
    InputError
        If segments overlap, are empty or leave the take, or an id is repeated.
    """
    old = {row["id"]: row for row in rows}
    by_place = {_place(row): row for row in rows}
    taken = {by_place[_place(row)]["id"] for row in new if _place(row) in by_place} if (new := list(new)) else set()
    result: list[Row] = []
    for row in new:
        same = by_place.get(_place(row))
        if same is not None:
            result.append(same)
            continue
        filled = _fill(row)
        name = row.get("id")
        if name is None or name in taken:
            filled = {**filled, "id": new_id()}
        elif name in old:
            before = old[name]
            filled = {**before, **filled, "revision": int(before.get("revision", 0)) + 1}
            if before["label"] != filled["label"]:
                filled = {key: value for key, value in filled.items() if key != "confidence" or "confidence" in row}
            if edited is not None:
                filled |= {"status": edited, "origin": "human"}
        taken.add(filled["id"])
        result.append(filled)
    _check_rows(result, n_frames)
    return difference(rows, result)


def _place(row: Row) -> tuple[object, ...]:
    return tuple(row.get(name, "interval") for name in _SAME)


def _fill(row: Row) -> dict[str, object]:
    for name, value in row.items():
        key_of_row({name: value})  # only what can be kept
    usual: Mapping[str, object] = {"status": "proposed", "origin": "import", "revision": 0, "kind": "interval"}
    return {**usual, **row, "label": check_label(row["label"])}


def _check_rows(rows: Sequence[Row], n_frames: int) -> None:
    if len({row["id"] for row in rows}) < len(rows):
        raise InputError("tier: an id is repeated")
    for row in rows:
        if not 0 <= row["onset"] < row["offset"] <= n_frames:
            raise InputError(f"segment {format_segment(row)}: expected frames within the take, which has {n_frames}")
    for first, second in pairwise(sort_rows(rows)):
        if first["offset"] > second["onset"]:
            raise InputError(
                f"segments {format_segment(first)} and {format_segment(second)} overlap; a tier holds one label at a "
                "time"
            )
