"""What a route asks for: the review, who is asking, that they are a lead.

::

    @router.get("/api/thing")
    def get_thing(
        review: Annotated[Review, Depends(get_review)], person: Annotated[Person, Depends(get_person)]
    ) -> Thing: ...

Tests put others in their place: ``app.dependency_overrides[get_person] = lambda: Person("ab", True)``.
"""

from __future__ import annotations

import hmac
from typing import Annotated
from urllib.parse import unquote

from fastapi import Depends, Request

from ..context import Review
from ..people.person import Person
from .errors import Refusal

__all__ = ["CSRF_HEADER", "PERSON_HEADER", "Person", "get_lead", "get_person", "get_review"]

CSRF_HEADER = "X-Mimique-CSRF"
"""What a page of another site cannot send along with the cookie."""

PERSON_HEADER = "X-Mimique-Person"
"""For whom a page was opened, percent-encoded; a page that does not say so is that of who is logged in."""

_READING = ("GET", "HEAD", "OPTIONS")


async def get_review(request: Request) -> Review:
    """Return what the server serves.

    Asynchronous, as :func:`get_lead`, since it waits for nothing: another thread for it would cost each request more
    than all that the guard does.
    """
    review: Review = request.app.state.review
    return review


def get_person(request: Request, review: Annotated[Review, Depends(get_review)]) -> Person:
    """Return who is asking.

    Raises
    ------
    Refusal
        401 without a valid session, or where the page was opened by somebody else than who is logged in by now; 403
        where something is to be changed without the session's CSRF token.
    """
    session = review.people.find_session(request.cookies.get(review.cookie, ""))
    if session is None:
        raise Refusal(401, "no-session", "nobody is logged in here; open the address that mimique printed, or log in")
    # All tabs share one cookie: who logs in in one of them must not become the author of what another tab sends.
    opened_by = request.headers.get(PERSON_HEADER)
    if opened_by is not None and unquote(opened_by) != session.person.name:
        raise Refusal(401, "no-session", "somebody else is logged in in this browser by now; log in again")
    given = request.headers.get(CSRF_HEADER, "")
    if request.method not in _READING and not hmac.compare_digest(given.encode(), session.csrf.encode()):
        raise Refusal(403, "csrf", f"the header {CSRF_HEADER} is not that of the session; reload the page")
    return session.person


async def get_lead(person: Annotated[Person, Depends(get_person)]) -> Person:
    """Return who is asking, if it is a lead.

    Raises
    ------
    Refusal
        403 otherwise.
    """
    if not person.is_lead:
        raise Refusal(403, "forbidden", f"{person.name} is not a lead; only leads may do this")
    return person
