"""TRC files: the text format of marker trajectories (Motion Analysis, OpenSim).

Five header lines (file type; names and values of the trial's properties; marker names, one every three columns;
X1 Y1 Z1 …), then a row a frame: frame number, time, coordinates. Columns are separated by tabs, or all by commas.
A blank cell or NaN in any spelling is a missing coordinate.

Rules where the file says a thing twice:

- ``DataRate`` is the rate. The time column must agree with it to 1 %, give or take half a frame and the rounding of
  its printed digits; a file that disagrees with itself there is refused. The first time stamp is the take's start.
- Frame numbers may begin anywhere and step by any constant; a jump is refused, since the time between is not known.
- The rows count, not ``NumFrames``: where they differ, the take's ``note`` says so. A last row that breaks off is
  refused: the file is cut.
"""

from __future__ import annotations

import math
import os
import warnings
from pathlib import Path

import numpy as np
import xarray as xr

from ..errors import FileFormatError, InputError
from .take import check_take, make_take, select_markers

__all__ = ["read_trc", "write_trc"]

_RATE_TOLERANCE = 0.01


def read_trc(data: bytes, *, unit: str | None = None) -> xr.Dataset:
    """Read a TRC file's bytes as a take.

    Parameters
    ----------
    data
        The whole file.
    unit
        Unit of length, in place of the file's ``Units``.

    Returns
    -------
    xarray.Dataset
        ``first_frame`` is the file's own number of the first row, ``axes`` its note on the axes (``X/Y/Z``).

    Raises
    ------
    FileFormatError
        If the file is not a TRC, is cut off, or a cell or count is wrong; the message names the line.
    InputError
        If the unit is unknown, or names are missing or repeated, or no marker is ever visible.
    """
    text = _decode(data)
    lines = text.splitlines()
    first = lines[0] if lines else ""
    if not first.lstrip("\ufeff").startswith("PathFileType"):
        raise FileFormatError("not a TRC file: it does not begin with PathFileType")
    delimiter = "\t" if "\t" in first else ","
    if len(lines) < 5:
        raise FileFormatError(f"the file is cut off in its header: expected five header lines, but got {len(lines)}")
    cells = [[cell.strip() for cell in line.split(delimiter)] for line in lines[:4]]
    header = dict(zip(cells[1], cells[2], strict=False))
    n_markers = _count(header, "NumMarkers")
    if n_markers == 0:
        raise FileFormatError("line 3: NumMarkers is 0, the file has no markers")
    rate = _rate(header)
    markers = [name for name in cells[3][2:] if name]
    if len(markers) != n_markers:
        raise FileFormatError(f"line 4: expected {n_markers} marker names (NumMarkers), but got {len(markers)}")

    rows, numbers, times = _read_rows(lines, delimiter, n_markers, complete=text.endswith(("\n", "\r")))
    if not rows:
        raise FileFormatError("there are no frames after the header")
    start = _check_times(times, rate)
    _check_frame_numbers(numbers)
    promised = header.get("NumFrames", "")
    differs = promised != str(len(rows))
    axes = cells[0][2].strip("()") if len(cells[0]) > 2 else ""
    return make_take(
        np.array(rows).reshape(len(rows), n_markers, 3),
        markers,
        rate,
        unit=unit if unit is not None else [header.get("Units", "")] * n_markers,
        start=start,
        first_frame=numbers[0],
        axes=axes or None,
        note=f"NumFrames says {promised or 'nothing'}, {len(rows)} rows are there and were read" if differs else None,
    )


def write_trc(path: Path, take: xr.Dataset) -> None:
    """Write the markers of a take as a tab-separated TRC file in mm.

    Every number is written with as many digits as it takes to read the same number again; a missing marker is three
    blank cells. Model outputs have no place in the format: they are left out, with a warning.

    Raises
    ------
    InputError
        If the take is not valid, or has no markers.
    """
    check_take(take)
    markers = select_markers(take)
    n_left_out = take.sizes["marker"] - markers.sizes["marker"]
    if markers.sizes["marker"] == 0:
        raise InputError(f"{path.name}: a TRC file holds markers, but this take has model outputs only")
    if n_left_out:
        warnings.warn(f"{path.name}: {n_left_out} model outputs have no place in a TRC file", stacklevel=2)
    names = [str(name) for name in markers["marker"].values]
    position = markers["position"].transpose("time", "marker", "space").values.astype(np.float64)
    n_frames, n_markers, _ = position.shape
    rate = repr(float(take.attrs["rate"]))
    first = int(take.attrs.get("first_frame", 1))
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{n_frames}\t{n_markers}\tmm\t{rate}\t{first}\t{n_frames}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, n_markers + 1) for axis in "XYZ"),
        "",
    ]
    for index, (time, frame) in enumerate(zip(markers["time"].values, position, strict=True)):
        values = ["" if math.isnan(value) else repr(float(value)) for value in frame.ravel()]
        lines.append("\t".join([str(first + index), repr(float(time)), *values]))
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _decode(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _count(header: dict[str, str], name: str) -> int:
    value = header.get(name, "")
    if not value.isascii() or not value.isdigit() or len(value) > 9:
        raise FileFormatError(f"line 3: expected a count as {name}, but got {value!r}")
    return int(value)


def _rate(header: dict[str, str]) -> float:
    value = header.get("DataRate", "")
    try:
        rate = float(value)
    except ValueError:
        rate = math.nan
    if not math.isfinite(rate) or rate <= 0:
        raise FileFormatError(f"line 3: expected DataRate above 0 Hz, but got {value!r}")
    return rate


def _read_rows(
    lines: list[str], delimiter: str, n_markers: int, *, complete: bool
) -> tuple[list[list[float]], list[int], list[str]]:
    """Read coordinates, frame numbers and time cells of all rows; ``complete`` says that the last line has its end."""
    rows, numbers, times = [], [], []
    width = 3 * n_markers
    for number, line in enumerate(lines[5:], start=6):
        cells = [cell.strip() for cell in line.split(delimiter)]
        if not any(cells):
            continue
        values = cells[2:]
        if any(values[width:]):
            raise FileFormatError(f"line {number}: expected {width} coordinates, but got {len(values)}")
        if len(values) < width and ((number == len(lines) and not complete) or len(values) % 3):
            raise FileFormatError(f"line {number}: the row breaks off after {len(values)} of {width} coordinates")
        try:
            frame = [float(cell) if cell else math.nan for cell in values[:width]]
            numbers.append(_frame_number(cells[0]))
        except ValueError as error:
            raise FileFormatError(f"line {number}: expected numbers or blanks, but {error}") from error
        rows.append(frame + [math.nan] * (width - len(frame)))
        times.append(cells[1] if len(cells) > 1 else "")
    return rows, numbers, times


def _frame_number(cell: str) -> int:
    """Return a frame number; some programs write it as a float."""
    value = float(cell)
    if not value.is_integer():
        raise ValueError(f"{cell!r} is not a whole frame number")
    return int(value)


def _check_times(times: list[str], rate: float) -> float:
    """Return the first time stamp in s, or refuse a time column that contradicts the rate."""
    try:
        values = np.array([float(time) for time in times])
    except ValueError as error:
        raise FileFormatError(f"the time column: expected seconds, but {error}") from error
    if not np.isfinite(values).all():
        raise FileFormatError("the time column: expected finite seconds")
    decimals = min(len(time.partition(".")[2]) if "e" not in time.lower() else 0 for time in times)
    rounding = 10.0**-decimals if any("." in time for time in times) else 1.0
    expected = values[0] + np.arange(len(values)) / rate
    allowed = max(rounding, 0.5 / rate) + _RATE_TOLERANCE * (expected - values[0])
    wrong = np.flatnonzero(np.abs(values - expected) > allowed)
    if wrong.size:
        row = int(wrong[0])
        raise FileFormatError(
            f"DataRate is {rate:g} Hz, but the time column says otherwise: row {row + 1} is at {values[row]:g} s, "
            f"expected {expected[row]:g} s"
        )
    return float(values[0])


def _check_frame_numbers(numbers: list[int]) -> None:
    """Refuse frame numbers that do not step evenly."""
    steps = np.diff(np.array(numbers, dtype=object))
    wrong = [i for i, step in enumerate(steps) if step != steps[0] or step < 1]
    if wrong:
        row = wrong[0]
        raise FileFormatError(
            f"frame numbers jump from {numbers[row]} to {numbers[row + 1]} at row {row + 2}: export without gaps"
        )
