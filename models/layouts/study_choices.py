"""The layouts that a study compares: named sets, k-means, and chosen ones. All are learned on actors in training."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...synthesis import Rig
from ...synthesis.landmark_finder import FaceLandmarks
from .choice import Layout, choose_layout
from .kmeans import cluster_trajectories, normalise_trajectories
from .named_sets import place_named_set
from .study_plan import MIRRORED, QR, SWAPPED, Actor, StudyPlan
from .study_trials import Trials, thin_frames

Array = NDArray[np.floating[Any]]
Vertices = NDArray[np.int64]
Keep = Callable[[str, Callable[[], dict[str, NDArray[Any]]]], dict[str, NDArray[Any]]]
"""Returns what was kept under a name, or makes it and keeps it."""

VARIANCE = 0.999
ROW = 8.0
"""Height in mm of the rows in which people read a face."""


@dataclass(frozen=True)
class Candidate:
    """A layout of the study.

    Parameters
    ----------
    name, method, set_name, size
        Its columns in the tables; ``size`` is what was asked for.
    vertices, markers
        In the order of their numbers.
    scores
        (n_cases, n_scores) of the solver, where the layout stands for several draws; else None.
    draws
        The vertices of these.
    n_actors
        From how many actors it was learned.
    """

    name: str
    method: str
    set_name: str
    size: int
    vertices: Vertices
    markers: tuple[str, ...]
    scores: Array | None = None
    draws: tuple[Vertices, ...] = field(default=(), repr=False)
    n_actors: int = 0


def order_for_people(rig: Rig, vertices: Vertices) -> Vertices:
    """Sort vertices from the forehead down, and from the subject's right to the left within a row of 8 mm."""
    places = rig.neutral[vertices]
    return vertices[np.lexsort((places[:, 0], -np.round(places[:, 1] / ROW)))]


def make_candidate(rig: Rig, name: str, method: str, size: int, vertices: Vertices, **more: Any) -> Candidate:
    """Return a candidate with markers M01, M02 and so on."""
    ordered = order_for_people(rig, vertices)
    markers = tuple(f"M{k:02d}" for k in range(1, len(ordered) + 1))
    return Candidate(name, method, "", size, ordered, markers, **more)


def place_sets(
    rig: Rig, plan: StudyPlan, landmarks: FaceLandmarks | None, why: str
) -> tuple[list[Candidate], list[str]]:
    """Place the plan's named sets; those that the rig cannot carry become notes, or are refused if named."""
    found, notes = [], []
    for name in dict.fromkeys((*plan.named, *plan.sets)):
        try:
            if landmarks is None:
                raise InputError(f"{name}: {why}")
            table = place_named_set(rig, name, landmarks=landmarks)
        except InputError as error:
            if name in plan.named:
                raise
            notes.append(f"the set {name} was left out: {error}")
            continue
        kind = "MAN" if name.startswith("MAN") else "STAR"
        markers = tuple(str(m) for m in table["marker"])
        found.append(Candidate(name, kind, name, len(table), table["vertex"].to_numpy(), markers))
    return found, notes


def draw_clusters(
    skin: Vertices, actors: Sequence[Actor], plan: StudyPlan, keep: Keep, seed: int, tick: Callable[[str], None]
) -> dict[int, tuple[list[Vertices], Array]]:
    """Cluster the actors' trajectories side by side, ``n_seeds`` times for each size; return vertices and inertias."""
    who = ", ".join(actor.name for actor in actors)
    rows: list[NDArray[np.floating[Any]]] = []

    def trajectories() -> NDArray[np.floating[Any]]:
        if not rows:
            shown = [a.face.pose(thin_frames(a.range_of_motion, plan.n_cluster_frames), skin) for a in actors]
            rows.append(_compress(np.hstack([normalise_trajectories(positions) for positions in shown])))
        return rows[0]

    def draw(size: int) -> dict[str, NDArray[Any]]:
        vertices, inertia = np.full((plan.n_seeds, size), -1, dtype=np.int64), np.empty(plan.n_seeds)
        for number in range(plan.n_seeds):
            places, inertia[number] = cluster_trajectories(
                trajectories(), size, rng=np.random.default_rng([seed, 5, number])
            )
            vertices[number, : len(places)] = skin[places]
        return {"vertices": vertices, "inertia": inertia}

    out = {}
    for size in plan.sizes:
        kept = keep(f"clusters of {who}, {size}", lambda size=size: draw(size))  # type: ignore[misc]
        out[size] = [row[row >= 0] for row in kept["vertices"]], kept["inertia"]
        tick(f"k-means, {size} markers")
    return out


def _compress(rows: NDArray[np.float64]) -> NDArray[np.float32]:
    """Turn rows into the few directions that hold 99.9 % of their squares: nearly the same distances, much sooner."""
    squares, ways = np.linalg.eigh(rows.T @ rows)
    kept = np.searchsorted(np.cumsum(squares), (1.0 - VARIANCE) * squares.sum())
    return (rows @ ways[:, kept:]).astype(np.float32)


def score_draws(
    trials: Trials, draws: Sequence[Vertices], inertia: Array, name: str, keep: Keep
) -> tuple[Array, int, int]:
    """Return the median over draws of each score, the draw whose mean error is the middle one, the tightest draw."""
    kept = keep(f"draws of {name}", lambda: {"scores": np.array([trials.score_layout(d) for d in draws])})
    scores = kept["scores"]
    means = scores[:, :, 2].mean(axis=1)
    return np.median(scores, axis=0), int(np.argsort(means, kind="stable")[len(means) // 2]), int(np.argmin(inertia))


def choose_orders(
    base: Rig,
    faces: Sequence[Rig],
    weights: Array,
    plan: StudyPlan,
    method: str,
    forbidden: Vertices | None,
    *,
    seed: int = 0,
) -> dict[int, Layout]:
    """Choose layouts of all sizes; without swaps a larger one begins with the smaller."""

    def choose(size: int) -> Layout:
        return choose_layout(
            [base, *faces],
            weights,
            size,
            method="qr" if method == QR else "greedy",
            mirror=method == MIRRORED,
            forbidden=forbidden,
            min_distance=plan.min_distance,
            n_candidates=plan.n_candidates,
            n_swaps=1 if method in (SWAPPED, MIRRORED) else 0,
            rng=np.random.default_rng([0, seed]),
        )

    if method in (SWAPPED, MIRRORED):
        return {size: choose(size) for size in plan.sizes}
    whole = choose(max(plan.sizes))
    return {
        size: Layout(np.sort(whole.order[:size]), whole.order[:size], whole.curve[:size], whole.parameters)
        for size in plan.sizes
    }
