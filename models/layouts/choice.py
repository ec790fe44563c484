"""Choosing a layout: how many markers, on which face, under which constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import check_array
from ...errors import InputError
from ...synthesis import Rig, WeightPrior
from ...synthesis.maximum_posterior import NOISE
from ...synthesis.thin_shell import rig_length
from .constraints import Places, find_places
from .faces import bend_displacements, carry_displacements
from .greedy import choose_greedily
from .kmeans import find_moving_vertices
from .pivoted_qr import choose_by_qr
from .reconstruction import Reconstruction
from .swaps import improve_by_swaps

__all__ = ["Layout", "choose_layout"]

Array = NDArray[np.floating[Any]]

METHODS = ("greedy", "qr")
MISMATCH = 0.03
"""Default mismatch: from ICT's identities to its rig, displacements come out 5 to 7 % of their length off, which is
``√3 m`` for m = 0.03 to 0.04. It also serves beside known faces, for those to come are others."""
IMAGINED = 4
"""How many faces are imagined where none but the rig is given."""
FRAMES = 100
"""Frames of each face that the error is measured on."""
LEAST_MOTION = 0.05
"""Root mean square displacement of the moving skin, mm, below which a performance says nothing about markers."""


@dataclass(frozen=True)
class Layout:
    """Where markers sit, and how good that is expected to be.

    Parameters
    ----------
    vertices
        (n_markers,) vertex numbers, sorted.
    order
        The same in the order chosen: its first part is a good layout of fewer markers (after swaps not quite so).
    curve
        (n_steps, 2) number of markers and expected root mean square error of the moving skin, mm, on the training
        performance; the last row is that of the whole layout, after swaps.
    parameters
        What it was chosen with.
    """

    vertices: NDArray[np.int64]
    order: NDArray[np.int64]
    curve: Array
    parameters: dict[str, Any]


def choose_layout(
    rigs: Rig | Sequence[Rig],
    weights: ArrayLike,
    n_markers: int,
    *,
    method: str = "greedy",
    mirror: bool | ArrayLike = False,
    forbidden: ArrayLike | None = None,
    keep: ArrayLike | None = None,
    min_distance: float = 8.0,
    noise: float = 0.4,
    mismatch: float = MISMATCH,
    loss: float = 0.2,
    n_swaps: int = 1,
    n_candidates: int = 500,
    prior: WeightPrior | None = None,
    rng: np.random.Generator | None = None,
) -> Layout:
    """Choose vertices for markers by the error of the face that is reconstructed from them.

    Parameters
    ----------
    rigs
        The rig on which weights will be solved, alone or followed by the faces of other people with the same topology
        and shapes; with them the layout is made to bear the differences between faces.
    weights
        (n_frames, n_shapes) of a range-of-motion performance; every face performs it.
    n_markers
        How many, exactly; kept ones count.
    method
        ``greedy`` (:mod:`.greedy`) or ``qr`` (:mod:`.pivoted_qr`); the latter looks neither at mismatch nor loss.
    mirror
        Whether the layout is mirror symmetric; or (n_vertices,) the mirrored vertex of each vertex, −1 where none is.
        Symmetry is easier to glue and costs accuracy: left and right at different places tell more.
    forbidden
        Vertices that take no marker.
    keep
        Vertices that have one in any case.
    min_distance
        mm, straight, between any two markers on the rig's neutral.
    noise
        Deviation of each coordinate of a marker, mm: cameras, skin and placement together. On training faces twice the
        noise that the markers really had chose better layouts than that noise itself.
    mismatch
        How differently faces move: deviation of the factors by which displacements are bent (:mod:`.faces`), on the
        other faces where some are given, else on four imagined ones.
    loss
        Share of frames in which some marker is missing, 0..1.
    n_swaps
        Rounds of local swaps at most (:mod:`.swaps`).
    n_candidates
        About how many vertices to consider, spread evenly.
    prior
        Of the weights; learned from ``weights`` by default, as the default solver does.
    rng
        Draws the imagined faces; seed 0 by default.

    Raises
    ------
    InputError
        If a parameter is out of range, the constraints leave too few places, the faces differ in topology or shapes,
        or the performance hardly moves.
    """
    rig, others = (rigs, []) if isinstance(rigs, Rig) else _first(rigs)
    if method not in METHODS:
        raise InputError(f"method: expected {' or '.join(METHODS)}, but got {method!r}")
    for name, number, most in (("noise", noise, np.inf), ("mismatch", mismatch, 10.0), ("loss", loss, 1.0)):
        if not (np.isfinite(number) and 0 <= number <= most):
            raise InputError(f"{name}: expected a number from 0 to {most:g}, but got {number}")
    if n_swaps < 0 or n_candidates < 1:
        raise InputError("n_swaps and n_candidates: expected 0 or more, and 1 or more")
    performed = check_array(weights, name="weights", shape=(None, rig.n_shapes), finite=True)
    places = find_places(
        rig,
        n_markers,
        mirror=mirror,
        forbidden=forbidden,
        keep=keep,
        min_distance=min_distance,
        n_candidates=n_candidates,
    )
    rng = np.random.default_rng(0) if rng is None else rng
    likely = WeightPrior.fit(performed) if prior is None else prior
    problem = _pose_problem(rig, others, performed, places, likely, noise, mismatch, rng)
    if method == "greedy":
        units = choose_greedily(problem, places, n_markers, loss)
        steps = _curve(problem, units)
        units = improve_by_swaps(problem, places, units, n_swaps, loss)
    else:
        units = choose_by_qr(problem.basis, likely.covariance, NOISE * rig_length(rig), places, n_markers)
        steps = _curve(problem, units)
    order = places.vertices[[c for unit in units for c in unit]]
    steps[-1, 1] = _curve(problem, units)[-1, 1]
    parameters = {
        "method": method,
        "n_markers": n_markers,
        "mirror": mirror if isinstance(mirror, bool) else "given",
        "n_forbidden": 0 if forbidden is None else int(np.size(forbidden)),
        "keep": [] if keep is None else [int(v) for v in np.ravel(keep)],
        "min_distance": float(min_distance),
        "noise": float(noise),
        "mismatch": float(mismatch),
        "loss": float(loss),
        "n_swaps": int(n_swaps) if method == "greedy" else 0,
        "n_candidates": len(places.vertices),
        "n_faces": 1 + len(others),
        "n_frames": len(performed),
    }
    return Layout(np.sort(order), order, steps, parameters)


def _first(rigs: Sequence[Rig]) -> tuple[Rig, list[Rig]]:
    faces = list(rigs)
    if not faces:
        raise InputError("rigs: expected at least the rig on which weights are solved")
    return faces[0], faces[1:]


def _pose_problem(
    rig: Rig,
    others: list[Rig],
    weights: Array,
    places: Places,
    prior: WeightPrior,
    noise: float,
    mismatch: float,
    rng: np.random.Generator,
) -> Reconstruction:
    """Show every face's performance to the candidates."""
    if len(prior.mean) != rig.n_shapes:
        raise InputError(f"prior: expected {rig.n_shapes} shapes, as the rig has, but got {len(prior.mean)}")
    frames = weights[np.unique(np.linspace(0, len(weights) - 1, FRAMES).round().astype(int))]
    skin = rig.deltas[:, find_moving_vertices(rig)].reshape(rig.n_shapes, -1)
    metric = skin @ skin.T * (3.0 / skin.shape[1])
    motion = float(np.sqrt(np.einsum("fi,ij,fj->f", frames, metric, frames).mean()))
    if not motion >= LEAST_MOTION:
        raise InputError(
            f"weights: the performance hardly moves the face ({motion:.3f} mm); take a range-of-motion performance"
        )
    basis = rig.deltas[:, places.vertices].transpose(1, 2, 0)
    if others:
        shown = [carry_displacements(rig, face, places.vertices, frames) for face in others]
    else:
        shown = [basis @ frames.T] * (IMAGINED if mismatch > 0 else 1)
    bent = [bend_displacements(moved, places.positions, mismatch, rng) for moved in shown]
    precision = (NOISE * rig_length(rig)) ** 2 * np.linalg.inv(prior.covariance)
    return Reconstruction(basis, np.concatenate(bent, 2), np.tile(frames, (len(bent), 1)), precision, metric, noise)


def _curve(problem: Reconstruction, units: list[list[int]]) -> Array:
    """Return the number of markers after each unit and the expected root mean square error, mm."""
    chosen: list[int] = []
    rows = []
    for unit in units:
        chosen += unit
        error = problem.state(np.array(chosen, dtype=np.int64)).error()
        rows.append((float(len(chosen)), float(np.sqrt(max(error, 0.0)))))
    return np.array(rows)
