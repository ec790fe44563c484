"""Regression from markers to weights with radial basis functions (Reverdy 2019, 2.13-2.14).

The approach of Deng, Chiang, Fox and Neumann, "Animating blendshape faces by cross-mapping motion capture data" (2006):
from L frames ``X_l`` whose weights ``W_l`` are known, ``F(X) = Σ_l c_l φ_l(X)`` with Gaussian
``φ_l(X) = exp(−‖X − X_l‖²/2σ_l²)`` and the ``c_l`` that make ``Σ_l (W_l − F(X_l))² + α Σ_l c_l²`` least (2.14).

It needs pairs of markers and weights of the same face, and weights far from all examples fall to 0. It stands here as
what direct solving is compared with.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.distance import cdist

from ..arrays import check_array
from ..errors import InputError

Array = NDArray[np.floating[Any]]

BLOCK = 4096
NEIGHBOURS = 10
"""Width of a centre: this many neighbours lie within ``σ_l/WIDTH`` of it."""
WIDTH = 3.0


@dataclass(frozen=True)
class RBFRegression:
    """A fitted regression; make one with :meth:`fit`.

    Parameters
    ----------
    centres
        (L, 3P) the examples' marker coordinates, mm.
    widths
        (L,) ``σ_l``, mm.
    coefficients
        (L, n_shapes) the ``c_l``.
    """

    centres: Array
    widths: Array
    coefficients: Array

    @classmethod
    def fit(
        cls, positions: ArrayLike, weights: ArrayLike, *, ridge: float = 1e-3, widths: ArrayLike | None = None
    ) -> RBFRegression:
        """Learn from frames whose weights are known.

        Parameters
        ----------
        positions
            (L, P, 3) marker positions in the rig's space, mm. Frames with a missing marker are left out.
        weights
            (L, n_shapes) their weights.
        ridge
            ``α ≥ 0`` of (2.14).
        widths
            ``σ_l`` in mm, one number or (L,) of the frames that are used; by default three times the distance to the
            tenth nearest example, so that neighbouring examples overlap.

        Raises
        ------
        InputError
            If fewer than two frames are whole, all are alike, or the ridge or a width is out of range.
        """
        positions = check_array(positions, name="positions", shape=(None, None, 3))
        weights = check_array(weights, name="weights", shape=(len(positions), None))
        whole = np.isfinite(positions).all((1, 2)) & np.isfinite(weights).all(1)
        if whole.sum() < 2:
            raise InputError(f"examples: expected at least two frames without NaN, but got {int(whole.sum())}")
        if not (np.isfinite(ridge) and ridge >= 0):
            raise InputError(f"ridge: expected a number of 0 or more, but got {ridge}")
        centres = positions[whole].reshape(int(whole.sum()), -1)
        squares = cdist(centres, centres, "sqeuclidean")
        if widths is None:
            nearest = min(NEIGHBOURS, len(centres) - 1)
            sigma = WIDTH * np.sqrt(np.partition(squares, nearest, axis=1)[:, nearest])
        else:
            sigma = np.broadcast_to(check_array(widths, name="widths"), (len(centres),)).astype(float)
        if not (np.isfinite(sigma) & (sigma > 0)).all():
            raise InputError("widths: expected mm above 0; examples that are all alike have no width")
        design = np.exp(-squares / (2 * sigma**2))
        # Rows of √α I make it a least-squares problem, safer than the normal equations for wide kernels.
        rows = np.vstack([design, np.sqrt(ridge) * np.eye(len(centres))])
        targets = np.vstack([weights[whole], np.zeros((len(centres), weights.shape[1]))])
        return cls(centres, sigma, np.linalg.lstsq(rows, targets, rcond=None)[0])

    def predict(self, positions: ArrayLike) -> Array:
        """Return (F, n_shapes) weights for (F, P, 3) positions; NaN for frames with a missing marker."""
        positions = check_array(positions, name="positions", shape=(None, self.centres.shape[1] // 3, 3))
        flat = positions.reshape(len(positions), -1)
        out = np.full((len(flat), self.coefficients.shape[1]), np.nan)
        seen = np.flatnonzero(np.isfinite(flat).all(1))
        for start in range(0, len(seen), BLOCK):
            rows = seen[start : start + BLOCK]
            design = np.exp(-cdist(flat[rows], self.centres, "sqeuclidean") / (2 * self.widths**2))
            out[rows] = design @ self.coefficients
        return out
