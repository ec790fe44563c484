"""Running the server until somebody ends it."""

from __future__ import annotations

import logging
import os
import socket
import ssl
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import uvicorn
from fastapi import FastAPI

from ....corpus.store.location import Location, locate
from ....errors import ConflictError, CorpusError, InputError
from ..context import Review, open_review
from .app import create_app
from .guard import name_hosts
from .server_lock import find_last_port, lock_server, note_address

__all__ = ["Serving", "run_server"]

_LOOPBACK = "127.0.0.1"
_ENDED = "mimique: ended; edits that are not published are kept"
_PATIENCE = 1
"""How long answers that are under way may take once the server is to end, in s."""


@dataclass(frozen=True)
class Serving:
    """How a review is to be served."""

    location: Location
    host: str | None = None
    """The address to listen at, for people who log in by name; None: this machine alone, one person, by token."""
    port: int | None = None
    """None: the one of last time if it is free, else any."""
    owner: str = ""
    """Who reviews, where nobody logs in by name."""
    certificate: Path | None = None
    key: Path | None = None
    """For https."""
    names: Collection[str] = ()
    """Further names that the server is known by."""


def run_server(
    serving: Serving,
    *,
    say: Callable[[str], None] = print,
    open_browser: bool = True,
    make_app: Callable[..., FastAPI] = create_app,
) -> None:
    """Serve a review until Ctrl-C or SIGTERM.

    Parameters
    ----------
    serving
        What, where, for whom.
    say
        Told each line for the person at the terminal.
    open_browser
        Whether to open the page; only where it needs no name.
    make_app
        Makes the application of a review and the names of its hosts.

    Raises
    ------
    CorpusError
        If there is no corpus, a newer mimique wrote it, it is reviewed by another process, or the address is taken.
    InputError
        If a certificate cannot be read.
    ConflictError
        If people are to log in by name and there are none.
    """
    location = locate(serving.location)
    named = serving.host is not None
    _check_certificate(serving)
    review = open_review(location, owner=None if named else serving.owner)
    try:
        if named and not any(one.is_active for one in review.people.accounts.list()):
            raise ConflictError(
                f"{location}: with --host people log in by name, and there are none; "
                f"add the first one with 'mimique reviewer add {location} NAME --lead'"
            )
        with lock_server(review.folder), _listen(serving, review.folder) as listener:
            _serve(serving, review, listener, say, open_browser and not named, make_app)
    finally:
        with suppress(CorpusError):
            review.close()
    _leave()


def _serve(
    serving: Serving,
    review: Review,
    listener: socket.socket,
    say: Callable[[str], None],
    open_browser: bool,
    make_app: Callable[..., FastAPI],
) -> None:
    port = listener.getsockname()[1]
    scheme = "https" if serving.certificate else "http"
    host = serving.host or _LOOPBACK
    shown = socket.gethostname() if host in ("0.0.0.0", "::") else host
    address = f"{scheme}://{f'[{shown}]' if ':' in shown else shown}:{port}/"
    note_address(review.folder, address, port)
    page = address if review.people.are_named else f"{address}#token={review.people.token}"
    app = make_app(review, hosts=name_hosts(serving.host, serving.names))
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,  # requests name takes and people
        server_header=False,
        lifespan="on",
        loop="asyncio",
        timeout_graceful_shutdown=_PATIENCE,
        timeout_keep_alive=30,
        proxy_headers=False,  # whoever may reach the server could otherwise say to be somebody else
        ssl_certfile=serving.certificate,
        ssl_keyfile=serving.key,
    )
    server, ended = uvicorn.Server(config), threading.Event()
    watching = threading.Thread(target=_watch, args=(server, review, ended, page, say, open_browser), daemon=True)
    watching.start()
    with suppress(KeyboardInterrupt):  # uvicorn has ended in order by then
        server.run(sockets=[listener])
    ended.set()
    server.should_exit = True
    say(_ENDED)


def _watch(
    server: uvicorn.Server,
    review: Review,
    ended: threading.Event,
    page: str,
    say: Callable[[str], None],
    open_browser: bool,
) -> None:
    """Say where the page is once it answers, and open it; see to it that the end is an end."""
    while not server.started and not server.should_exit:
        ended.wait(0.02)
    if not server.should_exit:
        say(f"mimique: review page at {page}")
        say("mimique: Ctrl-C ends it")
        if open_browser:
            with suppress(webbrowser.Error, OSError):
                webbrowser.open(page)
    while not server.should_exit:
        ended.wait(0.1)
    # That answers were cut off is no news to whoever ended it.
    logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL + 1)
    review.closing.set()
    if not ended.wait(_PATIENCE + 0.5):
        say(_ENDED)
        _exit()


def _leave() -> None:
    """End the process where routes still compute: Python would wait for their threads."""
    until = time.monotonic() + 0.3
    while any(one for one in threading.enumerate() if not one.daemon and one is not threading.current_thread()):
        if time.monotonic() > until:
            _exit()
        time.sleep(0.01)


def _exit() -> None:
    # Whatever is written is written whole or not at all: edits and commits are transactions.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def _listen(serving: Serving, folder: Path) -> socket.socket:
    host = serving.host or _LOOPBACK
    ports = [serving.port] if serving.port is not None else [find_last_port(folder), 0]
    for port in dict.fromkeys(ports):
        try:
            family, kind, _, _, place = socket.getaddrinfo(
                host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
            )[0]
            # asyncio sends small answers at once (TCP_NODELAY) only where it knows the protocol; else each waits 40 ms.
            listener = socket.socket(family, kind, socket.IPPROTO_TCP)
        except (OSError, UnicodeError) as error:
            raise CorpusError(
                f"--host {host}: no such address ({getattr(error, 'strerror', None) or error})"
            ) from error
        try:
            if os.name == "posix":  # elsewhere it would let two processes have the same port
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(place)
            listener.listen(128)
            return listener
        except (OSError, OverflowError) as error:
            listener.close()
            problem = getattr(error, "strerror", None) or error
    raise CorpusError(f"{host}, port {ports[0]}: cannot be listened at ({problem}); choose another with --port")


def _check_certificate(serving: Serving) -> None:
    if serving.certificate is None:
        if serving.key is not None:
            raise InputError("--key: belongs to a certificate; give --certificate as well")
        return
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(serving.certificate, serving.key)
    except (OSError, ssl.SSLError) as error:
        problem = getattr(error, "strerror", None) or error
        raise InputError(f"{serving.certificate}: cannot be used as a certificate with its key ({problem})") from error
