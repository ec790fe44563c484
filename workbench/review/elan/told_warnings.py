"""Warnings of readers and writers as lines for the person who sent or fetched the file."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["told_warnings"]

MOST = 20

_LOCK = threading.Lock()
"""Python keeps one list of warning filters for all threads: who changes and restores it must be alone."""


@contextmanager
def told_warnings() -> Iterator[list[str]]:
    """Collect the warnings of a block as lines, without repetitions, at most :data:`MOST`; the list is filled after it.

    One block runs at a time.
    """
    lines: list[str] = []
    with _LOCK, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield lines
    found = list(dict.fromkeys(" ".join(str(one.message).split()) for one in caught))
    lines += found[:MOST]
    if len(found) > MOST:
        lines.append(f"and {len(found) - MOST} more like these")
