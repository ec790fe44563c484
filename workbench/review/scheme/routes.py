"""``/api/scheme``."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends

from ....corpus import Corpus
from ..context import Review
from ..people.person import Person
from ..server.dependencies import get_lead, get_person, get_review
from ..server.errors import Refusal, refusals
from .messages import Scheme, SchemeRequest
from .scheme import change_scheme, list_vocabularies, read_scheme

router = APIRouter(tags=["scheme"])


@router.get("/api/scheme", responses=refusals(401, 422, 503))
def get_scheme(
    review: Annotated[Review, Depends(get_review)], person: Annotated[Person, Depends(get_person)]
) -> Scheme:
    """Return the coding scheme."""
    return _kept(review)


@router.post("/api/scheme", responses=refusals(401, 403, 404, 409, 413, 422, 503))
def post_scheme(
    request: SchemeRequest,
    review: Annotated[Review, Depends(get_review)],
    person: Annotated[Person, Depends(get_lead)],
) -> Scheme:
    """Change the coding scheme, in one commit; drafts follow where labels became others."""
    corpus = Corpus.open(review.location)  # its own: a commit moves it on
    if request.snapshot != corpus.snapshot:
        seen = Corpus.open(review.location, at=request.snapshot)
        if list_vocabularies(seen) != list_vocabularies(corpus):
            raise Refusal(409, "stale", "the scheme has changed meanwhile; look at it again and redo the change")
    changed = change_scheme(corpus, request.change, author=person.name)
    if changed.mapping:
        review.drafts.change_labels(changed.tiers, changed.vocabulary, changed.mapping, merged=changed.merged)
    return _kept(review)


def _kept(review: Review) -> Scheme:
    """Return the scheme of the newest snapshot, read once."""
    corpus = review.corpus()
    kept: dict[str, Scheme] = review.part("scheme", dict)
    found = kept.get(corpus.snapshot)
    if found is None:
        found = read_scheme(corpus)
        kept.clear()
        kept[corpus.snapshot] = found
    return found
