"""Two readings of a take side by side, where they differ, and what a settled tier starts from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pandas as pd

from ....corpus.annotations.tier_table import make_tier
from ....corpus.versions.segment_rows import Row
from ....errors import NotFoundError
from ..drafts.records import ADJUDICATED
from ..queueing.corpus_facts import get_facts
from .disagreements import Agreed, Difference, find_agreed, find_differences, jitter_frames
from .readings import Reading, find_published, find_readings, make_canonical

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["Comparison", "compare_readings", "find_settled", "start_adjudication"]


@dataclass(frozen=True)
class Comparison:
    """Two readings; each difference with whether it is settled."""

    first: Reading
    second: Reading
    differences: tuple[tuple[Difference, bool], ...]


def start_adjudication(review: Review, take: str, tier: str) -> pd.DataFrame:
    """Return the tier that an adjudication starts from: what all readers of a take say alike, with status adjudicated.

    Where all go from one label to the same other one, and their borders are the same but for a few frames
    (:mod:`.disagreements`), the border is put in the middle. All else is left open. The same readings give the same
    tier, ids too.

    Parameters
    ----------
    review
        The review.
    take, tier
        Which tier is to be settled.

    Returns
    -------
    A checked tier with all its columns, segments side by side; empty where there are fewer than two readings, or where
    they have nothing in common.

    Raises
    ------
    NotFoundError
        If there is no such take.
    ConflictError
        If the take is still coded blind.
    """
    readings = list(find_readings(review, take, tier).values())
    facts = get_facts(review)
    agreed: list[Agreed] = []
    if len(readings) > 1:
        agreed = find_agreed(
            [reading.rows for reading in readings],
            jitter=jitter_frames(facts.takes[take].rate),
            canonical=make_canonical(facts, tier),
        )
    table = pd.DataFrame(
        {
            "id": pd.Series([_make_id(take, tier, one) for one in agreed], dtype="uint64"),
            "onset": pd.Series([one.onset for one in agreed], dtype="int64"),
            "offset": pd.Series([one.offset for one in agreed], dtype="int64"),
            "label": pd.Series([one.label for one in agreed], dtype="str"),
            "status": pd.Series(["adjudicated"] * len(agreed), dtype="str"),
            "origin": pd.Series(["human"] * len(agreed), dtype="str"),
            "kind": pd.Series([_tell_kind(one) for one in agreed], dtype="str"),
        }
    )
    return make_tier(table, name=f"take {take!r}, tier {tier!r}")


def compare_readings(review: Review, take: str, tier: str, first: str, second: str) -> Comparison:
    """Put two people's readings of a take side by side.

    Raises
    ------
    NotFoundError
        If there is no such take, or no such reading.
    ConflictError
        If the take is still coded blind.
    """
    readings = find_readings(review, take, tier)
    for name in (first, second):
        if name not in readings:
            known = ", ".join(readings) or "nobody"
            raise NotFoundError(
                f"take {take!r}: no finished tier {tier[:100]!r} by {name[:100]!r}; there are those of {known}"
            )
    facts = get_facts(review)
    differences = find_differences(
        readings[first].rows,
        readings[second].rows,
        jitter=jitter_frames(facts.takes[take].rate),
        canonical=make_canonical(facts, tier),
    )
    settled = find_settled(review, take, tier)
    return Comparison(
        readings[first],
        readings[second],
        tuple((one, is_covered(one.onset, one.offset, settled)) for one in differences),
    )


def find_settled(review: Review, take: str, tier: str) -> list[tuple[int, int]]:
    """Return the stretches of a take that were settled: by a lead's draft, or in the corpus, side by side."""
    stretches = [(onset, offset) for name, onset, offset, _ in review.drafts.settled(take) if name == tier]
    rows: list[Row] = list(find_published(review, take, tier, ADJUDICATED))
    for key in review.drafts.begun(take=take):
        if key.purpose == "adjudication":
            rows += review.drafts.look(key.person, take, key.purpose).tiers.get(tier, ())
    stretches += [(row["onset"], row["offset"]) for row in rows if row["status"] == "adjudicated"]
    joined: list[tuple[int, int]] = []
    for onset, offset in sorted(stretches):
        if joined and onset <= joined[-1][1]:
            joined[-1] = (joined[-1][0], max(joined[-1][1], offset))
        else:
            joined.append((onset, offset))
    return joined


def is_covered(onset: int, offset: int, stretches: Iterable[tuple[int, int]]) -> bool:
    """Return whether one of the stretches holds all of [onset, offset)."""
    return any(begin <= onset and offset <= end for begin, end in stretches)


def _make_id(take: str, tier: str, one: Agreed) -> int:
    """Return an identifier that only this segment has, and has each time."""
    text = f"{len(take)}:{take}{len(tier)}:{tier}{one.row['id']}:{one.onset}"
    return int.from_bytes(hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()[:8], "little") or 1


def _tell_kind(one: Agreed) -> str:
    return "point" if one.row.get("kind") == "point" and one.offset - one.onset == 1 else "interval"
