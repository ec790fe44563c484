"""LSTS exactly as printed (Reverdy 2019, 5.30), for comparison.

``J(c) = ‖r‖ + α_ts ‖(AB)_nc c‖² + 3 S α_b E_b(c)``, ``α_ts + α_b = 1``, ``A = −k_s L + k_b L²``, S the vertices,

the data term *not* squared, lengths in a unit that the thesis does not state and that changes the weights, since
``‖r‖``, ``L`` and ``L²`` scale differently. Use :mod:`.lsts` for anything but comparison.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .lsts import SoftBounds

Array = NDArray[np.floating[Any]]

# ‖r‖ has a corner at 0; it is rounded off over this length, in the given unit.
CORNER = 1e-9
LAST_STEP = 1e-6
MAX_STEPS = 200


class PublishedLSTS:
    """The printed objective; basis and displacements come in the stated unit.

    Parameters
    ----------
    shell
        (N, N) ``(AB)_ncᵀ (AB)_nc`` in that unit.
    n_vertices
        S.
    alpha
        α_ts in 0..1.
    s, l_inf, l_sup
        Parameters of the bounds.
    """

    def __init__(self, shell: Array, n_vertices: int, alpha: float, s: float, l_inf: float, l_sup: float) -> None:
        self.shell, self.alpha = shell, alpha
        self.bounds = SoftBounds(3.0 * n_vertices * (1.0 - alpha), s, l_inf, l_sup)

    def prepare(self, basis: Array) -> Callable[[Array], Array]:
        """Return a function from (F, rows) displacements to (F, N) weights for a (rows, N) basis, frame by frame."""
        start = np.full(basis.shape[1], 0.5 * (self.bounds.l_inf + self.bounds.l_sup))
        return lambda displacements: np.array([self._solve_frame(basis, d, start) for d in displacements]).reshape(
            -1, basis.shape[1]
        )

    def _solve_frame(self, basis: Array, displacement: Array, start: Array) -> Array:
        """Damped Newton on one frame."""
        c = start
        gram = basis.T @ basis
        quadratic = 2.0 * self.alpha * self.shell

        def value(x: Array) -> float:
            r = displacement - basis @ x
            return float(np.sqrt(r @ r + CORNER**2) + 0.5 * x @ quadratic @ x + self.bounds.value(x).sum())

        for _ in range(MAX_STEPS):
            r = displacement - basis @ c
            norm = np.sqrt(r @ r + CORNER**2)
            pull = basis.T @ r / norm
            slope, curve = self.bounds.derivatives(c)
            gradient = -pull + quadratic @ c + slope
            hessian = (gram - np.outer(pull, pull)) / norm + quadratic + np.diag(curve)
            scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
            step = -scale * np.linalg.lstsq(hessian * np.outer(scale, scale), gradient * scale, rcond=1e-15)[0]
            here, length = value(c), 1.0
            while length > 1e-8 and value(c + length * step) > here + 1e-4 * length * (gradient @ step) + 1e-13 * abs(
                here
            ):
                length *= 0.5
            c = c + length * step
            if np.abs(step).max() < LAST_STEP:
                break
        return c

    def data_term(self, squared_residuals: Array) -> Array:
        """Return ``‖r‖`` per frame."""
        return np.sqrt(squared_residuals)

    def penalty(self, weights: Array) -> Array:
        """Return the two regularisation energies per frame."""
        shell = ((weights @ self.shell) * weights).sum(1)
        return self.alpha * shell + self.bounds.value(weights).sum(1)
