"""What every request goes through before a route sees it, and every answer before the browser does.

- *Host*: only names that this server is known by. Otherwise a foreign page could have its own name resolve to this
  address and then read everything as if it were its own ("DNS rebinding").
- *Origin*: what changes something must come from a page of this server, where the browser says where it comes from.
- *Size*: a body is at most so large, whether or not it says so beforehand.
- *Headers*: a content security policy without exceptions for inline code, nothing kept of answers of the API.
- *Failures*: what no route expected becomes an answer of the usual shape; the traceback goes to the log.
"""

from __future__ import annotations

import ipaddress
import logging
import socket
from collections.abc import Collection, Mapping
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .errors import refuse

__all__ = ["BODY_LIMIT", "SECURITY_HEADERS", "UPLOAD_LIMIT", "Guard", "name_hosts"]

BODY_LIMIT = 1_000_000
"""Bytes of a request's body."""

UPLOAD_LIMIT = 20_000_000
"""Bytes of a file that is uploaded."""

SECURITY_HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
        "connect-src 'self' blob:; media-src 'self' blob:; worker-src 'self' blob:; object-src 'none'; "
        "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": (
        "accelerometer=(), camera=(), display-capture=(), geolocation=(), gyroscope=(), magnetometer=(), "
        "microphone=(), midi=(), payment=(), usb=()"
    ),
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}

_READING = ("GET", "HEAD", "OPTIONS")
_log = logging.getLogger(__name__)


class _TooLargeError(Exception):
    """The body goes on beyond what is taken."""


class _Exchange:
    """One request's body counted, and its answer given headers."""

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._path: str = scope["path"]
        self._receive = receive
        self._send = send
        self.limit = UPLOAD_LIMIT
        self.has_started = False
        self.is_too_large = False
        self._taken = 0

    async def receive(self) -> Message:
        """Return the next piece of the body, as long as it is not too large."""
        message = await self._receive()
        if message["type"] == "http.request":
            self._taken += len(message.get("body", b""))
            if self._taken > self.limit:
                self.is_too_large = True
                raise _TooLargeError
        return message

    async def send(self, message: Message) -> None:
        """Send a piece of the route's answer, unless it is what it makes of a body that was cut off."""
        if self.has_started or not self.is_too_large:
            await self.answer(message)

    async def answer(self, message: Message) -> None:
        """Send a piece of an answer."""
        if message["type"] == "http.response.start":
            self.has_started = True
            _add_headers(MutableHeaders(scope=message), self._path)
        await self._send(message)


class Guard:
    """The outermost layer of the server.

    Parameters
    ----------
    app
        What it guards.
    hosts
        Names that the server answers to, in small letters; IP addresses are always right, since they are nobody's name.
    upload_paths
        Beginnings of paths that take :data:`UPLOAD_LIMIT` bytes instead of :data:`BODY_LIMIT`.
    """

    def __init__(self, app: ASGIApp, hosts: Collection[str] = (), upload_paths: tuple[str, ...] = ()) -> None:
        self._app = app
        self._hosts = frozenset(hosts)
        self._upload_paths = upload_paths

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        exchange = _Exchange(scope, receive, send)
        if not any(map(scope["path"].startswith, self._upload_paths)):
            exchange.limit = BODY_LIMIT
        headers = Headers(scope=scope)
        if problem := self._find_problem(scope["method"], headers):
            await refuse(403, "forbidden", problem)(scope, receive, exchange.answer)
            return
        exchange.is_too_large = _read_length(headers) > exchange.limit
        if not exchange.is_too_large:
            await self._ask(exchange, scope)
        if exchange.is_too_large and not exchange.has_started:
            text = f"the request is larger than {exchange.limit // 1_000_000} MB; send less at once"
            await refuse(413, "too-large", text)(scope, receive, exchange.answer)

    async def _ask(self, exchange: _Exchange, scope: Scope) -> None:
        try:
            await self._app(scope, exchange.receive, exchange.send)
        except Exception as error:
            if exchange.is_too_large:
                return
            _log.exception("%s %s", scope["method"], scope["path"])
            if exchange.has_started:
                raise
            text = f"the server failed ({type(error).__name__}); its window says more"
            await refuse(500, "server", text)(scope, exchange.receive, exchange.answer)

    def _find_problem(self, method: str, headers: Headers) -> str | None:
        host = headers.get("host", "")
        name = _host_name(host)
        if name is None or not (name in self._hosts or _is_address(name)):
            return f"this server is not called {host[:200]!r}; open the address that mimique printed"
        origin = headers.get("origin")
        if method not in _READING and origin is not None and _find_netloc(origin) != host.lower():
            return f"a page of {origin[:200]!r} may not change anything here"
        # "same-site" is another port or another name of the same machine or domain: not this page either.
        is_foreign = headers.get("sec-fetch-site") in ("cross-site", "same-site")
        if is_foreign and headers.get("sec-fetch-mode") != "navigate":
            return "a page of another site may not ask this server"
        return None


def name_hosts(host: str | None, also: Collection[str] = ()) -> set[str]:
    """Return the names that a server is known by, in small letters.

    Parameters
    ----------
    host
        The address it listens at; None for this machine alone.
    also
        Further names, as a proxy's.
    """
    names = {"localhost", *also}
    if host is not None:
        names |= {host, socket.gethostname(), socket.getfqdn()}
    return {name.lower().rstrip(".") for name in names if name}


def _find_netloc(origin: str) -> str | None:
    """Return host and port of an origin in small letters, None where it has none (``null``)."""
    try:
        return urlsplit(origin).netloc.lower() or None
    except ValueError:
        return None


def _host_name(host: str) -> str | None:
    """Return the name in a Host header: without port, in small letters."""
    try:
        return (urlsplit(f"//{host}").hostname or "").rstrip(".") or None
    except ValueError:
        return None


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _read_length(headers: Headers) -> int:
    """Return what the request says of its length; that of what comes in pieces is counted on the way."""
    length = headers.get("content-length", "0")
    return int(length[:20]) if length.isascii() and length.isdigit() else 0


def _add_headers(headers: MutableHeaders, path: str) -> None:
    for name, value in SECURITY_HEADERS.items():
        headers[name] = value
    if path.startswith("/api"):
        headers.setdefault("Cache-Control", "no-store")
