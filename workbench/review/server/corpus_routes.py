"""``/api/corpus``."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends

from ..context import Review
from ..people.person import Person
from .corpus_listing import list_corpus
from .dependencies import get_person, get_review
from .errors import refusals
from .messages import CorpusMessage

__all__ = ["router"]

router = APIRouter(tags=["corpus"])


@router.get("/api/corpus", responses=refusals(401, 503))
def get_corpus(
    review: Annotated[Review, Depends(get_review)], person: Annotated[Person, Depends(get_person)]
) -> CorpusMessage:
    """Return the corpus and its takes, as this person sees them."""
    return list_corpus(review, person)
