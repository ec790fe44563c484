"""How well a layout's markers tell the whole face: the error that layouts are chosen by.

The weights of a frame are estimated from its markers as the default solver does, without its bounds: with ``b_v`` the
three rows by which the shapes move vertex ``v`` and ``r_v`` the displacement that its marker shows,

    ``ĉ = A⁻¹ Σ_v b_vᵀ r_v``,  ``A = Λ + Σ_v b_vᵀ b_v``,  ``Λ = σ² Σ⁻¹``,

where ``Σ`` is the covariance of weights (Reverdy 2019, 2.9-2.12) and ``σ`` the noise that the solver assumes. The error

    ``J = mean_f ‖D (ĉ_f − c_f)‖²/P + tr(D A⁻¹ W A⁻¹ Dᵀ)/P``,  ``W = s² Σ_v b_vᵀ b_v``

has two parts. The first runs over known frames ``c_f``, whose ``r_v`` may come from other people's faces, so that what
the map between two faces gets wrong counts as it will later. The second is what independent errors of the markers'
coordinates with deviation ``s`` add. ``D`` moves the P vertices that count. A marker more or less changes ``A`` by rank
three, so the error after each of some hundred changes costs a few products of matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Reconstruction", "State"]

Array = NDArray[np.floating[Any]]
Places = NDArray[np.int64]


@dataclass(frozen=True)
class Reconstruction:
    """What candidates for markers tell, prepared once.

    Parameters
    ----------
    basis
        (n_candidates, 3, n_shapes) ``b_v``, mm.
    seen
        (n_candidates, 3, n_frames) ``r_v``, mm.
    weights
        (n_frames, n_shapes) the true weights.
    precision
        (n_shapes, n_shapes) ``Λ``, mm².
    metric
        (n_shapes, n_shapes) ``DᵀD/P``, mm²: ``cᵀ metric c`` is the mean squared displacement of the face.
    noise
        ``s``, mm.
    """

    basis: Array
    seen: Array
    weights: Array
    precision: Array
    metric: Array
    noise: float

    @property
    def n_candidates(self) -> int:
        """Number of candidates."""
        return len(self.basis)

    def state(self, chosen: Places) -> State:
        """Return what is known with these candidates as markers."""
        rows = self.basis[chosen].reshape(-1, self.basis.shape[2])
        gram = rows.T @ rows
        inverse = np.linalg.inv(self.precision + gram)
        told = rows.T @ self.seen[chosen].reshape(len(rows), len(self.weights))
        return State(self, 0.5 * (inverse + inverse.T), gram, inverse @ told - self.weights.T)


@dataclass(frozen=True)
class State:
    """What is known with some markers.

    Parameters
    ----------
    problem
        The candidates.
    inverse
        ``A⁻¹``.
    gram
        ``Σ_v b_vᵀ b_v``.
    errors
        (n_shapes, n_frames) ``ĉ − c``.
    """

    problem: Reconstruction
    inverse: Array
    gram: Array
    errors: Array

    def error(self) -> float:
        """Return ``J``, mm²."""
        p = self.problem
        known = float(np.sum((p.metric @ self.errors) * self.errors)) / len(p.weights)
        return known + p.noise**2 * float(np.sum((self.inverse @ p.metric @ self.inverse) * self.gram))

    def errors_with(self, units: Places) -> Array:
        """Return (n_units,) ``J``, mm², with the candidates of each row of ``units`` (n_units, m) added."""
        return self._errors_after(units, 1.0)

    def errors_without(self, units: Places) -> Array:
        """Return (n_units,) ``J``, mm², without the markers of each row of ``units``, which the state has."""
        return self._errors_after(units, -1.0)

    def _errors_after(self, units: Places, sign: float) -> Array:
        """Return ``J`` after a change of rank 3m, for each unit.

        With ``U = A⁻¹bᵀ``, ``G = U (I ± bU)⁻¹`` and the innovation ``z = r − b ĉ``, the new estimate is ``ĉ ± G z``,
        the new inverse ``A⁻¹ ∓ G Uᵀ``, and that times ``bᵀ`` is ``G``.
        """
        p = self.problem
        n_shapes, n_frames = self.errors.shape
        basis = p.basis[units].reshape(len(units), -1, n_shapes)
        n_rows = basis.shape[1]
        flat = basis.reshape(-1, n_shapes)
        toward = (flat @ self.inverse).reshape(basis.shape)  # Uᵀ
        inner = np.eye(n_rows) + sign * (toward @ basis.transpose(0, 2, 1))
        gain = np.linalg.solve(inner, toward)  # Gᵀ, for the inner matrix is symmetric.
        moved = (gain.reshape(flat.shape) @ p.metric).reshape(basis.shape)  # Gᵀ metric
        size = moved @ gain.transpose(0, 2, 1)
        innovation = p.seen[units].reshape(len(flat), n_frames) - flat @ (self.errors + p.weights.T)
        across = (innovation @ self.errors.T).reshape(basis.shape)
        blocks = innovation.reshape(len(basis), n_rows, n_frames)
        own = blocks @ blocks.transpose(0, 2, 1)
        known = (2.0 * sign * (moved * across).sum((1, 2)) + (size * own).sum((1, 2))) / n_frames
        carried = toward.reshape(flat.shape) @ self.gram  # Uᵀ gram
        spread = -2.0 * sign * ((carried @ self.inverse).reshape(basis.shape) * moved).sum((1, 2))
        spread += (size * (carried.reshape(basis.shape) @ toward.transpose(0, 2, 1))).sum((1, 2))
        spread += sign * np.trace(size, axis1=1, axis2=2)
        return self.error() + known + p.noise**2 * spread
