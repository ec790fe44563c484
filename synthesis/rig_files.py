"""Read rigs: a folder of OBJ files, an ``.npz`` of arrays, or glTF with morph targets.

Whatever the file's unit, the rig that comes out is in millimetres. OBJ and ``.npz`` do not say their unit, so the
caller must; glTF is in metres by its specification (Khronos glTF 2.0, 3.4).
"""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import FileFormatError, InputError, RigError
from .rig import Rig
from .rig_gltf import read_gltf
from .rig_obj import read_obj_folder

MILLIMETRES = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4}
"""Millimetres per unit of each length that :func:`read_rig` knows."""

HEAD_MM = 250.0  # Height of a head with some neck; only used to suggest a unit, never to choose one.

ARRAYS = ("vertices", "triangles", "names", "deltas")


def read_rig(path: str | PathLike[str], unit: str | None = None) -> Rig:
    """Read a rig and convert it to millimetres.

    Parameters
    ----------
    path
        A folder of OBJ files (``.obj`` or ``.obj.gz``: one neutral, one file a shape, equal topology), an ``.npz``
        with ``vertices (V, 3)``, ``triangles (T, 3)``, ``names (N,)`` and ``deltas (N, V, 3)``, or a ``.glb`` or
        ``.gltf`` file with morph targets; its meshes are the rig's parts.
    unit
        Unit of the file: mm, cm, dm, m or in. glTF files are in metres unless it says otherwise.

    Returns
    -------
    Rig
        Shapes keep the file's names and order; a folder's are in the order of their file names.

    Raises
    ------
    RigError
        If the unit is unknown or missing (a likely one is suggested), or the shapes do not share one topology.
    FileFormatError
        If the file cannot be read as what its name says.
    """
    path = Path(path)
    if unit is not None and unit not in MILLIMETRES:
        raise RigError(f"{path.name}: expected a unit out of {', '.join(MILLIMETRES)}, but got {unit!r}")
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder")
    suffix = path.suffix.lower()
    parts: list[tuple[str, int]] = []
    if path.is_dir():
        neutral, triangles, deltas, names = read_obj_folder(path)
    elif suffix == ".npz":
        neutral, triangles, deltas, names = _read_npz(path)
    elif suffix in (".glb", ".gltf"):
        neutral, triangles, deltas, names, parts = read_gltf(path)
        unit = unit or "m"
    else:
        raise FileFormatError(
            f"{path.name}: expected a folder of OBJ files, .npz, .glb or .gltf, but got {suffix or 'no suffix'!r}"
        )
    if unit is None:
        raise RigError(_unit_missing(path, neutral))
    scale = MILLIMETRES[unit]
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused by name just after
            return Rig(neutral * scale, triangles, deltas * scale, names, parts)
    except InputError as error:
        raise RigError(f"{path.name}: {error}") from error


def _read_npz(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], list[str]]:
    """Read the four arrays of an ``.npz`` rig."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            missing = [name for name in ARRAYS if name not in file.files]
            if missing:
                raise FileFormatError(
                    f"{path.name}: expected the arrays {', '.join(ARRAYS)}, but {', '.join(missing)} "
                    f"{'is' if len(missing) == 1 else 'are'} missing (it has {_some(file.files) or 'none'})"
                )
            vertices, triangles, names, deltas = (np.asarray(file[name]) for name in ARRAYS)
    except FileFormatError:
        raise
    except ValueError as error:  # NumPy takes what it does not know for a pickle, and explains how to run it
        raise FileFormatError(f"{path.name}: not a readable .npz file of plain arrays") from error
    except MemoryError as error:
        raise FileFormatError(f"{path.name}: it says that it holds more than fits into memory; not a rig") from error
    except (OSError, EOFError, KeyError, zipfile.BadZipFile, zlib.error, struct.error, RuntimeError) as error:
        # zipfile says RuntimeError, and NotImplementedError, which is one, of what it cannot decrypt or unpack.
        gist = " ".join(ascii(str(error))[1:-1].split())[:120]
        raise FileFormatError(f"{path.name}: not a readable .npz file ({gist})") from error
    for name, array, kinds in (
        ("vertices", vertices, "fiu"),
        ("triangles", triangles, "iu"),
        ("deltas", deltas, "fiu"),
    ):
        if array.dtype.kind not in kinds:
            raise FileFormatError(f"{path.name}: expected numbers in {name!r}, but got {array.dtype}")
    if names.ndim != 1 or names.dtype.kind not in "US":
        raise FileFormatError(f"{path.name}: expected a list of texts in 'names', but got {names.dtype} {names.shape}")
    texts = [n.decode() if isinstance(n, bytes) else str(n) for n in names.tolist()]
    return vertices.astype(np.float64), triangles.astype(np.int64), deltas.astype(np.float64), texts


def _some(names: Sequence[str]) -> str:
    """List at most six names, spelled so that they are one line whatever the file holds."""
    return ", ".join(ascii(n)[1:-1][:40] for n in names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")


def _unit_missing(path: Path, neutral: NDArray[np.float64]) -> str:
    """Say that a unit is needed and which one a head's size suggests."""
    size = float(np.ptp(neutral, axis=0).max()) if len(neutral) else 0.0
    text = f"{path.name}: its unit is not known; say unit='cm' (one of {', '.join(MILLIMETRES)})"
    if not np.isfinite(size) or size <= 0:
        return text
    likely = min(("mm", "cm", "dm", "m"), key=lambda u: abs(np.log(size * MILLIMETRES[u] / HEAD_MM)))
    return f"{text}. The mesh is {size:.3g} units across, which for a head suggests {likely}"
