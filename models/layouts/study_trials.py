"""Virtual captures of a study: what markers show of an actor's performance, and how well the face is made from them.

The markers sit on the actor's own face. Three ways lead from them to its mesh:

- ``solver``: the markers are adapted to the *base rig* by their neutral, the default solver finds weights there, with
  the prior of the teacher's range of motion, and the weights move the actor's face;
- ``sogp``: regression learned from the teacher's markers and weights, each actor scaled by the own range of motion
  (Reverdy 2019, 3.4.3); its weights move the actor's face;
- ``thin shell``: the neutral of the actor's face, bent by the markers alone.

The *teacher* of an actor in training is the actor; that of an unseen one is an actor in training.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...synthesis import Rig, WeightPrior, WeightSolver
from ...synthesis.adaptation import Adaptation
from ...synthesis.thin_shell_deformation import ThinShellDeformation
from ..regression.marker_regression import MarkerRegression, MarkerScale
from .misplacement import Sites, place_beside
from .study_plan import SOGP, SOLVER, Actor, StudyPlan

Array = NDArray[np.floating[Any]]
Vertices = NDArray[np.int64]

__all__ = ["SCORES", "Case", "Trials", "thin_frames"]

N_SOLVERS = 12
"""Prepared solvers that are kept."""
SCORES = ("rmse_printed", "rmse_mm", "mean_mm", "p95_mm")


@dataclass(frozen=True)
class Case:
    """One actor's take, thinned: the number of the actor and of the case, and the true weights."""

    number: int
    actor: int
    take: str
    weights: Array


def thin_frames(weights: Array, n_frames: int) -> Array:
    """Return at most so many frames, spread evenly from the first to the last."""
    return weights[np.unique(np.linspace(0, len(weights) - 1, min(n_frames, len(weights))).round().astype(int))]


class Trials:
    """All captures of a study; everything random comes from ``seed``, so that every layout meets the same draws.

    ``skin`` are the vertices at which errors are measured, or rather an even sample of them.
    """

    def __init__(
        self,
        base: Rig,
        training: Sequence[Actor],
        unseen: Sequence[Actor],
        plan: StudyPlan,
        skin: Vertices,
        regions: Mapping[str, Vertices],
        seed: int,
    ) -> None:
        self.base, self.plan, self.seed = base, plan, seed
        self.actors, self.n_training = [*training, *unseen], len(training)
        self.n_skin = len(skin)
        self.checked = skin[:: -(-len(skin) // plan.n_checked)]
        self.regions = {name: np.flatnonzero(np.isin(self.checked, found)) for name, found in regions.items()}
        self.cases = [
            Case(0, number, take, thin_frames(weights, plan.n_frames))
            for number, actor in enumerate(self.actors)
            for take, weights in actor.tests.items()
        ]
        self.cases = [Case(n, c.actor, c.take, c.weights) for n, c in enumerate(self.cases)]
        self.learned = [
            Case(len(self.cases) + number, number, "range of motion", thin_frames(actor.range_of_motion, plan.n_frames))
            for number, actor in enumerate(training)
        ]
        self.asked = [c for c in self.cases if c.actor >= self.n_training] or self.cases
        roms = [actor.range_of_motion for actor in training]
        # Faces that perform the same share prior and solver.
        self._same = [next(j for j in range(i + 1) if np.array_equal(roms[j], roms[i])) for i in range(len(roms))]
        self._priors = {i: WeightPrior.fit(roms[i]) for i in dict.fromkeys(self._same)}
        self._solvers: dict[tuple[bytes, int, int], WeightSolver] = {}
        self._deltas = [a.face.deltas[:, self.checked].reshape(a.face.n_shapes, -1) for a in self.actors]

    def teacher(self, actor: int) -> int:
        """Return the number of the actor in training from whom the reconstruction of an actor is learned."""
        return actor if actor < self.n_training else (actor - self.n_training) % self.n_training

    def score(self, distances: Array) -> Array:
        """Return :data:`SCORES`, then the mean of each region; of (n_frames, n_checked) distances, mm.

        The first is (3.5) as printed over all of the skin that moves, of which the checked vertices are a sample.
        """
        rmse = float(np.sqrt((distances**2).mean()))
        means = [float(distances[:, part].mean()) if len(part) else np.nan for part in self.regions.values()]
        whole = [rmse * np.sqrt(self.n_skin), rmse, float(distances.mean()), float(np.percentile(distances, 95))]
        return np.array(whole + means)

    def score_layout(self, vertices: Vertices, reconstruction: str = SOLVER) -> Array:
        """Return (n_cases, n_scores) of a layout."""
        if reconstruction == SOLVER:
            return np.array([self.score(d) for d in self.solve(vertices, self.cases)])
        made = self._regress(vertices) if reconstruction == SOGP else self._bend(vertices)
        return np.array([self.score(d) for d in made])

    def solve(
        self,
        vertices: Vertices,
        cases: Sequence[Case],
        *,
        noise: float | None = None,
        sites: Sites | None = None,
        own_rig: bool = False,
    ) -> Iterator[Array]:
        """Yield the (n_frames, n_checked) distances of what the solver makes of each case.

        Parameters
        ----------
        vertices
            Where the solver thinks the markers are.
        cases
            Some of :attr:`cases`.
        noise
            mm; the plan's by default.
        sites
            Where they really are.
        own_rig
            Whether the solver has the actor's face for a rig, instead of the base rig.
        """
        for actor, mine in _by_actor(cases):
            solver, adapt = self._prepare(vertices, actor, sites, own_rig)
            for case in mine:
                seen = self._see(case, vertices, sites, noise)
                yield self._distances(actor, solver.solve(adapt(seen)), case.weights)

    def lose(self, vertices: Vertices) -> dict[str, NDArray[Any]]:
        """Return what happens without one marker and without two, whichever they are.

        Returns
        -------
        ``one`` (n_markers,) mean errors, mm, without each marker; ``pairs`` (n_pairs, 2) places in ``vertices`` and
        ``two`` (n_pairs,) mean errors. Where there are more pairs than the plan's, they are drawn, after the pairs
        among the five markers whose loss does most harm.
        """
        n = len(vertices)
        one = self._lose_sets(vertices, [(j,) for j in range(n)])
        worst = list(combinations(np.argsort(one)[::-1][:5].tolist(), 2))
        every = [p for p in combinations(range(n), 2) if p not in worst and p[::-1] not in worst]
        if len(every) > self.plan.n_pairs:
            drawn = np.random.default_rng([self.seed, 3]).choice(len(every), self.plan.n_pairs, replace=False)
            every = [every[i] for i in np.sort(drawn)]
        pairs = np.array(worst + every, dtype=np.int64).reshape(-1, 2)
        two = self._lose_sets(vertices, [tuple(p) for p in pairs.tolist()]) if n > 2 else np.full(len(pairs), np.nan)
        return {"one": one, "pairs": pairs, "two": two, "n_worst": np.array(len(worst))}

    def misplace(self, vertices: Vertices, off: float) -> float:
        """Return the mean error, mm, with every marker glued so far from its place; mean over two draws."""
        errors = []
        for draw in range(2):
            rng = np.random.default_rng([self.seed, 4, draw])
            sites = place_beside(self.base, vertices, off, rng)
            errors += [float(d.mean()) for d in self.solve(vertices, self.asked, sites=sites)]
        return float(np.mean(errors))

    def mean_error(self, vertices: Vertices, *, noise: float | None = None, own_rig: bool = False) -> float:
        """Return the mean error, mm, over the cases of unseen actors, or all where there are none."""
        return float(np.mean([d.mean() for d in self.solve(vertices, self.asked, noise=noise, own_rig=own_rig)]))

    def training_error(self, vertices: Vertices) -> float:
        """Return the mean error, mm, on the ranges of motion that layouts are learned from."""
        return float(np.mean([d.mean() for d in self.solve(vertices, self.learned)]))

    def _lose_sets(self, vertices: Vertices, sets: Sequence[tuple[int, ...]]) -> Array:
        errors = np.zeros(len(sets))
        for actor, mine in _by_actor(self.asked):
            solver, adapt = self._prepare(vertices, actor, None, False)
            for case in mine:
                few = Case(case.number, actor, case.take, thin_frames(case.weights, self.plan.n_loss_frames))
                seen = np.repeat(adapt(self._see(few, vertices, None, None))[None], len(sets), axis=0)
                for row, lost in enumerate(sets):
                    seen[row][:, list(lost)] = np.nan
                made = solver.solve(seen.reshape(-1, *seen.shape[2:]))
                away = self._distances(actor, made, np.tile(few.weights, (len(sets), 1)))
                errors += away.reshape(len(sets), -1).mean(axis=1)
        return errors / len(self.asked)

    def _regress(self, vertices: Vertices) -> Iterator[Array]:
        teachers: dict[int, MarkerRegression] = {}
        for actor, mine in _by_actor(self.cases):
            number = self.teacher(actor)
            if number not in teachers:
                shown = thin_frames(self.actors[number].range_of_motion, self.plan.n_rom_frames)
                teachers[number] = MarkerRegression.fit(self._see_rom(number, vertices), shown, budget=self.plan.budget)
            scale = MarkerScale.fit(self._see_rom(actor, vertices))
            for case in mine:
                made = teachers[number].predict(self._see(case, vertices, None, None), actor_rom=scale)
                yield self._distances(actor, np.asarray(made), case.weights)

    def _bend(self, vertices: Vertices) -> Iterator[Array]:
        for actor, mine in _by_actor(self.cases):
            sheet = ThinShellDeformation(self.actors[actor].face, vertices)
            for case in mine:
                moved = sheet.displacements(self._see(case, vertices, None, None), self.checked)
                true = (case.weights @ self._deltas[actor]).reshape(moved.shape)
                yield np.linalg.norm(moved - true, axis=2)

    def _prepare(
        self, vertices: Vertices, actor: int, sites: Sites | None, own_rig: bool
    ) -> tuple[WeightSolver, Adaptation]:
        face = self.actors[actor].face
        rig = face if own_rig else self.base
        neutral = face.neutral[vertices] if sites is None else sites.neutral(face)
        key = (vertices.tobytes(), actor if own_rig else -1, self._same[self.teacher(actor)])
        if key not in self._solvers:
            while len(self._solvers) > N_SOLVERS:
                self._solvers.pop(next(iter(self._solvers)))
            self._solvers[key] = WeightSolver(rig, vertices, prior=self._priors[key[2]])
        return self._solvers[key], Adaptation.fit(neutral, rig.neutral[vertices])

    def _see(self, case: Case, vertices: Vertices, sites: Sites | None, noise: float | None) -> Array:
        face = self.actors[case.actor].face
        true = face.pose(case.weights, vertices) if sites is None else sites.on(face, case.weights)
        rng = np.random.default_rng([self.seed, 1, case.number])
        return np.asarray(true + rng.normal(0.0, self.plan.noise if noise is None else noise, true.shape))

    def _see_rom(self, actor: int, vertices: Vertices) -> Array:
        shown = thin_frames(self.actors[actor].range_of_motion, self.plan.n_rom_frames)
        true = self.actors[actor].face.pose(shown, vertices)
        return np.asarray(true + np.random.default_rng([self.seed, 2, actor]).normal(0, self.plan.noise, true.shape))

    def _distances(self, actor: int, made: Array, true: Array) -> Array:
        away = (made - true) @ self._deltas[actor]
        return np.linalg.norm(away.reshape(len(true), -1, 3), axis=2)


def _by_actor(cases: Sequence[Case]) -> Iterator[tuple[int, list[Case]]]:
    for actor in dict.fromkeys(case.actor for case in cases):
        yield actor, [case for case in cases if case.actor == actor]
