"""Sparse online Gaussian-process regression (Csató and Opper 2002), the regression of Reverdy 2019, 3.3.1.

A Gaussian process learns a smooth map from examples and says how sure it is, but exact learning from N examples takes
``N³`` operations. Csató and Opper ("Sparse on-line Gaussian processes", Neural Computation 14, 2002, 641-668) take in
one example after another and let only some of them, the *basis vectors*, carry the posterior:

- an example whose novelty ``γ = k(x, x) − kᵀ K⁻¹ k`` exceeds a threshold becomes a basis vector; any other is projected
  on the basis that there is, so that its information is kept and nothing grows;
- when there are more basis vectors than a budget allows, the one with the least score ``|α_i|/Q_ii`` is removed.

With threshold 0 and no budget this is exact Gaussian-process regression. With a basis that does not change it is FITC
(Snelson and Ghahramani 2005; Quiñonero-Candela and Rasmussen 2005): both are tested. How the posterior is kept, and why
not as in the paper, is said in :mod:`.sparse_posterior`. One budget of basis vectors and one kernel serve all outputs.

The result depends on the order of the examples once the budget is reached.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.distance import cdist
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.exceptions import NotFittedError

from ...arrays import check_array
from ...errors import InputError
from .one_thread import one_thread
from .sparse_posterior import SparsePosterior

Array = NDArray[np.floating[Any]]

__all__ = ["KERNELS", "SparseGaussianProcess", "evaluate_kernel"]

KERNELS = ("rbf", "matern52")
BLOCK = 2048
"""Points that are predicted at a time."""


def evaluate_kernel(squares: Array, kernel: str) -> Array:
    """Return the kernel, 1 at distance 0, of squared distances in units of the length scale.

    ``rbf``: ``exp(−r²/2)``; ``matern52``: ``(1 + √5 r + 5r²/3) exp(−√5 r)``.
    """
    if kernel == "rbf":
        return np.exp(-0.5 * squares)
    scaled = np.sqrt(5.0 * squares)
    return (1.0 + scaled + scaled * scaled / 3.0) * np.exp(-scaled)


class SparseGaussianProcess(RegressorMixin, BaseEstimator):
    """Sparse online Gaussian process with zero prior mean and a Gaussian likelihood.

    Inputs and outputs are taken as they are: centre and scale them before (:class:`.MarkerRegression` does).

    Parameters
    ----------
    length_scale
        Of the kernel, in units of the inputs, above 0: one number, or one for each input.
    amplitude
        Prior variance of every output, above 0.
    noise
        Variance of the outputs' noise, above 0.
    novelty
        0 to 1. Examples whose novelty is at most this part of the prior variance do not become basis vectors. By
        default the noise's part, ``noise/amplitude``: projecting an example adds its novelty to its noise, so none then
        counts for less than half.
    budget
        Largest number of basis vectors, at least 1; ``None`` for no limit.
    kernel
        One of :data:`KERNELS`.

    Attributes
    ----------
    basis_ : (n_basis, n_inputs)
        The basis vectors.
    n_seen_ : int
        Number of examples taken in.
    n_removed_ : int
        How often a basis vector went to keep the budget, be it an earlier one or the one that had just come.
    """

    def __init__(
        self,
        length_scale: float | ArrayLike = 1.0,
        *,
        amplitude: float = 1.0,
        noise: float = 0.01,
        novelty: float | None = None,
        budget: int | None = None,
        kernel: str = "rbf",
    ) -> None:
        self.length_scale = length_scale
        self.amplitude = amplitude
        self.noise = noise
        self.novelty = novelty
        self.budget = budget
        self.kernel = kernel

    def fit(self, X: ArrayLike, y: ArrayLike) -> SparseGaussianProcess:
        """Forget what was learned and learn from these examples, in their order; see :meth:`partial_fit`."""
        for name in ("_posterior", "_scaled"):
            self.__dict__.pop(name, None)
        return self.partial_fit(X, y)

    def partial_fit(self, X: ArrayLike, y: ArrayLike) -> SparseGaussianProcess:
        """Learn from more examples, one after another in their order.

        Parameters
        ----------
        X
            (n_examples, n_inputs).
        y
            (n_examples,) or (n_examples, n_outputs).

        Raises
        ------
        InputError
            For NaN, shapes that do not fit each other or earlier examples, no examples at all, or a parameter out of
            its range. Nothing is learned then.
        """
        inputs = check_array(X, name="X", shape=(None, None), finite=True)
        targets = check_array(y, name="y", finite=True)
        if targets.ndim not in (1, 2) or len(targets) != len(inputs):
            raise InputError(f"y: expected one row for each of the {len(inputs)} rows of X, but got {targets.shape}")
        if len(inputs) == 0:
            raise InputError("X: expected at least one example, but got none")
        length = self._check_parameters(inputs.shape[1])
        columns = targets.reshape(len(targets), -1)
        if not hasattr(self, "_posterior"):
            self._begin(inputs.shape[1], columns.shape[1], targets.ndim == 1, length)
        elif (columns.shape[1], targets.ndim == 1) != (self._posterior.mean.shape[1], self._flat):
            raise InputError(
                f"y: expected {self._posterior.mean.shape[1]} outputs as before, but got shape {targets.shape}"
            )
        elif inputs.shape[1] != self.n_features_in_:
            raise InputError(f"X: expected {self.n_features_in_} inputs as before, but got {inputs.shape[1]}")
        elif not np.array_equal(length, self._length):
            raise InputError("length_scale: it changed since the first examples; fit again instead")
        with one_thread():
            for point, target in zip(inputs / self._length, columns, strict=True):
                self._take_in(point, target)
        return self

    def predict(self, X: ArrayLike, return_std: bool = False) -> Array | tuple[Array, Array]:
        """Return the mean of the process, and its deviation where asked for.

        Parameters
        ----------
        X
            (n_points, n_inputs), without NaN.
        return_std
            Whether to return the deviation of the process (without the noise) too.

        Returns
        -------
        (n_points,) or (n_points, n_outputs) as ``y`` was, once or twice. The deviation is the same for all outputs,
        which share amplitude and noise.
        """
        if not hasattr(self, "_posterior"):
            raise NotFittedError("This SparseGaussianProcess is not fitted yet; call fit or partial_fit first.")
        points = check_array(X, name="X", shape=(None, self.n_features_in_), finite=True) / self._length
        n_outputs = self._posterior.mean.shape[1]
        mean, variance = np.empty((len(points), n_outputs)), np.empty(len(points))
        for start in range(0, len(points), BLOCK):
            block = slice(start, start + BLOCK)
            squares = cdist(points[block], self._scaled[: self._posterior.size], "sqeuclidean")
            mean[block], variance[block] = self._posterior.moments(evaluate_kernel(squares, self.kernel))
        std = np.sqrt(float(self.amplitude) * variance)
        if self._flat:
            return (mean[:, 0], std) if return_std else mean[:, 0]
        return (mean, np.repeat(std[:, None], n_outputs, axis=1)) if return_std else mean

    @property
    def n_outputs_(self) -> int:
        """Number of outputs."""
        return self._posterior.mean.shape[1]

    @property
    def basis_(self) -> Array:
        """(n_basis, n_inputs) the basis vectors."""
        return self._scaled[: self._posterior.size] * self._length

    def to_arrays(self) -> tuple[dict[str, NDArray], dict[str, Any]]:
        """Return all that makes the fitted process: arrays, and metadata that JSON can hold."""
        if not hasattr(self, "_posterior"):
            raise NotFittedError("This SparseGaussianProcess is not fitted yet; there is nothing to store.")
        arrays = {
            "basis": self._scaled[: self._posterior.size].copy(),
            "length_scale": self._length.copy(),
            "factor": np.ascontiguousarray(self._posterior.factor),
            "covariance": self._posterior.covariance.copy(),
            "mean": self._posterior.mean.copy(),
        }
        metadata = {
            "amplitude": float(self.amplitude),
            "noise": float(self.noise),
            "novelty": None if self.novelty is None else float(self.novelty),
            "budget": None if self.budget is None else int(self.budget),
            "kernel": self.kernel,
            "one_output": self._flat,
            "n_seen": self.n_seen_,
            "n_removed": self.n_removed_,
        }
        return arrays, metadata

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray], metadata: dict[str, Any]) -> SparseGaussianProcess:
        """Return the process that :meth:`to_arrays` described; it predicts the same and can learn on."""
        lacking = [k for k in ("basis", "length_scale", "factor", "covariance", "mean") if k not in arrays]
        lacking += [k for k in ("amplitude", "noise", "novelty", "kernel", "one_output") if k not in metadata]
        if lacking:
            raise InputError(f"stored Gaussian process: expected {', '.join(lacking)}, but it is not there")
        basis = check_array(arrays["basis"], name="stored basis", shape=(None, None), finite=True)
        n = len(basis)
        length = check_array(arrays["length_scale"], name="stored length_scale", shape=(basis.shape[1],), finite=True)
        mean = check_array(arrays["mean"], name="stored mean", shape=(n, None), finite=True)
        factor, covariance = (
            check_array(arrays[k], name=f"stored {k}", shape=(n, n), finite=True) for k in ("factor", "covariance")
        )
        names = ("amplitude", "noise", "novelty", "kernel")
        out = cls(length, budget=metadata.get("budget"), **{name: metadata[name] for name in names})
        out._begin(basis.shape[1], mean.shape[1], bool(metadata["one_output"]), out._check_parameters(basis.shape[1]))
        out._posterior = SparsePosterior.from_parts(factor, covariance, mean, out._posterior.noise)
        out._scaled = np.array(basis)
        out.n_seen_, out.n_removed_ = int(metadata.get("n_seen", n)), int(metadata.get("n_removed", 0))
        return out

    def _begin(self, n_inputs: int, n_outputs: int, flat: bool, length: Array) -> None:
        capacity = 16 if self.budget is None else min(int(self.budget), 1000) + 1
        self._posterior = SparsePosterior(n_outputs, float(self.noise) / float(self.amplitude), capacity)
        self._scaled = np.empty((capacity, n_inputs))
        self._length, self._flat = length, flat
        self.n_features_in_ = n_inputs
        self.n_seen_ = self.n_removed_ = 0

    def _take_in(self, point: Array, target: Array) -> None:
        """Learn from one example; ``point`` is in units of the length scale."""
        posterior = self._posterior
        away = self._scaled[: posterior.size] - point
        kernel = evaluate_kernel(np.einsum("ij,ij->i", away, away), self.kernel)
        shared, novelty = posterior.project(kernel)
        threshold = posterior.noise if self.novelty is None else self.novelty
        if posterior.size and novelty <= threshold:
            posterior.learn(shared, novelty, target)
        elif self.budget is not None and posterior.size >= self.budget and posterior.is_least(shared, novelty, target):
            posterior.learn(shared, novelty, target)
            self.n_removed_ += 1
        else:
            posterior.add(shared, novelty, target)
            self._remember(point)
        # More than one goes if the budget was made smaller since.
        while self.budget is not None and posterior.size > self.budget:
            self._remove(int(posterior.scores().argmin()))
        self.n_seen_ += 1

    def _remember(self, point: Array) -> None:
        if self._posterior.size > len(self._scaled):
            self._scaled = np.vstack([self._scaled, np.empty_like(self._scaled)])
        self._scaled[self._posterior.size - 1] = point

    def _remove(self, index: int) -> None:
        self._posterior.remove(index)
        self._scaled[index : self._posterior.size] = self._scaled[index + 1 : self._posterior.size + 1]
        self.n_removed_ += 1

    def _check_parameters(self, n_inputs: int) -> Array:
        """Refuse parameters out of their range; return the length scale of every input."""
        length = check_array(self.length_scale, name="length_scale", finite=True)
        if length.shape not in ((), (n_inputs,)) or not (length > 0).all():
            raise InputError(f"length_scale: expected one number above 0 or {n_inputs}, but got {self.length_scale!r}")
        for name in ("amplitude", "noise"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name}: expected a variance above 0, but got {value!r}")
        if self.novelty is not None and not 0 <= self.novelty <= 1:
            raise InputError(f"novelty: expected 0 to 1, or None, but got {self.novelty!r}")
        if self.budget is not None and (self.budget != int(self.budget) or self.budget < 1):
            raise InputError(f"budget: expected a whole number of 1 or more, or None, but got {self.budget!r}")
        if self.kernel not in KERNELS:
            raise InputError(f"kernel: expected one of {', '.join(KERNELS)}, but got {self.kernel!r}")
        return np.broadcast_to(length, (n_inputs,)).astype(np.float64)
