"""How far the weights of every frame can be trusted: what is left over, and what the face would have to do.

Per frame, so that frames can be found that stand out: a marker that swapped its name, a hand before the face, a shape
that the rig does not have.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from .thin_shell import thin_shell_matrix

if TYPE_CHECKING:
    from .weight_solver import WeightSolver

Array = NDArray[np.floating[Any]]

ACTIVE = 0.02
"""A shape counts as used above this weight: less moves no point of a face by more than about half a millimetre."""

CONSPICUOUS = 6.0
"""Deviations above the median at which a frame stands out; of normal ones a billionth does."""

LEAST_DEVIATION = 0.05
"""Smallest deviation, as a part of the median, that counts: a very even take must not flag every other frame."""

MAD_TO_DEVIATION = 1.4826
"""What makes a normal sample's median absolute deviation its standard deviation."""


@dataclass(frozen=True)
class Diagnosis:
    """Four numbers a frame; NaN where the frame has no weights.

    Parameters
    ----------
    residual
        (F,) root mean square, mm, of the distances between the markers that are seen and where the weights put them.
    cardinality
        (F,) how many weights are above ``ACTIVE`` in size.
    roughness
        (F,) thin-shell energy of the face ``cᵀ E c`` (2.16) divided by that of the rig's median shape at weight 1.
    bound_violation
        (F,) how far the weight that is furthest outside 0..1 is outside.
    """

    residual: Array
    cardinality: Array
    roughness: Array
    bound_violation: Array


def diagnose(solver: WeightSolver, positions: ArrayLike, weights: ArrayLike) -> Diagnosis:
    """Return the diagnosis of solved frames.

    Parameters
    ----------
    solver
        The solver that found the weights, or another one of the same rig and markers.
    positions
        (F, P, 3) as given to it, mm.
    weights
        (F, n_shapes).
    """
    distances = solver.residuals(positions, weights)
    c = np.asarray(weights, dtype=float)
    seen = np.isfinite(distances)
    solved = np.isfinite(c).all(axis=1)
    squares = np.where(seen, distances, 0.0) ** 2
    count = seen.sum(axis=1)
    residual = np.sqrt(squares.sum(axis=1) / np.maximum(count, 1))
    energy = thin_shell_matrix(solver.rig, solver.vertices, "energy", solver.options.k_s, solver.options.k_b)
    own = np.diag(energy)
    median = float(np.median(own[own > 0])) if (own > 0).any() else np.nan
    outside = np.maximum(-c, c - 1.0).max(axis=1, initial=0.0)

    def where_solved(values: Array) -> Array:
        return np.where(solved, values, np.nan)

    return Diagnosis(
        np.where(solved & (count > 0), residual, np.nan),
        where_solved((np.abs(c) > ACTIVE).sum(axis=1).astype(float)),
        where_solved(np.einsum("fi,ij,fj->f", c, energy, c, optimize=True) / median),
        where_solved(outside),
    )


def find_conspicuous_frames(residual: ArrayLike, k: float = CONSPICUOUS) -> NDArray[np.bool_]:
    """Return (F,) which frames' residuals stand out from the take's: exceed :func:`find_residual_threshold`.

    Parameters
    ----------
    residual
        (F,) mm; NaN never stands out.
    k
        How many deviations, above 0.

    Raises
    ------
    InputError
        If ``k`` is not above 0.
    """
    values = check_array(residual, name="residual", shape=(None,))
    with np.errstate(invalid="ignore"):
        return np.asarray(values > find_residual_threshold(values, k))


def find_residual_threshold(residual: ArrayLike, k: float = CONSPICUOUS) -> float:
    """Return the residual in mm above which a frame stands out from the take's; NaN where none is known.

    It is the median and ``k`` robust standard deviations: 1.4826 times the median absolute deviation, and at least 0.05
    times the median.

    Parameters
    ----------
    residual
        (F,) mm, NaN where unknown.
    k
        How many deviations, above 0.

    Raises
    ------
    InputError
        If ``k`` is not above 0.
    """
    values = check_array(residual, name="residual", shape=(None,))
    if not k > 0:
        raise InputError(f"k: expected a number above 0, but got {k}")
    known = values[np.isfinite(values)]
    if not len(known):
        return float("nan")
    median = float(np.median(known))
    deviation = max(MAD_TO_DEVIATION * float(np.median(np.abs(known - median))), LEAST_DEVIATION * median)
    return median + k * deviation
