"""A rig: a neutral mesh and the shapes that move it (Reverdy 2019, 5.1.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import NotFoundError, RigError


@dataclass(frozen=True)
class Rig:
    """Neutral mesh plus blendshapes.

    Parameters
    ----------
    neutral
        (n_vertices, 3) positions, mm; +X the subject's left, +Y up, +Z out of the face.
    triangles
        (n_triangles, 3) vertex numbers from zero, counter-clockwise seen from outside.
    deltas
        (n_shapes, n_vertices, 3) displacement of every vertex at weight 1, mm.
    shapes
        n_shapes names, in the order and spelling of the file that they come from.
    parts
        Name and number of triangles of each part (skin, eyes, teeth), in the order of the triangles, which run part by
        part. Empty: the rig is one part.

    Raises
    ------
    RigError
        If the arrays do not fit together: no shapes, names that repeat, triangles that point nowhere, NaN.
    """

    neutral: NDArray[np.float64]
    triangles: NDArray[np.int64]
    deltas: NDArray[np.float64]
    shapes: tuple[str, ...]
    parts: tuple[tuple[str, int], ...] = ()

    def __init__(
        self,
        neutral: ArrayLike,
        triangles: ArrayLike,
        deltas: ArrayLike,
        shapes: Sequence[str],
        parts: Sequence[tuple[str, int]] = (),
    ) -> None:
        neutral = check_array(neutral, name="rig neutral", shape=(None, 3), finite=True)
        triangles = check_array(triangles, name="rig triangles", shape=(None, 3), dtype=np.int64)
        names = tuple(str(s) for s in shapes)
        if not names:
            raise RigError("rig: it has no shapes; a rig needs at least one blendshape")
        repeated = sorted({n for n in names if names.count(n) > 1})
        if repeated:
            raise RigError(f"rig: shape names repeat: {', '.join(repeated)}; rename them")
        deltas = check_array(deltas, name="rig deltas", shape=(None, None, 3), finite=True)
        if deltas.shape[:2] != (len(names), len(neutral)):
            raise RigError(
                f"rig: expected deltas for {len(names)} shapes × {len(neutral)} vertices, "
                f"but got {deltas.shape[0]} × {deltas.shape[1]}; all shapes must share the neutral's topology"
            )
        if triangles.size and (triangles.min() < 0 or triangles.max() >= len(neutral)):
            raise RigError(f"rig: a triangle names vertex {triangles.max()}, but there are {len(neutral)} vertices")
        counted = tuple((str(name), int(count)) for name, count in parts)
        if counted and (min(c for _, c in counted) < 0 or sum(c for _, c in counted) != len(triangles)):
            raise RigError(
                f"rig: expected parts of {len(triangles)} triangles together, but got "
                f"{', '.join(f'{name} {count}' for name, count in counted)}"
            )
        object.__setattr__(self, "parts", counted)
        object.__setattr__(self, "neutral", neutral)
        object.__setattr__(self, "triangles", triangles)
        object.__setattr__(self, "deltas", deltas)
        object.__setattr__(self, "shapes", names)

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.neutral)

    @property
    def n_shapes(self) -> int:
        """Number of blendshapes."""
        return len(self.shapes)

    def index(self, shape: str) -> int:
        """Return the position of ``shape`` among the shapes.

        Raises
        ------
        NotFoundError
            If the rig has no such shape.
        """
        try:
            return self.shapes.index(shape)
        except ValueError:
            raise NotFoundError(f"rig: no shape {shape!r}; it has {', '.join(self.shapes)}") from None

    def pose(self, weights: ArrayLike, vertices: ArrayLike | None = None) -> NDArray[np.float64]:
        """Return the mesh for some weights, ``V = C·B`` (5.2, 5.3).

        Parameters
        ----------
        weights
            (..., n_shapes).
        vertices
            Vertex numbers to compute, all by default.

        Returns
        -------
        (..., n_vertices, 3) positions, mm.
        """
        weights = check_array(weights, name="weights")
        if weights.shape[-1:] != (self.n_shapes,):
            raise RigError(f"weights: expected {self.n_shapes} columns, one a shape, but got shape {weights.shape}")
        chosen = slice(None) if vertices is None else np.asarray(vertices, dtype=np.int64)
        neutral, deltas = self.neutral[chosen], self.deltas[:, chosen]
        moved = weights.reshape(-1, self.n_shapes) @ deltas.reshape(self.n_shapes, -1)
        return neutral + moved.reshape(*weights.shape[:-1], *neutral.shape)

    def to_dataset(self) -> xr.Dataset:
        """Return the rig as the dataset that a corpus stores."""
        return xr.Dataset(
            {
                "neutral": (("vertex", "space"), self.neutral),
                "triangles": (("triangle", "corner"), self.triangles),
                "deltas": (("shape", "vertex", "space"), self.deltas),
            },
            {"shape": list(self.shapes), "space": ["x", "y", "z"]},
            {"unit": "mm"} | ({"parts": [list(part) for part in self.parts]} if self.parts else {}),
        )

    @classmethod
    def from_dataset(cls, dataset: xr.Dataset) -> Rig:
        """Return the rig that :meth:`to_dataset` stored."""
        return cls(
            dataset["neutral"].values,
            dataset["triangles"].values,
            dataset["deltas"].values,
            [str(name) for name in dataset["shape"].values],
            [(name, count) for name, count in dataset.attrs.get("parts", ())],
        )
