"""Files and folders that are complete or not there: written beside their place, then moved to it."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError, MimiqueError


@contextmanager
def partial_file(path: Path) -> Iterator[Path]:
    """Give a path with the same suffix to write to; it becomes ``path`` when the block ends well.

    An older file of that name stays until then, and nothing is left behind when the block fails.

    Raises
    ------
    InputError
        If the folder is not there, the path is a folder, or the system does not let the file be written.
    """
    _check_folder(path)
    if path.is_dir():
        raise InputError(f"{path}: there is a folder of that name; choose another name for the file")
    with _explained(path):
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name[:80]}-") as folder:
            part = Path(folder) / f"part{path.suffix}"
            yield part
            part.chmod(0o644)
            part.replace(path)


@contextmanager
def partial_folder(path: Path) -> Iterator[Path]:
    """Give an empty folder to write to; it becomes ``path``, which must be new or empty, when the block ends well.

    Raises
    ------
    InputError
        If the folder above is not there, there is something in ``path`` already, or nothing can be written.
    """
    _check_folder(path)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise InputError(f"{path}: expected a new or an empty folder, but there is something already")
    with _explained(path):
        part = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name[:80]}-"))
        try:
            yield part
            part.chmod(0o755)
            part.replace(path)
        except BaseException:
            shutil.rmtree(part, ignore_errors=True)
            raise


def _check_folder(path: Path) -> None:
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}; make it first")


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if isinstance(error, MimiqueError):
            raise
        raise InputError(f"{path}: it cannot be written ({error.strerror or error}); nothing was left there") from error
