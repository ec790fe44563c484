"""``/api/elan``, ``/api/elan/preview`` and ``/api/elan/import``."""

from __future__ import annotations

from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Depends, Query, Request, Response

from ....corpus import Corpus
from ..coding.modes import mode_of
from ..context import Review
from ..drafts.messages import EditAnswer, outcome_message
from ..drafts.records import ForbiddenDraftError, Purpose, make_key
from ..server.dependencies import Person, get_person, get_review
from ..server.errors import Refusal, refusals
from ..showing.scene import corpus_folder
from ..showing.showing import check_shown
from .exporting import disposition, write_draft
from .importing import make_rows, parse_choice, preview_tiers, read_upload
from .messages import ElanPreview

__all__ = ["LARGEST_UPLOAD", "get_upload", "router"]

LARGEST_UPLOAD = 20 * 2**20
"""Bytes of a file: ELAN's own for an hour of dense annotation are a tenth of it."""

EAF = "application/xml"
UPLOADED = "application/octet-stream"

router = APIRouter(tags=["elan"])


async def get_upload(request: Request, person: Annotated[Person, Depends(get_person)]) -> bytes:
    """Return the body, read in pieces, so that nobody fills the memory; only of who is logged in.

    Raises
    ------
    Refusal
        413 if it is larger than :data:`LARGEST_UPLOAD`.
    """
    pieces, size = [], 0
    async for piece in request.stream():
        size += len(piece)
        if size > LARGEST_UPLOAD:
            raise Refusal(
                413, "too-large", f"the file has more than {LARGEST_UPLOAD >> 20} MB; import it with: mimique ingest"
            )
        pieces.append(piece)
    return b"".join(pieces)


ReviewHere = Annotated[Review, Depends(get_review)]
Somebody = Annotated[Person, Depends(get_person)]
Take = Annotated[str, Query(description="Name of the take.")]
Upload = Annotated[bytes, Depends(get_upload)]

_FILE: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "description": "An ELAN document (.eaf), at most 20 MB.",
        "content": {UPLOADED: {"schema": {"type": "string", "format": "binary"}}},
    }
}


class ElanDocument(Response):
    """An ELAN document."""

    media_type = EAF


@router.get(
    "/api/elan",
    response_class=ElanDocument,
    responses={
        200: {"description": "An ELAN document (.eaf)", "content": {EAF: {"schema": {"type": "string"}}}},
        **refusals(401, 403, 404, 409, 422, 503),
    },
)
def get_elan(review: ReviewHere, person: Somebody, take: Take, purpose: Purpose = "own") -> Response:
    """Return a draft as an ELAN document, with others' tiers where the person may see them.

    What the format could not keep stands in the header ``X-Mimique-Warnings``, one line each, percent-encoded.
    """
    if purpose == "adjudication" and not person.is_lead:
        raise ForbiddenDraftError(f"{person.name} is not a lead; only leads settle disagreements")
    state = review.drafts.open(make_key(person.name, take, purpose))
    newest = review.corpus()
    # What was drawn up on a take that is gone is still worth having: the snapshot it began from has the take.
    corpus = newest if state.gone is None else Corpus.open(review.location, at=state.base)
    check_shown(newest, take, of=corpus)
    written = write_draft(
        corpus,
        take,
        state.key.author,
        state.tiers,
        with_others=mode_of(review, person.name, take) == "review",
        folder=corpus_folder(newest),
    )
    headers = {"Content-Disposition": disposition(take, state.key.author)}
    if written.warnings:
        headers["X-Mimique-Warnings"] = quote("\n".join(written.warnings)[:2000])
    return ElanDocument(written.data, headers=headers)


@router.post("/api/elan/preview", responses=refusals(401, 403, 404, 409, 413, 422, 503), openapi_extra=_FILE)
def preview_elan(review: ReviewHere, person: Somebody, take: Take, data: Upload) -> ElanPreview:
    """Say what importing an ELAN document would bring; nothing is changed."""
    corpus = review.corpus()
    check_shown(corpus, take)
    draft = review.drafts.open(make_key(person.name, take))
    return preview_tiers(corpus, take, data, draft, with_others=mode_of(review, person.name, take) == "review")


@router.post("/api/elan/import", responses=refusals(401, 403, 404, 409, 413, 422, 503), openapi_extra=_FILE)
def import_elan(
    review: ReviewHere,
    person: Somebody,
    take: Take,
    version: Annotated[int, Query(ge=0, le=2**53, description="Of the draft that the person saw.")],
    request: Annotated[str, Query(min_length=1, max_length=100, description="A UUID: sent twice it counts once.")],
    tiers: Annotated[str, Query(description="JSON: which tier of the file becomes which of the draft, or null.")],
    data: Upload,
) -> EditAnswer:
    """Put tiers of an ELAN document in place of the draft's, as one edit."""
    corpus = review.corpus()
    check_shown(corpus, take)
    key = make_key(person.name, take)
    state = review.drafts.open(key)
    choice = parse_choice(tiers)
    found, _ = read_upload(corpus, take, data, state.n_frames)
    rows = make_rows(corpus, found, choice, state)
    return outcome_message(review.drafts.replace_tiers(key, rows, kind="import", request=request, version=version))
