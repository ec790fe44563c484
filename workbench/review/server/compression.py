"""Answers in JSON, compressed.

Only those: numbers as bytes hardly shrink, a part of a video must stay what it is, and the page's own files are kept
compressed already. What holds the session's secrets is left as it is: the length of a compressed answer tells of what
it holds.
"""

from __future__ import annotations

import asyncio
import gzip

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["CompressedJson"]

_SMALLEST = 1_000
_LARGE = 100_000
"""Bytes from which on compressing goes to a thread, so that others need not wait for it."""

_LEVEL = 5


class CompressedJson:
    """Compresses what is JSON and comes in one piece, for whoever takes it."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        takes = scope["type"] == "http" and "gzip" in Headers(scope=scope).get("accept-encoding", "")
        if not takes or scope["path"] == "/api/session":
            await self._app(scope, receive, send)
            return
        start: Message | None = None

        async def send_compressed(message: Message) -> None:
            nonlocal start
            if message["type"] == "http.response.start":
                headers = Headers(raw=message["headers"])
                kind = headers.get("content-type", "")
                if kind.startswith("application/json") and "content-encoding" not in headers:
                    start = message
                else:
                    await send(message)
                return
            if start is not None:
                body = message.get("body", b"")
                headers = MutableHeaders(raw=start["headers"])
                headers.add_vary_header("Accept-Encoding")
                if len(body) >= _SMALLEST and not message.get("more_body", False):
                    packed = await asyncio.to_thread(_compress, body) if len(body) >= _LARGE else _compress(body)
                    headers["Content-Encoding"] = "gzip"
                    headers["Content-Length"] = str(len(packed))
                    message = {**message, "body": packed}
                first, start = start, None
                await send(first)
            await send(message)

        await self._app(scope, receive, send_compressed)


def _compress(body: bytes) -> bytes:
    return gzip.compress(body, _LEVEL)
