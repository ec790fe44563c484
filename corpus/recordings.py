"""Read and write recordings: the suffix of the file decides on the format."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

from ..errors import FileFormatError, InputError, MimiqueError
from .c3d import read_c3d, write_c3d
from .take import POSITION_KINDS, check_take
from .trc import read_trc, write_trc

__all__ = ["RECORDING_SUFFIXES", "read_take", "write_take"]

_FARTHEST = 1e6  # mm

_READERS = {".c3d": read_c3d, ".trc": read_trc}
_WRITERS = {".c3d": write_c3d, ".trc": write_trc}

RECORDING_SUFFIXES = tuple(_READERS)
"""Suffixes of recordings, in lower case."""


def read_take(path: str | Path, *, unit: str | None = None) -> xr.Dataset:
    """Read a C3D or TRC file as a take: mm, seconds, NaN where a marker is missing.

    Parameters
    ----------
    path
        File with the suffix ``.c3d`` or ``.trc``, in any case.
    unit
        Unit of length (mm, cm, m, in …), in place of the one that the file states.

    Returns
    -------
    xarray.Dataset
        As :mod:`mimique.corpus.take` describes it. Attributes: ``rate`` (Hz), ``source_file`` (its name),
        ``source_sha256`` (of its bytes), ``source_unit`` and what the format notes (first frame, axes).

    Raises
    ------
    InputError
        If there is no such file, the suffix is another one, the unit is unknown, markers are unnamed or repeated,
        or all of them are missing all the time.
    FileFormatError
        If the file is not what its suffix says, or is damaged or cut off, or places a marker beyond a kilometre.
    """
    path = Path(path)
    reader = _choose(_READERS, path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror or error})") from error
    if not data:
        raise FileFormatError(f"{path.name}: the file is empty")
    try:
        take = reader(data, unit=unit)
    except MimiqueError as error:
        message = str(error).removeprefix("take: ")
        raise type(error)(f"{path.name}: {message}") from error
    _check_extent(take, path.name)
    take.attrs |= {"source_file": path.name, "source_sha256": hashlib.sha256(data).hexdigest()}
    return take


def write_take(path: str | Path, take: xr.Dataset) -> None:
    """Write a take as a C3D or TRC file; the suffix of ``path`` decides.

    A C3D keeps model outputs and rounds to 4-byte floats; a TRC keeps every digit and the start time, and leaves model
    outputs out with a warning. The file is complete or not there.

    Raises
    ------
    InputError
        If the suffix is another one, the folder cannot be written, or the take is not valid or does not fit.
    """
    path = Path(path)
    writer = _choose(_WRITERS, path)
    check_take(take)
    try:
        writer(path, take)
    except OSError as error:
        if isinstance(error, MimiqueError):
            raise
        raise InputError(f"{path}: the file cannot be written ({error.strerror or error})") from error


def _check_extent(take: xr.Dataset, name: str) -> None:
    """Refuse positions that no capture volume holds: a damaged file, or a wrong unit."""
    is_position = np.isin(take["kind"].values, POSITION_KINDS)
    far = np.abs(take["position"].values[:, is_position]) > _FARTHEST
    if far.any():
        frame, marker, _ = (int(i) for i in np.argwhere(far)[0])
        marker_name = take["marker"].values[is_position][marker]
        raise FileFormatError(
            f"{name}: marker {str(marker_name)!r} is more than a kilometre away in frame {frame}: the file is damaged, "
            "or its unit is wrong (name the right one with unit=)"
        )


def _choose(table: dict[str, Callable], path: Path) -> Callable:
    """Return the entry for the file's suffix, or say which suffixes there are."""
    try:
        return table[path.suffix.lower()]
    except KeyError:
        known = " or ".join(RECORDING_SUFFIXES)
        raise InputError(f"{path.name}: expected a recording ending in {known}, but got {path.suffix!r}") from None
