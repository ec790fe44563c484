"""Where leads plan double coding, see how far it is and compare readings, and coders say that they are done."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Depends, Query

from ..context import Review
from ..drafts.messages import segment_message
from ..people.person import Person
from ..server.dependencies import get_lead, get_person, get_review
from ..server.errors import refusals
from .adjudication import compare_readings
from .messages import (
    Adjudication,
    Agreement,
    CodedTake,
    CodingDone,
    CodingPlan,
    CodingRequest,
    Disagreement,
    Overview,
    OverviewPerson,
    OverviewTake,
    Reading,
    ToSettle,
    WorkOnTake,
)
from .overview import summarise
from .plan import Plan, read_plan, save_plan, say_done
from .readings import Reading as KeptReading

__all__ = ["router"]

router = APIRouter()

AReview = Annotated[Review, Depends(get_review)]
APerson = Annotated[Person, Depends(get_person)]
ALead = Annotated[Person, Depends(get_lead)]


@router.get("/api/coding", responses=refusals(401, 403, 503))
def get_coding(review: AReview, lead: ALead) -> CodingPlan:
    """Return the plan of double coding."""
    return _show_plan(read_plan(review))


@router.put("/api/coding", responses=refusals(401, 403, 409, 422, 503))
def put_coding(request: CodingRequest, review: AReview, lead: ALead) -> CodingPlan:
    """Draw takes by a plan; what somebody has begun to code stays as it is."""
    return _show_plan(save_plan(review, **request.model_dump()))


@router.post("/api/coding/done", responses=refusals(401, 403, 404, 409, 422, 503))
def post_done(request: CodingDone, review: AReview, person: APerson) -> CodingDone:
    """Say that the person has finished coding a take blind, or goes on after all."""
    found = say_done(review, person.name, request.take, request.done)
    return CodingDone(take=found.take, done=person.name in found.done)


@router.get("/api/overview", responses=refusals(401, 403, 503))
def get_overview(review: AReview, lead: ALead) -> Overview:
    """Return how far everybody is."""
    found = summarise(review, lead.name)
    return Overview(
        people=[OverviewPerson(**asdict(one)) for one in found.people],
        takes=[
            OverviewTake(
                take=one.take,
                signer=one.signer,
                protocol=one.protocol,
                seconds=one.seconds,
                by=[
                    WorkOnTake(
                        person=work.person,
                        mode=work.mode,
                        segments=work.segments,
                        reviewed=work.reviewed,
                        done=work.done,
                        unpublished=work.unpublished,
                    )
                    for work in one.by
                ],
            )
            for one in found.takes
        ],
        agreement=[Agreement(**asdict(one)) for one in found.agreement],
        to_settle=[ToSettle(**asdict(one)) for one in found.to_settle],
    )


@router.get("/api/adjudication", responses=refusals(401, 403, 404, 409, 422, 503))
def get_adjudication(
    review: AReview,
    lead: ALead,
    take: Annotated[str, Query()],
    tier: Annotated[str, Query()],
    first: Annotated[str, Query()],
    second: Annotated[str, Query()],
) -> Adjudication:
    """Return two people's readings of a take, and where they differ."""
    found = compare_readings(review, take, tier, first, second)
    return Adjudication(
        take=take,
        tier=tier,
        first=_show_reading(found.first),
        second=_show_reading(found.second),
        disagreements=[
            Disagreement(onset=one.onset, offset=one.offset, first=one.first, second=one.second, settled=settled)
            for one, settled in found.differences
        ],
    )


def _show_plan(plan: Plan) -> CodingPlan:
    return CodingPlan(
        tier=plan.tier,
        share=plan.share,
        coders=list(plan.coders),
        coders_per_take=plan.coders_per_take,
        seed=plan.seed,
        takes=[CodedTake(take=one.take, coders=list(one.coders), done=list(one.done)) for one in plan.takes],
    )


def _show_reading(reading: KeptReading) -> Reading:
    return Reading(author=reading.author, segments=[segment_message(row) for row in reading.rows])
