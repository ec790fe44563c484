"""How much a face moves: the velocity and acceleration energies of its weights (Reverdy 2019, 4.4 and 4.5).

    E_vel = Σ_i |dw_i/dt|        (4.4)        E_acc = Σ_i |d²w_i/dt²|        (4.5)

The thesis adds ``E_vel² + E_acc²``, that is 1/s² to 1/s⁴. With a time constant the sum means something, and it means
the same at every frame rate:

    combined = E_vel² + (τ E_acc)²

τ of one frame gives the derivatives per frame, for which the printed sum is meant literally.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from .derivatives import differentiate

__all__ = ["MotionEnergy", "motion_energy"]


@dataclass(frozen=True)
class MotionEnergy:
    """Energy curves of a take, each ``(n_frames,)``, NaN where the weights are.

    Parameters
    ----------
    velocity
        E_vel (4.4) in 1/s, at least 0.
    acceleration
        E_acc (4.5) in 1/s², at least 0.
    combined
        ``E_vel² + (τ E_acc)²`` in 1/s².
    tau
        τ in seconds.
    window
        Width of the smoothing derivative in seconds.
    """

    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    combined: NDArray[np.float64]
    tau: float
    window: float

    @property
    def level(self) -> NDArray[np.float64]:
        """Square root of the combined energy, in 1/s: it grows in proportion to the size of a movement."""
        return np.sqrt(self.combined)


def motion_energy(weights: ArrayLike, rate: float, *, tau: float = 0.05, window: float = 0.25) -> MotionEnergy:
    """Velocity, acceleration and combined energy of weights over time.

    Parameters
    ----------
    weights
        ``(n_frames, n_shapes)``; a frame with a NaN is a gap.
    rate
        Frames per second, above 0.
    tau
        Seconds by which acceleration is weighed against velocity, at least 0. For a movement that eases in and out
        over T seconds the two have the same greatest value at about τ = T/4. The default is less than that for most
        changes of expression (0.2 to 1 s), since acceleration carries most of the noise.
    window
        Full width in seconds of the tapered Savitzky-Golay derivative (:mod:`mimique.features.derivatives`).

    Raises
    ------
    InputError
        If the window holds too few frames at this rate, or τ is negative.
    """
    values = check_array(weights, name="weights", shape=(None, None))
    if not np.isfinite(tau) or tau < 0:
        raise InputError(f"tau: expected seconds, at least 0, but got {tau}")
    _, first, second = differentiate(values, rate, window=window)
    velocity = np.abs(first).sum(axis=1)
    acceleration = np.abs(second).sum(axis=1)
    return MotionEnergy(velocity, acceleration, velocity**2 + (tau * acceleration) ** 2, float(tau), float(window))
