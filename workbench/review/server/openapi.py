"""The description of the API: what FastAPI knows of the routes, and what stands before all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fastapi import APIRouter, FastAPI
from fastapi.dependencies.models import Dependant
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute

from .dependencies import CSRF_HEADER, get_lead, get_person
from .errors import ErrorMessage

__all__ = ["describe_api"]

_CHANGING = ("post", "put", "patch", "delete")


def describe_api(app: FastAPI, routers: Sequence[APIRouter], cookie: str) -> dict[str, Any]:
    """Return the OpenAPI description of ``app``.

    FastAPI's own, with what it cannot know: the refusals of :mod:`.guard` (403, 413), of a body that is no JSON (400)
    and of a request that is not as described (422, in the shape of all refusals); and who needs a session.

    Parameters
    ----------
    app
        The application.
    routers
        What it includes.
    cookie
        The name of the session's cookie.
    """
    described = get_openapi(title=app.title, version=app.version, routes=app.routes, description=app.description)
    components = described.setdefault("components", {})
    schemas = components.setdefault("schemas", {})
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)
    error = ErrorMessage.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas.update(error.pop("$defs", {}))
    schemas["ErrorMessage"] = error
    components["securitySchemes"] = {
        "session": {"type": "apiKey", "in": "cookie", "name": cookie},
        "csrf": {"type": "apiKey", "in": "header", "name": CSRF_HEADER},
    }
    needy = _list_needy(routers)
    for path, operations in described["paths"].items():
        for method, operation in operations.items():
            refused = {"403": "Forbidden"}
            if "requestBody" in operation:
                refused |= {"400": "Bad Request", "413": "Content Too Large"}
            if "requestBody" in operation or "parameters" in operation:
                refused["422"] = "Unprocessable Content"
            if (path, method) in needy:
                refused["401"] = "Unauthorized"
                operation["security"] = [{"session": [], "csrf": []} if method in _CHANGING else {"session": []}]
            responses = operation["responses"]
            for status in refused.keys() | {status for status in responses if status[0] in "45"}:
                # FastAPI gives them the media type of the route's success.
                text = refused.get(status) or responses[status]["description"]
                content = {"application/json": {"schema": {"$ref": "#/components/schemas/ErrorMessage"}}}
                responses[status] = {"description": text, "content": content}
            operation["responses"] = dict(sorted(responses.items()))
    return described


def _list_needy(routers: Sequence[APIRouter]) -> set[tuple[str, str]]:
    """Return path and method of every route that asks for a person."""
    routes = [route for router in routers for route in router.routes if isinstance(route, APIRoute)]
    return {
        (route.path_format, method.lower())
        for route in routes
        if _needs_person(route.dependant)
        for method in route.methods or ()
    }


def _needs_person(dependant: Dependant) -> bool:
    return dependant.call in (get_person, get_lead) or any(map(_needs_person, dependant.dependencies))
