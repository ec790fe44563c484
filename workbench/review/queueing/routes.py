"""Where the page asks what to look at next, and says how long its person worked."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Depends, Response
from pydantic_core import to_json

from ..context import Review
from ..people.person import Person
from ..server.dependencies import get_person, get_review
from ..server.errors import refusals
from .messages import Activity, ActivityAnswer, Pace, Queue
from .pace import measure_pace, record_activity
from .queue import list_queue

__all__ = ["router"]

router = APIRouter()

AReview = Annotated[Review, Depends(get_review)]
APerson = Annotated[Person, Depends(get_person)]


@router.get("/api/queue", response_model=Queue, responses=refusals(401, 503))
def get_queue(review: AReview, person: APerson) -> Response:
    """Return the segments that the person may review, most useful to look at first."""
    # Ten thousand items go out as they are: building and checking a model of each would take longer than all the rest.
    return Response(to_json(list_queue(review, person.name)), media_type="application/json")


@router.get("/api/pace", responses=refusals(401, 503))
def get_pace(review: AReview, person: APerson) -> Pace:
    """Return how far and how fast the person is."""
    return Pace(**asdict(measure_pace(review, person.name)))


@router.post("/api/activity", responses=refusals(401, 403, 404, 422, 503))
def post_activity(activity: Activity, review: AReview, person: APerson) -> ActivityAnswer:
    """Count time that the person spent on a take."""
    return ActivityAnswer(seconds=record_activity(review, person.name, activity.take, activity.seconds))
