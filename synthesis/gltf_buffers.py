"""The binary buffer of a glTF 2.0 file, laid out first and written afterwards, piece by piece (specification, 3.6).

Numbers are little-endian; every accessor begins at a multiple of its component's size, which a multiple of four always
is. A long animation is never in memory at once: its piece is a recipe.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

BYTE, SHORT, INT, FLOAT = 5121, 5123, 5125, 5126
_TYPES = {BYTE: "<u1", SHORT: "<u2", INT: "<u4", FLOAT: "<f4"}
_KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
VERTICES, CORNERS = 34962, 34963
"""What a buffer view is for (``bufferView.target``)."""

ACCESSOR_TEXT = 60
"""About as many bytes more does the description of a sparse accessor take than that of a dense one."""

Recipe = Callable[[], Iterator[bytes]]


class GltfBuffer:
    """Accessors, buffer views and the bytes behind them."""

    def __init__(self) -> None:
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self.length = 0
        self._pieces: list[tuple[int, Recipe]] = []

    def add(
        self,
        values: NDArray[Any],
        component: int,
        *,
        target: int | None = None,
        bounds: bool = False,
        normalized: bool = False,
    ) -> int:
        """Add values (n,) or (n, width) and return the accessor's number."""
        array = np.ascontiguousarray(values, dtype=_TYPES[component])
        view = self._add_view(array.nbytes, lambda: iter([array.tobytes()]), target)
        accessor = {"bufferView": view, **_describe(array, component)}
        if bounds:
            accessor |= _bounds(array)
        if normalized:
            accessor["normalized"] = True
        return self._add_accessor(accessor)

    def add_recipe(self, count: int, recipe: Recipe) -> int:
        """Add ``count`` single-precision numbers that the recipe yields when the file is written."""
        view = self._add_view(4 * count, recipe, None)
        return self._add_accessor({"bufferView": view, "componentType": FLOAT, "count": count, "type": "SCALAR"})

    def add_displacements(self, values: NDArray[np.float32], *, bounds: bool) -> int:
        """Add (n, 3) displacements, dense or sparse (specification, 3.6.2.3), whichever is smaller."""
        values = np.ascontiguousarray(values, dtype="<f4")
        accessor: dict[str, Any] = _describe(values, FLOAT)
        if bounds:
            accessor |= _bounds(values)
        rows = np.flatnonzero(values.any(axis=1))
        component = BYTE if len(values) <= 2**8 else SHORT if len(values) <= 2**16 else INT
        index_size = np.dtype(_TYPES[component]).itemsize
        if len(rows) == 0:
            rows = np.zeros(1, dtype=np.int64)  # it might be left out altogether, but VTK refuses such a file
        if len(rows) * (12 + index_size) + ACCESSOR_TEXT >= values.nbytes:
            view = self._add_view(values.nbytes, lambda: iter([values.tobytes()]), VERTICES)
            return self._add_accessor({"bufferView": view, **accessor})
        places, moved = rows.astype(_TYPES[component]), values[rows]
        where = self._add_view(places.nbytes, lambda: iter([places.tobytes()]), None)
        what = self._add_view(moved.nbytes, lambda: iter([moved.tobytes()]), None)
        accessor["sparse"] = {  # VTK's reader wants the offsets said that the specification lets one leave out
            "count": len(rows),
            "indices": {"bufferView": where, "byteOffset": 0, "componentType": component},
            "values": {"bufferView": what, "byteOffset": 0},
        }
        return self._add_accessor(accessor)

    def pieces(self) -> Iterator[bytes]:
        """Yield the buffer from its first byte to its last."""
        for length, recipe in self._pieces:
            yield from recipe()
            yield b"\0" * (-length % 4)

    def _add_view(self, length: int, recipe: Recipe, target: int | None) -> int:
        view = {"buffer": 0, "byteOffset": self.length, "byteLength": length}
        if target is not None:
            view["target"] = target
        self.views.append(view)
        self._pieces.append((length, recipe))
        self.length += length + -length % 4
        return len(self.views) - 1

    def _add_accessor(self, accessor: dict[str, Any]) -> int:
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _describe(array: NDArray[Any], component: int) -> dict[str, Any]:
    width = 1 if array.ndim == 1 else array.shape[1]
    return {"componentType": component, "count": len(array), "type": _KINDS[width]}


def _bounds(array: NDArray[Any]) -> dict[str, list[float]]:
    table = array.reshape(len(array), -1)
    return {"min": table.min(axis=0).tolist(), "max": table.max(axis=0).tolist()}
