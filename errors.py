"""Every error that a user of mimique can cause.

::

    MimiqueError
    ├── InputError        (ValueError)   what was given cannot be used: correct it
    │   ├── FileFormatError              a file is not what it claims, or is damaged
    │   └── RigError                     a rig, a marker map and markers that do not fit together
    ├── NotFoundError     (KeyError)     no such take, rig, tier, tag …: choose another name
    ├── ConflictError                    it is there already, or somebody else changed it: decide, then retry
    └── CorpusError       (OSError)      the corpus cannot be opened, locked or written: see to the folder

The tree is by what a handler would do about it. Every message is one line for a person: what is wrong, where
(file, line, marker, frame), what to do.
"""

from __future__ import annotations

__all__ = [
    "ConflictError",
    "CorpusError",
    "FileFormatError",
    "InputError",
    "MimiqueError",
    "NotFoundError",
    "RigError",
]


class MimiqueError(Exception):
    """Root of all errors that a user can cause; its text is one clear line."""

    def __str__(self) -> str:
        """Return the message itself (``KeyError`` would quote it, ``OSError`` would split it)."""
        return " ".join(str(part) for part in self.args)


class InputError(MimiqueError, ValueError):
    """Something that was given cannot be used as it is."""


class FileFormatError(InputError):
    """A file is not what it claims to be, or is damaged."""


class RigError(InputError):
    """A rig, a marker map and a set of markers do not fit together."""


class NotFoundError(MimiqueError, KeyError):
    """A name that the corpus does not know."""


class ConflictError(MimiqueError):
    """Something of that name is there already, or was changed by somebody else."""


class CorpusError(MimiqueError, OSError):
    """The corpus cannot be opened, locked or written."""
