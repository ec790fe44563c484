"""Smooth randomness and the course of a movement: the building stones of every simulated curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline


def smooth_noise(
    n_frames: int, rate: float, time: float, columns: int, *, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return smooth random curves of mean 0 and standard deviation about 1.

    Independent normal values ``time`` seconds apart, a cubic spline through them, at a random phase.

    Returns
    -------
    (n_frames, columns), dimensionless.
    """
    step = time * rate
    n_knots = int(np.ceil(n_frames / step)) + 5
    knots = (np.arange(n_knots) - 2 + rng.uniform(-0.5, 0.5)) * step
    return np.asarray(CubicSpline(knots, rng.standard_normal((n_knots, columns)))(np.arange(n_frames)))


def rise(fraction: NDArray[np.float64], p: float, q: float) -> NDArray[np.float64]:
    """Return ``1 − (1 − u^p)^q``, from 0 to 1 with a level start and end: an asymmetric sigmoid.

    Parameters
    ----------
    fraction
        u, limited to 0 … 1.
    p, q
        Above 1; a small p starts sooner, a large q arrives sooner.
    """
    u = np.clip(fraction, 0.0, 1.0)
    return 1.0 - (1.0 - u**p) ** q


def plateau(n_frames: int, onset: float, offset: float, ramp: float) -> NDArray[np.float64]:
    """Return a curve that is 1 between two times and 0 outside, with raised-cosine flanks.

    Parameters
    ----------
    onset, offset
        Frames, not necessarily whole, where the curve leaves 0 and is back at 0.
    ramp
        Frames that a flank takes; at most half the plateau.
    """
    ramp = max(min(ramp, 0.5 * (offset - onset)), 1e-9)
    frame = np.arange(n_frames)
    up = np.clip((frame - onset) / ramp, 0.0, 1.0)
    down = np.clip((offset - frame) / ramp, 0.0, 1.0)
    return 0.25 * (1.0 - np.cos(np.pi * up)) * (1.0 - np.cos(np.pi * down))


def saturate(weights: NDArray[np.float64], knee: float = 0.75) -> NDArray[np.float64]:
    """Return weights that bend smoothly towards 1 above ``knee`` and stay at 0 below 0."""
    above = knee + (1.0 - knee) * np.tanh((weights - knee) / (1.0 - knee))
    return np.maximum(np.where(weights > knee, above, weights), 0.0)
