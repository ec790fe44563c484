"""A server of the routes that show takes, without sessions: whoever asks is the person that it was made for."""

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
from fastapi import APIRouter, FastAPI
from mimique.workbench.review.context import Review
from mimique.workbench.review.server.dependencies import Person, get_person, get_review
from mimique.workbench.review.server.errors import add_error_handlers


def make_review(corpus_path: Path, folder: Path, **parts: Any) -> Review:
    """Return a review of a corpus with nothing but what its tests need."""
    people = SimpleNamespace(are_named=False)
    review = Review(location=corpus_path, folder=folder, database=None, people=people)  # type: ignore[arg-type]
    review._parts.update(parts)
    return review


class Client:
    """Asks an application in this process; what it does not expect is a 500, as it would be for a browser."""

    def __init__(self, app: FastAPI) -> None:
        self.app = app

    def get(self, path: str, **given: Any) -> httpx.Response:
        return asyncio.run(self._ask("GET", path, given))

    def post(self, path: str, **given: Any) -> httpx.Response:
        return asyncio.run(self._ask("POST", path, given))

    async def _ask(self, method: str, path: str, given: dict[str, Any]) -> httpx.Response:
        transport = httpx.ASGITransport(self.app, raise_app_exceptions=False)
        given["params"] = {key: value for key, value in given.get("params", {}).items() if value is not None}
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
            return await client.request(method, path, **given)


def make_client(review: Review, *routers: APIRouter, person: str = "ab", is_lead: bool = False) -> Client:
    """Return a client of these routes."""
    app = FastAPI()
    app.state.review = review
    add_error_handlers(app)
    for router in routers:
        app.include_router(router)
    app.dependency_overrides[get_review] = lambda: review
    app.dependency_overrides[get_person] = lambda: Person(person, is_lead)
    return Client(app)
