"""How a signer makes each affect: their own weights, sides and mixtures over the avatar's shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import RigError
from .parameters import NEUTRAL, Parameters
from .protocols import Instance, Script


@dataclass(frozen=True)
class Style:
    """What is a signer's own in their expressions.

    Parameters
    ----------
    poses
        (n_affects, 2, n_shapes) weights at full intensity, two ways of making each affect.
    mixture
        (n_affects,) how much of the second way, 0 to 1.
    intensity
        Factor on every intensity.
    resting
        (n_shapes,) weights that a neutral face of theirs keeps, mean.
    lag
        (n_regions,) s by which a region of the face runs late.
    blinks_per_minute
        Rate.
    """

    poses: NDArray[np.float64]
    mixture: NDArray[np.float64]
    intensity: float
    resting: NDArray[np.float64]
    lag: NDArray[np.float64]
    blinks_per_minute: float


def pose_vector(pose: Mapping[str, float], shapes: Sequence[str]) -> NDArray[np.float64]:
    """Return weights for named shapes; ``mouthSmile`` stands for mouthSmileLeft and mouthSmileRight.

    Returns
    -------
    (n_shapes,) weights.

    Raises
    ------
    RigError
        If the rig has no such shape.
    """
    weights = np.zeros(len(shapes))
    for name, value in pose.items():
        found = [i for i, shape in enumerate(shapes) if shape in (name, f"{name}Left", f"{name}Right")]
        if not found:
            raise RigError(f"rig: no shape {name!r}, nor a left and right one; simulation needs it")
        weights[found] = value
    return weights


def shape_regions(shapes: Sequence[str], regions: Sequence[str]) -> NDArray[np.int64]:
    """Return for each shape the number of the region that it moves, told by its name."""
    starts = {"brow": "brows", "eye": "eyes", "cheek": "cheeks", "nose": "cheeks", "mouth": "mouth", "jaw": "jaw"}
    numbers = []
    for shape in shapes:
        region = next((region for start, region in starts.items() if shape.startswith(start)), None)
        if region is None:
            raise RigError(f"rig: shape {shape!r} belongs to no region; its name must start with {', '.join(starts)}")
        numbers.append(list(regions).index(region))
    return np.array(numbers)


def draw_style(parameters: Parameters, shapes: Sequence[str], *, rng: np.random.Generator) -> Style:
    """Return the style of one signer."""
    setting = parameters.signer
    side = np.array([1.0 if s.endswith("Left") else -1.0 if s.endswith("Right") else 0.0 for s in shapes])
    # A shape's spread is shared by its two sides; the sides differ by the asymmetry alone.
    stems = [s.removesuffix("Left").removesuffix("Right") for s in shapes]
    partner = np.array([stems.index(stem) for stem in stems])
    poses = []
    for affect in parameters.affects:
        own = np.exp(setting["pose_spread"] * rng.standard_normal(len(shapes))[partner])
        lean = np.exp(0.5 * setting["asymmetry"] * rng.standard_normal() * side)
        poses.append([pose_vector(pose, shapes) * own * lean for pose in parameters.poses[affect]])
    lag = np.array([setting["lag"][region] for region in parameters.regions])
    resting = np.zeros(len(shapes))
    chosen = rng.permutation(len(shapes))[: len(shapes) // 3]
    resting[chosen] = setting["resting"] * rng.random(len(chosen))
    return Style(
        np.array(poses),
        rng.uniform(0.15, 0.85, len(parameters.affects)),
        float(rng.uniform(*setting["intensity"])),
        resting,
        lag + setting["lag_spread"] * rng.standard_normal(len(lag)),
        float(rng.uniform(*setting["blinks_per_minute"])),
    )


def draw_instances(
    script: Script, style: Style, parameters: Parameters, difficulty: str, *, rng: np.random.Generator
) -> list[Instance]:
    """Return every step of a take as it will be performed: how strongly, and how far into a neighbouring affect."""
    setting, blend = parameters.protocols, parameters.level(difficulty)["blend"]
    instances = []
    for step in script.steps:
        if step.affect == NEUTRAL:
            instances.append(Instance(NEUTRAL))
            continue
        if step.degree is None:
            mean = setting["intensity"][script.protocol]
        else:
            mean = setting["degree_intensity"][str(step.degree)]
        intensity = mean + setting["intensity_spread"][script.protocol] * rng.standard_normal()
        toward = parameters.confusion[step.affect]["toward"]
        partner = str(rng.choice(list(toward), p=list(toward.values())))
        # Most are nearly pure, some go far: a beta distribution with mean 0.3.
        share = blend * parameters.confusion[step.affect]["strength"] * rng.beta(1.1, 2.6)
        instances.append(Instance(step.affect, float(np.clip(style.intensity * intensity, 0.1, 1.25)), partner, share))
    return instances


def instance_pose(
    instance: Instance, style: Style, parameters: Parameters, difficulty: str, *, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the weights that one step holds.

    ``intensity · ((1 − blend) · own pose + blend · neighbour's pose)``, every shape a little off each time.

    Returns
    -------
    (n_shapes,) weights, up to about 1.3 before saturation.
    """
    if instance.affect == NEUTRAL:
        return style.resting * rng.uniform(0.3, 1.7)
    spread = parameters.level(difficulty)["pose_spread"]
    parts = []
    for affect in (instance.affect, instance.partner):
        k = parameters.affects.index(affect)
        second = np.clip(style.mixture[k] + spread * rng.standard_normal(), 0.0, 1.0)
        parts.append((1.0 - second) * style.poses[k, 0] + second * style.poses[k, 1])
    pose = (1.0 - instance.blend) * parts[0] + instance.blend * parts[1]
    return style.resting + instance.intensity * pose * np.exp(spread * rng.standard_normal(len(pose)))
