"""One server a corpus: two would each believe to be the only writer of the edits."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from ....errors import CorpusError

__all__ = ["find_last_port", "lock_server", "note_address"]


@contextmanager
def lock_server(folder: Path) -> Iterator[None]:
    """Be the only server of a corpus; the operating system ends the lock with the process, however that ends.

    Parameters
    ----------
    folder
        That of the edits; it is there.

    Raises
    ------
    CorpusError
        If another process serves the corpus; the message says where.
    """
    lock = FileLock(folder / "server.lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise CorpusError(
            f"{folder}: this corpus is already reviewed {_describe(folder)}; go there, or end it"
        ) from None
    except OSError as error:
        raise CorpusError(f"{folder}: cannot be written ({error.strerror or error}); see to its rights") from error
    try:
        yield
    finally:
        lock.release()


def note_address(folder: Path, address: str, port: int) -> None:
    """Write down where the server is, without the token, for whoever starts a second one."""
    facts = {"address": address, "port": port, "pid": os.getpid(), "host": socket.gethostname()}
    with suppress(OSError):  # only a help
        (folder / "server.json").write_text(json.dumps(facts), encoding="utf-8")


def find_last_port(folder: Path) -> int:
    """Return the port of the last server of this corpus, 0 where there was none.

    Taken again, so that pages that are still open find their server, and their own store, after it was started anew.
    """
    with suppress(OSError, ValueError, KeyError, TypeError):
        port = json.loads((folder / "server.json").read_text(encoding="utf-8"))["port"]
        return port if isinstance(port, int) and 1024 <= port <= 65535 else 0
    return 0


def _describe(folder: Path) -> str:
    try:
        facts = json.loads((folder / "server.json").read_text(encoding="utf-8"))
        return f"at {facts['address']} (process {facts['pid']} on {facts['host']})"
    except (OSError, ValueError, KeyError, TypeError):
        return "by another process"
