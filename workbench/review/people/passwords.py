"""Passwords: kept as Argon2id hashes, with the parameters that RFC 9106 recommends for little memory."""

from __future__ import annotations

import threading
import unicodedata

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from ....errors import InputError

__all__ = ["SHORTEST", "check_password_form", "hash_password", "is_outdated", "verify_password"]

SHORTEST = 10
"""Characters that a password has at least."""

_LONGEST = 1024
_hasher = PasswordHasher()
# Each hash takes 64 MB; a crowd at the login page must not take all of the machine's memory.
_at_once = threading.BoundedSemaphore(2)
_nobody: list[str] = []


def hash_password(password: str) -> str:
    """Return what is kept of a password.

    Raises
    ------
    InputError
        If it is shorter than :data:`SHORTEST` characters, or longer than 1024.
    """
    check_password_form(password)
    with _at_once:
        return _hasher.hash(_encode(password))


def check_password_form(password: str) -> None:
    """Refuse what cannot be a password; raises as :func:`hash_password`."""
    if not SHORTEST <= len(password) <= _LONGEST:
        raise InputError(f"password: expected {SHORTEST} to {_LONGEST} characters, but got {len(password)}")


def verify_password(kept: str | None, password: str) -> bool:
    """Return whether it is the password that was kept.

    Where nothing was kept (nobody of that name) it takes as long to say no, so that names cannot be found out by it.
    """
    with _at_once:
        if kept is None and not _nobody:
            _nobody.append(_hasher.hash("nobody"))
        try:
            return (
                _hasher.verify(_nobody[0] if kept is None else kept, _encode(password[:_LONGEST])) and kept is not None
            )
        except (VerificationError, InvalidHashError):
            return False


def is_outdated(kept: str) -> bool:
    """Return whether it should be hashed again, with the parameters of today."""
    return _hasher.check_needs_rehash(kept)


def _encode(password: str) -> bytes:
    """Return its bytes: an é that one keyboard sends as one character and another as two is the same."""
    return unicodedata.normalize("NFC", password).encode("utf-8", "surrogatepass")
