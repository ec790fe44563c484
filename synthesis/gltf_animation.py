"""Weights over time from the animations of glTF 2.0 files (specification, 3.11)."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import FileFormatError, InputError, NotFoundError
from .gltf_document import Accessors, damage_in_one_line, open_gltf
from .rig_gltf import name_targets

EVEN = 0.01  # of a step: keys further from an even grid than this are not one frame each
MOST_FRAMES = 50_000_000

Floats = NDArray[np.float64]


def read_gltf_weights(
    path: str | PathLike[str], *, animation: str | None = None, rate: float | None = None
) -> xr.Dataset:
    """Read the animation of morph-target weights of a ``.glb`` or ``.gltf`` file.

    Keys that are evenly spaced are the frames. Programs that drop keys that can be done without leave uneven ones:
    these curves (linear, stepped or cubic) are sampled, as often as their closest keys are apart unless told otherwise.

    Parameters
    ----------
    path
        The file.
    animation
        Its name; needed only where several move weights.
    rate
        Frames per second to sample at, Hz.

    Returns
    -------
    xarray.Dataset
        ``weights (time, shape)`` with ``time`` in s; ``rate`` in Hz and ``source_file`` as attributes. NaN in the
        frames that mimique noted as not known. A target that two meshes have is taken from the first.

    Raises
    ------
    NotFoundError
        If no animation is called so.
    InputError
        If there are several to choose from.
    FileFormatError
        If the file holds no weights over time, or is damaged.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise InputError(f"rate: expected a positive number of frames per second, but got {rate}")
    with damage_in_one_line(path):
        document, accessors = open_gltf(path)
        found = _choose(path, document.get("animations", []), animation)
        curves = _read_curves(document, accessors, found)
        if not curves:
            raise FileFormatError(f"{path.name}: its animation moves no shape that has a name")
        notes = (found.get("extras") or {}).get("mimique") or {}
        times, own_rate, at = _frames(path, [times for times, _, _ in curves.values()], rate, notes)
        columns = [_sample(*curve, at) for curve in curves.values()]
        values = np.stack(columns, axis=1)
        if rate is None:
            for onset, offset in notes.get("missing", []):
                values[int(onset) : int(offset)] = np.nan
    return xr.Dataset(
        {"weights": (("time", "shape"), values)},
        {"time": ("time", times, {"units": "s"}), "shape": list(curves)},
        {"rate": own_rate, "source_file": path.name},
    )


def _choose(path: Path, animations: list[dict[str, Any]], name: str | None) -> dict[str, Any]:
    moving = [a for a in animations if any(c["target"].get("path") == "weights" for c in a["channels"])]
    if not moving:
        raise FileFormatError(f"{path.name}: expected an animation of morph-target weights, but found none")
    names = [str(a.get("name", f"animation {i}")) for i, a in enumerate(moving)]
    listed = ", ".join(ascii(n)[1:-1] for n in names[:6])
    if name is not None:
        if name not in names:
            raise NotFoundError(f"{path.name}: no animation {name!r} moves weights; these do: {listed}")
        return moving[names.index(name)]
    if len(moving) > 1:
        raise InputError(f"{path.name}: several animations move weights; choose one of {listed}")
    return moving[0]


def _read_curves(
    document: dict[str, Any], accessors: Accessors, animation: dict[str, Any]
) -> dict[str, tuple[Floats, Floats, str]]:
    """Return keys, values (n_keys, 1 or 3: in-tangent, value, out-tangent) and interpolation by shape."""
    curves: dict[str, tuple[Floats, Floats, str]] = {}
    named = name_targets(document)
    for channel in animation["channels"]:
        target = channel["target"]
        if target.get("path") != "weights" or "node" not in target:
            continue
        names = named.get(document["nodes"][target["node"]]["mesh"], [])
        if not names:
            continue
        sampler = animation["samplers"][channel["sampler"]]
        kind = sampler.get("interpolation", "LINEAR")
        times = accessors.read(sampler["input"])
        width = 3 if kind == "CUBICSPLINE" else 1
        values = accessors.read(sampler["output"]).reshape(len(times), width, len(names))
        if not len(times) or (np.diff(times) <= 0).any() or not np.isfinite(times).all():
            raise ValueError("the times of an animation do not ascend")
        for place, name in enumerate(names):
            curves.setdefault(name, (times, values[:, :, place], kind))
    return curves


def _frames(
    path: Path, keys: Sequence[Floats], rate: float | None, notes: dict[str, Any]
) -> tuple[Floats, float, Floats]:
    """Return the times of the frames, their rate, and the times at which the curves are read: the keys' own if even."""
    first, last = min(times[0] for times in keys), max(times[-1] for times in keys)
    longest = max(keys, key=len)
    noted = float(notes.get("rate", 0) or 0)
    if rate is None and np.isfinite(noted) and noted > 0:
        return first + np.arange(len(longest)) / noted, noted, longest  # single-precision times, put right
    if rate is None:
        steps = np.diff(longest)
        if not len(steps):
            raise FileFormatError(f"{path.name}: one key is no animation; its rate is not known")
        step = float((longest[-1] - longest[0]) / len(steps))
        grid = first + np.arange(len(longest)) * step
        if np.abs(longest - grid).max() < EVEN * step and all(np.array_equal(times, longest) for times in keys):
            rate = float(np.round(1 / step, 3))
            return first + np.arange(len(longest)) / rate, rate, longest
        closest = float(min(np.diff(times).min() for times in keys if len(times) > 1))
        rate = float(np.round(1 / closest, 3))
    n_frames = int(np.floor((last - first) * rate + EVEN)) + 1
    if not 0 < n_frames <= MOST_FRAMES:
        raise FileFormatError(f"{path.name}: its animation would be {n_frames} frames at {rate:g} Hz; give a rate")
    times = first + np.arange(n_frames) / rate
    return times, float(rate), times


def _sample(times: Floats, values: Floats, kind: str, at: Floats) -> Floats:
    """Return the curve at some times (specification, appendix C); before and after the keys it stays as it is there."""
    middle = values[:, values.shape[1] // 2]
    if kind == "LINEAR" or len(times) == 1:
        return np.interp(at, times, middle)
    # A key's single-precision time may lie a little after the frame that it stands for.
    near = 1e-6 * max(1.0, float(np.abs(times).max()))
    below = np.clip(np.searchsorted(times, at + near, side="right") - 1, 0, len(times) - 2)
    if kind == "STEP":
        return np.asarray(np.where(at + near >= times[-1], middle[-1], middle[below]))
    step = times[below + 1] - times[below]
    t = np.clip((at - times[below]) / step, 0, 1)
    return np.asarray(
        (2 * t**3 - 3 * t**2 + 1) * middle[below]
        + step * (t**3 - 2 * t**2 + t) * values[below, 2]
        + (3 * t**2 - 2 * t**3) * middle[below + 1]
        + step * (t**3 - t**2) * values[below + 1, 0]
    )
