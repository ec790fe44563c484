"""The posterior of a sparse online Gaussian process over its basis vectors, and its three updates.

Csató and Opper, "Sparse on-line Gaussian processes", Neural Computation 14 (2002), write the posterior as
``mean(x) = αᵀ k(x)`` and ``cov(x, x') = k(x, x') + k(x)ᵀ C k(x')`` with ``k(x)`` the kernel between ``x`` and the basis
vectors, and keep beside ``α`` and ``C`` the inverse kernel matrix ``Q = K⁻¹``. ``Q`` grows without bound when basis
vectors come near each other, and so does the rounding error of all that is computed from it. The same posterior is kept
here in whitened values: with the Cholesky factor ``K = L Lᵀ`` and ``f`` the process at the basis vectors, ``u = L⁻¹ f``
is ``N(0, I)`` before any data and ``N(m, S)`` after, and

    α = L⁻ᵀ m,   C = L⁻ᵀ (S − I) L⁻¹,   Q = L⁻ᵀ L⁻¹.

``m`` and ``S`` stay of order one and every update is backward stable. So that ``K`` can be factored at all when basis
vectors all but coincide, a small part ``δ`` of the noise's variance (the *nugget*) is counted as part of the process at
the basis vectors, ``K = k(B, B) + δI``, and taken off the noise there: with every example a basis vector that changes
nothing. All variances are in units of the kernel's own, ``k(x, x) = 1``. Several outputs share basis and ``S``; each
has its column of ``m``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dger, dtrsv

Array = NDArray[np.floating[Any]]

__all__ = ["SparsePosterior"]

NUGGET = 1e-8
"""Largest part of the noise, in units of the prior variance, that is counted as part of the process."""


class SparsePosterior:
    """Gaussian posterior over whitened values at the basis vectors.

    Parameters
    ----------
    n_outputs
        Number of outputs that share the basis.
    noise
        ``σ²``, variance of the observations' noise, above 0.
    capacity
        For how many basis vectors memory is taken at first; it grows as needed.

    Attributes
    ----------
    size : int
        Number of basis vectors.
    """

    def __init__(self, n_outputs: int, noise: float, capacity: int = 16) -> None:
        self.size = 0
        self.noise, self.nugget = noise, min(NUGGET, 0.5 * noise)
        # Beyond the basis L is the identity, so that triangular solves may take the whole array, without a copy.
        self._L = np.eye(capacity, order="F")
        self._S = np.zeros((capacity, capacity), order="F")
        self._m = np.zeros((capacity, n_outputs))
        self._alpha = np.zeros((capacity, n_outputs))
        self._q = np.ones(capacity)
        self._n_removed = 0

    @classmethod
    def from_parts(cls, factor: Array, covariance: Array, mean: Array, noise: float) -> SparsePosterior:
        """Return the posterior with these ``L``, ``S`` and ``m``."""
        out = cls(mean.shape[1], noise, max(1, len(mean)))
        out.size = n = len(mean)
        out._L[:n, :n], out._S[:n, :n], out._m[:n] = factor, covariance, mean
        out._refresh()
        return out

    @property
    def factor(self) -> Array:
        """``L`` (n_basis, n_basis), lower triangular."""
        return self._L[: self.size, : self.size]

    @property
    def covariance(self) -> Array:
        """``S`` (n_basis, n_basis), symmetric."""
        return self._S[: self.size, : self.size]

    @property
    def mean(self) -> Array:
        """``m`` (n_basis, n_outputs)."""
        return self._m[: self.size]

    def project(self, kernel: Array) -> tuple[Array, float]:
        """Return what a point shares with the basis, and its novelty.

        Parameters
        ----------
        kernel
            (n_basis,) kernel between the point and the basis vectors.

        Returns
        -------
        ``l = L⁻¹ k`` (n_basis,), and ``γ = k(x, x) − kᵀ K⁻¹ k = 1 − l·l``, the part of the prior variance at the point
        that the basis does not explain: 0 to 1, where rounding may leave it a little below 0.
        """
        shared = self._solve(kernel)
        return shared, 1.0 - float(shared @ shared)

    def learn(self, shared: Array, novelty: float, target: Array) -> None:
        """Take in an observation without enlarging the basis.

        Its value is seen through the basis: ``f(x) = l·u`` plus a part of variance ``γ`` that the basis does not know,
        which adds to the noise. The moments at the basis vectors are then those of the exact update, which is the
        projection of Csató and Opper, with ``q = (y − mean)/(σ² + σ_x²)`` and ``r = −1/(σ² + σ_x²)``.

        Parameters
        ----------
        shared, novelty
            From :meth:`project`.
        target
            (n_outputs,) what was observed.
        """
        self._absorb(shared, target, self.noise + max(novelty, 0.0))

    def _absorb(self, shared: Array, target: Array, noise: float) -> None:
        """Take in ``target = l·u`` plus noise of that variance."""
        gain = self.covariance @ shared
        spread = noise + float(shared @ gain)
        step = (target - shared @ self.mean) / spread
        self._m[: self.size] += np.outer(gain, step)
        self._alpha[: self.size] += np.outer(self._solve(gain, transposed=True), step)
        padded = self._pad(gain)
        dger(-1.0 / spread, padded, padded, a=self._S, overwrite_a=1)

    def add(self, shared: Array, novelty: float, target: Array) -> None:
        """Take in an observation and make its point a basis vector; see :meth:`learn`."""
        if self.size == len(self._L):
            self._grow()
        n, length = self.size, float(np.sqrt(max(novelty, 0.0) + self.nugget))
        self._q[:n] += (self._solve(shared, transposed=True) / length) ** 2
        self._q[n] = 1.0 / length**2
        self._L[n, :n], self._L[n, n] = shared, length
        self._S[n, n] = 1.0
        self.size = n + 1
        self._absorb(np.append(shared, length), target, self.noise - self.nugget)

    def scores(self) -> Array:
        """Return (n_basis,) how far the mean at each basis vector moves if that vector is removed.

        ``|α_i|/Q_ii``; with several outputs the length of that vector of differences.
        """
        return np.linalg.norm(self._alpha[: self.size], axis=1) / self._q[: self.size]

    def is_least(self, shared: Array, novelty: float, target: Array) -> bool:
        """Tell whether a basis vector made of this observation would have the least score of all.

        Removing it at once is the same as :meth:`learn`, which is far less work than :meth:`add` and :meth:`remove`.
        """
        length = max(novelty, 0.0) + self.nugget
        gain = self.covariance @ shared
        step = (target - shared @ self.mean) / (self.noise - self.nugget + length + float(shared @ gain))
        alpha = self._alpha[: self.size] + np.outer(self._solve(gain - shared, transposed=True), step)
        q = self._q[: self.size] + self._solve(shared, transposed=True) ** 2 / length
        others = np.sqrt(np.einsum("io,io->i", alpha, alpha)) / q
        return bool(np.linalg.norm(step) * length < others.min(initial=np.inf))

    def remove(self, index: int) -> None:
        """Remove a basis vector; those behind it move up.

        The moments at the vectors that stay do not change. In the parameters of the paper, with ``Q*`` and ``C*`` the
        column of the vector that goes and ``q*``, ``c*``, ``α*`` its own entries,
        ``α ← α − α* Q*/q*``, ``Q ← Q − Q* Q*ᵀ/q*``, ``C ← C + c* Q* Q*ᵀ/q*² − (Q* C*ᵀ + C* Q*ᵀ)/q*``.
        """
        n, last = self.size, self.size - 1
        unit = np.zeros(n)
        unit[index] = 1.0
        gone = self._solve(self._solve(unit), transposed=True)
        self._alpha[:n] -= np.outer(gone / gone[index], self._alpha[index].copy())
        # Rounding may eat what a near neighbour had added; no entry can be less than 1/(k(x, x) + δ).
        self._q[:n] = np.maximum(self._q[:n] - gone**2 / gone[index], 1.0 / (1.0 + self.nugget))
        self._turn_out(index)
        for rows in (self._alpha, self._q):
            rows[index:last] = rows[index + 1 : n]
        self._L[last, :last] = self._L[:last, last] = 0.0
        self._L[last, last] = self._q[last] = 1.0
        self._S[last] = self._S[:, last] = 0.0
        self._m[last] = self._alpha[last] = 0.0
        self.size = last
        self._n_removed += 1
        if self._n_removed % 256 == 0:
            self._refresh()

    def moments(self, kernel: Array) -> tuple[Array, Array]:
        """Return mean (n_points, n_outputs) and variance (n_points,) for (n_points, n_basis) kernel values."""
        shared = solve_triangular(self.factor, kernel.T, lower=True).T
        explained = np.einsum("ij,ij->i", shared, shared)
        kept = np.einsum("ij,ij->i", shared @ self.covariance, shared)
        return shared @ self.mean, np.clip(1.0 - explained, 0.0, None) + np.clip(kept, 0.0, None)

    def _turn_out(self, index: int) -> None:
        """Whiten the values without those at a basis vector: the new ``L``, ``m`` and ``S``, in the first places.

        Below the row that goes, ``f = c u_i + L' u'`` with ``c`` the column and ``L'`` the triangle that it leaves.
        The triangle of what stays belongs to ``û = chol(I + p pᵀ)⁻¹ (p u_i + u')``, ``p = L'⁻¹ c``, whose rows are
        orthonormal (the modification C1 of Gill, Golub, Murray and Saunders 1974) and written so that nothing cancels:
        ``û_j = √(t_{j−1}/t_j) (u_j + p_j (u_i − Σ_{k<j} p_k u_k)/t_{j−1})``, ``t_j = 1 + Σ_{k≤j} p_k²``.
        """
        n, last = self.size, self.size - 1
        if index == last:
            return
        below = slice(index + 1, n)
        p = solve_triangular(self._L[below, below], self._L[below, index], lower=True)
        t = np.append(1.0, 1.0 + np.cumsum(p * p))
        scale, share = np.sqrt(t[:-1] / t[1:]), p / t[:-1]

        def turn(rows: Array) -> Array:
            """Rows of ``û`` from the rows of ``u_i`` and ``u'``."""
            known = np.empty_like(rows[1:])
            known[0] = 0.0
            np.cumsum(p[:-1, None] * rows[1:-1], axis=0, out=known[1:])
            return scale[:, None] * (rows[1:] + share[:, None] * (rows[0] - known))

        self._L[index:last, :index] = self._L[below, :index]
        self._L[index:last, index:last] = np.tril(turn(self._L[below, index:n].T).T)
        self._m[index:last] = turn(self._m[index:n])
        self._S[index:last, :n] = turn(self._S[index:n, :n])
        self._S[:last, index:last] = turn(self._S[:last, index:n].T).T

    def _solve(self, values: Array, transposed: bool = False) -> Array:
        """Return ``L⁻¹ v`` or ``L⁻ᵀ v``."""
        return dtrsv(self._L, self._pad(values), lower=1, trans=int(transposed), overwrite_x=1)[: self.size]

    def _pad(self, values: Array) -> Array:
        padded = np.zeros(len(self._L))
        padded[: self.size] = values
        return padded

    def _refresh(self) -> None:
        """Compute what the scores need anew: it is carried along with rounding that adds up."""
        inverse = solve_triangular(self.factor, np.eye(self.size), lower=True)
        self._q[: self.size] = np.einsum("ij,ij->j", inverse, inverse)
        self._alpha[: self.size] = inverse.T @ self.mean

    def _grow(self) -> None:
        n, capacity = self.size, 2 * len(self._L)
        L, S, q = np.eye(capacity, order="F"), np.zeros((capacity, capacity), order="F"), np.ones(capacity)
        m, alpha = np.zeros((2, capacity, self._m.shape[1]))
        L[:n, :n], S[:n, :n], m[:n], alpha[:n], q[:n] = self._L, self._S, self._m, self._alpha, self._q
        self._L, self._S, self._m, self._alpha, self._q = L, S, m, alpha, q
