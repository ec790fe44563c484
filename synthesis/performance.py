"""What a face does over time, with everything that is to be seen beside it: the input of playback and films."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..arrays import check_array
from ..errors import InputError, RigError
from .rig import Rig


@dataclass(frozen=True)
class Performance:
    """A rig, its weights over time, and what is shown with them.

    Parameters
    ----------
    rig
        The face.
    weights
        (n_frames, n_shapes); a frame with NaN shows the neutral and says so.
    rate
        Frames per second, Hz.
    title
        What the caption says, usually the take's name.
    note
        A second, quieter line: ``"simulated"``, the signer, the solve.
    markers
        (n_frames, n_markers, 3) positions adapted to the rig, mm; NaN where a marker is missing. Optional.
    marker_vertices
        (n_markers,) the rig's vertices that these markers sit on; with them the fitted markers and the residuals are
        known. Optional.
    raw_markers
        (n_frames, any number, 3) the signer's own markers as stabilised, mm in rig space. Optional.
    tiers
        Segment tables by tier name, with the columns ``onset``, ``offset`` (frames, half-open) and ``label``; the
        first three are shown.
    energy
        (n_frames,) any curve to draw over the tiers, such as the motion energy. Optional.
    vertex_colours
        (n_vertices, 3) red, green, blue in [0, 1]; skin everywhere if not given.

    Raises
    ------
    InputError
        If the arrays do not fit together.
    """

    rig: Rig
    weights: NDArray[np.float64]
    rate: float
    title: str = ""
    note: str = ""
    markers: NDArray[np.float64] | None = None
    tiers: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    energy: NDArray[np.float64] | None = None
    vertex_colours: NDArray[np.float64] | None = None
    marker_vertices: NDArray[np.int64] | None = None
    raw_markers: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        weights = check_array(self.weights, name="weights", shape=(None, None))
        if weights.shape[1] != self.rig.n_shapes:
            raise RigError(f"weights: expected {self.rig.n_shapes} columns, one a shape, but got {weights.shape[1]}")
        if not len(weights):
            raise InputError("weights: expected at least one frame, but got none; there is nothing to show")
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise InputError(f"rate: expected a positive number of frames per second, but got {self.rate}")
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "rate", float(self.rate))
        if self.markers is not None:
            markers = check_array(self.markers, name="markers", shape=(len(weights), None, 3))
            object.__setattr__(self, "markers", markers)
        if self.raw_markers is not None:
            raw = check_array(self.raw_markers, name="raw markers", shape=(len(weights), None, 3))
            object.__setattr__(self, "raw_markers", raw)
        self._check_vertices()
        if self.energy is not None:
            object.__setattr__(self, "energy", check_array(self.energy, name="energy", shape=(len(weights),)))
        self._check_colours()
        for name, table in self.tiers.items():
            missing = {"onset", "offset", "label"} - set(table.columns)
            if missing:
                raise InputError(f"tier {name!r}: expected columns onset, offset, label, but got no {sorted(missing)}")

    def _check_colours(self) -> None:
        if self.vertex_colours is None:
            return
        colours = check_array(self.vertex_colours, name="vertex colours", shape=(self.rig.n_vertices, 3), finite=True)
        if colours.min() < 0 or colours.max() > 1:
            raise InputError(
                f"vertex colours: expected values from 0 to 1, but got {colours.min():g} to {colours.max():g}"
            )
        object.__setattr__(self, "vertex_colours", colours)

    def _check_vertices(self) -> None:
        if self.marker_vertices is None:
            return
        if self.markers is None:
            raise InputError("marker vertices: expected markers with them, but got none")
        vertices = check_array(
            self.marker_vertices, name="marker vertices", shape=(self.markers.shape[1],), dtype=np.int64
        )
        if vertices.size and not 0 <= vertices.min() <= vertices.max() < self.rig.n_vertices:
            raise RigError(f"marker vertices: expected 0 to {self.rig.n_vertices - 1}, but got {vertices.max()}")
        object.__setattr__(self, "marker_vertices", vertices)

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return len(self.weights)

    @property
    def duration(self) -> float:
        """Length in seconds, ``n_frames / rate``."""
        return self.n_frames / self.rate

    def label_at(self, tier: str, frame: int) -> str:
        """Return the label of the segment of ``tier`` that holds ``frame``, empty where there is none.

        Where segments overlap, the one that began last counts.
        """
        table = self.tiers[tier]
        onset, offset = table["onset"].to_numpy(), table["offset"].to_numpy()
        holds = np.flatnonzero((onset <= frame) & (frame < offset))
        return str(table["label"].iloc[holds[np.argmax(onset[holds])]]) if len(holds) else ""

    def frame_at(self, seconds: float) -> int:
        """Return the frame that is due ``seconds`` after the start; the last one holds."""
        return min(int(seconds * self.rate + 1e-6), self.n_frames - 1)

    def is_lost(self, frame: int) -> bool:
        """Return whether a weight of ``frame`` is not known."""
        return not bool(np.isfinite(self.weights[frame]).all())

    def fitted_at(self, frame: int) -> NDArray[np.float64] | None:
        """Return the markers as the weights of ``frame`` place them, (n_markers, 3), NaN where one is not known."""
        if self.marker_vertices is None:
            return None
        return self.rig.pose(self.weights[frame], self.marker_vertices)

    def residuals_at(self, frame: int) -> NDArray[np.float64] | None:
        """Return the distances of adapted and fitted markers in ``frame``, (n_markers,) mm, NaN where unknown."""
        fitted = self.fitted_at(frame)
        return None if fitted is None or self.markers is None else np.linalg.norm(self.markers[frame] - fitted, axis=1)


def count_clock_frames(first: Performance, beside: Performance | None) -> int:
    """Return the frames, at the first one's rate, until both performances have ended."""
    if beside is None:
        return first.n_frames
    return max(first.n_frames, int(np.ceil(beside.duration * first.rate - 1e-6)))
