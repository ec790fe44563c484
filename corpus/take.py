"""A take: one recorded sequence of one signer, as an :class:`xarray.Dataset`.

::

    position (time, marker, space)   float64; mm for markers; NaN where a marker is missing
    time (time)                      s, evenly spaced by 1 / rate; frame i is at time[i]
    marker (marker)                  names, unique, in the file's order
    space (space)                    x y z
    kind (marker)                    "marker", or what a model computed: "angle", "force", "moment", "power" …
    unit (marker)                    "mm" for markers; a model output keeps its own unit
    attributes                       rate (Hz); where known source_file, source_sha256, source_unit, signer, protocol

The axes stay as they were recorded; what the file says of them is noted in the attributes (``x_screen``,
``y_screen`` of a C3D: the directions that the recording program drew to the right and upwards).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from ..arrays import check_array
from ..errors import InputError
from .formats.units import MILLIMETRES, parse_length_unit

__all__ = [
    "POSITION_KINDS",
    "check_take",
    "from_movement",
    "make_bare_take",
    "make_take",
    "select_markers",
    "to_movement",
]

SPACE = ["x", "y", "z"]

POSITION_KINDS = ("marker", "modelled")
"""Kinds whose values are positions, so in mm: tracked points, and points that a model computed from them."""

_TIME_TOLERANCE = 0.01
"""How far, in frames, a time stamp may lie from its even place."""


def make_take(
    position: ArrayLike,
    markers: Sequence[str],
    rate: float,
    *,
    kind: str | Sequence[str] | None = None,
    unit: str | Sequence[str] | None = None,
    start: float = 0.0,
    without_markers: bool = False,
    **attributes: Any,
) -> xr.Dataset:
    """Build a take from an array of positions.

    Parameters
    ----------
    position
        (n_frames, n_markers, 3), NaN where a marker is missing. A point that lacks one coordinate, or has an
        infinite one, lacks all three in the take.
    markers
        Names, unique and not empty.
    rate
        Frames per second, > 0.
    kind
        One for all or one a marker; "marker" unless given.
    unit
        What ``position`` is given in: one for all positions, or one a marker; mm unless given. Positions are
        converted to mm; a model output keeps its values, and its unit where one a marker is given.
    start
        Time of the first frame in s.
    **attributes
        Further attributes of the take (``signer``, ``protocol``, ``source_file`` …); ``None`` leaves one out.

    Returns
    -------
    xarray.Dataset
        A take that :func:`check_take` accepts.

    Raises
    ------
    InputError
        If the shapes do not fit, a unit is unknown, or :func:`check_take` finds a fault.
    """
    points = check_array(position, name="position", shape=(None, len(markers), 3)).copy()
    n_frames, n_markers, _ = points.shape
    kinds = [kind or "marker"] * n_markers if kind is None or isinstance(kind, str) else [str(k) for k in kind]
    if len(kinds) != n_markers:
        raise InputError(f"kind: expected one for each of {n_markers} markers, but got {len(kinds)}")
    if unit is None or isinstance(unit, str):
        units = [(unit or "mm") if k in POSITION_KINDS else "" for k in kinds]
    else:
        units = [str(u) for u in unit]
    if len(units) != n_markers:
        raise InputError(f"unit: expected one for each of {n_markers} markers, but got {len(units)}")

    is_position = np.array([k in POSITION_KINDS for k in kinds], dtype=bool)
    source_units = []
    factors = np.ones(n_markers)
    for index in map(int, np.flatnonzero(is_position)):
        name = parse_length_unit(units[index], where=f"marker {markers[index]!r}")
        factors[index] = MILLIMETRES[name]
        units[index] = "mm"
        source_units.append(name)
    if (factors != 1).any():
        with np.errstate(over="ignore", invalid="ignore"):  # infinite or no number: missing either way
            points *= factors[:, None]
    finite = np.isfinite(points)
    points[~(finite[..., 0] & finite[..., 1] & finite[..., 2])] = np.nan

    rate = _number(rate, "rate")
    with np.errstate(over="ignore", invalid="ignore"):  # a rate near 0: check_take refuses what is not even
        time = start + np.arange(n_frames) / rate if rate > 0 else np.zeros(n_frames)
    if source_units:
        attributes.setdefault("source_unit", " ".join(dict.fromkeys(source_units)))
    take = xr.Dataset(
        {"position": (("time", "marker", "space"), points, {"units": "mm"})},
        coords={
            "time": ("time", time, {"units": "s"}),
            "marker": ("marker", np.asarray([str(m) for m in markers], dtype=str)),
            "space": ("space", np.asarray(SPACE)),
            "kind": ("marker", np.asarray(kinds, dtype=str)),
            "unit": ("marker", np.asarray(units, dtype=str)),
        },
        attrs={"rate": rate, **{k: v for k, v in attributes.items() if v is not None}},
    )
    check_take(take, without_markers=without_markers)
    return take


def make_bare_take(n_frames: int, rate: float, *, start: float = 0.0, **attributes: Any) -> xr.Dataset:
    """Return a take without markers, for a performance of which only the weights are known.

    Parameters
    ----------
    n_frames, rate, start, attributes
        As of :func:`make_take`.

    Raises
    ------
    InputError
        If there are no frames, or the rate is not above 0.
    """
    return make_take(np.zeros((n_frames, 0, 3)), [], rate, start=start, without_markers=True, **attributes)


def check_take(take: xr.Dataset, *, without_markers: bool = False) -> None:
    """Refuse a dataset that is not a usable take, with every fault in one line.

    Checked: the variable ``position`` with dimensions (time, marker, space) and three space axes; ``rate`` > 0;
    time stamps that rise evenly by 1 / rate (to 1 % of a frame); marker names that are there, unique and free of
    control characters; at least one frame, one marker and one position that is not missing.

    Parameters
    ----------
    take
        The dataset.
    without_markers
        Whether a take without any marker will do: one of which only the weights are known.

    Raises
    ------
    InputError
        If anything of this fails.
    """
    if not isinstance(take, xr.Dataset) or "position" not in take:
        raise InputError("take: expected an xarray.Dataset with the variable 'position'")
    position = take["position"]
    if set(position.dims) != {"time", "marker", "space"}:
        raise InputError(f"take: expected position (time, marker, space), but got {tuple(map(str, position.dims))}")
    problems = [*_shape_problems(take, without_markers), *_time_problems(take), *_name_problems(take)]
    values = np.asarray(position.values)
    if not np.issubdtype(values.dtype, np.floating):
        problems.append(f"expected positions as floating-point numbers, but got {values.dtype}")
    elif values.size and not np.isfinite(values).any():
        problems.append("every marker is missing in every frame")
    if problems:
        raise InputError("take: " + "; ".join(problems))


def select_markers(take: xr.Dataset) -> xr.Dataset:
    """Return the take without model outputs: tracked markers only, in the same order."""
    if "kind" not in take.coords:
        return take
    return take.isel(marker=np.flatnonzero(np.asarray(take["kind"].values).astype(str) == "marker"))


def to_movement(take: xr.Dataset, *, plural: bool = False) -> xr.Dataset:
    """Convert a take to a poses dataset in the convention of the ``movement`` package.

    Its dimensions are ``position (time, space, keypoint, individual)`` and ``confidence (time, keypoint,
    individual)``; the only individual is the signer. Confidence is NaN, "not known". Model outputs have no place
    there: they are left out, with a warning.

    Parameters
    ----------
    take
        A take.
    plural
        Whether the dimensions are called ``keypoints`` and ``individuals``, as in older versions of ``movement``.
    """
    check_take(take)
    markers = select_markers(take)
    if markers.sizes["marker"] < take.sizes["marker"]:
        n_left_out = take.sizes["marker"] - markers.sizes["marker"]
        warnings.warn(f"to_movement: {n_left_out} model outputs are not positions and are left out", stacklevel=2)
    keypoint, individual = ("keypoints", "individuals") if plural else ("keypoint", "individual")
    position = markers["position"].transpose("time", "space", "marker").values[..., None]
    return xr.Dataset(
        {
            "position": (("time", "space", keypoint, individual), position.astype(np.float64)),
            "confidence": (("time", keypoint, individual), np.full(position[:, 0].shape, np.nan)),
        },
        coords={
            "time": np.asarray(markers["time"].values),
            "space": np.asarray(SPACE),
            keypoint: np.asarray(markers["marker"].values),
            individual: np.asarray([str(take.attrs.get("signer", "individual_0"))]),
        },
        attrs={**take.attrs, "fps": take.attrs["rate"], "time_unit": "seconds", "ds_type": "poses"},
    )


def from_movement(
    dataset: xr.Dataset, *, individual: str | None = None, rate: float | None = None, unit: str = "mm"
) -> xr.Dataset:
    """Convert a 3D poses dataset of the ``movement`` package to a take.

    Parameters
    ----------
    dataset
        ``position (time, space, keypoint, individual)``; the plural names of older versions are understood, and a
        missing individual dimension too.
    individual
        Which one to take; needed where there are several.
    rate
        Frames per second; needed where the dataset has no ``fps``.
    unit
        Unit of length of the positions (``movement`` records none).

    Raises
    ------
    InputError
        If dimensions are missing, the data are not 3D, the individual is not named or not there, no rate is known,
        or the time stamps are not even.
    """
    renaming = {"keypoints": "marker", "keypoint": "marker", "individuals": "individual"}
    if not isinstance(dataset, xr.Dataset) or "position" not in dataset:
        raise InputError("from_movement: expected an xarray.Dataset with the variable 'position'")
    position = dataset["position"]
    position = position.rename({old: new for old, new in renaming.items() if old in position.dims})
    if "individual" in position.dims:
        names = [str(name) for name in position["individual"].values]
        if individual is None and len(names) != 1:
            raise InputError(f"from_movement: choose one individual of {', '.join(names)} with individual=")
        if individual is not None and individual not in names:
            raise InputError(f"from_movement: expected an individual of {', '.join(names)}, but got {individual!r}")
        position = position.isel(individual=names.index(individual) if individual is not None else 0)
    if set(position.dims) != {"time", "space", "marker"} or [str(s) for s in position["space"].values] != SPACE:
        found = ", ".join(f"{name} ({size})" for name, size in position.sizes.items())
        raise InputError(f"from_movement: expected time, space (x, y, z), keypoint, individual, but got {found}")
    fps = rate if rate is not None else dataset.attrs.get("fps")
    if fps is None:
        raise InputError("from_movement: the dataset has no fps; give the frames per second with rate=")
    fps = _number(fps, "rate")
    time = np.asarray(position["time"].values, dtype=np.float64)
    if dataset.attrs.get("time_unit") == "frames":
        with np.errstate(all="ignore"):  # check_take refuses what is not finite
            time = time / fps
    attributes = {k: v for k, v in dataset.attrs.items() if k not in ("rate", "fps", "time_unit", "ds_type")}
    attributes.pop("source_unit", None)
    take = make_take(
        position.transpose("time", "marker", "space").values,
        [str(m) for m in position["marker"].values],
        fps,
        unit=unit,
        **attributes,
    ).assign_coords(time=("time", time, {"units": "s"}))
    check_take(take)
    return take


def _number(value: Any, name: str) -> float:
    """Return ``value`` as a float, or say that it is none."""
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: expected a number, but got {value!r}") from error


def _shape_problems(take: xr.Dataset, without_markers: bool) -> list[str]:
    problems = []
    if take.sizes["time"] == 0:
        problems.append("there are no frames")
    if take.sizes["marker"] == 0 and not without_markers:
        problems.append("there are no markers")
    if take.sizes["space"] != 3:
        problems.append(f"expected 3 space axes, but got {take.sizes['space']}")
    problems += [
        f"the coordinate {name!r} is missing" for name in ("time", "marker", "space") if name not in take.coords
    ]
    return problems


def _time_problems(take: xr.Dataset) -> list[str]:
    rate = take.attrs.get("rate")
    if not isinstance(rate, (int, float, np.number)) or not np.isfinite(rate) or rate <= 0:
        return [f"expected a rate above 0 Hz, but got {rate!r}"]
    if "time" not in take.coords or take.sizes["time"] == 0:
        return []
    time = np.asarray(take["time"].values, dtype=np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        late = np.abs((time - time[0]) * float(rate) - np.arange(time.size))
    wrong = np.flatnonzero(~(late <= _TIME_TOLERANCE))
    if wrong.size == 0:
        return []
    first = int(wrong[0])
    return [f"time is not even at {float(rate):g} Hz: frame {first} is at {time[first]:g} s"]


def _name_problems(take: xr.Dataset) -> list[str]:
    if "marker" not in take.coords:
        return []
    names = [str(name) for name in take["marker"].values]
    problems = []
    unnamed = [str(i + 1) for i, name in enumerate(names) if not name.strip()]
    if unnamed:
        problems.append(f"markers without a name: number {', '.join(unnamed[:8])}{' …' if len(unnamed) > 8 else ''}")
    counts: dict[str, int] = {}
    for name in names:
        counts[name] = counts.get(name, 0) + 1
    repeated = [repr(name) for name, count in counts.items() if count > 1 and name.strip()]
    if repeated:
        problems.append(f"repeated marker names: {', '.join(repeated[:8])}{' …' if len(repeated) > 8 else ''}")
    odd = [repr(name) for name in names if any(ord(letter) < 32 for letter in name)]
    if odd:
        problems.append(f"marker names with control characters: {', '.join(odd[:8])}")
    return problems
