"""What moves on a signing face and is not affect: blinks, gaze, mouthing, grammatical brows and cheek puffs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .noise import plateau
from .parameters import Parameters
from .poses import Style, pose_vector
from .protocols import Script

# Share of the neutral before and after a sentence that is signed already, or still.
SIGNED_NEUTRAL = 0.8


@dataclass(frozen=True)
class Confounders:
    """Weights that are not affect, and where they come from.

    Parameters
    ----------
    weights
        (n_frames, n_shapes) of everything but blinks.
    blink
        (n_frames,) closure of the lids, 0 to 1.
    mouth_busy
        (n_frames,) how far mouthing takes the mouth from affect, 0 to 1.
    nod, shake
        (n_frames,) degrees of the head.
    events
        Rows of (onset, offset, label, kind); kinds overlap, rows of one kind do not.
    """

    weights: NDArray[np.float64]
    blink: NDArray[np.float64]
    mouth_busy: NDArray[np.float64]
    nod: NDArray[np.float64]
    shake: NDArray[np.float64]
    events: list[tuple[int, int, str, str]]


def signed_stretches(script: Script, bounds: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return the frames of each repetition that are signed: all between its neutrals, and part of those."""
    stretches = []
    for before, after in script.utterances:
        lead = SIGNED_NEUTRAL * (bounds[2 * before + 1] - bounds[2 * before]) / 2
        tail = SIGNED_NEUTRAL * (bounds[2 * after + 1] - bounds[2 * after]) / 2
        stretches.append((int(bounds[2 * before + 1] - lead), int(bounds[2 * after] + tail)))
    return stretches


def add_confounders(
    script: Script,
    bounds: NDArray[np.int64],
    style: Style,
    shapes: Sequence[str],
    parameters: Parameters,
    difficulty: str,
    *,
    rng: np.random.Generator,
) -> Confounders:
    """Return everything on the face of one take that is not affect.

    Outside sentences there are blinks and a little gaze only.
    """
    n_frames = int(bounds[-1])
    blink, mouth_busy, nod, shake = np.zeros((4, n_frames))
    result = Confounders(np.zeros((n_frames, len(shapes))), blink, mouth_busy, nod, shake, [])
    strength = parameters.level(difficulty)["confounders"]
    stretches = signed_stretches(script, bounds)
    _blink(result, stretches, style, parameters, rng)
    _look(result, script.protocol, shapes, parameters, rng)
    for onset, offset in stretches:
        _mouth(result, onset, offset, shapes, parameters, strength, rng)
        _mark_grammar(result, onset, offset, script.grammar, shapes, parameters, strength, rng)
        for _ in range(script.cheeks):
            _puff(result, onset, offset, shapes, parameters, strength, rng)
    return result


def _blink(
    result: Confounders,
    stretches: Sequence[tuple[int, int]],
    style: Style,
    parameters: Parameters,
    rng: np.random.Generator,
) -> None:
    """Add blinks at random, and mostly one at the end of a sentence; closing is faster than opening."""
    n_frames, rate, setting = len(result.blink), parameters.rate, parameters.blink
    times = rng.uniform(0, n_frames, rng.poisson(style.blinks_per_minute * n_frames / rate / 60.0)).tolist()
    times += [offset + rng.normal(0.0, 0.1) * rate for _, offset in stretches if rng.random() < 0.7]
    closing, opening = setting["closing"] * rate, setting["opening"] * rate
    free = 0.0
    for time in sorted(times):
        if time < free or time + closing + opening > n_frames:
            continue
        stretch = rng.uniform(0.85, 1.3)
        frame = np.arange(int(time), min(int(time + stretch * (closing + opening)) + 1, n_frames))
        since = (frame - time) / stretch
        shut = np.where(since < closing, since / closing, 1.0 - (since - closing) / opening)
        smooth = np.clip(shut, 0.0, 1.0)
        result.blink[frame] = rng.uniform(*setting["amplitude"]) * smooth**2 * (3.0 - 2.0 * smooth)
        result.events.append((int(frame[0]), int(frame[-1]) + 1, "blink", "blink"))
        free = float(frame[-1]) + 0.2 * rate


def _look(
    result: Confounders, protocol: str, shapes: Sequence[str], parameters: Parameters, rng: np.random.Generator
) -> None:
    """Add gaze: quick shifts between random places, with lids that follow a look down."""
    n_frames, rate, setting = len(result.blink), parameters.rate, parameters.gaze
    n_shifts = rng.poisson(setting["shifts_per_minute"][protocol] * n_frames / rate / 60.0)
    times = np.sort(rng.uniform(0, n_frames, n_shifts))
    ramp = setting["ramp"] * rate
    for kind, onset, offset in zip(rng.random(n_shifts), times, np.append(times, n_frames)[1:], strict=True):
        if kind < 0.4 or offset - onset < 2 * ramp:
            continue  # back to the camera
        offset = min(offset, onset + rng.uniform(0.2, 1.0) * setting["longest"] * rate)
        across = rng.normal(0.0, setting["horizontal"])
        up = rng.normal(-0.1, setting["vertical"])
        pose = {
            "eyeLookOutLeft": max(across, 0.0),
            "eyeLookInRight": max(across, 0.0),
            "eyeLookInLeft": max(-across, 0.0),
            "eyeLookOutRight": max(-across, 0.0),
            "eyeLookUp": max(up, 0.0),
            "eyeLookDown": max(-up, 0.0),
            "eyeBlink": setting["lid"] * max(-up, 0.0),
        }
        result.weights[:] += plateau(n_frames, onset, offset, ramp)[:, None] * np.minimum(
            pose_vector(pose, shapes), 0.8
        )
        result.events.append((int(onset), int(offset), "shift", "gaze"))


def _mouth(
    result: Confounders,
    onset: int,
    offset: int,
    shapes: Sequence[str],
    parameters: Parameters,
    strength: float,
    rng: np.random.Generator,
) -> None:
    """Add mouthing: words of one to three syllables, each a short pulse of one mouth picture."""
    n_frames, rate, setting = len(result.blink), parameters.rate, parameters.mouthing
    visemes = [pose_vector(v, shapes) for v in setting["viseme"]]
    syllable = rate / rng.uniform(*setting["syllables_per_second"])
    time = float(onset)
    while time + syllable < offset:
        n_syllables = int(rng.integers(setting["syllables_per_word"][0], setting["syllables_per_word"][1] + 1))
        n_syllables = min(n_syllables, int((offset - time) / syllable))
        end = time + n_syllables * syllable
        result.events.append((int(time), int(end), "word", "mouthing"))
        result.mouth_busy[:] = np.maximum(result.mouth_busy, plateau(n_frames, time - 0.05 * rate, end, 0.12 * rate))
        for i in range(n_syllables):
            start = time + (i - 0.15) * syllable
            frame = np.arange(max(int(start), 0), min(int(start + 1.3 * syllable) + 1, n_frames))
            pulse = np.sin(np.pi * np.clip((frame - start) / (1.3 * syllable), 0.0, 1.0)) ** 2
            viseme = visemes[int(rng.integers(len(visemes)))]
            amplitude = strength * setting["amplitude"] * rng.uniform(0.5, 1.2)
            result.weights[frame] += amplitude * pulse[:, None] * viseme
        time = end + rng.uniform(*setting["pause"]) * rate


def _mark_grammar(
    result: Confounders,
    onset: int,
    offset: int,
    name: str,
    shapes: Sequence[str],
    parameters: Parameters,
    strength: float,
    rng: np.random.Generator,
) -> None:
    """Add what brows and head say about the sentence: questions, topics, negation, conditions."""
    n_frames, rate, setting = len(result.blink), parameters.rate, parameters.grammar[name]
    start = onset + setting["start"] * (offset - onset)
    end = onset + setting["end"] * (offset - onset)
    if end <= start:
        return
    course = plateau(n_frames, start, end, parameters.grammar["ramp"] * rate)
    result.weights[:] += strength * rng.uniform(0.7, 1.15) * course[:, None] * pose_vector(setting["pose"], shapes)
    since = (np.arange(n_frames) - start) / rate
    result.nod[:] += setting["nod"] * rng.uniform(0.6, 1.3) * course
    result.shake[:] += setting["shake"] * course * np.sin(2.0 * np.pi * rng.uniform(1.4, 2.2) * since)
    result.events.append((int(start), int(end), name, "grammar"))


def _puff(
    result: Confounders,
    onset: int,
    offset: int,
    shapes: Sequence[str],
    parameters: Parameters,
    strength: float,
    rng: np.random.Generator,
) -> None:
    """Add a cheek puff that belongs to a sign, with pressed lips."""
    n_frames, rate, setting = len(result.blink), parameters.rate, parameters.cheeks
    length = rng.uniform(*setting["duration"]) * rate
    start = rng.uniform(onset, max(offset - length, onset + 1))
    end = min(start + length, offset)
    pose = pose_vector({"cheekPuff": 1.0, "mouthPress": 0.35}, shapes)
    amplitude = min(strength, 1.0) * rng.uniform(*setting["amplitude"])
    result.weights[:] += amplitude * plateau(n_frames, start, end, 0.12 * rate)[:, None] * pose
    result.mouth_busy[:] = np.maximum(result.mouth_busy, plateau(n_frames, start, end, 0.12 * rate))
    result.events.append((int(start), int(end), "puff", "cheeks"))
