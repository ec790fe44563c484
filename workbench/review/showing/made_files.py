"""Files of what was computed to be shown, each under the fingerprint of what it was computed from.

They lie in the review's folder and can be deleted at any time: what is missing is computed again.
"""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable, Collection
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import CorpusError

__all__ = ["MadeFiles", "make_key"]


def make_key(**facts: Any) -> str:
    """Return the fingerprint of facts that JSON can hold."""
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


class MadeFiles:
    """A folder of files that are made once, whoever asks at the same time.

    Parameters
    ----------
    folder
        Made when the first file is.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._lock = threading.Lock()
        self._making: dict[str, threading.Lock] = {}

    def find(self, key: str, suffix: str, make: Callable[[Path], object]) -> Path:
        """Return the file of ``key``; ``make`` writes it, under another name first, where it is not there.

        Raises
        ------
        CorpusError
            If the folder cannot be written.
        """
        path = self.folder / f"{key}{suffix}"
        with self._hold(path.name):
            if not path.is_file():
                part = self.folder / f"{key}.part{suffix}"
                try:
                    self.folder.mkdir(parents=True, exist_ok=True)
                    make(part)
                    part.replace(path)
                except OSError as error:
                    raise CorpusError(
                        f"{self.folder}: what is to be shown cannot be kept there ({error.strerror or error}); free "
                        "space or see to the folder"
                    ) from error
                finally:
                    with suppress(OSError):
                        part.unlink(missing_ok=True)
        return path

    def find_array(self, key: str, make: Callable[[], NDArray[np.float32]]) -> NDArray[np.float32]:
        """Return the array of ``key``; where it is not there ``make`` computes it. It need not be kept to be used."""
        path = self.folder / f"{key}.npy"
        with self._hold(path.name):
            with suppress(OSError, ValueError, EOFError):  # not there, or cut off: compute it again
                kept: NDArray[np.float32] = np.load(path, mmap_mode="r", allow_pickle=False)
                return kept
            made = make()
            part = self.folder / f"{key}.part.npy"
            with suppress(OSError):  # a full disk makes it slow, not wrong
                self.folder.mkdir(parents=True, exist_ok=True)
                np.save(part, made, allow_pickle=False)
                part.replace(path)
            with suppress(OSError):
                part.unlink(missing_ok=True)
        return made

    def drop_others(self, keys: Collection[str]) -> int:
        """Delete the files of all other keys, of takes and signers that are gone too; return how many.

        What somebody has asked for in this process stays: it may be of a newer snapshot, and be read this moment.
        """
        dropped = 0
        with self._lock:
            asked = {name.partition(".")[0] for name in self._making}
        for path in self.folder.glob("*"):
            if path.name.partition(".")[0] not in {*keys, *asked}:
                with suppress(OSError):
                    path.unlink()
                    dropped += 1
        return dropped

    def _hold(self, name: str) -> threading.Lock:
        """Return the lock under which a file is made; there are few names, so that they are kept."""
        with self._lock:
            return self._making.setdefault(name, threading.Lock())
