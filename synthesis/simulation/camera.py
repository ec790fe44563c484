"""What a motion capture system makes of true markers: noise, and gaps where cameras lose one or a hand hides some."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .parameters import Parameters


def add_noise(
    positions: NDArray[np.float64], parameters: Parameters, *, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return positions with white noise; each marker has its own standard deviation.

    Parameters
    ----------
    positions
        (n_frames, n_markers, 3) mm.
    """
    least, most = parameters.camera["noise"]
    deviation = rng.uniform(least, most, (positions.shape[1], 1))
    return positions + deviation * rng.standard_normal(positions.shape)


def lose_markers(
    neutral: NDArray[np.float64],
    kinds: list[str],
    n_frames: int,
    protocol: str,
    parameters: Parameters,
    *,
    rng: np.random.Generator,
) -> NDArray[np.bool_]:
    """Return where markers are missing.

    Parameters
    ----------
    neutral
        (n_markers, 3) places on the face, mm: a hand hides neighbours together.
    kinds
        head, face, lips or lids, per marker.

    Returns
    -------
    (n_frames, n_markers) True where a marker is lost. The very first and last frames are whole.
    """
    setting, rate = parameters.camera, parameters.rate
    missing = np.zeros((n_frames, len(kinds)), dtype=bool)
    edge = parameters.frames(setting["still_start"])
    minutes = n_frames / rate / 60.0
    for marker, kind in enumerate(kinds):
        for _ in range(rng.poisson(setting["gaps_per_minute"][kind] * minutes)):
            _lose(missing, [marker], setting["gap"], edge, rate, rng)
    low = [m for m, kind in enumerate(kinds) if kind != "head" and neutral[m, 1] < np.median(neutral[:, 1])]
    for _ in range(rng.poisson(setting["hands_per_minute"][protocol] * minutes)):
        centre = neutral[rng.choice(low)]
        near = [m for m in low if np.linalg.norm(neutral[m] - centre) < setting["hand_reach"]]
        _lose(missing, near, setting["hand_gap"], edge, rate, rng)
    return missing


def _lose(
    missing: NDArray[np.bool_],
    markers: list[int],
    setting: Mapping[str, float],
    edge: int,
    rate: int,
    rng: np.random.Generator,
) -> None:
    """Mark one gap of log-normal length at a random time."""
    length = setting["median"] * np.exp(setting["spread"] * rng.standard_normal())
    n = max(1, round(min(length, setting["longest"]) * rate))
    last = len(missing) - edge - n
    if last > edge:
        onset = int(rng.integers(edge, last))
        missing[onset : onset + n, markers] = True
