"""Read and write tiers: the suffix of the file decides on the format (ELAN's ``.eaf``, Praat's ``.TextGrid``)."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from ..errors import FileFormatError, InputError, MimiqueError
from .eaf import read_eaf
from .eaf_writing import format_eaf
from .textgrid import format_textgrid, read_textgrid

__all__ = ["TIER_SUFFIXES", "read_tiers", "write_tiers"]

TIER_SUFFIXES = (".eaf", ".textgrid")
"""Suffixes of annotation files, in lower case."""


def read_tiers(path: str | Path, rate: float) -> dict[str, pd.DataFrame]:
    """Read the tiers of an ELAN or Praat file in whole frames.

    Parameters
    ----------
    path
        File with the suffix ``.eaf`` or ``.TextGrid``, in any case.
    rate
        Frames per second of the take that the tiers belong to, > 0.

    Returns
    -------
    dict
        Tier name to a table as :mod:`mimique.corpus.tier_table` describes it, in the file's order. A point becomes a
        one-frame segment of kind "point"; annotations that divide a parent's time share its whole frames, at least
        one each; time slots without a value are interpolated; an unnamed or repeated tier gets a numbered name.

    Raises
    ------
    InputError
        If there is no such file, the suffix is another one, or the rate is not above 0.
    FileFormatError
        If the file is not what its suffix says, or is damaged.
    """
    path = Path(path)
    _check(path, rate)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror or error})") from error
    try:
        if not data:
            raise FileFormatError("the file is empty")
        if path.suffix.lower() == ".eaf":
            return read_eaf(data, float(rate), source=path.name)
        return read_textgrid(data, float(rate))
    except MimiqueError as error:
        raise type(error)(f"{path.name}: {error}") from error


def write_tiers(
    path: str | Path,
    tiers: Mapping[str, pd.DataFrame],
    rate: float,
    *,
    media: str | Path | Sequence[str | Path] = (),
    author: str = "",
) -> None:
    """Write tiers as an ELAN or Praat file; the suffix of ``path`` decides.

    Frames are rounded to milliseconds only here, and read back as the same frames. What a format cannot hold is
    refused; what gets lost in it is a warning. The file is complete or not there.

    Parameters
    ----------
    path
        File to write, ending in ``.eaf`` or ``.TextGrid``.
    tiers
        Tier name to table; ``onset``, ``offset`` and ``label`` are enough.
    rate
        Frames per second, > 0; at most 1000 for an EAF.
    media
        Sound and film files for ELAN to show with it.
    author
        Author of tiers whose ``table.attrs["author"]`` names none; an EAF keeps it as the ANNOTATOR.

    Raises
    ------
    InputError
        If the suffix is another one, the rate or a tier is not valid, or the file cannot be written.
    """
    path = Path(path)
    _check(path, rate)
    if path.suffix.lower() == ".eaf":
        files = [media] if isinstance(media, (str, Path)) else list(media)
        text = format_eaf(tiers, float(rate), media=[Path(file) for file in files], author=author)
    else:
        text = format_textgrid(tiers, float(rate))
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        part.replace(path)
    except (OSError, UnicodeEncodeError) as error:
        part.unlink(missing_ok=True)
        raise InputError(f"{path}: the file cannot be written ({error})") from error


def _check(path: Path, rate: float) -> None:
    if path.suffix.lower() not in TIER_SUFFIXES:
        raise InputError(
            f"{path.name}: expected an annotation file ending in .eaf or .TextGrid, but got {path.suffix!r}"
        )
    if not isinstance(rate, (int, float)) or isinstance(rate, bool) or not math.isfinite(rate) or rate <= 0:
        raise InputError(f"rate: expected frames per second above 0, but got {rate!r}")
