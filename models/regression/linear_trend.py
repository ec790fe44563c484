"""A linear trend under a regression: ridge regression whose strength is tried out on stretches of time left out.

Markers follow weights linearly (Reverdy 2019, 5.3), so weights follow markers nearly so, and a Gaussian process that
need not learn the linear part learns the rest from fewer examples. ``(XᵀX/N + λI) β = XᵀY/N``; neighbouring frames are
alike, so single frames left out would be guessed from their neighbours and ``λ`` come out too small: whole stretches
are left out instead.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from ...arrays import check_array
from ...errors import InputError

__all__ = ["RIDGES", "fit_linear_trend"]

RIDGES = np.geomspace(1e-6, 1.0, 19)
"""The ``λ`` that are tried; inputs of deviation 1 are meant."""


def fit_linear_trend(X: ArrayLike, Y: ArrayLike, *, n_folds: int = 5) -> tuple[NDArray[np.float64], float]:
    """Fit a linear map without constant.

    Parameters
    ----------
    X
        (n_frames, n_inputs), centred, of deviation about 1, in the order of time.
    Y
        (n_frames, n_outputs), centred; all outputs share ``λ``.
    n_folds
        Number of stretches, 2 or more.

    Returns
    -------
    Coefficients (n_inputs, n_outputs), and the ``λ`` of :data:`RIDGES` whose error on the stretches left out is least.

    Raises
    ------
    InputError
        If there are fewer frames than stretches.
    """
    inputs = check_array(X, name="X", shape=(None, None), finite=True)
    targets = check_array(Y, name="Y", shape=(len(inputs), None), finite=True)
    if not 2 <= n_folds <= len(inputs):
        raise InputError(
            f"linear trend: expected 2 to {len(inputs)} stretches, one frame or more each, but got {n_folds}"
        )
    errors = np.zeros(len(RIDGES))
    for held in np.array_split(np.arange(len(inputs)), n_folds):
        solve = _ridge(np.delete(inputs, held, axis=0), np.delete(targets, held, axis=0))
        errors += [((inputs[held] @ solve(ridge) - targets[held]) ** 2).sum() for ridge in RIDGES]
    best = float(RIDGES[int(errors.argmin())])
    return _ridge(inputs, targets)(best), best


def _ridge(inputs: NDArray, targets: NDArray) -> Any:
    """Return the coefficients as a function of ``λ``: one factorisation serves all."""
    values, vectors = eigh(inputs.T @ inputs / len(inputs))
    turned = vectors.T @ (inputs.T @ targets / len(inputs))
    return lambda ridge: vectors @ (turned / (np.clip(values, 0.0, None) + ridge)[:, None])
