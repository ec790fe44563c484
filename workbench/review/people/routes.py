"""``/api/session``, ``/api/settings``, ``/api/accounts``."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response

from .... import __version__
from ....errors import ConflictError, InputError
from ..context import Review
from ..server.dependencies import get_lead, get_person, get_review
from ..server.errors import Refusal, refusals
from .accounts import Account, check_free_name, check_name
from .messages import AccountRequest, AccountRow, NameLogin, PasswordRequest, SessionMessage, TokenLogin
from .person import Person
from .sessions import LIFETIME

__all__ = ["router"]

router = APIRouter(tags=["people"])

AReview = Annotated[Review, Depends(get_review)]


@router.post("/api/session", responses=refusals(401, 422, 429, 503))
def log_in(request: Request, response: Response, review: AReview, login: TokenLogin | NameLogin) -> SessionMessage:
    """Log in, by the token in the opened address or by name; the session comes as a cookie."""
    if isinstance(login, TokenLogin):
        secret = review.people.log_in_by_token(login.token)
    else:
        secret = review.people.log_in_by_name(login.person, login.password, _address(request))
    _set_cookie(request, response, review, secret)
    return _describe(review, secret)


@router.get("/api/session", responses=refusals(401, 503))
def get_session(request: Request, review: AReview, person: Annotated[Person, Depends(get_person)]) -> SessionMessage:
    """Return who is logged in."""
    return _describe(review, request.cookies.get(review.cookie, ""))


@router.delete("/api/session", status_code=204, responses=refusals(401, 403, 503))
def log_out(
    request: Request, response: Response, review: AReview, person: Annotated[Person, Depends(get_person)]
) -> None:
    """End the session."""
    review.people.log_out(request.cookies.get(review.cookie, ""))
    response.delete_cookie(review.cookie, httponly=True, samesite="strict", secure=request.url.scheme == "https")


@router.put("/api/password", responses=refusals(401, 403, 409, 413, 422, 429, 503))
def put_password(
    request: Request,
    response: Response,
    review: AReview,
    person: Annotated[Person, Depends(get_person)],
    passwords: PasswordRequest,
) -> SessionMessage:
    """Give oneself another password; all other browsers are logged out, this one has a new session."""
    secret = review.people.change_own_password(person.name, passwords.old, passwords.new, _address(request))
    _set_cookie(request, response, review, secret)
    return _describe(review, secret)


@router.put("/api/settings", responses=refusals(401, 403, 413, 422, 503))
def put_settings(
    settings: dict[str, Any], review: AReview, person: Annotated[Person, Depends(get_person)]
) -> dict[str, Any]:
    """Keep what the person chose, in place of what was there, at most 64 kB."""
    review.people.put_settings(person.name, settings)
    return settings


@router.get("/api/accounts", responses=refusals(401, 403, 503))
def list_accounts(review: AReview, lead: Annotated[Person, Depends(get_lead)]) -> list[AccountRow]:
    """Return all accounts, those that were removed too."""
    return [_to_row(account) for account in review.people.accounts.list()]


@router.post("/api/accounts", responses=refusals(401, 403, 409, 413, 422, 503))
def put_account(request: AccountRequest, review: AReview, lead: Annotated[Person, Depends(get_lead)]) -> AccountRow:
    """Make an account, or change the rights and, unless it is null, the password of one that is there."""
    accounts = review.people.accounts
    name = check_name(request.person)
    if any(one.person == name and one.is_active for one in accounts.list()):
        return _to_row(accounts.change(name, password=request.password, is_lead=request.is_lead))
    if request.password is None:
        raise InputError(f"account {name!r}: a new account needs a password")
    check_free_name(review.corpus(), name)
    return _to_row(accounts.add(name, request.password, is_lead=request.is_lead))


@router.delete("/api/accounts", status_code=204, responses=refusals(401, 403, 404, 409, 422, 503))
def remove_account(
    person: Annotated[str, Query()], review: AReview, lead: Annotated[Person, Depends(get_lead)]
) -> None:
    """Let somebody in no more; their edits stay."""
    if review.people.are_named and person == lead.name:
        raise ConflictError("this is your own account; another lead may remove it")
    review.people.accounts.remove(person)


def _address(request: Request) -> str:
    return request.client.host if request.client else ""


def _set_cookie(request: Request, response: Response, review: Review, secret: str) -> None:
    response.set_cookie(
        review.cookie,
        secret,
        max_age=LIFETIME,
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )


def _describe(review: Review, secret: str) -> SessionMessage:
    session = review.people.find_session(secret)
    if session is None:  # ended meanwhile
        raise Refusal(401, "no-session", "nobody is logged in here")
    corpus = review.corpus()
    return SessionMessage(
        person=session.person.name,
        is_lead=session.person.is_lead,
        named=review.people.are_named,
        csrf=session.csrf,
        corpus=corpus.name,
        snapshot=corpus.snapshot,
        place=review.place,
        version=__version__,
        settings=review.people.settings(session.person.name),
    )


def _to_row(account: Account) -> AccountRow:
    return AccountRow(person=account.person, is_lead=account.is_lead, is_active=account.is_active)
