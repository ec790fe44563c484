"""Where the head is: a sway that belongs to the protocol, what affect and grammar add, and the room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from .confounders import Confounders
from .noise import smooth_noise
from .parameters import Parameters

# The face's axes (+X its left, +Y up, +Z out of it) in the room's (z up), for a face that looks along −y.
UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class HeadMotion:
    """Rigid motion of the head, ``room = rotation · face + translation``.

    Parameters
    ----------
    rotation
        (n_frames, 3, 3).
    translation
        (n_frames, 3) mm.
    """

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]

    def move(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n_frames, n, 3) points of the face in the room, mm."""
        return np.einsum("fij,fpj->fpi", self.rotation, points) + self.translation[:, None]


def move_head(
    activation: NDArray[np.float64],
    confounders: Confounders,
    protocol: str,
    facing: float,
    parameters: Parameters,
    *,
    rng: np.random.Generator,
) -> HeadMotion:
    """Return the head's motion in one take.

    Parameters
    ----------
    activation
        (n_frames, n_affects): fear goes back, sadness sinks, …
    facing
        Degrees about the vertical that this signer is turned in the room.
    """
    setting, n_frames = parameters.head, len(activation)
    sway = smooth_noise(n_frames, parameters.rate, setting["time"][protocol], 6, rng=rng)
    slow = gaussian_filter1d(activation, setting["follow"] * parameters.rate, axis=0, mode="nearest")
    coupled = slow @ np.array([setting["affect"][affect] for affect in parameters.affects])
    angles = setting["rotation"][protocol] * sway[:, :3] * [0.8, 1.0, 0.5] + coupled[:, :3]
    angles[:, 0] += confounders.nod
    angles[:, 1] += confounders.shake
    shift = setting["translation"][protocol] * sway[:, 3:] * [1.0, 0.5, 0.8]
    shift[:, 2] += coupled[:, 3]
    head = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
    seat = Rotation.from_euler("z", facing, degrees=True).as_matrix() @ UPRIGHT
    neck = np.array(setting["neck"])
    # Turn about the neck, shift in the face's axes, then take a seat in the room.
    within = neck - np.einsum("fij,j->fi", head, neck) + shift
    return HeadMotion(seat @ head, within @ seat.T + np.array(setting["seat"]))
