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
        (n_frames, n_markers, 3) positions in rig space, mm; NaN where a marker is missing. Optional.
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
        if self.energy is not None:
            object.__setattr__(self, "energy", check_array(self.energy, name="energy", shape=(len(weights),)))
        if self.vertex_colours is not None:
            colours = check_array(
                self.vertex_colours, name="vertex colours", shape=(self.rig.n_vertices, 3), finite=True
            )
            if colours.min() < 0 or colours.max() > 1:
                raise InputError(
                    f"vertex colours: expected values from 0 to 1, but got {colours.min():g} to {colours.max():g}"
                )
            object.__setattr__(self, "vertex_colours", colours)
        for name, table in self.tiers.items():
            missing = {"onset", "offset", "label"} - set(table.columns)
            if missing:
                raise InputError(f"tier {name!r}: expected columns onset, offset, label, but got no {sorted(missing)}")

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
