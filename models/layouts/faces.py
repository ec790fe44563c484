"""What the rig is shown of other people's faces: the mismatch that layouts have to live with.

A signer's markers come to the rig by a map between two faces at rest (:mod:`mimique.synthesis.adaptation`), and what
moves through it arrives bent. Where the faces of other people are known, their markers are taken through such a map,
which is fitted to many points, so that it does not change with the layout. Where they are not, faces are imagined on
which each displacement is multiplied by ``I + m N(x)``, with ``N`` a 3 × 3 field of standard normal numbers that
changes smoothly over the skin: neighbours err alike, so that more markers at one place do not average it out.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...synthesis import Rig
from ...synthesis.adaptation import Adaptation
from .constraints import spread_points

__all__ = ["bend_displacements", "carry_displacements"]

Array = NDArray[np.floating[Any]]

MAP_POINTS = 60
"""Points that the map between two faces is fitted to."""
WAVES = 64
"""Random waves that make a smooth field (Rahimi and Recht 2007)."""
REACH = 0.25
"""Length over which a field changes, as a part of the face's largest extent."""


def carry_displacements(rig: Rig, actor: Rig, vertices: NDArray[np.int64], weights: Array) -> Array:
    """Return (n_vertices, 3, n_frames), mm, what the actor's vertices show on the rig.

    Parameters
    ----------
    rig
        On which weights are solved.
    actor
        The other face, of the same topology and shapes.
    vertices
        Which vertices.
    weights
        (n_frames, n_shapes) of the actor's performance.

    Raises
    ------
    InputError
        If the two differ in their vertices or shapes.
    """
    if actor.n_vertices != rig.n_vertices or actor.shapes != rig.shapes:
        raise InputError(
            f"rigs: expected the same vertices and shapes on every face, {rig.n_vertices} and {rig.n_shapes}, "
            f"but got {actor.n_vertices} and {actor.n_shapes}; one topology at a time"
        )
    fitted = vertices[spread_points(rig.neutral[vertices], MAP_POINTS)]
    adapt = Adaptation.fit(actor.neutral[fitted], rig.neutral[fitted])
    moved = adapt.carry(actor.pose(weights, vertices)) - adapt.carry(actor.neutral[vertices])
    return np.ascontiguousarray(moved.transpose(1, 2, 0))


def bend_displacements(displacements: Array, positions: Array, mismatch: float, rng: np.random.Generator) -> Array:
    """Return displacements as one imagined face shows them.

    Parameters
    ----------
    displacements
        (n_vertices, 3, n_frames), mm.
    positions
        (n_vertices, 3) of the neutral, mm.
    mismatch
        ``m``, the deviation of each entry of the field; no unit.
    rng
        Draws the field.
    """
    extent = float(np.ptp(positions, axis=0).max())
    if mismatch == 0 or not extent > 0:
        return displacements
    waves = rng.normal(0.0, 1.0 / (REACH * extent), (WAVES, 3))
    phases = np.cos(positions @ waves.T + rng.uniform(0.0, 2.0 * np.pi, WAVES))
    field = np.sqrt(2.0 / WAVES) * (phases @ rng.normal(size=(WAVES, 9))).reshape(-1, 3, 3)
    return displacements + mismatch * (field @ displacements)
