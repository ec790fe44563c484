"""glTF 2.0 documents (``.glb``, ``.gltf``): their JSON, their buffers, their nodes; Khronos glTF 2.0 specification."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from ..errors import FileFormatError, MimiqueError

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MOST_ENTRIES = 5_000_000  # a file can claim any number, without a byte for them
COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")


@contextmanager
def damage_in_one_line(path: Path) -> Iterator[None]:
    """Turn whatever a damaged document causes within the block into one :class:`FileFormatError`."""
    try:
        with np.errstate(invalid="ignore", over="ignore"):  # damaged numbers are found by what they lead to
            yield
    except MimiqueError:
        raise
    except (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, struct.error) as error:
        gist = " ".join(str(error).split())[:120]
        raise FileFormatError(f"{path.name}: not a readable glTF 2.0 file ({type(error).__name__}: {gist})") from error
    except (RecursionError, MemoryError) as error:
        raise FileFormatError(f"{path.name}: not a readable glTF 2.0 file: nested too deep, or too large") from error


def open_gltf(path: Path) -> tuple[dict[str, Any], Accessors]:
    """Return the JSON document and what reads its accessors.

    Raises
    ------
    FileFormatError
        If the file's version is another, or its meshes are compressed.
    """
    document, chunk = read_document(path)
    packed = [name for name in document.get("extensionsRequired", []) if name in COMPRESSED]
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            # Some programs forget to say that it is required: without the extension these accessors are empty.
            named = [name for name in primitive.get("extensions", {}) if name in COMPRESSED]
            if named and "bufferView" not in document["accessors"][primitive["attributes"]["POSITION"]]:
                packed += named
    if packed:
        raise FileFormatError(f"{path.name}: its meshes are compressed ({packed[0]}); export it uncompressed")
    return document, Accessors(path, document, chunk)


def world_matrices(document: dict[str, Any]) -> list[NDArray[np.float64]]:
    """Return the placement of every node in the scene, (4, 4) each."""
    nodes = document.get("nodes", [])
    parent = {child: i for i, node in enumerate(nodes) for child in node.get("children", [])}
    local = [node_matrix(node) for node in nodes]
    placed = []
    for start in range(len(nodes)):
        matrix, at, steps = np.eye(4), start, 0
        while True:
            matrix, steps = local[at] @ matrix, steps + 1
            if at not in parent or steps > len(nodes):  # a damaged file can go in circles
                break
            at = parent[at]
        placed.append(matrix)
    return placed


def node_matrix(node: dict[str, Any]) -> NDArray[np.float64]:
    """Return a node's placement in its parent, (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), dtype=np.float64)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", [1, 1, 1]), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def read_document(path: Path) -> tuple[dict[str, Any], bytes | None]:
    """Return the JSON document and the binary chunk of a GLB."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        return json.loads(data.decode("utf-8-sig")), None
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2 or length > len(data):
        raise FileFormatError(
            f"{path.name}: expected glTF version 2 and {length} bytes, but got version {version} and {len(data)} bytes"
        )
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<I4s", data, at)
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    return json.loads(chunks[b"JSON"].decode("utf-8")), chunks.get(b"BIN\0")


class Accessors:
    """Typed views into the buffers of one document."""

    def __init__(self, path: Path, document: dict[str, Any], chunk: bytes | None) -> None:
        self._document = document
        self._buffers = [_load_buffer(path, buffer, chunk) for buffer in document.get("buffers", [])]

    def read(self, index: int) -> NDArray[np.float64]:
        """Return an accessor's values, (count,) or (count, width), sparse entries filled in."""
        accessor = self._document["accessors"][index]
        count, width = int(accessor["count"]), WIDTHS[accessor["type"]]
        dtype = np.dtype(COMPONENTS[accessor["componentType"]])
        if not 0 <= count <= MOST_ENTRIES:
            raise ValueError(f"accessor {index} claims {count} entries")
        values = np.zeros((count, width))
        if "bufferView" in accessor:
            raw = self._view(accessor["bufferView"], accessor.get("byteOffset", 0), dtype, count, width)
            with np.errstate(invalid="ignore"):  # Damaged numbers; the rig refuses what is not finite.
                values[:] = raw
        sparse = accessor.get("sparse")
        if sparse:
            where, what, n = sparse["indices"], sparse["values"], int(sparse["count"])
            kind = np.dtype(COMPONENTS[where["componentType"]])
            rows = self._view(where["bufferView"], where.get("byteOffset", 0), kind, n, 1)[:, 0].astype(np.int64)
            values[rows] = self._view(what["bufferView"], what.get("byteOffset", 0), dtype, n, width)
        if accessor.get("normalized") and dtype.kind in "iu":
            values = np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values[:, 0] if width == 1 else values

    def _view(self, view: int, offset: int, dtype: np.dtype, count: int, width: int) -> NDArray:
        """Return (count, width) raw values, heeding the view's stride."""
        layout = self._document["bufferViews"][view]
        data = self._buffers[layout["buffer"]]
        start = int(layout.get("byteOffset", 0)) + int(offset)
        stride = int(layout.get("byteStride", dtype.itemsize * width))
        end = start + stride * (count - 1) + dtype.itemsize * width if count else start
        if end > len(data) or end > int(layout.get("byteOffset", 0)) + int(layout["byteLength"]):
            raise ValueError(f"buffer view {view} is shorter than its {count} entries")
        return np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize))


def _load_buffer(path: Path, buffer: dict[str, Any], chunk: bytes | None) -> bytes:
    """Return a buffer's bytes: the GLB's own chunk, a data URI, or a file beside the document."""
    uri = buffer.get("uri")
    if uri is None:
        if chunk is None:
            raise ValueError("a buffer has neither a URI nor a binary chunk")
        return chunk
    if uri.startswith("data:"):
        try:
            return base64.b64decode(uri.partition(",")[2], validate=True)
        except binascii.Error as error:
            raise ValueError(f"a data URI is damaged: {error}") from error
    return (path.parent / unquote(uri)).read_bytes()
