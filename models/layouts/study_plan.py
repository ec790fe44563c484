"""What a study of marker layouts is made of: actors, what is asked, and what comes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...arrays import check_array
from ...errors import InputError
from ...synthesis import Rig
from .named_sets import NAMED_SETS

__all__ = [
    "METHODS",
    "RECONSTRUCTIONS",
    "Actor",
    "LayoutStudy",
    "PieceStore",
    "StudyPlan",
]

MEDIAN, TIGHTEST, ONE_ACTOR, SEVERAL = (
    "k-means median",
    "k-means best inertia",
    "k-means one actor",
    "k-means several actors",
)
GREEDY, SWAPPED, MIRRORED, QR = "greedy", "greedy + swaps", "greedy, mirrored", "pivoted QR"
CHOSEN = (SWAPPED, GREEDY, MIRRORED, QR)
METHODS = (MEDIAN, TIGHTEST, ONE_ACTOR, SEVERAL, GREEDY, SWAPPED, MIRRORED, QR)
"""How layouts of any size are chosen; STAR and MAN sets have sizes of their own."""

SOGP, SOLVER, THIN_SHELL = "sogp", "solver", "thin shell"
RECONSTRUCTIONS = (SOGP, SOLVER, THIN_SHELL)
"""How a face is made from markers: Reverdy's regression, the default weight solver, the bare sheet of skin."""


class PieceStore(Protocol):
    """Where finished pieces of a study are kept, so that an interrupted one goes on."""

    def get(self, name: str) -> dict[str, NDArray[Any]] | None:
        """Return the arrays kept under a name, or None."""

    def put(self, name: str, arrays: dict[str, NDArray[Any]]) -> None:
        """Keep arrays under a name."""


@dataclass(frozen=True)
class Actor:
    """A face and what it performs.

    Parameters
    ----------
    name
        Unique in a study.
    face
        Rig with the triangles and shapes of the study's base rig.
    range_of_motion
        (n_frames, n_shapes) weights, finite.
    tests
        Weights of other performances, by name.
    rate
        Hz.
    """

    name: str
    face: Rig
    range_of_motion: NDArray[np.float64]
    tests: Mapping[str, NDArray[np.float64]]
    rate: float = 30.0

    def __post_init__(self) -> None:
        """Check that all performances are weights of the face."""
        for what, weights in {"range of motion": self.range_of_motion, **self.tests}.items():
            checked = check_array(
                weights, name=f"actor {self.name}, {what}", shape=(None, self.face.n_shapes), finite=True
            )
            if len(checked) < 2:
                raise InputError(f"actor {self.name}, {what}: expected two frames or more, but got {len(checked)}")


@dataclass(frozen=True)
class StudyPlan:
    """What a study asks.

    Parameters
    ----------
    sizes
        Numbers of markers.
    methods
        Of :data:`METHODS`.
    sets
        Names of marker sets (:data:`.NAMED_SETS`); those that the rig cannot carry are left out with a note.
    named
        Sets that were asked for by name: refused where the rig cannot carry them.
    reconstructions
        Of :data:`RECONSTRUCTIONS`.
    n_seeds
        Draws of k-means.
    noise
        Deviation of each coordinate of a marker, mm, unless another is the question.
    noises, offs
        Noise, and distance of a marker from its place on the skin, whose effect is measured; mm.
    n_frames
        Frames of each test performance at most, spread evenly; the loss of markers sees ``n_loss_frames``.
    n_rom_frames
        Frames of a range of motion that the regression learns from, at most.
    n_cluster_frames
        Frames of each actor that k-means sees, at most.
    n_checked
        Vertices of the skin that moves, spread evenly through their numbers, that errors are measured at; at most.
    n_pairs
        Pairs of lost markers that are tried, at most.
    budget
        Basis vectors of the regression.
    min_distance
        mm between two markers of a chosen layout.
    n_candidates
        About how many vertices chosen layouts choose among. On a head of 11 000 vertices 1500, some 7 mm apart, were
        better than 500, 12 mm apart, on the ranges of motion that layouts were learned from.
    lids
        Whether chosen layouts may have markers on the lids.
    mirror
        Whether a mirror symmetric layout is recommended, where the rig allows one. Performances are nearly symmetric,
        so that one side tells of the other; a face that is not, as in signing, needs markers on both.
    wanted
        Number of markers of the recommended layout, one of ``sizes``; by the next rule if left out.
    enough
        The recommended layout is the smallest whose error on the ranges of motion that it was chosen on, solved from
        virtual markers, is at most so many times the least of all sizes; of this size the best chosen one.
    """

    sizes: tuple[int, ...] = (10, 15, 20, 30, 40)
    methods: tuple[str, ...] = METHODS
    sets: tuple[str, ...] = NAMED_SETS
    named: tuple[str, ...] = ()
    reconstructions: tuple[str, ...] = RECONSTRUCTIONS
    n_seeds: int = 20
    noise: float = 0.2
    noises: tuple[float, ...] = (0.0, 0.1, 0.2, 0.5, 1.0)
    offs: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0, 5.0)
    n_frames: int = 80
    n_loss_frames: int = 16
    n_rom_frames: int = 600
    n_cluster_frames: int = 80
    n_checked: int = 1500
    n_pairs: int = 60
    budget: int = 300
    min_distance: float = 8.0
    n_candidates: int = 1500
    lids: bool = False
    mirror: bool = True
    wanted: int | None = None
    enough: float = 1.1

    def __post_init__(self) -> None:
        """Check names and ranges."""
        for what, names, known in (
            ("methods", self.methods, METHODS),
            ("sets", (*self.sets, *self.named), NAMED_SETS),
            ("reconstructions", self.reconstructions, RECONSTRUCTIONS),
        ):
            for name in names:
                if name not in known:
                    raise InputError(f"{what}: expected some of {', '.join(known)}, but got {name!r}")
        if not self.sizes or min(self.sizes) < 1:
            raise InputError(f"sizes: expected numbers of markers, 1 or more, but got {self.sizes}")
        if self.wanted is not None and self.wanted not in self.sizes:
            raise InputError(f"wanted: expected one of the sizes {self.sizes}, but got {self.wanted}")
        if SOLVER not in self.reconstructions:
            raise InputError(f"reconstructions: {SOLVER!r} is what layouts are compared by; leave it in")
        numbers = (self.n_seeds, self.n_loss_frames, self.n_rom_frames, self.n_cluster_frames, self.n_checked)
        if min(*numbers, self.n_frames, self.n_pairs, self.budget, self.n_candidates) < 1:
            raise InputError("plan: every number of frames, seeds, vertices and pairs must be 1 or more")
        if not (min((self.noise, *self.noises, *self.offs)) >= 0 and self.enough >= 1):
            raise InputError("plan: noise and distances must be 0 mm or more, and enough 1 or more")

    @classmethod
    def quick(cls, **more: Any) -> StudyPlan:
        """Return a plan that takes a fraction of the time: fewer sizes, seeds and frames."""
        small: dict[str, Any] = {
            "sizes": (10, 20, 40),
            "n_seeds": 5,
            "n_frames": 40,
            "n_loss_frames": 6,
            "n_rom_frames": 300,
            "n_cluster_frames": 30,
            "n_checked": 800,
            "n_pairs": 20,
            "n_candidates": 800,
            "budget": 100,
        }
        return cls(**(small | more))


@dataclass(frozen=True)
class LayoutStudy:
    """What a study found.

    Parameters
    ----------
    tables
        By title, one row a number's set:

        - ``errors``: layout, method, set, K, trained_on (the actor whom regression and prior learned from), tested_on,
          same_actor, reconstruction, take, frames, rmse_printed, rmse_mm, mean_mm, p95_mm
        - ``bootstrap``: layout, method, set, K, reconstruction, tested (unseen or training), n_pairs,
          mean_mm, low, high
        - ``regions``: as ``errors`` up to ``take``, then region, mean_mm
        - ``noise``, ``misplacement``, ``losses``, ``mismatch``: layout, K and what was done to it
        - ``stability``: method, K, over (seeds, takes or actors), jaccard, jaccard_near
        - ``symmetry``: layout, method, K, trained_on_n_actors, asymmetry_mm
        - ``labels``, where there are labelled takes: layout, K, accuracy, macro_f1
    layouts
        layout, method, K, marker, vertex; the rows of a layout in the order in which people number them.
    notes
        Sentences that a reader of the numbers should know.
    parameters
        The plan, the actors and their roles.
    recommended
        Name of a layout.
    head_markers
        The rigid markers that every capture needs: name to vertex; empty where the rig has no place for them.
    """

    tables: dict[str, pd.DataFrame]
    layouts: pd.DataFrame
    notes: tuple[str, ...]
    parameters: dict[str, Any]
    recommended: str
    head_markers: dict[str, int] = field(default_factory=dict)

    def layout(self, name: str | None = None) -> pd.DataFrame:
        """Return ``marker, vertex`` of a layout, by default of the recommended one.

        Raises
        ------
        InputError
            If there is none of that name.
        """
        wanted = self.recommended if name is None else name
        rows = self.layouts[self.layouts["layout"] == wanted]
        if rows.empty:
            known = ", ".join(dict.fromkeys(self.layouts["layout"]))
            raise InputError(f"layout: expected one of {known}, but got {wanted!r}")
        return rows[["marker", "vertex"]].reset_index(drop=True)
