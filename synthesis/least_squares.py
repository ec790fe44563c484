"""Weights without any prior knowledge: plain least squares (Reverdy 2019, 2.7-2.8), the simplest baseline."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .small_products import times

Array = NDArray[np.floating[Any]]


class LeastSquares:
    """``argmin ‖d − B c‖²``; where several weights are equally good, the smallest."""

    def prepare(self, basis: Array) -> Callable[[Array], Array]:
        """Return a function from (F, rows) displacements to (F, N) weights for a (rows, N) basis."""
        inverse = np.ascontiguousarray(np.linalg.pinv(basis).T)
        return lambda displacements: times(displacements, inverse)

    def data_term(self, squared_residuals: Array) -> Array:
        """Return ``‖r‖²`` per frame."""
        return squared_residuals

    def penalty(self, weights: Array) -> Array:
        """Return zeros: nothing is penalised."""
        return np.zeros(len(weights))
