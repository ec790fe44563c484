"""The study of marker layouts of Reverdy 2019, ch. 3, and what it leaves open.

Layouts are learned on range-of-motion performances of actors in training; what they are worth is measured on other
performances, of these actors and of unseen ones, in three ways of making a face from markers (:mod:`.study_trials`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError, MimiqueError
from ...synthesis import Rig
from ...synthesis.face_regions import face_regions, forbidden_vertices
from ...synthesis.head_markers import head_markers
from ...synthesis.landmark_finder import FaceLandmarks
from .choice import Layout
from .constraints import spread_points
from .kmeans import find_moving_vertices
from .study_checks import check_actors
from .study_choices import Candidate, choose_orders, draw_clusters, make_candidate, place_sets, score_draws
from .study_plan import (
    CHOSEN,
    GREEDY,
    MEDIAN,
    MIRRORED,
    ONE_ACTOR,
    QR,
    SEVERAL,
    SOLVER,
    SWAPPED,
    TIGHTEST,
    Actor,
    LayoutStudy,
    PieceStore,
    StudyPlan,
)
from .study_tables import tabulate_bands, tabulate_errors, tabulate_robustness, tabulate_stability, tabulate_symmetry
from .study_trials import Trials, thin_frames

Vertices = NDArray[np.int64]

__all__ = ["run_study"]

N_EVERYWHERE = 300
"""Markers that stand for one on every vertex: more bring nothing."""


def run_study(
    base: Rig,
    training: Sequence[Actor],
    unseen: Sequence[Actor],
    plan: StudyPlan | None = None,
    *,
    rng: np.random.Generator,
    done: PieceStore | None = None,
    progress: Callable[[str, float], object] | None = None,
) -> LayoutStudy:
    """Compare layouts.

    Parameters
    ----------
    base
        The rig on which weights are solved.
    training
        Actors whose range-of-motion performances layouts, priors and regressions learn from; at least one.
    unseen
        Actors that nothing is learned from.
    plan
        What is asked.
    rng
        One number is drawn from it; everything random follows from that.
    done
        Where finished pieces are kept. It must tell apart other actors, plans and random numbers by itself.
    progress
        Told the name of each finished piece and its share of the whole, 0..1.

    Raises
    ------
    InputError
        If actors' meshes or shapes differ from the base rig's, a name comes twice, a range of motion hardly moves the
        face, more markers are asked for than vertices move, nothing is left to test on, or a set that was asked for by
        name cannot be placed.
    """
    plan = plan or StudyPlan()
    actors, notes = check_actors(base, training, unseen, plan)
    work = _Work(base, actors[: len(training)], actors[len(training) :], plan, int(rng.integers(2**31)), done, progress)
    work.notes += notes
    return work.run()


class _Work:
    def __init__(
        self,
        base: Rig,
        training: Sequence[Actor],
        unseen: Sequence[Actor],
        plan: StudyPlan,
        seed: int,
        done: PieceStore | None,
        progress: Callable[[str, float], object] | None,
    ) -> None:
        self.base, self.training, self.unseen, self.plan, self.seed = base, training, unseen, plan, seed
        self.done, self.progress = done, progress
        self.notes: list[str] = []
        self.landmarks: FaceLandmarks | None = None
        self.why = ""
        self.regions: dict[str, Vertices] = {}
        self.forbidden: Vertices | None = None
        self.skin = find_moving_vertices(base)
        self._study_face()
        self.trials = Trials(base, training, unseen, plan, self.skin, self.regions, seed)
        self.orders: dict[str, dict[int, Layout]] = {}
        self.draws: dict[str, dict[int, tuple[list[Vertices], Any]]] = {}
        single = [training[0]] if len(training) < 2 else training[:2]
        self.groups = {MEDIAN: list(training)}
        if ONE_ACTOR in plan.methods and len(training) > 1:
            self.groups |= {f"{ONE_ACTOR} {actor.name}": [actor] for actor in single}
        n_chosen = sum(method in plan.methods for method in CHOSEN)
        n_layouts = len(plan.sizes) * (len(self.groups) + 1 + n_chosen) + len(plan.sets)
        self.total = 2 * len(self.groups) * len(plan.sizes) + n_chosen + n_layouts * (len(plan.reconstructions) + 1) + 4

    def run(self) -> LayoutStudy:
        candidates, left_out = place_sets(self.base, self.plan, self.landmarks, self.why)
        self.notes += left_out
        candidates += self._cluster() + self._choose()
        scores = {}
        for c in candidates:
            for how in self.plan.reconstructions:
                given = c.scores if how == SOLVER else None
                scores[c.name, how] = self._score(c, how) if given is None else given
                self._tick(f"{c.name}, {how}")
        errors, regions = tabulate_errors(self.trials, candidates, scores)
        tested = [c for c in candidates if c.method not in (ONE_ACTOR, TIGHTEST)]
        robust = {}
        for c in tested:
            robust[c.name] = self.keep(f"robust {c.name}", lambda c=c: self._disturb(c.vertices))  # type: ignore[misc]
            self._tick(f"{c.name}, disturbed")
        every = float(self.keep("everywhere", self._cover)["error"])
        tables = {"errors": errors, "bootstrap": tabulate_bands(errors, self.seed), "regions": regions}
        tables |= tabulate_robustness(self.trials, tested, robust, every)
        tables["stability"] = tabulate_stability(self.base, self._vary())
        middle = None if self.landmarks is None else self.landmarks.surface.middle
        tables["symmetry"] = tabulate_symmetry(self.base, candidates, middle)
        twins = [c for c in candidates if c.method == MEDIAN] if SEVERAL in self.plan.methods else []
        if len(self.training) > 1 and twins:
            tables = {title: _add_several(table) for title, table in tables.items()}
            candidates += [_as_several(c) for c in twins]
        rows = [
            (c.name, c.method, c.size, m, v) for c in candidates for m, v in zip(c.markers, c.vertices, strict=True)
        ]
        self._tell()
        return LayoutStudy(
            tables,
            pd.DataFrame(rows, columns=["layout", "method", "K", "marker", "vertex"]),
            tuple(self.notes),
            self._parameters(),
            self._recommend(candidates),
            self._place_head(),
        )

    def keep(self, name: str, make: Callable[[], dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
        """Return what was kept under a name, or make it and keep it."""
        found = None if self.done is None else self.done.get(name)
        if found is None:
            found = make()
            if self.done is not None:
                self.done.put(name, found)
        return found

    def _tick(self, name: str, pieces: float = 1.0) -> None:
        if self.progress is not None:
            self.progress(name, pieces / self.total)

    def _study_face(self) -> None:
        """Find landmarks, regions and forbidden places, as far as the rig allows."""
        try:
            found = FaceLandmarks(self.base)
            banned = forbidden_vertices(self.base, landmarks=found)
            self.regions = face_regions(self.base, landmarks=found)
            kinds = ("inner_lips", "hidden") if self.plan.lids else ("lids", "inner_lips", "hidden")
            self.forbidden = np.unique(np.concatenate([banned[kind] for kind in kinds]))
            self.skin = np.setdiff1d(self.skin, banned["hidden"])
            self.landmarks = found
        except MimiqueError as error:
            self.why = str(error)
            self.notes.append(
                f"regions, forbidden places (lids, inner lips) and what is hidden are not known on this rig: {error}"
            )

    def _score(self, c: Candidate, how: str) -> NDArray[Any]:
        return self.keep(f"{how} of {c.name}", lambda: {"scores": self.trials.score_layout(c.vertices, how)})["scores"]

    def _cluster(self) -> list[Candidate]:
        out = []
        for group, actors in self.groups.items():
            draws = draw_clusters(self.skin, actors, self.plan, self.keep, self.seed, self._tick)
            self.draws[group] = draws
            for size, (drawn, inertia) in draws.items():
                scores, middle, tight = score_draws(self.trials, drawn, inertia, f"{group} {size}", self.keep)
                self._tick(f"{group}, {size} markers, solved")
                one = group != MEDIAN
                out.append(
                    make_candidate(
                        self.base,
                        f"{group} {size}",
                        ONE_ACTOR if one else MEDIAN,
                        size,
                        drawn[middle],
                        scores=scores,
                        draws=tuple(drawn),
                        n_actors=len(actors),
                    )
                )
                if not one and TIGHTEST in self.plan.methods:
                    name = f"{TIGHTEST} {size}"
                    out.append(
                        make_candidate(self.base, name, TIGHTEST, size, drawn[tight], n_actors=len(self.training))
                    )
        return out

    def _choose(self) -> list[Candidate]:
        out = []
        faces, weights = [a.face for a in self.training], self._motion(self.training)
        for method in (GREEDY, SWAPPED, MIRRORED, QR):
            if method not in self.plan.methods:
                continue
            self._tick(method)
            try:
                orders = self._choose_kept(f"choice {method}", faces, weights, method)
            except InputError as error:
                self.notes.append(f"{method} was left out: {error}")
                continue
            self.orders[method] = orders
            for size, layout in orders.items():
                out.append(
                    make_candidate(
                        self.base, f"{method} {size}", method, size, layout.order, n_actors=len(self.training)
                    )
                )
        return out

    def _choose_kept(
        self, name: str, faces: Sequence[Rig], weights: NDArray[Any], method: str, seed: int = 0
    ) -> dict[int, Layout]:
        def make() -> dict[str, NDArray[Any]]:
            found = choose_orders(self.base, faces, weights, self.plan, method, self.forbidden, seed=seed)
            return {f"{part} {k}": getattr(v, part) for k, v in found.items() for part in ("order", "curve")}

        kept = self.keep(name, make)
        return {
            k: Layout(np.sort(kept[f"order {k}"]), kept[f"order {k}"], kept[f"curve {k}"], {}) for k in self.plan.sizes
        }

    @staticmethod
    def _motion(actors: Sequence[Actor]) -> NDArray[Any]:
        """Return the actors' ranges of motion, one after the other, alike in length."""
        shown = min(len(a.range_of_motion) for a in actors)
        return np.concatenate([thin_frames(a.range_of_motion, min(shown, 2000)) for a in actors])

    def _disturb(self, vertices: Vertices) -> dict[str, NDArray[Any]]:
        noises = [self.trials.mean_error(vertices, noise=mm) for mm in self.plan.noises]
        offs = [self.trials.misplace(vertices, mm) for mm in self.plan.offs]
        return {
            "noise": np.array(noises),
            "off": np.array(offs),
            "error": np.array(self.trials.mean_error(vertices)),
            "own_rig": np.array(self.trials.mean_error(vertices, own_rig=True)),
            **self.trials.lose(vertices),
        }

    def _cover(self) -> dict[str, NDArray[Any]]:
        spread = self.skin[spread_points(self.base.neutral[self.skin], N_EVERYWHERE)]
        return {"error": np.array(self.trials.mean_error(spread))}

    def _vary(self) -> dict[tuple[str, int, str], list[Vertices]]:
        """Choose again with other seeds, takes and actors."""
        first = self.training[0]
        takes = [first, *(replace(first, range_of_motion=w) for w in first.tests.values())]
        found: dict[tuple[str, int, str], list[Vertices]] = {}
        for size, (drawn, _) in self.draws[MEDIAN].items():
            found["k-means", size, "seeds"] = drawn
        few = replace(self.plan, n_seeds=1)
        for over, others in (("takes", takes), ("actors", list(self.training))):
            for number, actor in enumerate(others):
                named = replace(actor, name=f"{actor.name}, {over} {number}")
                drawn_once = draw_clusters(self.skin, [named], few, self.keep, self.seed, lambda _: None)
                for size, (drawn, _) in drawn_once.items():
                    found.setdefault(("k-means", size, over), []).extend(drawn)
            self._tick(f"k-means over {over}")
        for method in (GREEDY, QR):
            for over, others in (("seeds", [first] * 3), ("takes", takes), ("actors", list(self.training))):
                if method not in self.plan.methods or (method == QR and over == "seeds"):
                    continue
                for number, actor in enumerate(others):
                    name = f"{method} over {over} {number}"
                    with suppress(InputError):  # a take that hardly moves says nothing about markers
                        chosen = self._choose_kept(
                            name, [actor.face], actor.range_of_motion, method, number if over == "seeds" else 0
                        )
                        for size, layout in chosen.items():
                            found.setdefault((method, size, over), []).append(layout.vertices)
            self._tick(f"{method} chosen again")
        return found

    def _recommend(self, candidates: Sequence[Candidate]) -> str:
        """Name a layout by its error on what it was learned from, by the rule of the plan."""
        mirrored = [c for c in candidates if c.method == MIRRORED] if self.plan.mirror else []
        able = (
            mirrored or [c for c in candidates if c.method in CHOSEN] or [c for c in candidates if c.method == MEDIAN]
        )

        def measure(c: Candidate) -> float:
            kept = self.keep(f"learned {c.name}", lambda: {"error": np.array(self.trials.training_error(c.vertices))})
            return float(kept["error"])

        able = [c for c in able if self.plan.wanted in (None, c.size)]
        errors = {c.name: measure(c) for c in able}
        best = {size: min(errors[c.name] for c in able if c.size == size) for size in {c.size for c in able}}
        size = min(size for size, error in best.items() if error <= self.plan.enough * min(best.values()))
        return min((c.name for c in able if c.size == size), key=lambda name: errors[name])

    def _place_head(self) -> dict[str, int]:
        if self.landmarks is None:
            return {}
        for count in (6, 5, 4):
            with suppress(InputError):
                return head_markers(self.base, count, landmarks=self.landmarks)
        self.notes.append("head markers: too little of this rig's head holds still; choose four to six by hand")
        return {}

    def _tell(self) -> None:
        plan, trials = self.plan, self.trials
        self.notes.append(
            f"errors are distances over {len(trials.checked)} of {trials.n_skin} vertices of the moving skin, in at "
            f"most {plan.n_frames} frames of each take, spread evenly; markers have {plan.noise:g} mm of noise"
        )
        self.notes.append(
            f"'{MEDIAN}' is the median over {plan.n_seeds} seeds with the solver; its other reconstructions and its "
            "disturbances are those of the seed whose solver error is the median"
        )
        if not self.unseen:
            self.notes.append("there is no unseen actor: all errors are on actors that layouts were learned from")
        if len(self.training) < 2:
            self.notes.append("one actor in training: layouts of one and of several actors cannot be compared")
        elif all(np.allclose(a.face.deltas, self.training[0].face.deltas, atol=1e-6) for a in self.training):
            self.notes.append(
                "the faces in training share their shapes' displacements, so that clustering one actor or several "
                "differs only where their performances do"
            )

    def _parameters(self) -> dict[str, Any]:
        return {
            **{key: list(value) if isinstance(value, tuple) else value for key, value in asdict(self.plan).items()},
            "training": [a.name for a in self.training],
            "unseen": [a.name for a in self.unseen],
            "takes": {a.name: list(a.tests) for a in (*self.training, *self.unseen)},
            "seed": self.seed,
        }


def _as_several(c: Candidate) -> Candidate:
    return replace(c, name=f"{SEVERAL} {c.size}", method=SEVERAL)


def _add_several(table: pd.DataFrame) -> pd.DataFrame:
    """Repeat the rows of k-means on all actors under its other name."""
    if "layout" not in table or "method" not in table:
        return table
    again = table[table["method"] == MEDIAN]
    again = again.assign(method=SEVERAL, layout=again["K"].map(lambda size: f"{SEVERAL} {size}"))
    return pd.concat([table, again], ignore_index=True)
