"""A rig and its weights over time as glTF 2.0 binary (``.glb``), after the Khronos glTF 2.0 specification.

Every part of the rig is a mesh with a node of its own and only the shapes that touch it, as morph targets: sparse where
that is smaller. All nodes are driven by one animation. Lengths are metres, times seconds, as the format has it; its
axes are mimique's. What the format has no word for stands in ``extras``, where :func:`.read_rig` and
:func:`.read_gltf_weights` find it again: names and order of the shapes, the rate, the frames whose weights are not
known (they show the neutral), and, of a rig in parts, each vertex's number (attribute ``_VERTEX``).
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, RigError
from .animation import Frames, check_weights, fill_missing, find_missing, weight_blocks
from .gltf_buffers import CORNERS, FLOAT, INT, SHORT, VERTICES, GltfBuffer
from .linear_colours import linearise_colours
from .moving_mesh import find_normals
from .partial_files import partial_file
from .rig import Rig
from .rig_parts import RigPart, join_names, split_parts

METRES = 1e-3  # of a millimetre
SKIN = (0.70, 0.42, 0.29)  # linear red, green, blue
INTERPOLATIONS = ("LINEAR", "STEP")
MOST_BYTES = 2**32 - 1  # lengths are 4-byte numbers
MOST_NUMBERED = 2**24  # whole numbers that single precision holds


def write_gltf(
    path: str | PathLike[str],
    rig: Rig,
    weights: Frames | None = None,
    rate: float | None = None,
    *,
    name: str = "take",
    interpolation: str = "LINEAR",
    colours: ArrayLike | None = None,
    shape_normals: bool = False,
    tolerance: float = 0.0,
) -> Path:
    """Write a rig as a ``.glb`` file, with an animation where there are weights.

    Parameters
    ----------
    path
        The file; complete or not there.
    rig
        The face.
    weights
        (n_frames, n_shapes), read a part at a time. A frame with a weight that is not known (NaN) shows the neutral;
        a shape of which nothing is known stays at 0.
    rate
        Of the weights, Hz.
    name
        Of the animation.
    interpolation
        Between frames: "LINEAR" or "STEP".
    colours
        (n_vertices, 3) red, green, blue from 0 to 1, sRGB; one colour of skin if left out.
    shape_normals
        Whether the normals' changes are written for each shape too: right shading where the program does not compute
        normals itself, for about twice the size.
    tolerance
        Displacements of a vertex that are at most as long as this, mm, are left out.

    Returns
    -------
    The file's path.

    Raises
    ------
    RigError, InputError
        If rig, weights, rate or colours cannot be used, the take is too long for the format, or the file cannot be
        written.
    """
    path = Path(path)
    if path.suffix.lower() != ".glb":
        raise InputError(f"{path.name}: expected a file name ending in .glb")
    if interpolation not in INTERPOLATIONS:
        raise InputError(f"interpolation: expected one of {', '.join(INTERPOLATIONS)}, but got {interpolation!r}")
    if (weights is None) != (rate is None):
        raise InputError("weights and their rate come together; only one of them was given")
    buffer, parts = GltfBuffer(), split_parts(rig)
    names = join_names([part.name for part in parts])
    meshes = _write_meshes(buffer, rig, parts, colours, shape_normals, tolerance)
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "mimique"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(parts))), "extras": {"mimique": {"shapes": list(rig.shapes)}}}],
        "nodes": [{"name": called, "mesh": i} for i, called in enumerate(names)],
        "meshes": [{"name": called, **mesh} for called, mesh in zip(names, meshes, strict=True)],
        "materials": [
            {
                "name": "skin",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [1, 1, 1, 1] if colours is not None else [*SKIN, 1],
                    "metallicFactor": 0,
                    "roughnessFactor": 0.7,
                },
                "doubleSided": True,
            }
        ],
    }
    if weights is not None and rate is not None:
        check_weights(rig, weights, rate)
        document["animations"] = [_write_animation(buffer, parts, weights, rate, name, interpolation)]
    document |= {"accessors": buffer.accessors, "bufferViews": buffer.views}
    document["buffers"] = [{"byteLength": buffer.length}]
    try:
        # the standard leaves no room for lone halves of a character
        text = json.dumps(document, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode()
    except UnicodeEncodeError as error:
        raise RigError(f"{path.name}: a name holds half a character ({error.object[error.start]!a})") from error
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + buffer.length
    if total > MOST_BYTES:
        raise InputError(f"{path.name}: {total / 1e9:.1f} GB are more than the format holds; give a lower rate")
    with partial_file(path) as part, part.open("wb") as file:
        file.write(b"glTF" + struct.pack("<II", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", buffer.length, b"BIN\0"))
        for piece in buffer.pieces():
            file.write(piece)
    return path


def _write_meshes(
    buffer: GltfBuffer,
    rig: Rig,
    parts: list[RigPart],
    colours: ArrayLike | None,
    shape_normals: bool,
    tolerance: float,
) -> list[dict[str, Any]]:
    """Write what does not move over time and return the meshes."""
    with np.errstate(over="ignore"):  # refused in a line just after
        neutral, deltas = (rig.neutral * METRES).astype(np.float32), (rig.deltas * METRES).astype(np.float32)
    for what, values in (("neutral", neutral), ("deltas", deltas)):
        if not np.isfinite(values).all():
            raise RigError(f"rig {what}: a coordinate is beyond single precision, the numbers of the format")
    if tolerance > 0:
        deltas[np.linalg.norm(rig.deltas, axis=2) <= tolerance] = 0
    normals = _unit_normals(rig, rig.neutral)
    tints = None if colours is None else _opaque_colours(rig, colours)
    meshes = []
    for part in parts:
        chosen = part.vertices
        attributes = {
            "POSITION": buffer.add(neutral[chosen], FLOAT, target=VERTICES, bounds=True),
            "NORMAL": buffer.add(normals[chosen], FLOAT, target=VERTICES),
        }
        if tints is not None:
            attributes["COLOR_0"] = buffer.add(tints[chosen], SHORT, target=VERTICES, normalized=True)
        if len(parts) > 1 and rig.n_vertices <= MOST_NUMBERED:
            attributes["_VERTEX"] = buffer.add(chosen, FLOAT, target=VERTICES)
        small = len(chosen) < 2**16  # the largest number of each kind is not a vertex (3.7.2.1)
        primitive: dict[str, Any] = {
            "attributes": attributes,
            "indices": buffer.add(part.triangles.ravel(), SHORT if small else INT, target=CORNERS),
            "material": 0,
        }
        mesh: dict[str, Any] = {"primitives": [primitive]}
        targets = []
        for shape in part.shapes:
            target = {"POSITION": buffer.add_displacements(deltas[shape, chosen], bounds=True)}
            if shape_normals:
                turned = _unit_normals(rig, rig.neutral + rig.deltas[shape])[chosen] - normals[chosen]
                target["NORMAL"] = buffer.add_displacements(turned, bounds=False)
            targets.append(target)
        if targets:
            primitive["targets"] = targets
            mesh["extras"] = {"targetNames": [rig.shapes[shape] for shape in part.shapes]}
        meshes.append(mesh)
    return meshes


def _write_animation(
    buffer: GltfBuffer, parts: list[RigPart], weights: Frames, rate: float, name: str, interpolation: str
) -> dict[str, Any]:
    """Write times and weights and return the animation that drives all parts."""
    n_frames = len(weights)
    times = np.arange(n_frames) / rate
    with np.errstate(over="ignore"):
        single = times.astype(np.float32)
    if not np.isfinite(single[-1]) or (np.diff(single) <= 0).any():
        raise InputError(
            f"weights: {n_frames} frames at {rate:g} Hz cannot be told apart in the format's single-precision seconds; "
            "give another rate, or a shorter take"
        )
    lost, never = find_missing(weights)
    shared = buffer.add(single, FLOAT, bounds=True)
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    for node, part in enumerate(parts):
        if not len(part.shapes):
            continue

        def recipe(columns: NDArray[np.int64] = part.shapes) -> Iterator[bytes]:
            for _, values in weight_blocks(weights):
                values[:, never] = 0
                yield fill_missing(values)[:, columns].astype("<f4").tobytes()

        output = buffer.add_recipe(n_frames * len(part.shapes), recipe)
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": "weights"}})
        samplers.append({"input": shared, "output": output, "interpolation": interpolation})
    notes = {"rate": rate, "missing": lost.tolist()}
    return {"name": name, "channels": channels, "samplers": samplers, "extras": {"mimique": notes}}


def _unit_normals(rig: Rig, points: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return normals of length 1, also where a vertex has no triangle or one without an area."""
    centred = points - rig.neutral.mean(axis=0)  # single precision is finest around zero
    normals = find_normals(centred, rig.triangles).astype(np.float64)
    length = np.linalg.norm(normals, axis=1)
    normals[length < 0.5] = (0, 0, 1)
    return (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)


def _opaque_colours(rig: Rig, colours: ArrayLike) -> NDArray[np.uint16]:
    """Return linear red, green, blue and an opaque alpha in 16 bits."""
    linear = linearise_colours(rig, colours)
    return np.round(np.column_stack([linear, np.ones(len(linear))]) * 65535).astype(np.uint16)
