"""Curves of a whole take: its energies, computed a block at a time, its residual, the weights of one shape."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ....errors import InputError, NotFoundError
from ....features import differentiate, motion_energy
from .made_files import MadeFiles, make_key
from .shown_weights import BLOCK, ShownWeights

__all__ = ["CURVE_UNITS", "ENERGIES", "WINDOW", "compute_energies", "has_energies", "list_curves", "read_curve"]

ENERGIES = ("velocity", "acceleration", "level")
CURVE_UNITS = {"velocity": "1/s", "acceleration": "1/s²", "level": "1/s", "residual": "mm"}
"""Curves that a take may have besides those of its shapes; see :class:`mimique.features.MotionEnergy`."""

WINDOW = 0.25
TAU = 0.05
"""Seconds: width of the smoothing derivative, and weight of acceleration against velocity, as in the player."""


def has_energies(rate: float) -> bool:
    """Return whether the window holds enough frames at this rate (Hz) to take derivatives."""
    try:
        differentiate(np.zeros((1, 1)), rate, window=WINDOW)
    except InputError:
        return False
    return True


def compute_energies(weights: ShownWeights, *, size: int = BLOCK) -> NDArray[np.float32]:
    """Compute the energies of a take a block at a time, so that a long one needs no more memory than a short one.

    Each block is taken with a margin on both sides. The derivative at a frame looks at most one window away (near the
    end of a run of frames it reaches as far inwards as it lacks outwards), so that within a wider margin the cut
    changes nothing.

    Parameters
    ----------
    weights
        What to compute them of.
    size
        Frames of a block.

    Returns
    -------
    (3, n_frames): velocity (1/s), acceleration (1/s²) and level (1/s), NaN where the weights are.

    Raises
    ------
    InputError
        If the window holds too few frames at this rate.
    """
    margin = math.ceil(WINDOW * weights.rate) + 2
    found = np.empty((len(ENERGIES), weights.n_frames), dtype=np.float32)
    for first in range(0, weights.n_frames, size):
        begin = max(first - margin, 0)
        block = weights.read(begin, first + size + margin - begin)
        energy = motion_energy(block, weights.rate, tau=TAU, window=WINDOW)
        core = slice(first - begin, min(first + size, weights.n_frames) - begin)
        for row, name in zip(found, ENERGIES, strict=True):
            row[first : first + size] = getattr(energy, name)[core]
    return found


def list_curves(weights: ShownWeights) -> list[str]:
    """Return the names of the curves that a take has besides those of its shapes."""
    names = list(ENERGIES) if has_energies(weights.rate) else []
    return names + (["residual"] if "residual" in weights.stored else [])


def read_curve(files: MadeFiles, weights: ShownWeights, curve: str) -> NDArray[np.float32]:
    """Return (n_frames,) one curve: an energy, the residual, or a shape's weights.

    Raises
    ------
    NotFoundError
        If the take has no such curve.
    """
    known = list_curves(weights)
    if curve in ENERGIES and curve in known:
        key = make_key(energies=weights.key, tau=TAU, window=WINDOW)
        return files.find_array(key, lambda: compute_energies(weights))[ENERGIES.index(curve)]
    residual = weights.read_residual() if curve == "residual" else None
    if residual is not None:
        return residual.astype(np.float32)
    if curve in weights.shapes:
        return weights.read_shape(curve)
    raise NotFoundError(
        f"take {weights.take!r}: no curve {curve!r}; it has {', '.join(known) or 'none'} and the shapes of rig "
        f"{weights.rig!r}"
    )
