"""``/api/scheme``."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends

from ....corpus import Corpus
from ..coding.modes import find_hidden
from ..context import Review
from ..people.person import Person
from ..server.dependencies import get_lead, get_person, get_review
from ..server.errors import Refusal, refusals
from .messages import Scheme, SchemeRequest
from .scheme import change_scheme, list_vocabularies, read_scheme

router = APIRouter(tags=["scheme"])

LOCK_TIMEOUT = 5.0
"""How long a change waits for others that write the corpus, in s; all drafts stand still meanwhile."""


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
    corpus = Corpus.open(review.location, lock_timeout=LOCK_TIMEOUT)  # its own: a commit moves it on
    if request.snapshot != corpus.snapshot:
        seen = Corpus.open(review.location, at=request.snapshot)
        if list_vocabularies(seen) != list_vocabularies(corpus):
            raise Refusal(409, "stale", "the scheme has changed meanwhile; look at it again and redo the change")
    # Nobody edits or publishes between the commit and what follows it in the drafts: what is published in between
    # would bring the old label back. All are locked at once and in order, so that no two wait for each other.
    with review.drafts.locked(*(keys := review.drafts.begun())):
        changed = change_scheme(corpus, request.change, author=person.name)
        if changed.mapping:
            review.drafts.change_labels(
                changed.tiers, changed.vocabulary, changed.mapping, merged=changed.merged, keys=keys
            )
    return _kept(review)


def _kept(review: Review) -> Scheme:
    """Return the scheme of the newest snapshot, read once for each set of takes that are coded blind."""
    corpus, hidden = review.corpus(), find_hidden(review)
    kept: dict[tuple[str, frozenset[str]], Scheme] = review.part("scheme", dict)
    found = kept.get((corpus.snapshot, hidden))
    if found is None:
        found = read_scheme(corpus, hidden=hidden)
        kept.clear()
        kept[corpus.snapshot, hidden] = found
    return found
