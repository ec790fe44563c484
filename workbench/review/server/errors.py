"""Refusals: every answer that is no success has one JSON shape, whatever raised it.

``{"error": {"kind": "conflict", "message": "one line for a person"}}``. The kind says what a page does about it. It
follows from the class of a :class:`~mimique.errors.MimiqueError`; an error with attributes ``status`` and ``kind`` of
its own, as :class:`Refusal` has, says them itself.
"""

from __future__ import annotations

import logging
import sqlite3
from http import HTTPStatus
from typing import Any, Literal

import icechunk
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from starlette.exceptions import HTTPException

from ....corpus.store.locking import describe_error
from ....errors import ConflictError, CorpusError, InputError, MimiqueError, NotFoundError

__all__ = ["ErrorMessage", "Kind", "Refusal", "add_error_handlers", "describe_refusal", "refusals", "refuse"]

Kind = Literal[
    "input",
    "not-found",
    "conflict",
    "stale",
    "corpus",
    "no-session",
    "forbidden",
    "csrf",
    "too-large",
    "too-many",
    "not-saved",
    "take-gone",
    "no-weights",
    "server",
]


class ErrorBody(BaseModel):
    """What is wrong."""

    kind: Kind
    message: str


class ErrorMessage(BaseModel):
    """The answer to whatever was refused."""

    error: ErrorBody


class Refusal(MimiqueError):  # noqa: N818  (not an error of the program: an answer)
    """An answer with a status and a kind of its own.

    ::

        raise Refusal(409, "stale", "the draft has changed; it is fetched again")
    """

    def __init__(self, status: int, kind: Kind, message: str, headers: dict[str, str] | None = None) -> None:
        super().__init__(message)
        self.status = status
        self.kind = kind
        self.headers = headers


_log = logging.getLogger(__name__)

_BY_CLASS: tuple[tuple[type[BaseException], int, Kind], ...] = (
    (NotFoundError, 404, "not-found"),
    (ConflictError, 409, "conflict"),
    (CorpusError, 503, "corpus"),
    (InputError, 422, "input"),
    (MimiqueError, 422, "input"),
)
_BY_STATUS: dict[int, Kind] = {
    400: "input",
    401: "no-session",
    403: "forbidden",
    404: "not-found",
    405: "input",
    409: "conflict",
    413: "too-large",
    415: "input",
    416: "input",
    422: "input",
    429: "too-many",
    503: "corpus",
}


def refusals(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the ``responses=`` of a route that may refuse with these statuses.

    ::

        @router.get("/api/draft", responses=refusals(401, 403, 404, 422, 503))
    """
    return {
        status: {"model": ErrorMessage, "description": HTTPStatus(status).phrase} for status in sorted(set(statuses))
    }


def describe_refusal(error: MimiqueError) -> tuple[int, Kind]:
    """Return the status and the kind of an error that a user can cause."""
    status, kind = next((status, kind) for of, status, kind in _BY_CLASS if isinstance(error, of))
    return getattr(error, "status", status), getattr(error, "kind", kind)


def refuse(status: int, kind: Kind, message: str, headers: dict[str, str] | None = None) -> JSONResponse:
    """Return the answer itself, for code outside of the routes."""
    # Lone surrogates, as odd names may hold, have no UTF-8.
    line = " ".join(message.split()).encode("utf-8", "replace").decode()
    return JSONResponse({"error": {"kind": kind, "message": line}}, status_code=status, headers=headers)


def add_error_handlers(app: FastAPI) -> None:
    """Give every refusal of ``app`` the one shape."""

    @app.exception_handler(MimiqueError)
    def _(request: Request, error: MimiqueError) -> JSONResponse:
        status, kind = describe_refusal(error)
        review = request.app.state.review
        message = review.without_places(str(error))
        if message != str(error):
            _log.warning("%s", error)  # for whoever sees to the server
        return refuse(status, kind, message, getattr(error, "headers", None))

    @app.exception_handler(RequestValidationError)
    def _(request: Request, error: RequestValidationError) -> JSONResponse:
        return refuse(422, "input", _describe_validation(error))

    @app.exception_handler(HTTPException)
    def _(request: Request, error: HTTPException) -> JSONResponse:
        kind = _BY_STATUS.get(error.status_code, "server" if error.status_code >= 500 else "input")
        return refuse(error.status_code, kind, str(error.detail), dict(error.headers or {}))

    @app.exception_handler(sqlite3.Error)
    def _(request: Request, error: sqlite3.Error) -> JSONResponse:
        return refuse(503, "not-saved", f"the edits' database answers: {error}; free space or see to its folder")

    @app.exception_handler(icechunk.IcechunkError)
    def _(request: Request, error: icechunk.IcechunkError) -> JSONResponse:
        return refuse(503, "corpus", f"the corpus cannot be read: {describe_error(error)}")

    @app.exception_handler(UnicodeError)
    def _(request: Request, error: UnicodeError) -> JSONResponse:
        return refuse(422, "input", f"a text of the request is no Unicode: {error}")

    @app.exception_handler(OverflowError)
    def _(request: Request, error: OverflowError) -> JSONResponse:
        return refuse(422, "input", f"a number of the request is too large: {error}")


def _describe_validation(error: RequestValidationError) -> str:
    """Return the first problem in one line, where it is and what was expected."""
    problems = error.errors()
    if not problems:
        return "the request does not have the expected form"
    first = problems[0]
    place = ".".join(str(part) for part in first.get("loc", ())) or "request"
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return f"{place}: {first.get('msg', 'not as expected')}{more}"[:500]
