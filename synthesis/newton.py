"""Minimise ``½ cᵀ H c − gᵀ c + Σ_i φ(c_i)`` for many ``g`` at once.

``H`` is shared by all frames and positive semidefinite, ``φ`` is smooth and strictly convex. Frames go in blocks:

1. Conjugate gradients (Polak and Ribière's, restarted where they would turn back), preconditioned by the inverse of
   ``H`` plus the block's mean ``φ″``: all frames of a block share one matrix, and since ``φ″`` seldom rules, some ten
   steps reach the minimum.
2. The few frames that need more get damped Newton steps, each with its own Hessian; these always converge.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .small_products import times

Array = NDArray[np.floating[Any]]


class Potential(Protocol):
    """A smooth, strictly convex function of one weight."""

    def value(self, c: Array) -> Array:
        """Return φ of every entry."""
        ...

    def derivatives(self, c: Array) -> tuple[Array, Array]:
        """Return φ′ and φ″ > 0 of every entry."""
        ...


ROWS = 256  # Frames at a time, such that their arrays stay in cache.
GRADIENT_STEPS = 44
FRESH_STEPS = (0, 4)  # Where the shared matrix is made anew.
DONE = 1e-9  # Preconditioned gradient, that is, about the distance to the minimum.
# Newton's error squares with every full step: a last step this long leaves about its square.
LAST_STEP = 1e-5
NEWTON_STEPS = 200
MAX_HALVINGS = 40


def minimise(H: Array, g: Array, start: Array, phi: Potential) -> Array:
    """Return the minimisers, (F, N), to about 1e-9.

    Parameters
    ----------
    H
        (N, N) symmetric, positive semidefinite.
    g
        (F, N).
    start
        (F, N) where to begin.
    phi
        φ.
    """
    out = np.empty_like(g)
    for first in range(0, len(g), ROWS):
        part = slice(first, first + ROWS)
        c, left = _conjugate_gradients(H, g[part], start[part], phi)
        if len(left):
            c[left] = _newton(H, g[part][left], c[left], phi)
        out[part] = c
    return out


def _conjugate_gradients(H: Array, g: Array, start: Array, phi: Potential) -> tuple[Array, NDArray[np.int64]]:
    """Return weights and the frames that are not done."""
    out = start.copy()
    left = np.arange(len(g))
    diagonal = np.diag(H)
    c = start
    slope, curve = phi.derivatives(c)
    Hc = times(c, H)
    gradient = Hc - g + slope
    for step in range(GRADIENT_STEPS):
        if step in FRESH_STEPS:
            # The geometric mean: a few frames beyond the bounds, where φ″ explodes, must not rule the block.
            P = np.linalg.inv(H + np.diag(np.exp(np.log(curve + 1e-300).mean(0))))
            z = times(gradient, P)
            p = -z
            gz = _dot(gradient, z)
        Hp = times(p, H)
        length = -_dot(gradient, p)
        length /= np.maximum(_dot(Hp, p) + np.einsum("fi,fi,fi->f", curve, p, p)[:, None], 1e-300)
        c = c + length * p
        Hp *= length
        Hc += Hp
        slope, curve = phi.derivatives(c)
        new = Hc - g
        new += slope
        z = times(new, P)
        gz_new = _dot(new, z)
        p *= np.maximum(gz_new - _dot(gradient, z), 0.0) / np.maximum(gz, 1e-300)
        p -= z
        gradient, gz = new, gz_new
        if step >= 7 and step % 2:
            going = _unfinished(z, gradient, diagonal + curve)
            out[left[~going]] = c[~going]
            if not going.any():
                return out, left[:0]
            if going.mean() < 0.75:
                left = left[going]
                c, Hc, g, p, z, gz, gradient, curve = (a[going] for a in (c, Hc, g, p, z, gz, gradient, curve))
    going = _unfinished(z, gradient, diagonal + curve)
    # Where an exponential threw a frame far off, its start is the better place to go on from.
    better = _objective(H, g, c, phi) <= _objective(H, g, start[left], phi)
    out[left[better]] = c[better]
    return out, left[going]


def _objective(H: Array, g: Array, c: Array, phi: Potential) -> Array:
    return 0.5 * (c * times(c, H)).sum(1) - (g * c).sum(1) + phi.value(c).sum(1)


def _unfinished(z: Array, gradient: Array, curvature: Array) -> NDArray[np.bool_]:
    """Say which frames still move: the shared matrix's step must be short, and each weight's own step too.

    The second catches frames that the shared matrix does not fit.
    """
    return ~((np.abs(z).max(1) <= DONE) & ((np.abs(gradient) / curvature).max(1) <= DONE))


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("fi,fi->f", a, b)[:, None]


def _newton(H: Array, g: Array, start: Array, phi: Potential) -> Array:
    """Damped Newton, frame by frame Hessians."""
    c = start.copy()
    active = np.arange(len(c))
    diagonal = np.arange(len(H))
    for _ in range(NEWTON_STEPS):
        if not len(active):
            break
        x, gx = c[active], g[active]
        slope, curve = phi.derivatives(x)
        gradient = times(x, H) - gx + slope
        matrices = np.broadcast_to(H, (len(x), *H.shape)).copy()
        matrices[:, diagonal, diagonal] += curve
        step = -np.linalg.solve(matrices, gradient[:, :, None])[:, :, 0]
        length = _line_search(H, gx, x, step, (gradient * step).sum(1), phi)
        c[active] = x + length[:, None] * step
        active = active[np.abs(step).max(1) > LAST_STEP]
    return c


def _line_search(H: Array, g: Array, x: Array, step: Array, slope: Array, phi: Potential) -> Array:
    """Halve each frame's step until it descends as far as Armijo's rule asks."""
    here = _objective(H, g, x, phi)
    length = np.ones(len(x))
    pending = np.arange(len(x))
    for _ in range(MAX_HALVINGS):
        trial = x[pending] + length[pending, None] * step[pending]
        value = _objective(H, g[pending], trial, phi)
        slack = 1e-12 * np.maximum(np.abs(here[pending]), 1.0)  # Rounding near the minimum.
        pending = pending[~(value <= here[pending] + 1e-4 * length[pending] * slope[pending] + slack)]
        if not len(pending):
            break
        length[pending] *= 0.5
    return length
