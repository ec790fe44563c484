"""Length scale, amplitude and noise of a Gaussian process, by marginal likelihood on some of the examples.

With ``K`` the kernel matrix of unit amplitude, ``λ`` the ratio of noise to amplitude and O outputs that share them,

    log p(Y) = −½ Σ_o y_oᵀ (s(K + λI))⁻¹ y_o − ½ N O log 2πs − ½ O log |K + λI|

(Rasmussen and Williams, *Gaussian Processes for Machine Learning*, 2006, 2.30). The amplitude ``s`` that makes it
greatest is ``Σ_o y_oᵀ (K + λI)⁻¹ y_o / NO`` for any ``λ`` and length scale; one factorisation into eigenvectors serves
all ``λ`` of a length scale. So two unknowns are searched, one within the other: first on a grid, for there may be more
than one optimum, then between the best grid point's neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar
from scipy.spatial.distance import pdist, squareform

from ...arrays import check_array
from ...errors import InputError
from .one_thread import one_thread
from .sparse_gaussian_process import KERNELS, evaluate_kernel

Array = NDArray[np.floating[Any]]

__all__ = ["KernelParameters", "fit_kernel_parameters", "log_marginal_likelihood"]

LENGTHS = np.geomspace(0.1, 30.0, 12)
"""Length scales that are tried first, in units of the median distance between examples."""
RATIOS = np.geomspace(1e-6, 1.0, 13)
"""Ratios of noise to amplitude that are tried first; the least bounds the conditioning."""


@dataclass(frozen=True)
class KernelParameters:
    """Length scale (units of the inputs), amplitude (variance), noise (variance) and the likelihood that they reach."""

    length_scale: float
    amplitude: float
    noise: float
    log_likelihood: float


def log_marginal_likelihood(
    X: ArrayLike, Y: ArrayLike, length_scale: float, amplitude: float, noise: float, kernel: str = "rbf"
) -> float:
    """Return ``log p(Y)``, summed over outputs.

    Parameters
    ----------
    X
        (n_examples, n_inputs).
    Y
        (n_examples, n_outputs), of prior mean 0.
    length_scale, amplitude, noise, kernel
        As in :class:`.SparseGaussianProcess`.
    """
    inputs, targets = _check(X, Y, kernel)
    squares = squareform(pdist(inputs, "sqeuclidean"))
    values, energies = _spectrum(squares, targets, length_scale, kernel)
    n, n_outputs = targets.shape
    scales = amplitude * values + noise
    return float(-0.5 * ((energies / scales).sum() + n_outputs * (np.log(scales).sum() + n * np.log(2 * np.pi))))


def fit_kernel_parameters(
    X: ArrayLike, Y: ArrayLike, *, kernel: str = "rbf", n_examples: int = 300
) -> KernelParameters:
    """Choose the parameters under which evenly spaced examples are most likely.

    Parameters
    ----------
    X
        (n_examples, n_inputs).
    Y
        (n_examples, n_outputs), of prior mean 0; all share the parameters.
    kernel
        One of :data:`.KERNELS`.
    n_examples
        How many examples to use at most, at least 2; the work grows with its cube.

    Raises
    ------
    InputError
        If there are fewer than two examples, all inputs are alike, or all outputs are 0.

    Notes
    -----
    Neighbouring frames of a take are alike, so examples count for less than their number; even spacing over a
    range-of-motion take makes them as different as they come. The noise is at least 1e-6 of the amplitude.
    """
    inputs, targets = _check(X, Y, kernel)
    if n_examples < 2 or len(inputs) < 2:
        raise InputError(f"kernel parameters: expected at least two examples, but got {min(n_examples, len(inputs))}")
    chosen = np.unique(np.linspace(0, len(inputs) - 1, min(n_examples, len(inputs))).round().astype(int))
    inputs, targets = inputs[chosen], targets[chosen]
    distances = pdist(inputs)
    typical = float(np.median(distances)) or float(distances.mean())
    if not typical > 0 or not np.abs(targets).max() > 0:
        raise InputError("kernel parameters: expected examples that differ and outputs that are not all 0")
    squares = squareform((distances / typical) ** 2)

    def search(log_length: float) -> tuple[float, float, float]:
        """Least negative log-likelihood of a length scale, with its log ratio and amplitude."""
        values, energies = _spectrum(squares, targets, float(np.exp(log_length)), kernel)
        n, n_outputs = targets.shape

        def cost(log_ratio: float) -> tuple[float, float]:
            scales = values + np.exp(log_ratio)
            amplitude = float((energies / scales).sum() / (n * n_outputs))
            return 0.5 * n_outputs * (
                n * np.log(amplitude) + np.log(scales).sum() + n * (1 + np.log(2 * np.pi))
            ), amplitude

        _, best = _refine(np.log(RATIOS), lambda log_ratio: cost(log_ratio)[0])
        negative, amplitude = cost(best)
        return negative, best, amplitude

    with one_thread():
        _, log_length = _refine(np.log(LENGTHS), lambda at: search(at)[0])
        negative, log_ratio, amplitude = search(log_length)
    ratio = float(np.exp(log_ratio))
    return KernelParameters(float(np.exp(log_length)) * typical, amplitude, ratio * amplitude, -negative)


def _refine(grid: Array, cost: Any) -> tuple[float, float]:
    """Least value of a function of one unknown and where it is: the best of a grid, then between its neighbours."""
    costs = [cost(at) for at in grid]
    best = int(np.argmin(costs))
    bounds = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-3})
    return min((float(found.fun), float(found.x)), (float(costs[best]), float(grid[best])))


def _spectrum(squares: Array, targets: Array, length_scale: float, kernel: str) -> tuple[Array, Array]:
    """Eigenvalues of the kernel matrix, and ``Σ_o (vᵀ y_o)²`` for each of its eigenvectors."""
    values, vectors = eigh(evaluate_kernel(squares / length_scale**2, kernel))
    return np.clip(values, 0.0, None), ((vectors.T @ targets) ** 2).sum(axis=1)


def _check(X: ArrayLike, Y: ArrayLike, kernel: str) -> tuple[Array, Array]:
    inputs = check_array(X, name="X", shape=(None, None), finite=True)
    targets = check_array(Y, name="Y", shape=(len(inputs), None), finite=True)
    if kernel not in KERNELS:
        raise InputError(f"kernel: expected one of {', '.join(KERNELS)}, but got {kernel!r}")
    return inputs, targets
