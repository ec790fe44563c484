"""The simulated corpus, take by take: what a capture session would have left, and the truth beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ..rig import Rig
from .camera import add_noise, lose_markers
from .confounders import Confounders, add_confounders
from .head_motion import HeadMotion, move_head
from .noise import saturate
from .parameters import NEUTRAL, PROTOCOLS, Parameters, load_parameters, random_stream
from .performance import perform_steps
from .planning import PlannedTake, plan_signer
from .signers import Signer, create_signer
from .tiers import annotate_take, true_tiers


@dataclass(frozen=True)
class Truth:
    """What no recording shows. The pipeline never reads it.

    Parameters
    ----------
    weights
        (n_frames, n_shapes) of the signer's own shapes.
    activation
        (n_frames, n_affects) how active each affect is.
    markers
        (n_frames, n_markers, 3) mm without noise and gaps, on the unmoved head, in the signer's face's axes.
    head
        Motion of the head in the room.
    tiers
        True segments of affect and of each kind of confounder.
    face
        The signer's own face; ``face.shapes`` names the weights.
    marker_vertices
        (n_markers,) where the markers really sit on it.
    """

    weights: NDArray[np.float64]
    activation: NDArray[np.float64]
    affects: list[str]
    markers: NDArray[np.float64]
    head: HeadMotion
    tiers: dict[str, pd.DataFrame]
    face: Rig
    marker_vertices: NDArray[np.int64]


@dataclass(frozen=True)
class Recording:
    """One simulated take.

    Parameters
    ----------
    name
        ``s1_IE_joy``.
    signer, protocol, affect
        Who, how, and which affect was asked for.
    instruction
        What the signer was told.
    rate
        Hz.
    marker_names
        40 on the face, 6 on the skull.
    positions
        (n_frames, n_markers, 3) mm in the room (z up), NaN in gaps.
    head_markers
        Names of those on the skull.
    neutral_frame
        A frame in which the face is neutral, still and whole.
    tiers
        Of the annotators, by name; columns onset, offset (frames) and label; affect also from_label, to_label.
    attributes
        What the file should say of itself: that it is simulated, by which parameters, with which seed.
    """

    name: str
    signer: str
    protocol: str
    affect: str
    instruction: str
    rate: int
    marker_names: tuple[str, ...]
    positions: NDArray[np.float64]
    head_markers: list[str]
    neutral_frame: int
    tiers: dict[str, pd.DataFrame]
    truth: Truth
    attributes: Mapping[str, str | int]


def simulate_corpus(
    signers: int = 2,
    difficulty: str = "medium",
    seconds: float | None = None,
    *,
    seed: int = 0,
    parameters: Parameters | None = None,
) -> Iterator[Recording]:
    """Make the recordings of a simulated corpus, one at a time.

    Parameters
    ----------
    signers
        How many people.
    difficulty
        easy, medium or hard.
    seconds
        Length of the whole corpus, roughly; None for everything that Reverdy 2019 recorded, with the times of Table B.1
        (2357 s for two signers).
    seed
        The same seed gives the same recordings; a signer's are the same however many others there are (at full size).

    Yields
    ------
    Recording

    Raises
    ------
    InputError
        If there is no signer or no such difficulty, or the seconds are too few.
    """
    parameters = parameters or load_parameters()
    if signers < 1:
        raise InputError(f"signers: expected at least 1, but got {signers}")
    share = None if seconds is None else seconds / signers
    for number in range(signers):
        signer = create_signer(number, parameters, seed=seed)
        for take in plan_signer(signer, share, parameters, difficulty, seed=seed):
            yield record_take(take, parameters, difficulty, seed=seed)


def record_take(take: PlannedTake, parameters: Parameters, difficulty: str, *, seed: int) -> Recording:
    """Return a planned take as it was performed, captured and annotated."""
    signer, script = take.signer, take.script
    bounds = take.bounds["truth"]
    numbers = (signer.number, PROTOCOLS.index(script.protocol), take.number)
    affect, activation = perform_steps(
        take.instances,
        bounds,
        script.protocol,
        signer.style,
        signer.regions,
        parameters,
        difficulty,
        rng=random_stream(seed, "motion", *numbers),
    )
    rng = random_stream(seed, "face", *numbers)
    others = add_confounders(script, bounds, signer.style, signer.rig.shapes, parameters, difficulty, rng=rng)
    weights = combine_weights(affect, others, signer, parameters, difficulty)
    markers = signer.skin.move_markers(weights, parameters.rate, rng=rng)
    head = move_head(
        activation,
        others,
        script.protocol,
        signer.facing,
        parameters,
        rng=random_stream(seed, "head", *numbers),
    )
    rng = random_stream(seed, "camera", *numbers)
    missing = lose_markers(signer.skin.neutral, signer.marker_kinds, len(weights), script.protocol, parameters, rng=rng)
    positions = add_noise(head.move(markers), parameters, rng=rng)
    positions[missing] = np.nan
    return Recording(
        name=take.name,
        signer=signer.code,
        protocol=script.protocol,
        affect=script.affect,
        instruction=script.instruction,
        rate=parameters.rate,
        marker_names=signer.marker_names,
        positions=positions,
        head_markers=signer.head_markers,
        neutral_frame=_neutral_frame(take, weights, missing),
        tiers=annotate_take(take, parameters),
        truth=Truth(
            weights,
            activation,
            parameters.affects,
            markers,
            head,
            true_tiers(take, others, parameters),
            signer.rig,
            signer.marker_vertices,
        ),
        attributes={
            "simulated": "yes",
            "simulation_version": parameters.version,
            "simulation_difficulty": difficulty,
            "simulation_seed": seed,
        },
    )


def combine_weights(
    affect: NDArray[np.float64], others: Confounders, signer: Signer, parameters: Parameters, difficulty: str
) -> NDArray[np.float64]:
    """Return weights between 0 and 1 of affect and everything else together.

    Mouthing takes part of mouth and jaw from affect; what both ask of a shape joins as ``a + b − a·b``; lids that close
    are no longer wide or narrowed.
    """
    left = parameters.level(difficulty)["mouth_left"]
    low = np.isin(signer.regions, [parameters.regions.index("mouth"), parameters.regions.index("jaw")])
    share = 1.0 - (1.0 - left) * others.mouth_busy[:, None] * low
    a, b = saturate(share * affect), saturate(others.weights)
    weights = a + b - a * b
    shapes = signer.rig.shapes
    for side in ("Left", "Right"):
        blink = shapes.index(f"eyeBlink{side}")
        for other in (f"eyeWide{side}", f"eyeSquint{side}"):
            weights[:, shapes.index(other)] *= 1.0 - others.blink
        weights[:, blink] = np.maximum(weights[:, blink], others.blink)
    return weights


def _neutral_frame(take: PlannedTake, weights: NDArray[np.float64], missing: NDArray[np.bool_]) -> int:
    """Return the frame of least weights in true neutral steps, among those where every marker is seen."""
    neutral, bounds = np.zeros(len(weights), dtype=bool), take.bounds["truth"]
    for i, step in enumerate(take.script.steps):
        if step.affect == NEUTRAL:
            neutral[bounds[2 * i] : bounds[2 * i + 1]] = True
    whole = neutral & ~missing.any(axis=1)
    effort = np.where(whole if whole.any() else neutral, weights.sum(axis=1), np.inf)
    return int(np.argmin(effort))
