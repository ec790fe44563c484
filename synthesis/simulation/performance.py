"""Affect in time: onset, hold and release of every region of the face, as weights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .noise import rise, smooth_noise
from .parameters import NEUTRAL, Parameters
from .poses import Style, instance_pose
from .protocols import Instance


def perform_steps(
    instances: Sequence[Instance],
    bounds: NDArray[np.int64],
    protocol: str,
    style: Style,
    regions: NDArray[np.int64],
    parameters: Parameters,
    difficulty: str,
    *,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the weights of affect alone, and how active each affect is.

    Each region has its own lag behind each transition. A hold drifts, slackens and trembles.

    Parameters
    ----------
    bounds
        2·n_steps true boundaries, frames.
    regions
        (n_shapes,) region of each shape.

    Returns
    -------
    (n_frames, n_shapes) weights, not yet saturated, and (n_frames, n_affects) activations.
    """
    n_frames, n_regions = int(bounds[-1]), len(parameters.regions)
    weights = np.zeros((n_frames, len(regions)))
    activation = np.zeros((n_frames, len(parameters.affects)))
    spread, linger = parameters.signer["lag_spread"], parameters.motion["linger"][protocol]
    late = parameters.motion["linger_time"] * parameters.rate
    # (transition, region) lags; a lag stays below a third of its transition.
    lengths = np.diff(bounds)[1::2, None]
    lags = parameters.rate * (style.lag + spread * rng.standard_normal((len(lengths), n_regions)))
    lags = np.clip(lags, -lengths / 3, lengths / 3)
    starts, ends = bounds[1:-1:2, None] + lags, bounds[2:-1:2, None] + lags
    for i, instance in enumerate(instances):
        pose = instance_pose(instance, style, parameters, difficulty, rng=rng)
        first = 0 if i == 0 else int(np.floor(starts[i - 1].min()))
        last = n_frames if i == len(instances) - 1 else int(np.ceil(ends[i].max() + late))
        first, last = max(first, 0), min(last, n_frames)
        frame = np.arange(first, last)
        envelope = np.ones((len(frame), n_regions))
        if i > 0:
            envelope *= _course(frame, starts[i - 1], ends[i - 1], parameters.motion["onset_shape"])
        if i < len(instances) - 1:
            shape = parameters.motion["release_shape"]
            gone = (1.0 - linger) * _course(frame, starts[i], ends[i], shape)
            envelope *= 1.0 - gone - linger * _course(frame, starts[i], ends[i] + late, shape)
        held = np.maximum(frame - bounds[2 * i], 0) / parameters.rate
        envelope *= (1.0 - np.minimum(parameters.motion["hold_decay"] * held, 0.2))[:, None]
        weights[first:last] += envelope[:, regions] * pose
        if instance.affect != NEUTRAL:
            strength = instance.intensity * envelope.mean(axis=1)
            activation[first:last, parameters.affects.index(instance.affect)] += (1.0 - instance.blend) * strength
            activation[first:last, parameters.affects.index(instance.partner)] += instance.blend * strength
    return weights * _hold_variation(n_frames, regions, protocol, parameters, rng), activation


def _course(
    frame: NDArray[np.int64], start: NDArray[np.float64], end: NDArray[np.float64], shape: Sequence[float]
) -> NDArray[np.float64]:
    """Return (frames, regions) from 0 before ``start`` to 1 after ``end``."""
    return rise((frame[:, None] - start) / np.maximum(end - start, 1.0), *shape)


def _hold_variation(
    n_frames: int, regions: NDArray[np.int64], protocol: str, parameters: Parameters, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return (n_frames, n_shapes) factors about 1: slow drift of each region, and tremor."""
    setting, n_regions = parameters.motion, len(parameters.regions)
    drift = smooth_noise(n_frames, parameters.rate, setting["hold_drift_time"], n_regions, rng=rng)
    tremor = smooth_noise(n_frames, parameters.rate, 0.5 / setting["tremor_rate"], n_regions, rng=rng)
    factor = 1.0 + setting["hold_drift"][protocol] * drift + setting["tremor"] * tremor
    return np.maximum(factor, 0.0)[:, regions]
