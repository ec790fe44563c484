"""How far everybody is, for the lead: people, takes, agreement, and what is to be settled."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

from ..queueing.corpus_facts import CorpusFacts, get_facts
from .adjudication import find_settled, is_covered
from .agreement import PairAgreement, measure_agreement
from .disagreements import Difference, find_differences, jitter_frames
from .modes import Mode, modes_of
from .plan import Plan, read_plan
from .readings import Reading, list_readings, make_canonical

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["Overview", "PersonSummary", "TakeSummary", "Unsettled", "Work", "summarise"]

_MOST_KEPT = 5000


@dataclass(frozen=True)
class Work:
    """What one person did on one take; segments are held ones, ``reviewed_seconds`` the time of reviewed ones."""

    person: str
    take: str
    mode: Mode
    segments: int
    reviewed: int
    reviewed_seconds: float
    edits: int
    unpublished: int
    done: bool


@dataclass(frozen=True)
class PersonSummary:
    """What one person did; ``seconds_per_minute`` is of work, per minute of recording that they reviewed."""

    person: str
    is_lead: bool
    takes: int
    reviewed: int
    edits: int
    unpublished: int
    active_seconds: float
    seconds_per_minute: float | None
    last_active: str | None


@dataclass(frozen=True)
class TakeSummary:
    """A take, and who worked on it or is to code it."""

    take: str
    signer: str | None
    protocol: str | None
    seconds: float
    by: tuple[Work, ...]


@dataclass(frozen=True)
class Unsettled:
    """A take on which two people disagree: how often, for how long, and how many of these are settled."""

    take: str
    tier: str
    first: str
    second: str
    disagreements: int
    seconds: float
    settled: int


@dataclass(frozen=True)
class Overview:
    """All of it."""

    people: tuple[PersonSummary, ...]
    takes: tuple[TakeSummary, ...]
    agreement: tuple[PairAgreement, ...]
    to_settle: tuple[Unsettled, ...]


def summarise(review: Review, person: str | None = None) -> Overview:
    """Return how far everybody is.

    To a lead (``person``) who still codes a take blind, how much the others found in it is not told: their work on it
    counts as none until all are done.

    People are those who have an account or have done something on the page. What is to be settled are takes coded by
    several people, when all are done, and takes of which several published the same tier; those without a disagreement
    are left out.
    """
    facts, plan = get_facts(review), read_plan(review)
    work = _collect_work(review, facts, plan)
    if person is not None:
        blind = {take for take, mode in modes_of(review, person).items() if mode == "blind"}
        work = [_hide(one) if one.take in blind and one.person != person else one for one in work]
    readings = list_readings(review)
    takes = tuple(
        TakeSummary(
            one.take, one.signer, one.protocol, one.seconds, tuple(some for some in work if some.take == one.take)
        )
        for one in facts.takes.values()
    )
    return Overview(
        tuple(_summarise_people(review, work, plan)),
        takes,
        tuple(measure_agreement(review, readings)),
        tuple(_find_unsettled(review, facts, readings)),
    )


def _collect_work(review: Review, facts: CorpusFacts, plan: Plan) -> list[Work]:
    """Return who did what, by person and take; coders who have not begun too."""
    pairs = {(key.person, key.take) for key in review.drafts.begun() if key.purpose == "own"}
    pairs |= {(person, one.take) for one in plan.takes for person in one.coders}
    done = {(person, one.take) for one in plan.takes for person in one.done}
    modes: dict[str, dict[str, Mode]] = {}
    found = []
    for person, take in sorted(pairs):
        if person not in modes:
            modes[person] = modes_of(review, person)
        mode = modes[person].get(take, "review")
        fact = facts.takes.get(take)
        if fact is None:  # deleted meanwhile; its edits are still in the draft
            continue
        look = review.drafts.look(person, take)
        held = [
            row
            for tier, rows in (look.tiers.items() if look.begun else ())
            for row in rows
            if not facts.is_transition(tier, row)
        ]
        reviewed = [row for row in held if row["status"] != "proposed"]
        seconds = sum(row["offset"] - row["onset"] for row in reviewed) / fact.rate
        found.append(
            Work(
                person,
                take,
                mode,
                len(held),
                len(reviewed),
                seconds,
                look.edits,
                look.unpublished,
                (person, take) in done,
            )
        )
    return found


def _hide(work: Work) -> Work:
    return replace(work, segments=0, reviewed=0, reviewed_seconds=0.0, edits=0, unpublished=0)


def _summarise_people(review: Review, work: Iterable[Work], plan: Plan) -> list[PersonSummary]:
    with review.database.read() as connection:
        totals = connection.execute("SELECT person, SUM(seconds) FROM activity GROUP BY person").fetchall()
        moments = connection.execute("SELECT person, moment FROM activity ORDER BY turn").fetchall()
    active = {str(row[0]): float(row[1]) for row in totals}
    last = {str(row[0]): str(row[1]) for row in moments}
    leads = {account.person: account.is_lead for account in review.people.accounts.list() if account.is_active}
    if review.people.owner is not None:
        leads[review.people.owner.name] = review.people.owner.is_lead
    by_person: dict[str, list[Work]] = {}
    for one in work:
        by_person.setdefault(one.person, []).append(one)
    names = {*leads, *active, *by_person, *plan.coders}
    summaries = []
    for name in sorted(names):
        own = by_person.get(name, [])
        minutes = sum(one.reviewed_seconds for one in own) / 60.0
        seconds = active.get(name, 0.0)
        summaries.append(
            PersonSummary(
                person=name,
                is_lead=leads.get(name, False),
                takes=sum(one.edits > 0 for one in own),
                reviewed=sum(one.reviewed for one in own),
                edits=sum(one.edits for one in own),
                unpublished=sum(one.unpublished for one in own),
                active_seconds=seconds,
                seconds_per_minute=seconds / minutes if minutes and seconds else None,
                last_active=last.get(name),
            )
        )
    return summaries


def _find_unsettled(
    review: Review, facts: CorpusFacts, readings: Mapping[tuple[str, str], Mapping[str, Reading]]
) -> list[Unsettled]:
    found = []
    for (take, tier), some in readings.items():
        settled = None
        for first, second in combinations(sorted(some), 2):
            differences = _compare(review, facts, take, tier, some[first], some[second])
            if not differences:
                continue
            settled = find_settled(review, take, tier) if settled is None else settled
            found.append(
                Unsettled(
                    take,
                    tier,
                    first,
                    second,
                    len(differences),
                    sum(one.offset - one.onset for one in differences) / facts.takes[take].rate,
                    sum(is_covered(one.onset, one.offset, settled) for one in differences),
                )
            )
    return found


def _compare(
    review: Review, facts: CorpusFacts, take: str, tier: str, first: Reading, second: Reading
) -> list[Difference]:
    """Return the differences of two readings, found once for the same rows and labels."""
    kept: dict[tuple, tuple[Reading, Reading, list[Difference]]] = review.part("differences", dict)
    key = (take, tier, id(first.rows), id(second.rows), facts.vocabulary(tier))
    if key not in kept:
        if len(kept) >= _MOST_KEPT:
            kept.clear()
        differences = find_differences(
            first.rows,
            second.rows,
            jitter=jitter_frames(facts.takes[take].rate),
            canonical=make_canonical(facts, tier),
        )
        kept[key] = (first, second, differences)
    return kept[key][2]
