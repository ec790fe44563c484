"""Non-negative least squares (Lawson and Hanson 1974), frame by frame with SciPy: the baseline of the field.

Reverdy 2019, 2.3.3, names it as the usual way to keep weights from cancelling each other.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

Array = NDArray[np.floating[Any]]


class NonNegativeLeastSquares:
    """``argmin ‖d − B c‖²`` over ``c ≥ 0``."""

    def prepare(self, basis: Array) -> Callable[[Array], Array]:
        """Return a function from (F, rows) displacements to (F, N) weights for a (rows, N) basis."""
        return lambda displacements: np.array([nnls(basis, d)[0] for d in displacements]).reshape(-1, basis.shape[1])

    def data_term(self, squared_residuals: Array) -> Array:
        """Return ``‖r‖²`` per frame."""
        return squared_residuals

    def penalty(self, weights: Array) -> Array:
        """Return zeros; weights below zero are not allowed at all."""
        return np.where((weights < 0).any(1), np.inf, 0.0)
