"""The plan of double coding: which takes are coded blind, by whom, and who is done."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ....corpus.versions.segment_rows import Row, encode_row
from ....errors import ConflictError, InputError, NotFoundError
from ...pipeline.segmenting import SEGMENT_TIER
from ..drafts.records import make_key
from ..people.accounts import check_name
from ..queueing.corpus_facts import get_facts
from .drawing import count_wanted, draw_takes, place_in_line
from .readings import published_tiers

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["DrawnTake", "Plan", "read_plan", "save_plan", "say_done"]


@dataclass(frozen=True)
class DrawnTake:
    """A take that is coded blind; ``done``: which of its coders have finished."""

    take: str
    tier: str
    coders: tuple[str, ...]
    done: tuple[str, ...]

    @property
    def is_finished(self) -> bool:
        """Whether all coders are done, so that the readings may be compared."""
        return len(self.done) == len(self.coders)


@dataclass(frozen=True)
class Plan:
    """Share of the takes (0 to 1) that ``coders_per_take`` of the coders code blind; ``takes``: those drawn."""

    tier: str = "affect"
    share: float = 0.0
    coders: tuple[str, ...] = ()
    coders_per_take: int = 2
    seed: int = 0
    takes: tuple[DrawnTake, ...] = ()


def read_plan(review: Review) -> Plan:
    """Return the plan as it is, takes by name."""
    with review.database.read() as connection:
        row = connection.execute("SELECT tier, share, coders, coders_per_take, seed FROM coding_plan").fetchone()
        drawn = connection.execute("SELECT take, tier, person, done FROM coding ORDER BY take, rowid").fetchall()
    coders: dict[str, list[str]] = {}
    done: dict[str, list[str]] = {}
    tiers: dict[str, str] = {}
    for take, tier, person, is_done in drawn:
        tiers[take] = tier
        coders.setdefault(take, []).append(person)
        done.setdefault(take, []).extend([person] if is_done else [])
    takes = tuple(DrawnTake(take, tiers[take], tuple(some), tuple(done[take])) for take, some in coders.items())
    if row is None:
        return Plan(takes=takes)
    return Plan(row[0], float(row[1]), tuple(json.loads(row[2])), int(row[3]), int(row[4]), takes)


def save_plan(
    review: Review, *, tier: str, share: float, coders: Sequence[str], coders_per_take: int, seed: int
) -> Plan:
    """Draw takes by a plan and keep it.

    What somebody has begun to code stays as it is, whatever the plan says now, unless one of its coders has no account
    any more, who could never finish it: then it is drawn no longer and opens to all. A drawn take that still fits the
    plan stays too, so that takes which are added later do not reshuffle the others. Takes on which somebody works
    already, or which one of the coders has published or looked at, are not drawn: they could not code them blind.

    Parameters
    ----------
    review
        The review.
    tier
        What is coded.
    share, coders, coders_per_take, seed
        As :func:`.drawing.draw_takes` has them.

    Returns
    -------
    The plan with the takes that are drawn now.

    Raises
    ------
    InputError
        If a coder is nobody who may log in, the tier is that of automatic cuts, or too few takes can be drawn.
    ConflictError
        If somebody began to work on a drawn take at this very moment; nothing is kept then.
    """
    if tier == SEGMENT_TIER:
        raise InputError(f"tier: expected one that people code, but {tier!r} holds the automatic cuts")
    coders = _check_coders(review, coders)
    old = read_plan(review)
    takes = {name: one.signer for name, one in get_facts(review).takes.items() if one.refusal is None}
    begun = _find_begun(review)
    there = _find_people(review)
    fixed = {
        one.take: one.coders
        for one in old.takes
        # A coder who may not log in any more never says that they are done: the take would stay closed for ever.
        if one.is_finished or (set(one.coders) <= there if there is not None else True)
        if one.done or any((coder, one.take) in begun for coder in one.coders)
    }
    kept = {
        one.take: one.coders
        for one in old.takes
        if one.take in takes
        and one.take not in fixed
        and (one.tier, old.seed, len(one.coders)) == (tier, seed, coders_per_take)
        and set(one.coders) <= set(coders)
    }
    room = max(count_wanted(share, len(takes)) - sum(take in takes for take in fixed), 0)
    in_line = sorted(kept, key=lambda take: place_in_line(seed, take))[:room]
    drawn = draw_takes(
        takes,
        coders,
        share=share,
        coders_per_take=coders_per_take,
        seed=seed,
        kept={take: some for take, some in fixed.items() if take in takes} | {take: kept[take] for take in in_line},
        closed=_find_closed(review, takes, tier, coders, begun, old),
    )
    drawn |= fixed
    new = {take: some for take, some in drawn.items() if take not in fixed}
    with review.database.write() as connection:
        _refuse_begun(new, {one.take for one in old.takes} - set(drawn), _find_begun(review) - begun)
        connection.execute(
            "INSERT OR REPLACE INTO coding_plan (only_one, tier, share, coders, coders_per_take, seed) "
            "VALUES (1, ?, ?, ?, ?, ?)",
            (tier, share, json.dumps(list(coders)), coders_per_take, seed),
        )
        for (take,) in connection.execute("SELECT DISTINCT take FROM coding").fetchall():
            if take not in fixed:
                connection.execute("DELETE FROM coding WHERE take = ?", (take,))
        connection.executemany(
            "INSERT INTO coding (take, person, tier) VALUES (?, ?, ?)",
            [(take, person, tier) for take, some in sorted(new.items()) for person in some],
        )
    return read_plan(review)


def say_done(review: Review, person: str, take: str, done: bool) -> DrawnTake:
    """Say that a coder has finished a take, or goes on after all; readings are kept when the last one has.

    Raises
    ------
    NotFoundError
        If the person does not code this take blind.
    ConflictError
        If the readings were told to others already.
    """
    found = _find_drawn(review, person, take)
    # None of the coders edits meanwhile: what was saved before the last one is done belongs to the reading.
    with review.drafts.locked(*(make_key(coder, take) for coder in found.coders)):
        found = _find_drawn(review, person, take)
        if found.is_finished:
            if done:
                return found
            raise ConflictError(
                f"take {take!r}: all its coders were done, and may have seen each other's coding by now"
            )
        _keep_done(review, person, found, done)
        return _find_drawn(review, person, take)


def _find_drawn(review: Review, person: str, take: str) -> DrawnTake:
    found = next((one for one in read_plan(review).takes if one.take == take and person in one.coders), None)
    if found is None:
        raise NotFoundError(f"take {take[:100]!r} is not among those that {person} codes blind")
    return found


def _keep_done(review: Review, person: str, found: DrawnTake, done: bool) -> None:
    take = found.take
    readings = {coder: _read_tier(review, coder, take, found.tier) for coder in found.coders}
    with review.database.write() as connection:
        connection.execute("UPDATE coding SET done = ? WHERE take = ? AND person = ?", (done, take, person))
        waiting = connection.execute("SELECT COUNT(*) FROM coding WHERE take = ? AND NOT done", (take,)).fetchone()[0]
        if not waiting:
            connection.executemany(
                "INSERT OR REPLACE INTO coding_readings (take, person, tier, rows) VALUES (?, ?, ?, ?)",
                [(take, coder, found.tier, _encode(rows)) for coder, rows in readings.items()],
            )


def _check_coders(review: Review, coders: Sequence[str]) -> tuple[str, ...]:
    """Return the names as accounts have them."""
    coders = tuple(check_name(coder) for coder in coders)
    if len(set(coders)) != len(coders):
        raise InputError("coders: expected each person once")
    known = _find_people(review)
    if known is None:
        return coders
    unknown = [coder for coder in coders if coder not in known]
    if unknown:
        raise InputError(
            f"coders: there is no account {unknown[0][:100]!r}; there are {', '.join(sorted(known)) or 'none'}"
        )
    return coders


def _find_people(review: Review) -> set[str] | None:
    """Return who may log in, None where nobody does by name."""
    if not review.people.are_named:
        return None
    return {account.person for account in review.people.accounts.list() if account.is_active}


def _find_begun(review: Review) -> set[tuple[str, str]]:
    """Return who has edited what: pairs of person and take."""
    return {(key.person, key.take) for key in review.drafts.begun() if key.purpose == "own"}


def _find_closed(
    review: Review,
    takes: Collection[str],
    tier: str,
    coders: Sequence[str],
    begun: Collection[tuple[str, str]],
    old: Plan,
) -> set[str]:
    """Return the takes that cannot be coded blind any more: edited, published or looked at with their proposals."""
    edited = {take for _, take in begun}
    published = {
        take
        for take in takes
        if any(one.tier == tier and one.author in coders for one in published_tiers(review, take))
    }
    drawn = {(person, one.take) for one in old.takes for person in one.coders}
    with review.database.read() as connection:
        looked = connection.execute("SELECT person, take FROM activity").fetchall()
    seen = {str(take) for person, take in looked if person in coders and (person, take) not in drawn}
    return edited | published | seen


def _refuse_begun(new: Collection[str], released: Collection[str], begun: Collection[tuple[str, str]]) -> None:
    """Refuse where an edit came in between: a take just drawn, or one that is drawn no more."""
    for person, take in sorted(begun):
        if take in new or take in released:
            raise ConflictError(f"take {take!r}: {person} has just begun to work on it; draw again")


def _read_tier(review: Review, person: str, take: str, tier: str) -> tuple[Row, ...]:
    return tuple(review.drafts.look(person, take).tiers.get(tier, ()))


def _encode(rows: Sequence[Row]) -> str:
    return json.dumps([encode_row(row) for row in rows])
