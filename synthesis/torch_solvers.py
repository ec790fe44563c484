"""The minimisations of :mod:`.torch_backend`, written for many frames at once on one device.

Every function takes and returns PyTorch tensors of one device, float64. PyTorch is optional and therefore not imported
here: tensors bring their operations along, what else is needed comes with the ``torch`` argument, the module.

The course is that of :mod:`.box_qp` and :mod:`.newton`, the pieces are chosen for a device that likes few, large
operations: products with one matrix for all frames bring most frames to the minimum, and those that are left get
their own factorisation in batched Cholesky decompositions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

Tensor = Any

SLICE = 64  # Neighbouring frames that share a preconditioner.
GRADIENT_STEPS = 18
DONE = 1e-8  # Length of a step, that is, about the distance to the minimum.
LAST_STEP = 1e-5  # Newton's error squares with every full step: a last step this long leaves about its square.
NEWTON_STEPS = 200
MAX_HALVINGS = 40

GUESSING_STEPS = 8
PENALTY = 0.2
OVER_RELAXATION = 1.6
ACTIVE_SET_STEPS = 12
PROJECTION_STEPS = 500
TOLERANCE = 1e-12
LEAST_MOVE = 1e-14  # What rounding leaves of a step.
ILL_CONDITIONED = 1e9
PROXIMITY = 1e-11
PROXIMAL_ROUNDS = 4
PADDING = 16


class SoftPotential:
    """``weight · Σ exp((l_inf − c)/s) + exp((c − l_sup)/s)``, entry by entry (Reverdy 2019, 5.24)."""

    def __init__(self, weight: float, s: float, l_inf: float, l_sup: float) -> None:
        self.weight, self.s, self.l_inf, self.l_sup = weight, s, l_inf, l_sup

    def parts(self, c: Tensor) -> tuple[Tensor, Tensor]:
        """Return both exponentials, each capped where a line search may look; no minimum lies there."""
        low = ((self.l_inf - c) / self.s).clamp(-300.0, 300.0).exp()
        high = ((c - self.l_sup) / self.s).clamp(-300.0, 300.0).exp()
        return self.weight * low, self.weight * high

    def value(self, c: Tensor) -> Tensor:
        """Return the potential of every entry."""
        low, high = self.parts(c)
        return low + high

    def derivatives(self, c: Tensor) -> tuple[Tensor, Tensor]:
        """Return its first and second derivative."""
        low, high = self.parts(c)
        return (high - low) / self.s, (low + high) / self.s**2


def soft_minimiser(torch: Any, H: Tensor, phi: SoftPotential) -> Callable[[Tensor], Tensor]:
    """Return a function from (F, N) ``g`` to the minimisers (F, N) of ``½ cᵀ H c − gᵀ c + Σ φ(c_i)``.

    Preconditioned conjugate gradients first (Polak and Ribière, restarted where they would turn back), then damped
    Newton steps, batched, for the frames that are not at the minimum yet; these always converge.
    """
    n = len(H)
    eye = torch.eye(n, dtype=H.dtype, device=H.device)
    slope, curve = phi.derivatives(torch.zeros(1, dtype=H.dtype, device=H.device))
    first = torch.linalg.pinv(H + curve * eye, hermitian=True)

    def objective(g: Tensor, c: Tensor) -> Tensor:
        return 0.5 * (c * (c @ H)).sum(1) - (g * c).sum(1) + phi.value(c).sum(1)

    def solve(g: Tensor) -> Tensor:
        start = ((g - slope) @ first).clamp(phi.l_inf, phi.l_sup)
        c, going = _descend(torch, H, g, start, phi)
        left = going.nonzero()[:, 0]
        if len(left):
            # Where an exponential threw a frame far off, its start is the better place to go on from.
            better = objective(g[left], c[left]) <= objective(g[left], start[left])
            begin = torch.where(better[:, None], c[left], start[left])
            c[left] = _newton(torch, H, g[left], begin, phi, objective)
        return c

    return solve


def _descend(torch: Any, H: Tensor, g: Tensor, start: Tensor, phi: SoftPotential) -> tuple[Tensor, Tensor]:
    """Take some steps of conjugate gradients; return weights and which frames are not at the minimum."""
    n_frames, n = g.shape
    padding = -n_frames % SLICE
    c = torch.cat([start, start[-1:].expand(padding, n)]).reshape(-1, SLICE, n).clone()
    g = torch.cat([g, g[-1:].expand(padding, n)]).reshape(-1, SLICE, n)
    slope, curve = phi.derivatives(c)
    linear = c @ H - g  # The gradient without φ′, updated step by step.
    gradient = linear + slope
    for step in range(GRADIENT_STEPS):
        if step in (0, 3):
            # Renewed once, near the minimum. The geometric mean: a few frames beyond the bounds must not rule.
            typical = (curve + 1e-300).log().mean(1).exp()
            P = torch.linalg.inv_ex(H + torch.diag_embed(typical))[0]
            z = gradient @ P
            p = -z
            gz = (gradient * z).sum(2, keepdim=True)
        Hp = p @ H
        length = -(gradient * p).sum(2, keepdim=True) / (p * (Hp + curve * p)).sum(2, keepdim=True).clamp_min(1e-300)
        c = c + length * p
        linear = linear + length * Hp
        slope, curve = phi.derivatives(c)
        new = linear + slope
        z = new @ P
        gz_new = (new * z).sum(2, keepdim=True)
        turn = (gz_new - (gradient * z).sum(2, keepdim=True)).clamp_min(0.0) / gz.clamp_min(1e-300)
        p = turn * p - z
        gradient, gz = new, gz_new
    # The shared step must be short, and each weight's own too: it catches frames that the preconditioner does not fit.
    own = gradient.abs() / (H.diagonal() + curve)
    done = (z.abs().amax(2) <= DONE) & (own.amax(2) <= DONE)
    return c.reshape(-1, n)[:n_frames], ~done.reshape(-1)[:n_frames]


def _newton(
    torch: Any,
    H: Tensor,
    g: Tensor,
    start: Tensor,
    phi: SoftPotential,
    objective: Callable[[Tensor, Tensor], Tensor],
) -> Tensor:
    """Damped Newton, frame by frame Hessians in batches; steps are halved until they descend as Armijo's rule asks."""
    c = start.clone()
    active = torch.arange(len(c), device=c.device)
    for _ in range(NEWTON_STEPS):
        if not len(active):
            break
        x, gx = c[active], g[active]
        slope, curve = phi.derivatives(x)
        gradient = x @ H - gx + slope
        step = -_solve_definite(torch, H + torch.diag_embed(curve), gradient)
        descent = (gradient * step).sum(1)
        here = objective(gx, x)
        slack = 1e-12 * here.abs().clamp_min(1.0)  # Rounding near the minimum.
        length = torch.ones_like(here)
        for _ in range(MAX_HALVINGS):
            short = ~(objective(gx, x + length[:, None] * step) <= here + 1e-4 * length * descent + slack)
            if not short.any():
                break
            length = torch.where(short, 0.5 * length, length)
        c[active] = x + length[:, None] * step
        active = active[step.abs().amax(1) > LAST_STEP]
    return c


class BoxProgram:
    """``min ½ cᵀ H c − gᵀ c`` over ``lower ≤ c ≤ upper`` for many ``g``, as :class:`.box_qp.BoxQP` solves it.

    Alternating directions guess which weights sit on a bound, the primal-dual active set method corrects the guess,
    and projected Newton finishes the frames in which the optimum's conditions do not hold. A nearly singular ``H``, as
    ``nnls`` may have, goes from zero straight to projected Newton, in proximal rounds: each adds a tiny
    ``‖c − previous‖²``, whose pull fades from round to round.

    Parameters
    ----------
    torch
        The module.
    H
        (N, N) symmetric, positive semidefinite; weights whose row is zero stay at ``lower``.
    lower, upper
        Bounds of every weight; ``upper`` may be infinite.
    """

    def __init__(self, torch: Any, H: Tensor, lower: float, upper: float) -> None:
        self._torch = torch
        diagonal = H.diagonal()
        self._inert = diagonal <= 0
        scale = torch.where(self._inert, torch.ones_like(diagonal), diagonal.clamp_min(1e-300)).rsqrt()
        self._scale = scale  # Solved for c / scale, where H has a diagonal of ones.
        eye = torch.eye(len(H), dtype=H.dtype, device=H.device)
        self._H = H * scale[:, None] * scale + torch.diag(self._inert.to(H.dtype))
        self._lower, self._upper = lower / scale, upper / scale
        self._P = torch.linalg.inv(self._H + PENALTY * eye)
        inverse, info = torch.linalg.inv_ex(self._H)
        condition = float(self._H.abs().sum(1).max() * inverse.abs().sum(1).max())
        self._definite = int(info) == 0 and math.isfinite(condition) and condition < ILL_CONDITIONED
        self._Q = 0.5 * (inverse + inverse.T)
        self._near = self._H if self._definite else self._H + PROXIMITY * eye

    def solve(self, g: Tensor) -> Tensor:
        """Return the minimisers (F, N)."""
        torch = self._torch
        g = torch.where(self._inert, self._lower, g * self._scale)
        if not self._definite:
            c = self._clip(torch.zeros_like(g))
            for _ in range(PROXIMAL_ROUNDS):
                c = self._finish(g + PROXIMITY * c, c)
            return c * self._scale
        c, force = self._guess(g)
        self._correct(g, c, force)
        return self._finish(g, c) * self._scale

    def _clip(self, x: Tensor) -> Tensor:
        return self._torch.minimum(self._torch.maximum(x, self._lower), self._upper)

    def _guess(self, g: Tensor) -> tuple[Tensor, Tensor]:
        """Alternate between the parabola and the box; return weights and the force ``g − H c`` against the bounds."""
        c = self._clip(g @ self._Q)
        force = self._torch.zeros_like(g)
        base = OVER_RELAXATION * (g @ self._P)
        pull = OVER_RELAXATION * PENALTY * self._P
        for _ in range(GUESSING_STEPS):
            x = base + (c - force) @ pull + (1.0 - OVER_RELAXATION) * c + force
            c = self._clip(x)
            force = x - c
        return c, force

    def _correct(self, g: Tensor, c: Tensor, force: Tensor) -> None:
        """Hold the weights that are forced against a bound, solve for the others, look again; works in place."""
        torch = self._torch
        free = g @ self._Q
        left = torch.arange(len(c), device=c.device)
        low, high = force < 0, force > 0
        slack = TOLERANCE * (1.0 + free.abs().amax(1, keepdim=True))
        for _ in range(ACTIVE_SET_STEPS):
            held = low | high
            bound = torch.where(high, self._upper, self._lower)
            here = free[left]
            forces = _solve_chosen(torch, self._Q, held, torch.where(held, here - bound, 0.0))
            x = torch.where(held, bound, here - forces @ self._Q)
            c[left] = self._clip(x)
            new_low = torch.where(held, low & (forces <= 0), x < self._lower - slack[left])
            new_high = torch.where(held, high & (forces >= 0), x > self._upper + slack[left])
            going = ((new_low != low) | (new_high != high)).any(1).nonzero()[:, 0]
            left, low, high = left[going], new_low[going], new_high[going]
            if not len(left):
                break

    def _finish(self, g: Tensor, start: Tensor) -> Tensor:
        """Projected Newton: hold what is pushed against its bound, take a Newton step with the rest, project.

        Only the frames in which the Karush-Kuhn-Tucker conditions do not hold yet are touched.
        """
        torch = self._torch
        c = self._clip(start)
        size = TOLERANCE * (1.0 + g.abs().amax(1) + c.abs().amax(1))
        active = torch.arange(len(c), device=c.device)
        for _ in range(PROJECTION_STEPS):
            x = c[active]
            gradient = x @ self._near - g[active]
            free = ~(((x <= self._lower) & (gradient >= 0)) | ((x >= self._upper) & (gradient <= 0)))
            going = (torch.where(free, gradient, 0.0).abs().amax(1) > size[active]).nonzero()[:, 0]
            active, x, gradient, free = active[going], x[going], gradient[going], free[going]
            if not len(active):
                break
            step = -_solve_chosen(torch, self._near, free, gradient)
            moved = self._project(x, step, gradient)
            c[active] = moved
            active = active[(moved - x).abs().amax(1) > LEAST_MOVE * (1.0 + x.abs().amax(1))]
        return c

    def _project(self, x: Tensor, step: Tensor, gradient: Tensor) -> Tensor:
        """Step along the projected path, halving until the objective falls enough."""
        torch = self._torch
        length = torch.ones_like(x[:, :1])
        out = self._clip(x + step)
        for _ in range(MAX_HALVINGS):
            d = out - x
            linear = (gradient * d).sum(1, keepdim=True)
            change = linear + 0.5 * (d * (d @ self._near)).sum(1, keepdim=True)
            short = ~(change <= 1e-4 * linear)
            if not short.any():
                break
            length = torch.where(short, 0.5 * length, length)
            out = self._clip(x + length * step)
        return out


def _solve_chosen(torch: Any, matrix: Tensor, chosen: Tensor, right: Tensor) -> Tensor:
    """Solve ``matrix[S, S] y_S = right_S`` per frame, with S the frame's chosen weights; y is 0 elsewhere.

    Frames with about as many chosen weights are solved together, padded with rows of the identity.
    """
    n = len(matrix)
    out = torch.zeros_like(right)
    counts = chosen.sum(1)
    order = (~chosen).to(torch.uint8).argsort(dim=1, stable=True)
    most = int(counts.max()) if len(counts) else 0
    for below in range(0, most, PADDING):
        size = min(below + PADDING, n)
        rows = ((counts > below) & (counts <= size)).nonzero()[:, 0]
        if not len(rows):
            continue
        index = order[rows, :size]
        inside = torch.arange(size, device=matrix.device) < counts[rows, None]
        systems = matrix[index[:, :, None], index[:, None, :]]
        systems = systems * (inside[:, :, None] & inside[:, None, :])
        systems.diagonal(dim1=1, dim2=2).add_((~inside).to(systems.dtype))
        values = right[rows].gather(1, index) * inside
        out[rows] = out[rows].scatter(1, index, _solve_definite(torch, systems, values))
    return out


def _solve_definite(torch: Any, matrices: Tensor, right: Tensor) -> Tensor:
    """Solve one positive definite system per frame."""
    factors, _ = torch.linalg.cholesky_ex(matrices)
    return torch.cholesky_solve(right[:, :, None], factors)[:, :, 0]
