"""Drafts and publishing for the page: what is shown, edits, undo and redo, and the commit."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from ....corpus import Corpus
from ..coding.modes import mode_of
from ..context import Review
from ..server.dependencies import Person, get_person, get_review
from ..server.errors import refusals
from .messages import (
    Draft,
    EditAnswer,
    EditRequest,
    PurposeName,
    StepRequest,
    draft_message,
    operation_of,
    outcome_message,
)
from .publish_messages import PublishAnswer, PublishPlan, PublishRequest, plan_message
from .publishing import LOCK_TIMEOUT, find_commit, plan_publishing, publish
from .records import DraftKey, ForbiddenDraftError, make_key
from .starting import StoredTier

__all__ = ["router"]

router = APIRouter()

Reviewed = Annotated[Review, Depends(get_review)]
Asking = Annotated[Person, Depends(get_person)]


@router.get("/api/draft", responses=refusals(401, 403, 404, 422, 503))
def get_draft(
    review: Reviewed, person: Asking, take: Annotated[str, Query()], purpose: Annotated[PurposeName, Query()] = "own"
) -> Draft:
    """Return the person's draft of a take, begun where there is none."""
    key = _require_key(person, take, purpose)
    state = review.drafts.open(key)
    mode = mode_of(review, person.name, take)
    others: tuple[StoredTier, ...] = ()
    if mode == "review" and state.gone is None:
        others = tuple(one for one in review.drafts.starts.stored(review.corpus(), take) if one.author != key.author)
    with review.database.read() as connection:
        done = connection.execute(
            "SELECT done FROM coding WHERE take = ? AND person = ?", (take, person.name)
        ).fetchone()
    return draft_message(state, others, mode=mode, done=bool(done and done[0]))


@router.post("/api/draft/edit", responses=refusals(401, 403, 404, 409, 413, 422, 503))
def post_edit(review: Reviewed, person: Asking, body: EditRequest) -> EditAnswer:
    """Apply an operation; the answer comes once it is on disk."""
    key = _require_key(person, body.take, body.purpose)
    operation = operation_of(body.operation)
    return outcome_message(review.drafts.edit(key, operation, request=body.request, version=body.version))


@router.post("/api/draft/undo", responses=refusals(401, 403, 404, 409, 413, 422, 503))
def post_undo(review: Reviewed, person: Asking, body: StepRequest) -> EditAnswer:
    """Take the last edit of a draft back."""
    key = _require_key(person, body.take, body.purpose)
    return outcome_message(review.drafts.undo(key, request=body.request, version=body.version))


@router.post("/api/draft/redo", responses=refusals(401, 403, 404, 409, 413, 422, 503))
def post_redo(review: Reviewed, person: Asking, body: StepRequest) -> EditAnswer:
    """Apply again what was undone last."""
    key = _require_key(person, body.take, body.purpose)
    return outcome_message(review.drafts.redo(key, request=body.request, version=body.version))


@router.get("/api/publish", responses=refusals(401, 403, 503))
def get_publish(review: Reviewed, person: Asking) -> PublishPlan:
    """Return what publishing the person's drafts would do."""
    corpus = review.corpus()
    plan = plan_publishing(review.drafts, person.name, is_lead=person.is_lead, corpus=corpus)
    blame = {
        (tier.key.take, tier.key.purpose, tier.state.tier): find_commit(corpus, tier.key, tier.state.tier)
        for tier in plan.tiers
        if tier.conflicts
    }
    return plan_message(plan, blame)


@router.post("/api/publish", responses=refusals(401, 403, 409, 413, 422, 503))
def post_publish(review: Reviewed, person: Asking, body: PublishRequest) -> PublishAnswer:
    """Publish just the plan that the person saw, as one commit."""
    corpus = Corpus.open(review.location, lock_timeout=LOCK_TIMEOUT)
    done = publish(
        review.drafts,
        person.name,
        is_lead=person.is_lead,
        corpus=corpus,
        plan=body.plan,
        message=body.message,
        choices=body.choices,
    )
    return PublishAnswer(snapshot=done.snapshot, changes=done.changes, takes=done.takes)


def _require_key(person: Person, take: str, purpose: str) -> DraftKey:
    if purpose == "adjudication" and not person.is_lead:
        raise ForbiddenDraftError(f"{person.name} is not a lead; only leads settle disagreements")
    return make_key(person.name, take, purpose)
