"""Markers as small balls, and the lines from measured to fitted ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .drawing import add_actor, make_mesh
from .performance import Performance

MARKER_COLOURS = {"raw": "#c7a6ff", "adapted": "#f4f7fa", "fitted": "#38b6ff", "residuals": "#ffd400"}
"""One colour for each kind of marker, told apart also by people who see red and green alike."""

_SIZES = {"raw": 0.8, "adapted": 1.0, "fitted": 0.85}


class MarkerBalls:
    """One mesh of small balls; a missing marker's ball has no size.

    Parameters
    ----------
    renderer
        PyVista's renderer to draw with.
    n_markers
        Number of balls.
    radius
        Of an adapted marker, mm.
    kind
        ``raw``, ``adapted`` or ``fitted``.
    """

    def __init__(self, renderer: Any, n_markers: int, radius: float, kind: str) -> None:
        import pyvista as pv

        ball = pv.Icosphere(radius=1.0, nsub=1)
        self._unit = np.asarray(ball.points, dtype=np.float32)
        self._radius = radius * _SIZES[kind]
        faces = np.asarray(ball.regular_faces) + len(self._unit) * np.arange(n_markers)[:, None, None]
        self._mesh = make_mesh(np.zeros((n_markers * len(self._unit), 3)), faces.reshape(-1, 3))
        self._mesh.point_data["Normals"] = np.tile(self._unit, (n_markers, 1))
        shine = add_actor(renderer, self._mesh, MARKER_COLOURS[kind]).prop
        shine.ambient, shine.diffuse, shine.specular, shine.specular_power = 0.25, 0.75, 0.5, 30

    def place(self, centres: NDArray[np.float64], elsewhere: NDArray[np.float64]) -> None:
        """Put the balls at (n_markers, 3); those that are NaN shrink to nothing at ``elsewhere``."""
        seen = np.asarray(np.isfinite(centres).all(axis=1))
        middle = np.where(seen[:, None], centres, elsewhere)
        balls = middle[:, None] + np.where(seen, self._radius, 0.0)[:, None, None] * self._unit
        self._mesh.points = balls.reshape(-1, 3).astype(np.float32)


class ResidualLines:
    """Lines from adapted to fitted markers; one of which an end is missing has no length."""

    def __init__(self, renderer: Any, n_markers: int) -> None:
        import pyvista as pv

        cells = np.column_stack([np.full(n_markers, 2), np.arange(n_markers), np.arange(n_markers) + n_markers])
        self._mesh = pv.PolyData(np.zeros((2 * n_markers, 3), dtype=np.float32), lines=cells.ravel())
        line = add_actor(renderer, self._mesh, MARKER_COLOURS["residuals"]).prop
        line.line_width, line.lighting = 2.5, False

    def place(self, starts: NDArray[np.float64], ends: NDArray[np.float64], elsewhere: NDArray[np.float64]) -> None:
        """Draw the lines from (n_markers, 3) to (n_markers, 3)."""
        seen = np.isfinite(np.column_stack([starts, ends])).all(axis=1, keepdims=True)
        both = np.concatenate([np.where(seen, starts, elsewhere), np.where(seen, ends, elsewhere)])
        self._mesh.points = both.astype(np.float32)


class Markers:
    """All that is shown of a performance's markers.

    Parameters
    ----------
    renderer
        PyVista's renderer to draw with.
    performance
        Whose markers.
    kinds
        Of :data:`.view.MARKER_KINDS`; what the performance does not have is left out.
    radius
        Of a marker, mm.
    """

    def __init__(self, renderer: Any, performance: Performance, kinds: tuple[str, ...], radius: float) -> None:
        self.performance = performance
        self._elsewhere = performance.rig.neutral.mean(axis=0)
        self.kinds = find_shown_kinds(performance, kinds)
        """What is shown."""
        if "residuals" in self.kinds:
            radius *= 0.5  # residuals are about as long as a ball is wide, which would hide them
        self._balls: dict[str, MarkerBalls] = {}
        for kind in self.kinds:
            if kind != "residuals":
                source = performance.raw_markers if kind == "raw" else performance.markers
                assert source is not None
                self._balls[kind] = MarkerBalls(renderer, source.shape[1], radius, kind)
        self._lines: ResidualLines | None = None
        if "residuals" in self.kinds:
            assert performance.markers is not None
            self._lines = ResidualLines(renderer, performance.markers.shape[1])

    def show(self, frame: int) -> None:
        """Bring all to ``frame``."""
        p = self.performance
        fitted = p.fitted_at(frame) if self._lines is not None or "fitted" in self._balls else None
        places = {
            "raw": None if p.raw_markers is None else p.raw_markers[frame],
            "adapted": None if p.markers is None else p.markers[frame],
            "fitted": fitted,
        }
        for kind, balls in self._balls.items():
            centres = places[kind]
            assert centres is not None
            balls.place(centres, self._elsewhere)
        if self._lines is not None and fitted is not None and p.markers is not None:
            self._lines.place(p.markers[frame], fitted, self._elsewhere)


def find_shown_kinds(performance: Performance, kinds: tuple[str, ...]) -> tuple[str, ...]:
    """Return those of ``kinds`` that the performance has at least one marker of."""
    p = performance
    adapted = p.markers is not None and p.markers.shape[1] > 0
    fitted = adapted and p.marker_vertices is not None
    raw = p.raw_markers is not None and p.raw_markers.shape[1] > 0
    there = {"raw": raw, "adapted": adapted, "fitted": fitted, "residuals": fitted}
    return tuple(kind for kind in there if kind in kinds and there[kind])
