"""The page itself: the files that its build left in ``static/``, served from memory.

Reading them all beforehand (under 3 MB) means that no path of a request ever reaches the file system.
"""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
import threading
from dataclasses import dataclass
from pathlib import Path

from fastapi import APIRouter, Request, Response
from fastapi.responses import PlainTextResponse

from .errors import Refusal

__all__ = ["STATIC_FOLDER", "StaticPage"]

STATIC_FOLDER = Path(__file__).resolve().parent.parent / "static"
"""Where the build of the page puts it."""

_NOT_BUILT = (
    "mimique: the review page is not built in this copy. In a checkout run 'make page'; otherwise install mimique "
    "again without MIMIQUE_SKIP_FRONTEND.\n"
)
_TEXTS = ("text/", "application/javascript", "application/json", "image/svg")


@dataclass(frozen=True)
class _File:
    data: bytes
    packed: bytes | None
    kind: str
    etag: str
    cache: str


class StaticPage:
    """The files of one build.

    Parameters
    ----------
    folder
        Where they are; read again where ``index.html`` has changed.
    """

    def __init__(self, folder: Path = STATIC_FOLDER) -> None:
        self._folder = folder
        self._files: dict[str, _File] = {}
        self._built: int | None = None
        self._lock = threading.Lock()

    @property
    def router(self) -> APIRouter:
        """The route of everything that is not the API's; to be included last."""
        router = APIRouter()
        router.add_api_route("/{path:path}", self.answer, methods=["GET", "HEAD"], include_in_schema=False)
        return router

    def answer(self, request: Request, path: str) -> Response:
        """Answer with a file of the page."""
        files = self._read()
        if not files and path in ("", "index.html"):
            return PlainTextResponse(_NOT_BUILT, status_code=503)
        file = None if path.startswith("api/") else files.get(path or "index.html")
        if file is None:
            raise Refusal(404, "not-found", f"there is nothing at {request.url.path[:200]}")
        headers = {"Cache-Control": file.cache, "ETag": file.etag}
        if file.packed is not None:
            headers["Vary"] = "Accept-Encoding"
        if file.etag in request.headers.get("if-none-match", ""):
            return Response(status_code=304, headers=headers)
        if file.packed is not None and "gzip" in request.headers.get("accept-encoding", ""):
            return Response(file.packed, media_type=file.kind, headers={**headers, "Content-Encoding": "gzip"})
        return Response(file.data, media_type=file.kind, headers=headers)

    def _read(self) -> dict[str, _File]:
        try:
            built = (self._folder / "index.html").stat().st_mtime_ns
        except OSError:
            return {}
        with self._lock:
            if built != self._built:
                paths = [path for path in sorted(self._folder.rglob("*")) if path.is_file()]
                self._files = {path.relative_to(self._folder).as_posix(): _read_file(path) for path in paths}
                self._built = built
            return self._files


def _read_file(path: Path) -> _File:
    data = path.read_bytes()
    # Not asked of the system alone: some have .js as text/plain, which browsers refuse to run.
    known = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".svg": "image/svg+xml"}
    kind = known.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    packed = gzip.compress(data, 6) if kind.startswith(_TEXTS) and len(data) > 500 else None
    # The build puts a hash of the content into the names of all that lies in assets/.
    cache = "public, max-age=31536000, immutable" if path.parent.name == "assets" else "no-cache"
    return _File(data, packed, kind, f'"{hashlib.sha256(data).hexdigest()[:32]}"', cache)
