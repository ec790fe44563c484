"""What a study of marker layouts can start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...synthesis import Rig
from .choice import LEAST_MOTION
from .kmeans import find_moving_vertices
from .study_plan import Actor, StudyPlan

__all__ = ["check_actors"]


def check_actors(
    base: Rig, training: Sequence[Actor], unseen: Sequence[Actor], plan: StudyPlan
) -> tuple[list[Actor], list[str]]:
    """Refuse what cannot be studied, and leave out test takes that hardly move.

    Returns
    -------
    All actors, and a note on each take that was left out.

    Raises
    ------
    InputError
        See :func:`.run_study`.
    """
    actors = [*training, *unseen]
    if not training:
        raise InputError("layout study: expected at least one actor to learn from, but got none")
    names = [actor.name for actor in actors]
    if len(set(names)) < len(names):
        raise InputError(f"layout study: expected different names of actors, but got {', '.join(names)}")
    moving = find_moving_vertices(base)
    if max(plan.sizes) > len(moving):
        raise InputError(
            f"layout study: {max(plan.sizes)} markers are asked for, but only {len(moving)} vertices of the rig move"
        )
    kept, notes = [], []
    for actor in actors:
        _check_face(base, actor)
        moved = _measure_motion(actor.face, actor.range_of_motion)
        if not moved >= LEAST_MOTION:
            raise InputError(
                f"actor {actor.name}: the range of motion hardly moves the face ({moved:.3f} mm); choose another take "
                "for it"
            )
        sizes = {take: _measure_motion(actor.face, weights) for take, weights in actor.tests.items()}
        notes += [
            f"{actor.name}, {take}: it hardly moves the face ({size:.3f} mm), so it was left out"
            for take, size in sizes.items()
            if size < LEAST_MOTION
        ]
        tests = {take: weights for take, weights in actor.tests.items() if sizes[take] >= LEAST_MOTION}
        kept.append(replace(actor, tests=tests))
    if not any(actor.tests for actor in kept):
        raise InputError(
            "layout study: expected performances that move the face, beside the ranges of motion, to test on, but "
            "there are none"
        )
    return kept, notes


def _check_face(base: Rig, actor: Actor) -> None:
    face = actor.face
    if face.n_vertices != base.n_vertices or not np.array_equal(face.triangles, base.triangles):
        raise InputError(
            f"actor {actor.name}: expected the base rig's mesh ({base.n_vertices} vertices, {len(base.triangles)} "
            f"triangles), but got another ({face.n_vertices} vertices, {len(face.triangles)} triangles)"
        )
    if face.shapes != base.shapes:
        raise InputError(f"actor {actor.name}: expected the base rig's shapes in their order, but got others")


def _measure_motion(face: Rig, weights: NDArray[np.float64]) -> float:
    """Return the root mean square displacement of the skin that moves, mm."""
    moving = find_moving_vertices(face)
    if not len(moving):
        return 0.0
    skin = face.deltas[:, moving].reshape(face.n_shapes, -1)
    metric = skin @ skin.T * (3.0 / skin.shape[1])
    return float(np.sqrt(np.einsum("fi,ij,fj->f", weights, metric, weights).mean()))
