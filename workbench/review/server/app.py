"""The web application: all routes of the review, and the page."""

from __future__ import annotations

import importlib
import threading
from collections.abc import AsyncIterator, Collection
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from fastapi import FastAPI

from .... import __version__
from ..context import PACKAGES, Review
from ..showing.showing import warm
from .compression import CompressedJson
from .corpus_routes import router as corpus_router
from .errors import add_error_handlers
from .guard import Guard, name_hosts
from .openapi import describe_api
from .static_page import STATIC_FOLDER, StaticPage

__all__ = ["create_app"]

_UPLOADS = ("/api/elan/",)


def create_app(review: Review, *, hosts: Collection[str] = (), static_folder: Path = STATIC_FOLDER) -> FastAPI:
    """Make the application that serves one review.

    Parameters
    ----------
    review
        What it serves; closed when the server ends.
    hosts
        Names that the server is known by, besides ``localhost`` and its IP addresses.
    static_folder
        Where the page was built.
    """

    @asynccontextmanager
    async def live(app: FastAPI) -> AsyncIterator[None]:
        # The rigs' files are made before somebody asks for one.
        threading.Thread(target=warm, args=(review,), daemon=True).start()
        yield
        review.closing.set()

    app = FastAPI(
        title="mimique review",
        version=__version__,
        description="What the review page asks of its server.",
        openapi_url="/api/openapi.json",
        # These two pages would fetch their scripts from elsewhere.
        docs_url=None,
        redoc_url=None,
        lifespan=live,
    )
    app.state.review = review
    add_error_handlers(app)
    modules = [importlib.import_module(f"..{package}.routes", __package__) for package in PACKAGES]
    routers = [corpus_router, *(module.router for module in modules)]
    for router in routers:
        app.include_router(router)
    app.include_router(StaticPage(static_folder).router)
    app.add_middleware(CompressedJson)
    app.add_middleware(Guard, hosts=name_hosts(None) | set(hosts), upload_paths=_UPLOADS)

    def describe() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = describe_api(app, routers, review.cookie)
        return app.openapi_schema

    app.openapi = describe  # type: ignore[method-assign]
    return app
