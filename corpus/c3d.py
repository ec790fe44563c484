"""C3D files: the binary format of marker-based motion capture.

Reading is our own (a few NumPy views, once :mod:`.c3d_header` has checked every size), for Intel, DEC and SGI/MIPS
files, with integer or float samples; writing is ezc3d's (Michaud and Begon 2021, doi:10.21105/joss.02911), which is
also the independent judge of the reader in the tests.
"""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..errors import FileFormatError, InputError
from .c3d_header import C3DHeader, read_c3d_header
from .c3d_parameters import decode_floats, word_order
from .take import POSITION_KINDS, check_take, make_take

__all__ = ["read_c3d", "write_c3d"]

_KINDS = {"ANGLES": "angle", "FORCES": "force", "MOMENTS": "moment", "POWERS": "power", "SCALARS": "scalar"}
_MODELLED = "MODELED_MARKERS"
_LAST_FRAME = 0xFFFF  # that the header's words can number
_MAX_POINTS = 0xFFFF
_OWN_FACTS = ("MIMIQUE", "ATTRIBUTES")  # "key=value" texts: what is known of a take and has no place in the format
_FORMAT_FACTS = frozenset({
    "rate", "first_frame", "encoding", "note", "x_screen", "y_screen", "axes",
    "source_file", "source_sha256", "source_unit",
})  # fmt: skip
_MAX_LABELS = 255  # entries of one parameter; a further 255 go into LABELS2, and so on


def read_c3d(data: bytes, *, unit: str | None = None) -> xr.Dataset:
    """Read the points of a C3D file's bytes as a take.

    All points are kept in file order. A point that the parameters list under ``POINT:ANGLES``, ``FORCES``,
    ``MOMENTS``, ``POWERS``, ``SCALARS`` or another group of ``POINT:TYPE_GROUPS`` is a model output of that kind and
    keeps the unit given there. A point is missing (NaN) where its residual is negative or a coordinate is not a
    finite number; (0, 0, 0) with a valid residual is a position. Analog samples are left alone.

    Parameters
    ----------
    data
        The whole file.
    unit
        Unit of length, in place of the file's ``POINT:UNITS``.

    Returns
    -------
    xarray.Dataset
        Time begins at 0 s; ``first_frame`` is the file's own number of the first frame, ``x_screen`` and
        ``y_screen`` its axes notes, ``note`` says where header and parameters disagree. What
        :func:`write_c3d` noted of the take (signer, protocol, that it is simulated) comes back as text.

    Raises
    ------
    FileFormatError
        If the file is not a C3D, is damaged or cut off, or holds no points.
    InputError
        If the unit is unknown, or labels are missing or repeated, or no point is ever visible.
    """
    header = read_c3d_header(data)
    labels = header.parameters.texts("POINT", "LABELS")[: header.n_points]
    if len(labels) < header.n_points:
        raise FileFormatError(f"markers without a name: {header.n_points} points, but POINT:LABELS names {len(labels)}")
    kinds, units = _kinds_and_units(header, labels, unit)
    screen = {key: (header.parameters.texts("POINT", key.upper()) or [""])[0] for key in ("x_screen", "y_screen")}
    take = make_take(
        _decode_points(data, header),
        labels,
        header.rate,
        kind=kinds,
        unit=units,
        first_frame=header.first_frame,
        encoding=f"{header.parameters.processor} {'float' if header.is_float else 'integer'}",
        note="; ".join(header.notes) or None,
        x_screen=screen["x_screen"] or None,
        y_screen=screen["y_screen"] or None,
    )
    return take.assign_attrs({**_own_facts(header), **take.attrs})


def write_c3d(path: Path, take: xr.Dataset) -> None:
    """Write a take as a C3D file: Intel floats, mm, missing points with a residual of −1.

    Positions are rounded to 4-byte floats (about 1e-4 mm at 1 m). Model outputs are written with their kind and,
    where all of a kind share one, their unit. Signer, protocol and other plain attributes are noted in a parameter of
    mimique's own; a start other than 0 s is not written. The file is complete or not there: it is written beside its
    place, read again and compared, then moved.

    Raises
    ------
    InputError
        If the take is not valid or does not fit the format (labels beyond 255 bytes, more than 65535 points).
    """
    check_take(take)
    labels = [str(name) for name in take["marker"].values]
    too_long = [name for name in labels if len(name.encode()) > _MAX_LABELS]
    if too_long:
        raise InputError(f"marker {too_long[0][:40]!r}…: expected a name of at most 255 bytes for a C3D file")
    if len(labels) > _MAX_POINTS:
        raise InputError(f"{path.name}: a C3D file holds at most {_MAX_POINTS} points, but the take has {len(labels)}")
    start = float(take["time"].values[0])
    if start:
        warnings.warn(f"{path.name}: a C3D file begins at 0 s; the take's start at {start:g} s is lost", stacklevel=3)
    position = take["position"].transpose("time", "marker", "space").values.astype(np.float64)
    missing = np.asarray(np.isnan(position).any(axis=2))
    position[missing] = np.nan
    file = _build_file(take, labels, position, missing)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.stem}-") as folder:
        part = Path(folder) / "take.c3d"
        try:
            file.write(str(part))
            again = read_c3d(part.read_bytes())
        except (OSError, RuntimeError, ValueError) as error:
            raise InputError(f"{path.name}: this take does not fit into a C3D file ({error})") from error
        same_names = list(again["marker"].values) == [name.strip() for name in labels]
        single = position.astype(np.float32)
        if not same_names or not np.array_equal(again["position"].values, single, equal_nan=True):
            raise InputError(f"{path.name}: this take does not fit into a C3D file; it would read as another one")
        part.replace(path)


def _build_file(take: xr.Dataset, labels: list[str], position: NDArray, missing: NDArray[np.bool_]) -> Any:
    """Return ezc3d's object for a take."""
    import ezc3d  # here, because only those who write need it loaded

    n_frames, n_markers = missing.shape
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [float(take.attrs["rate"])]
    point["UNITS"]["value"] = ["mm"]
    for part in range(0, n_markers, _MAX_LABELS):
        suffix = str(part // _MAX_LABELS + 1) if part else ""
        names = labels[part : part + _MAX_LABELS]
        file.add_parameter("POINT", "LABELS" + suffix, names)
        file.add_parameter("POINT", "DESCRIPTIONS" + suffix, [""] * len(names))
    _add_kinds(file, take, labels)
    for key in ("x_screen", "y_screen"):
        if take.attrs.get(key):
            file.add_parameter("POINT", key.upper(), [str(take.attrs[key])])
    facts = [f"{k}={v}" for k, v in take.attrs.items() if k not in _FORMAT_FACTS and isinstance(v, (str, int, float))]
    facts = [fact for fact in facts if len(fact.encode()) <= _MAX_LABELS]
    if facts:
        file.add_parameter(*_OWN_FACTS, facts)
    first = int(take.attrs.get("first_frame", 1))
    if n_frames >= _LAST_FRAME:
        for name, frame in (("ACTUAL_START_FIELD", 1), ("ACTUAL_END_FIELD", n_frames)):
            file.add_parameter("TRIAL", name, [frame & 0xFFFF, frame >> 16])
    elif 0 < first <= _LAST_FRAME - n_frames:
        file["header"]["points"]["first_frame"] = first - 1  # ezc3d counts from 0
    file["data"]["points"] = np.concatenate([position.transpose(2, 1, 0), np.ones((1, n_markers, n_frames))])
    file["data"]["meta_points"]["residuals"] = np.where(missing.T, -1.0, 0.0)[None]
    return file


def _decode_points(data: bytes, header: C3DHeader) -> NDArray[np.float64]:
    """Return the points, (n_frames, n_points, 3) in the file's unit, NaN where missing."""
    processor = header.parameters.processor
    width = 4 if header.is_float else 2
    size = header.n_frames * header.frame_size
    frames = np.frombuffer(data, dtype=np.uint8, count=size, offset=header.data_offset)
    frames = frames.reshape(header.n_frames, header.frame_size)[:, : 4 * width * header.n_points]
    raw = np.ascontiguousarray(frames).data
    shape = (header.n_frames, header.n_points, 4)
    if header.is_float:
        points = decode_floats(raw, processor).reshape(shape)
        # The fourth word of an invalid point is −1, as a float or (some programs) as an integer, a NaN: its sign tells.
        missing = np.signbit(points[..., 3]) & (points[..., 3] != 0)
        xyz = points[..., :3].copy()
    else:
        words = np.frombuffer(raw, dtype=word_order(processor) + "i2").reshape(shape)
        missing = words[..., 3] < 0
        xyz = words[..., :3] * header.scale
    xyz[missing] = np.nan
    return xyz


def _own_facts(header: C3DHeader) -> dict[str, str]:
    """Return the plain attributes that mimique noted when it wrote the file."""
    facts = dict(text.partition("=")[::2] for text in header.parameters.texts(*_OWN_FACTS))
    return {key: value for key, value in facts.items() if key.isidentifier() and key not in _FORMAT_FACTS}


def _kinds_and_units(header: C3DHeader, labels: list[str], unit: str | None) -> tuple[list[str], list[str]]:
    """Kind and unit of each point, from the groups that the parameters list."""
    groups = dict(_KINDS)
    pairs = header.parameters.texts("POINT", "TYPE_GROUPS")
    for group, kind in zip(pairs[::2], pairs[1::2], strict=False):
        if group:
            groups[group.upper()] = (kind or group).lower()
    length = unit if unit is not None else next(iter(header.parameters.texts("POINT", "UNITS")), "")
    kinds, units = ["marker"] * len(labels), [length] * len(labels)
    bare = [label.rsplit(":", 1)[-1] for label in labels]  # "subject:RHipAngles" may be listed as "RHipAngles"
    for group, kind in groups.items():
        members = {name for name in header.parameters.texts("POINT", group) if name}
        is_model = "MODEL" in group
        own_unit = length if is_model else next(iter(header.parameters.texts("POINT", f"{kind.upper()}_UNITS")), "")
        for index, label in enumerate(labels):
            if label in members or bare[index] in members:
                kinds[index], units[index] = ("modelled" if is_model else kind), own_unit
    return kinds, units


def _add_kinds(file: Any, take: xr.Dataset, labels: list[str]) -> None:
    """List the model outputs in POINT, by kind, the way Vicon's programs do."""
    if "kind" not in take.coords:
        return
    kinds = [str(kind) for kind in take["kind"].values]
    units = [str(unit) for unit in take["unit"].values] if "unit" in take.coords else [""] * len(kinds)
    known = {kind: group for group, kind in _KINDS.items()}
    pairs: list[str] = []
    for kind in dict.fromkeys(k for k in kinds if k != "marker"):
        group = _MODELLED if kind == "modelled" else known.get(kind, f"{kind.upper()}S")
        members = [label for label, k in zip(labels, kinds, strict=True) if k == kind]
        if len(members) > _MAX_LABELS:
            raise InputError(f"expected at most 255 model outputs of kind {kind!r} for a C3D file, got {len(members)}")
        pairs += [group, kind.upper()]
        file.add_parameter("POINT", group, members)
        own_units = {unit for unit, k in zip(units, kinds, strict=True) if k == kind and unit}
        if kind not in POSITION_KINDS and len(own_units) == 1:
            file.add_parameter("POINT", f"{kind.upper()}_UNITS", [own_units.pop()])
        elif kind not in POSITION_KINDS and own_units:
            warnings.warn(
                f"a C3D file has one unit for all of kind {kind!r}: {sorted(own_units)} is lost", stacklevel=3
            )
    if pairs:
        file.add_parameter("POINT", "TYPE_GROUPS", pairs)
