"""What the signers are asked to do: the four protocols of Reverdy 2019, 4.3.2 (IE, SE, EU) and 6.1 (IGE)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .parameters import NEUTRAL, Parameters


@dataclass(frozen=True)
class Step:
    """One thing to do: an affect, or neutral, and in graded takes the degree asked for (1 to 3)."""

    affect: str
    degree: int | None = None


@dataclass(frozen=True)
class Script:
    """What one take consists of.

    Parameters
    ----------
    name
        Of the take, without the signer: ``IE_joy``.
    protocol
        IE, SE, IGE or EU.
    affect
        The affect asked for.
    steps
        What follows what; between two steps lies a transition.
    instruction
        What the signer was told.
    utterances
        For sentences: numbers of the neutral steps before and after each repetition.
    grammar, cheeks
        For sentences: what brows and head say besides affect, and how many cheek puffs belong to them.
    """

    name: str
    protocol: str
    affect: str
    steps: tuple[Step, ...]
    instruction: str
    utterances: tuple[tuple[int, int], ...] = ()
    grammar: str = "none"
    cheeks: int = 0


@dataclass(frozen=True)
class Instance:
    """One step as it is performed.

    Parameters
    ----------
    affect
        What was asked for, or neutral.
    intensity
        Of a full pose, 0 to about 1.2.
    partner, blend
        The affect that it slides into, and the share of that one's pose (0 to 1).
    """

    affect: str
    intensity: float = 0.0
    partner: str = NEUTRAL
    blend: float = 0.0


def corpus_size(parameters: Parameters, seconds: float | None) -> Mapping[str, Any]:
    """Return how many takes and repetitions fit into ``seconds`` per signer; everything when it is None."""
    sizes = parameters.protocols["size"]
    return sizes[-1] if seconds is None else next(size for size in sizes if seconds < size["below"])


def write_scripts(parameters: Parameters, size: Mapping[str, Any], rng: np.random.Generator) -> list[Script]:
    """Return all scripts of one signer.

    Full size gives 6 IE, 5 SE, 6 IGE and 18 EU takes. The order of the affects within SE, and which affects a small
    corpus grades, differ from signer to signer.

    Parameters
    ----------
    size
        As :func:`corpus_size` returns it.
    rng
        The signer's random numbers.
    """
    orders = {base: rng.permutation([a for a in parameters.affects if a != base]) for base in parameters.affects}
    graded = sorted(rng.permutation(len(parameters.affects))[: size["graded"]])
    bases = parameters.protocols["sequence_bases"][: size["sequences"]]
    return [
        *(isolated_expression(a, size["isolated_repetitions"]) for a in parameters.affects),
        *(sequence_of_expressions(a, orders[a].tolist()) for a in bases),
        *(
            graded_expression(parameters.affects[i], parameters.protocols["degrees"], size["graded_rounds"])
            for i in graded
        ),
        *_utterances(parameters, size),
    ]


def isolated_expression(affect: str, repetitions: int) -> Script:
    """IE: one affect several times, each time from neutral and back (N-J-N-J-N)."""
    steps = _between_neutrals([Step(affect)] * repetitions)
    return Script(f"IE_{affect}", "IE", affect, steps, f"Show {affect} {repetitions} times, and hold it each time.")


def sequence_of_expressions(affect: str, others: list[str]) -> Script:
    """SE: one affect in turn with each other one (N-J-Su-J-A-J-…-J-N)."""
    steps = [Step(NEUTRAL), Step(affect)]
    for other in others:
        steps += [Step(other), Step(affect)]
    steps.append(Step(NEUTRAL))
    return Script(f"SE_{affect}", "SE", affect, tuple(steps), f"Alternate {affect} with {', '.join(others)}.")


def graded_expression(affect: str, degrees: list[int], rounds: int) -> Script:
    """IGE: one affect in rising degrees, several rounds, neutral in between (N-J1-N-J2-N-J3-N-J1-…)."""
    steps = _between_neutrals([Step(affect, degree) for _ in range(rounds) for degree in degrees])
    return Script(
        f"IGE_{affect}", "IGE", affect, steps, f"Show {affect} weakly, clearly, exaggeratedly; {rounds} rounds."
    )


def _utterances(parameters: Parameters, size: Mapping[str, Any]) -> list[Script]:
    """EU: each sentence several times, with the affect asked for."""
    scripts, seen = [], dict.fromkeys(parameters.affects, 0)
    for sentence in parameters.sentences:
        affect = sentence["affect"]
        seen[affect] += 1
        if seen[affect] > size["sentences_per_affect"]:
            continue
        steps, utterances = [Step(NEUTRAL)], []
        for _ in range(size["sentence_repetitions"]):
            first = len(steps) - 1
            steps += [*(Step(a) for a in sentence["contour"]), Step(NEUTRAL)]
            utterances.append((first, len(steps) - 1))
        scripts.append(
            Script(
                f"EU_{affect}_{seen[affect]}",
                "EU",
                affect,
                tuple(steps),
                f"Sign with {affect}: {sentence['text']}",
                tuple(utterances),
                sentence["grammar"],
                sentence["cheeks"],
            )
        )
    return scripts


def _between_neutrals(steps: list[Step]) -> tuple[Step, ...]:
    return (Step(NEUTRAL), *(s for step in steps for s in (step, Step(NEUTRAL))))
