"""What people say of takes when they have finished: the readings that are compared and settled.

A take that was coded blind has the readings of its coders as they were when the last of them was done; what they change
later, when they have seen the others', changes no agreement. Of other takes the tiers count that people published.
Nobody's reading of a take is told before all its coders are done.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING

from ....corpus.versions.segment_rows import Row, decode_row
from ....errors import ConflictError, NotFoundError
from ...pipeline.segmenting import SEGMENT_TIER
from ..drafts.records import ADJUDICATED
from ..queueing.corpus_facts import CorpusFacts, get_facts

if TYPE_CHECKING:
    from ..context import Review
    from ..drafts.starting import StoredTier

__all__ = ["Reading", "find_published", "find_readings", "list_readings", "make_canonical", "published_tiers"]


@dataclass(frozen=True)
class Reading:
    """What one person says of one tier of a take.

    Parameters
    ----------
    author
        The person.
    rows
        Segments in order of onset.
    from_scratch
        Whether no machine proposed anything of it: only such readings are compared for agreement.
    is_blind
        Whether it is of a take that was drawn for double coding.
    """

    author: str
    rows: tuple[Row, ...]
    from_scratch: bool
    is_blind: bool


def list_readings(review: Review) -> dict[tuple[str, str], dict[str, Reading]]:
    """Return the readings of all takes by take and tier, then by author; those of takes still coded blind left out."""
    facts = get_facts(review)
    with review.database.read() as connection:
        drawn = connection.execute("SELECT take, tier, MIN(done) FROM coding GROUP BY take, tier").fetchall()
        frozen = connection.execute("SELECT take, tier, person, rows FROM coding_readings").fetchall()
    open_takes = {str(row[0]) for row in drawn if not row[2]}
    finished = {(str(row[0]), str(row[1])) for row in drawn if row[2]}
    found: dict[tuple[str, str], dict[str, Reading]] = {}
    for take, tier, person, text in frozen:
        if (take, tier) in finished and take not in open_takes and take in facts.takes:
            found.setdefault((take, tier), {})[person] = Reading(person, _decode(text), True, True)
    for take in facts.takes:
        if take not in open_takes:
            for one in published_tiers(review, take):
                if (take, one.tier) not in finished:
                    found.setdefault((take, one.tier), {})[one.author] = Reading(
                        one.author, one.rows, all(row["origin"] != "model" for row in one.rows), False
                    )
    return {place: dict(sorted(some.items())) for place, some in sorted(found.items())}


def find_readings(review: Review, take: str, tier: str) -> dict[str, Reading]:
    """Return the readings of one take by author.

    Raises
    ------
    NotFoundError
        If there is no such take.
    ConflictError
        If it is still coded blind.
    """
    if take not in get_facts(review).takes:
        raise NotFoundError(f"there is no take {take[:100]!r}")
    with review.database.read() as connection:
        coders = connection.execute("SELECT person, done, tier FROM coding WHERE take = ?", (take,)).fetchall()
        rows = connection.execute(
            "SELECT person, rows FROM coding_readings WHERE take = ? AND tier = ? ORDER BY person", (take, tier)
        ).fetchall()
    waiting = [str(row[0]) for row in coders if not row[1]]
    if waiting:
        raise ConflictError(f"take {take!r} is still coded blind: {', '.join(sorted(waiting))} are not done yet")
    if any(row[2] == tier for row in coders):
        return {str(row[0]): Reading(str(row[0]), _decode(row[1]), True, True) for row in rows}
    return {
        one.author: Reading(one.author, one.rows, all(row["origin"] != "model" for row in one.rows), False)
        for one in published_tiers(review, take)
        if one.tier == tier
    }


def published_tiers(review: Review, take: str) -> list[StoredTier]:
    """Return the tiers of a take that people published, by tier and author; settled ones left out."""
    return [
        one
        for one in review.drafts.starts.stored(review.corpus(), take)
        if one.made_by != "model" and one.author != ADJUDICATED and one.tier != SEGMENT_TIER
    ]


def find_published(review: Review, take: str, tier: str, author: str) -> tuple[Row, ...]:
    """Return the rows of a tier in the corpus, none where it is not there."""
    stored = review.drafts.starts.stored(review.corpus(), take)
    return next((one.rows for one in stored if one.tier == tier and one.author == author), ())


def make_canonical(facts: CorpusFacts, tier: str) -> Callable[[str], str]:
    """Return what tells which label a spelling stands for in a tier."""
    vocabulary = facts.vocabulary(tier)
    return str if vocabulary is None else cache(vocabulary.canonical)


@lru_cache(maxsize=1024)
def _decode(text: str) -> tuple[Row, ...]:
    return tuple(decode_row(row) for row in json.loads(text))
