"""Quadratic programs with bounds, many at once: ``min ½ cᵀ H c − gᵀ c`` over ``lower ≤ c ≤ upper``.

``H`` is shared by all frames and positive definite. Three stages, each for the frames that the one before left over:

1. a few steps of the alternating direction method of multipliers (Boyd et al. 2011), which need one matrix for all
   frames, guess which weights sit on a bound;
2. the primal-dual active set method (Hintermüller, Ito and Kunisch 2003) corrects the guess. Held weights are few, so
   with ``Q = H⁻¹`` it solves for their multipliers, ``Q_AA λ_A = bound − (Q g)_A``: systems of about ten unknowns;
3. projected Newton (Bertsekas 1982) finishes the frames in which the second cycles; it always converges.

A frame is done when its Karush-Kuhn-Tucker conditions hold to rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .small_products import times

Array = NDArray[np.floating[Any]]
Held = NDArray[np.bool_]

ROWS = 512  # Frames at a time, such that their arrays stay in cache.
GUESSING_STEPS = 8
PENALTY = 0.2
OVER_RELAXATION = 1.6
ACTIVE_SET_STEPS = 12
PADDING = 4
NEWTON_STEPS = 500
TOLERANCE = 1e-10
ILL_CONDITIONED = 1e9


class BoxQP:
    """Quadratic programs that share ``H`` and the bounds.

    Parameters
    ----------
    H
        (N, N) symmetric, positive definite.
    lower, upper
        Bounds of every weight.
    """

    def __init__(self, H: Array, lower: float = 0.0, upper: float = 1.0) -> None:
        scale = 1.0 / np.sqrt(np.diag(H))
        self._scale = scale  # Solved for c / scale, where H has a diagonal of ones.
        self._H = H * np.outer(scale, scale)
        self._lower, self._upper = lower / scale, upper / scale
        self._Q = np.linalg.inv(self._H)
        self._P = np.linalg.inv(self._H + PENALTY * np.eye(len(H)))
        condition = np.abs(self._H).sum(1).max() * np.abs(self._Q).sum(1).max()
        self._invertible = bool(condition < ILL_CONDITIONED)

    def solve(self, g: Array, start: Array | None = None) -> Array:
        """Return the minimisers (F, N) for (F, N) linear terms.

        ``start``, weights near the minimisers, takes the place of the guess; the minimisers do not depend on it.
        """
        out = np.empty_like(g)
        for first in range(0, len(g), ROWS):
            part = slice(first, first + ROWS)
            near = None if start is None else start[part] / self._scale
            out[part] = self._solve_block(g[part] * self._scale, near) * self._scale
        return out

    def _solve_block(self, g: Array, near: Array | None) -> Array:
        free = times(g, self._Q)
        if near is None:
            c, force = self._guess(g, free)
        else:
            c = np.clip(near, self._lower, self._upper)
            force = (c >= self._upper).astype(float) - (c <= self._lower)
        left = self._correct(free, c, force) if self._invertible else np.arange(len(g))
        if len(left):
            c[left] = self._finish(g[left], c[left])
        return c

    def _guess(self, g: Array, free: Array) -> tuple[Array, Array]:
        """Alternate between the parabola and the box; return weights and the force ``g − H c`` against the bounds."""
        c = np.clip(free, self._lower, self._upper)
        force = np.zeros_like(g)
        base = OVER_RELAXATION * times(g, self._P)
        pull = OVER_RELAXATION * PENALTY * self._P
        for _ in range(GUESSING_STEPS):
            x = times(c - force, pull)
            x += base
            x += (1.0 - OVER_RELAXATION) * c
            x += force
            c = np.clip(x, self._lower, self._upper)
            force = x - c
        return c, force

    def _correct(self, free: Array, c: Array, force: Array) -> NDArray[np.int64]:
        """Hold the weights that are forced against a bound, solve for the others, look again; works in place.

        Returns the frames that are not done.
        """
        left = np.arange(len(c))
        low, high = force < 0, force > 0
        slack = TOLERANCE * (1.0 + np.abs(free).max(1, keepdims=True))
        for _ in range(ACTIVE_SET_STEPS):
            held = low | high
            bound = np.where(high, self._upper, self._lower)
            forces = _solve_subsystems(self._Q, held, free[left] - bound)
            x = np.where(held, bound, free[left] - times(forces, self._Q))
            c[left] = x
            new_low = np.where(held, low & (forces <= 0), x < self._lower - slack[left])
            new_high = np.where(held, high & (forces >= 0), x > self._upper + slack[left])
            going = ((new_low != low) | (new_high != high)).any(1)
            left, low, high = left[going], new_low[going], new_high[going]
            if not len(left):
                break
        np.clip(c, self._lower, self._upper, out=c)
        return left

    def _finish(self, g: Array, start: Array) -> Array:
        """Projected Newton: hold what is pushed against its bound, take a Newton step with the rest, project."""
        c = np.clip(start, self._lower, self._upper)
        size = TOLERANCE * (1.0 + np.abs(g).max(1))
        active = np.arange(len(c))
        for _ in range(NEWTON_STEPS):
            x = c[active]
            gradient = times(x, self._H) - g[active]
            free = ~(((x <= self._lower) & (gradient >= 0)) | ((x >= self._upper) & (gradient <= 0)))
            going = np.abs(np.where(free, gradient, 0.0)).max(1) > size[active]
            active, x, gradient, free = active[going], x[going], gradient[going], free[going]
            if not len(active):
                break
            step = -_solve_subsystems(self._H, free, gradient)
            c[active] = self._project(x, step, gradient)
        return c

    def _project(self, x: Array, step: Array, gradient: Array) -> Array:
        """Step along the projected path, halving until the objective falls enough."""
        out = np.clip(x + step, self._lower, self._upper)
        pending = np.arange(len(x))
        length = 1.0
        for _ in range(40):
            d = out[pending] - x[pending]
            linear = (gradient[pending] * d).sum(1)
            change = linear + 0.5 * (d * times(d, self._H)).sum(1)
            pending = pending[~(change <= 1e-4 * linear)]
            if not len(pending):
                break
            length *= 0.5
            out[pending] = np.clip(x[pending] + length * step[pending], self._lower, self._upper)
        return out


def _solve_subsystems(matrix: Array, chosen: Held, right: Array) -> Array:
    """Solve ``matrix[S, S] y_S = right_S`` per frame, with S the frame's chosen weights; y is 0 elsewhere.

    Frames with about as many chosen weights are solved together, padded with rows of the identity.
    """
    out = np.zeros_like(right)
    n = len(matrix)
    flat = np.ascontiguousarray(matrix).ravel()
    counts = chosen.sum(1)
    padded = np.minimum(-(-counts // PADDING) * PADDING, n)
    order = np.argsort(~chosen, axis=1, kind="stable")
    for size in np.unique(padded):
        if size == 0:
            continue
        rows = np.flatnonzero(padded == size)
        index = order[rows, :size]
        systems = flat[index[:, :, None] * n + index[:, None, :]]
        inside = np.arange(size) < counts[rows, None]
        systems *= inside[:, :, None]
        systems *= inside[:, None, :]
        systems[:, np.arange(size), np.arange(size)] += ~inside
        values = np.where(inside, np.take_along_axis(right[rows], index, axis=1), 0.0)
        solution = np.linalg.solve(systems, values[:, :, None])[:, :, 0]
        out[rows[:, None], index] = solution
    return out
