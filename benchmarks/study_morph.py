"""Which morph map brings an actor's markers to the rig best: kernel × affine part × ridge."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
from mimique.errors import MimiqueError
from mimique.synthesis import MorphMap, WeightSolver
from mimique.synthesis.alignment import align_points
from study_data import NOISE, Scene, place

KERNELS = ("triharmonic", "biharmonic", "thin-plate", "gaussian", "multiquadric")
FORMS = ((True, 0.0), (True, 0.01), (True, 0.1), (True, 1.0), (False, 0.0), (False, 0.1))  # Affine part, ridge.
DISPLACEMENTS = "none: displacements copied"
SCALED = "none: displacements scaled"  # By the similarity of the two sets of markers.
COPIES = (DISPLACEMENTS, SCALED)
STEP = 48


def compare_maps(scene: Scene, quick: bool) -> pd.DataFrame:
    """One row per actor and map: errors in mm, of markers (without noise) and of the solved face (with noise)."""
    rig, vertices = scene.rig, scene.vertices
    truth = np.concatenate([w[::STEP] for w in scene.tests.values()])
    true_markers = rig.pose(truth, vertices) - rig.neutral[vertices]
    true_held = rig.pose(truth, scene.held_out) - rig.neutral[scene.held_out]
    true_face = rig.pose(truth, scene.checked)
    solver = WeightSolver(rig, vertices, method="bounded")
    rows = []
    for number, actor in enumerate(scene.actors[:2] if quick else scene.actors):
        rng = np.random.default_rng([31, number])
        exact = place(actor, scene.marked()).on(actor, scene.perform(truth))
        noisy = exact + rng.normal(0, NOISE, exact.shape)
        neutral = actor.neutral[scene.marked()]
        maps = [*((copy, (False, 0.0)) for copy in COPIES), *itertools.product(KERNELS, FORMS)]
        for kernel, (affine, ridge) in maps:
            row = {"scene": scene.name, "actor": number, "kernel": kernel, "affine": affine, "ridge": ridge}
            options = {"kernel": kernel, "affine": affine, "ridge": ridge}
            align = align_points(neutral, rig.neutral[vertices], scale=kernel == SCALED)
            homeward = align_points(rig.neutral[vertices], neutral, scale=kernel == SCALED)
            try:
                if kernel in COPIES:
                    there = _copy(align, neutral, rig.neutral[vertices])
                    back = _copy(homeward, rig.neutral[vertices], neutral)
                else:
                    there = _adapt(align, neutral, rig.neutral[vertices], options)
                    back = _adapt(homeward, rig.neutral[vertices], neutral, options)
            except MimiqueError:
                rows.append(row)
                continue
            # A ridge takes the neutral off its place, so displacements count from the mapped neutral.
            shift = rig.neutral[vertices] - there(neutral)
            seen = there(exact) + shift
            rows.append(row | _errors(seen - rig.neutral[vertices], true_markers, "marker"))
            if kernel not in COPIES and len(scene.held_out):
                held = there(actor.pose(truth, scene.held_out)) - there(actor.neutral[scene.held_out])
                rows[-1] |= _errors(held, true_held, "held_out")
            # (4.1) divided by the number of markers: there and back again.
            home = neutral - back(rig.neutral[vertices])
            rows[-1]["round_trip"] = float(np.linalg.norm(back(seen) + home - exact, axis=2).mean())
            weights = solver.solve(there(noisy) + shift)
            face = np.linalg.norm(rig.pose(weights, scene.checked) - true_face, axis=2)
            rows[-1] |= {
                "rmse": float(np.sqrt(((weights - truth) ** 2).mean())),
                "mean": float(face.mean()),
                "p95": float(np.percentile(face, 95)),
            }
    return pd.DataFrame(rows)


def _adapt(align, source: np.ndarray, target: np.ndarray, options: dict):
    morph = MorphMap.fit(align.apply(source), target, **options)
    return lambda points: morph(align.apply(points))


def _copy(align, source: np.ndarray, target: np.ndarray):
    rest = align.apply(source)
    return lambda points: align.apply(points) - rest + target


def _errors(made: np.ndarray, true: np.ndarray, name: str) -> dict[str, float]:
    return {name: float(np.linalg.norm(made - true, axis=2).mean())}
