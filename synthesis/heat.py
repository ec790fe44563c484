"""Heat maps on the skin: how far it moved, or how far the fit is from the markers, in mm.

The colours are those of *viridis* (S. van der Walt and N. Smith, Matplotlib 2.0) without its darkest part, which would
swallow the face's shading: even steps look even, also to people with the common kinds of colour blindness and in grey.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..errors import InputError
from .moving_mesh import MovingMesh
from .performance import Performance

_SAMPLES = 64  # frames from which the scale is chosen
_NICE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0)


@lru_cache(maxsize=1)
def colour_table() -> NDArray[np.uint8]:
    """Return the colours from the least to the greatest value, (256, 3)."""
    import matplotlib

    table = matplotlib.colormaps["viridis"](np.linspace(0.18, 1, 256))[:, :3]
    return np.round(table * 255).astype(np.uint8)


class Heat:
    """Colours of a performance's skin.

    ``displacement`` is a vertex's distance from its place in the neutral; what no shape moves, such as hair, keeps its
    own colour. ``residual`` is known at the markers; between them it is their mean, weighted by ``exp(-d²/2s²)`` of the
    distance ``d`` in the neutral, with ``s`` the median distance of neighbouring markers; farther away the skin shows.

    Parameters
    ----------
    performance
        What is shown.
    what
        ``displacement`` or ``residual``.

    Raises
    ------
    InputError
        If residuals are asked for and not known.
    """

    def __init__(self, performance: Performance, what: str) -> None:
        self.performance = performance
        self.what = what
        self._neutral = performance.rig.neutral.astype(np.float32)
        reach = np.linalg.norm(performance.rig.deltas, axis=2).max(axis=0)
        self._movable = np.clip(reach / max(0.03 * reach.max(), 1e-9), 0, 1).astype(np.float32)
        if what == "residual":
            if performance.marker_vertices is None or not len(performance.marker_vertices):
                raise InputError(
                    f"heat: the residual of {performance.title or 'this performance'} is not known, since it has no "
                    "markers on this rig; choose displacement"
                )
            self._kernel = self._spread(performance.marker_vertices)
        self.ceiling = self._choose_ceiling()
        """The value at the upper end of the scale, mm."""

    def values(self, frame: int, mesh: MovingMesh) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return values (n_vertices,) in mm and how much they count against the skin's own colour, 0 to 1."""
        if self.what == "displacement":
            return np.linalg.norm(mesh.points - self._neutral, axis=1), self._movable
        found = self.performance.residuals_at(frame)
        residuals = np.full(self._kernel.shape[1], np.nan) if found is None else found
        seen = np.isfinite(residuals)
        total = self._kernel @ seen.astype(np.float32)
        summed = self._kernel @ np.where(seen, residuals, 0).astype(np.float32)
        values = np.divide(summed, total, out=np.zeros_like(summed), where=total > 1e-6)
        return values, np.minimum(total * 1.6, 1)

    def colours(self, frame: int, mesh: MovingMesh, skin: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the colours (n_vertices, 3) of ``frame``, to which ``mesh`` has been brought."""
        values, share = self.values(frame, mesh)
        hot = colour_table()[np.clip(values * (255 / self.ceiling), 0, 255).astype(np.int64)]
        mixed = skin + share[:, None] * (hot.astype(np.float32) - skin)
        return np.asarray(np.round(mixed).astype(np.uint8))

    def _spread(self, vertices: NDArray[np.int64]) -> NDArray[np.float32]:
        places = self.performance.rig.neutral[vertices]
        spacing = 10.0
        if len(places) > 1:
            spacing = max(float(np.median(cKDTree(places).query(places, k=2)[0][:, 1])), 1.0)
        squared = ((self.performance.rig.neutral[:, None] - places) ** 2).sum(axis=2)
        return np.exp(-squared / (2 * spacing**2)).astype(np.float32)

    def _choose_ceiling(self) -> float:
        """Choose the scale for the whole take from some of its frames, rounded up: colours mean the same throughout."""
        p = self.performance
        frames = np.unique(np.linspace(0, p.n_frames - 1, _SAMPLES).astype(int))
        if self.what == "residual":
            found = np.concatenate([np.atleast_1d(p.residuals_at(int(f))) for f in frames])  # type: ignore[arg-type]
            found = found[np.isfinite(found)]
            high = float(np.percentile(found, 95)) if found.size else 0.0
        else:
            mesh, high = MovingMesh(p.rig), 0.0
            for frame in frames:
                mesh.pose(p.weights[frame])
                moved = np.linalg.norm(mesh.points[mesh.moved] - self._neutral[mesh.moved], axis=1)
                high = max(high, float(np.percentile(moved, 99.5)) if moved.size else 0.0)
        return round_up(high)


def round_up(value: float) -> float:
    """Return the least of 1, 1.5, 2, 3, 5, 7.5, times a power of ten, that is no less than ``value``; 1 for 0."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(power * step for step in _NICE if power * step >= value * (1 - 1e-9)))
