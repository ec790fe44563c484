"""One thread for linear algebra on small matrices.

A few hundred rows are too few to share out: threads that wait for each other at every step make thousands of small
steps slower, and on a busy machine many times slower. threadpoolctl is scikit-learn's own means to limit them.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache

from threadpoolctl import ThreadpoolController

__all__ = ["one_thread"]


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()  # Looks through all loaded libraries: milliseconds, so once.


def one_thread() -> AbstractContextManager:
    """Return a context in which BLAS uses one thread; what was set before comes back after it."""
    return _controller().limit(limits=1, user_api="blas")
