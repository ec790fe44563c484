"""Chosen layouts beside k-means: error of the face on performances and identities that no choice has seen.

Run ``python benchmarks/layouts_choice.py --data DIR [--counts 10 20 40] [--seeds 20]``; DIR holds ``ict_facekit`` and
``arkit_recordings``. Layouts are chosen on the range-of-motion take and, where faces are used, on four training
identities of ICT (sums of standard-normal weights times identity modes). They are tried on three other identities and
three other takes: markers with 0.2 mm noise, the default adaptation, the default ``map`` solver with a prior of the
range-of-motion take's weights, the same for all. Errors are mean distances, mm, of every fourth moving vertex in every
20th frame (k-means learns from every 40th frame, the lost markers are tried in every 60th).

*Worst lost* is the mean error without the one marker whose loss does most harm. *True rig* solves the same markers of
an actor whose own rig is known, so that nothing but the markers' number, places and noise is left; what it lacks to the
error is the mismatch between two faces.
"""

from __future__ import annotations

import argparse
import time
from functools import cache
from pathlib import Path

import numpy as np
from mimique.models.layouts import find_moving_vertices, kmeans_layout, normalise_trajectories
from mimique.models.layouts.choice import choose_layout
from mimique.models.layouts.constraints import spread_points
from mimique.synthesis import Rig, WeightPrior, WeightSolver, read_rig, weight_methods
from mimique.synthesis.adaptation import Adaptation
from study_data import NOISE, RANGE_OF_MOTION, TESTS, on_rig, read_performance

TRAINING_SEED, TEST_SEED = 100, 20
STEP = 20


class Trial:
    """The rig, who performs what on it, and how well a layout tells it."""

    def __init__(self, data: Path) -> None:
        self.rig = read_rig(data / "ict_facekit" / "rig.npz", unit="cm")
        with np.load(data / "ict_facekit" / "identities.npz") as file:
            self.modes = file["deltas"].astype(float) * 10.0
        folder = data / "arkit_recordings" / "livelinkface"
        takes = {t: on_rig(read_performance(folder / f"{t}.csv"), self.rig) for t in (*TESTS, RANGE_OF_MOTION)}
        self.range_of_motion = takes.pop(RANGE_OF_MOTION)
        self.takes = takes
        self.training, self.tests = self.people(TRAINING_SEED, 4), self.people(TEST_SEED, 3)
        self.prior = WeightPrior.fit(self.range_of_motion)
        self.moving = find_moving_vertices(self.rig)
        self.checked = self.rig.deltas[:, self.moving[::4]].reshape(self.rig.n_shapes, -1)
        # The energy of the whole rig does not look at the markers; one second for each layout is one too many.
        shell = cache(lambda rig_id, form, k_s, k_b: thin_shell(self.rig, self.moving[:1], form, k_s, k_b))
        thin_shell = weight_methods.thin_shell_matrix
        weight_methods.thin_shell_matrix = lambda rig, _, form, k_s, k_b: shell(id(rig), form, k_s, k_b)

    def people(self, seed: int, count: int) -> list[Rig]:
        draws = np.random.default_rng(seed).normal(size=(count, len(self.modes)))
        faces = [self.rig.neutral + np.tensordot(w, self.modes, axes=1) for w in draws]
        return [Rig(face, self.rig.triangles, self.rig.deltas, self.rig.shapes) for face in faces]

    def error(self, layout: np.ndarray, *, step: int = STEP, own_rig: bool = False, lost: bool = False) -> float:
        """Mean vertex error, mm; with ``lost``, that without the marker whose loss does most harm."""
        solver = WeightSolver(self.rig, layout, prior=self.prior)
        rng = np.random.default_rng(1)
        errors = []
        for actor in self.tests:
            adapt = Adaptation.fit(actor.neutral[layout], self.rig.neutral[layout])
            for weights in self.takes.values():
                truth = weights[::step]
                noise = rng.normal(0, NOISE, (len(truth), len(layout), 3))
                seen = (self.rig.pose(truth, layout) + noise) if own_rig else adapt(actor.pose(truth, layout) + noise)
                errors.append(
                    [self._distance(solver, seen, truth, j) for j in (range(len(layout)) if lost else [None])]
                )
        return float(np.mean(errors, axis=0).max())

    def _distance(self, solver: WeightSolver, seen: np.ndarray, truth: np.ndarray, lost: int | None) -> float:
        if lost is not None:
            seen = seen.copy()
            seen[:, lost] = np.nan
        away = (solver.solve(seen) - truth) @ self.checked
        return float(np.linalg.norm(away.reshape(len(truth), -1, 3), axis=2).mean())


def inertia(rows: np.ndarray, moving: np.ndarray, layout: np.ndarray) -> float:
    """Sum of squared distances to the nearest chosen vertex: of several k-means, which fits best."""
    centres = rows[np.searchsorted(moving, layout)]
    squares = (rows**2).sum(1)[:, None] + (centres**2).sum(1) - 2.0 * rows @ centres.T
    return float(squares.min(1).sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--counts", type=int, nargs="+", default=[10, 15, 20, 30, 40])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument(
        "--no-losses", action="store_true", help="leave the lost markers out; they take most of the time"
    )
    options = parser.parse_args()
    trial = Trial(options.data)
    rig, learned = trial.rig, trial.range_of_motion
    faces = [rig, *trial.training]
    chosen = {
        "greedy": lambda k: choose_layout(faces, learned, k),
        "greedy, mirrored": lambda k: choose_layout(faces, learned, k, mirror=True),
        "greedy, rig alone": lambda k: choose_layout(rig, learned, k),
        "pivoted QR": lambda k: choose_layout(rig, learned, k, method="qr"),
    }
    every = trial.moving[spread_points(rig.neutral[trial.moving], 300)]
    print(f"300 markers, spread evenly: {trial.error(every, step=60):.3f} mm", flush=True)
    print("| markers | layout | error, mm | of k-means | worst lost, mm | of k-means | true rig, mm | seconds |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    rows = normalise_trajectories(rig.pose(learned[::40], trial.moving))
    for count in options.counts:
        start = time.perf_counter()
        draws = [kmeans_layout(rig, learned[::40], count, rng=np.random.default_rng(s)) for s in range(options.seeds)]
        spent = (time.perf_counter() - start) / len(draws)
        errors = [trial.error(d) for d in draws]
        middle = float(np.median(errors))
        typical = draws[int(np.argsort(errors)[len(errors) // 2])]
        tight = draws[int(np.argmin([inertia(rows, trial.moving, d) for d in draws]))]
        base: float | None = None
        for name, layout in (
            (f"k-means, median of {len(draws)}", typical),
            ("k-means, least inertia", tight),
            *chosen.items(),
        ):
            start = time.perf_counter()
            vertices = layout(count).vertices if callable(layout) else layout
            seconds = time.perf_counter() - start if callable(layout) else spent
            error = middle if layout is typical else trial.error(vertices)
            worst = np.nan if options.no_losses else trial.error(vertices, step=60, lost=True)
            base = worst if base is None else base
            known = trial.error(vertices, own_rig=True)
            print(
                f"| {count} | {name} | {error:.3f} | {error / middle:.2f} | {worst:.3f} | {worst / base:.2f} "
                f"| {known:.3f} | {seconds:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
