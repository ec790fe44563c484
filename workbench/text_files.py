"""Text files that people asked for: whole, or not there."""

from __future__ import annotations

import tempfile
from pathlib import Path

from ..errors import InputError


def write_text(path: Path, text: str) -> None:
    """Write a text file (UTF-8); an older one of that name stays until the new one is complete.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    part: str | None = None
    try:
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", newline="\n", dir=path.parent, prefix=f".{path.name}-", delete=False
        ) as file:
            part = file.name
            file.write(text)
        Path(part).chmod(0o644)
        Path(part).replace(path)
    except OSError as error:
        if part is not None:
            Path(part).unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from error
