"""Minimise ``½ cᵀ H c − gᵀ c + Σ_i φ(c_i)`` for many ``g`` at once.

``H`` is shared by all frames and positive semidefinite, ``φ`` is smooth and strictly convex.

1. Conjugate gradients (Polak and Ribière's, restarted where they would turn back). Slices of 64 frames share one
   preconditioner, the inverse of ``H`` plus the slice's mean ``φ″``: since neighbours are alike and ``φ″`` seldom
   rules, about ten steps reach the minimum.
2. The frames that need more are gathered, get a preconditioner that fits them better, and as many steps again.
3. The few that are left take damped Newton steps, each with its own Hessian; these always converge.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .small_products import ROWS as SLICE
from .small_products import times

Array = NDArray[np.floating[Any]]

BLOCK = 4 * SLICE  # Frames at a time, such that their arrays stay in cache.
# Per round: how many steps, and after how many the preconditioner is made anew from where the frames are then.
ROUNDS = ((12, 3), (8, 0), (16, 6))
FEW = 4  # So few frames go straight to Newton.
DONE = 1e-9  # Length of a step, that is, about the distance to the minimum.
# Newton's error squares with every full step: a last step this long leaves about its square.
LAST_STEP = 1e-5
NEWTON_STEPS = 200
MAX_HALVINGS = 40


class Potential(Protocol):
    """A smooth, strictly convex function of one weight."""

    def value(self, c: Array) -> Array:
        """Return φ of every entry."""
        ...

    def derivatives(self, c: Array) -> tuple[Array, Array]:
        """Return φ′ and φ″ > 0 of every entry."""
        ...


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
    c = start.copy()
    left = np.arange(len(g))
    for steps, renewal in ROUNDS if len(g) > FEW else ():
        going = np.zeros(len(left), dtype=bool)
        for first in range(0, len(left), BLOCK):
            part = left[first : first + BLOCK]
            c[part], going[first : first + BLOCK] = _descend(H, g[part], c[part], phi, steps, renewal)
        left = left[going]
    if len(left):
        # Where an exponential threw a frame far off, its start is the better place to go on from.
        worse = ~(_objective(H, g[left], c[left], phi) <= _objective(H, g[left], start[left], phi))
        c[left[worse]] = start[left[worse]]
        c[left] = _newton(H, g[left], c[left], phi)
    return c


def _descend(
    H: Array, g: Array, start: Array, phi: Potential, steps: int, renewal: int
) -> tuple[Array, NDArray[np.bool_]]:
    """Take some steps of preconditioned conjugate gradients; return weights and which frames still move."""
    n_frames, n = g.shape
    rows = min(SLICE, n_frames)
    padding = -n_frames % rows
    c: Array = np.concatenate([start, np.repeat(start[-1:], padding, axis=0)]).reshape(-1, rows, n)
    g = np.concatenate([g, np.repeat(g[-1:], padding, axis=0)]).reshape(-1, rows, n)
    diagonal = np.diag(H)
    slope, curve = phi.derivatives(c)
    gradient = c @ H
    gradient -= g
    gradient += slope
    for step in range(steps):
        if step in (0, renewal):
            # The geometric mean: a few frames beyond the bounds, where φ″ explodes, must not rule the slice.
            typical = np.exp(np.log(curve + 1e-300).mean((0, 1) if step == 0 else 1))
            P = np.linalg.inv(H + typical[..., None] * np.eye(n))
            z = gradient @ P
            p = -z
            gz = _dot(gradient, z)
        Hp = p @ H
        curve *= p
        curve += Hp
        length = -_dot(gradient, p) / np.maximum(_dot(curve, p), 1e-300)
        c += length * p
        Hp *= length
        gradient -= slope
        new = gradient + Hp
        gradient += slope
        slope, curve = phi.derivatives(c)
        new += slope
        z = new @ P
        gz_new = _dot(new, z)
        p *= np.maximum(gz_new - _dot(gradient, z), 0.0) / np.maximum(gz, 1e-300)
        p -= z
        gradient, gz = new, gz_new
    # The shared step must be short, and each weight's own too: it catches frames that the preconditioner does not fit.
    done = (np.abs(z).max(2) <= DONE) & ((np.abs(gradient) / (diagonal + curve)).max(2) <= DONE)
    return c.reshape(-1, n)[:n_frames], ~done.reshape(-1)[:n_frames]


def _dot(a: Array, b: Array) -> Array:
    return np.einsum("sfi,sfi->sf", a, b)[..., None]


def _objective(H: Array, g: Array, c: Array, phi: Potential) -> Array:
    return 0.5 * (c * times(c, H)).sum(1) - (g * c).sum(1) + phi.value(c).sum(1)


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
