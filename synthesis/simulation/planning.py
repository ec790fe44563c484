"""Who does what, when, and what the annotators take it for: everything about a take before anything moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .annotators import keep_enough, see_steps, seen_degrees, shift_boundaries
from .parameters import PROTOCOLS, Parameters, random_stream
from .poses import draw_instances
from .protocols import Instance, Script, corpus_size, write_scripts
from .signers import Signer
from .timetable import Timetable, schedule_protocol


@dataclass(frozen=True)
class PlannedTake:
    """A take before it is performed.

    Parameters
    ----------
    name
        ``s1_IE_joy``.
    number
        Of the take within the signer's protocol, from 0.
    instances
        The steps as they will be performed.
    labels, degrees
        By annotator: what each step is taken for, and the degree 0 to 3 that is seen.
    timetable
        When the first annotator sees what.
    bounds
        By annotator, and "truth": 2·n_steps frames, step, transition, step, …
    """

    name: str
    number: int
    signer: Signer
    script: Script
    instances: list[Instance]
    labels: dict[str, list[str]]
    degrees: dict[str, list[int]]
    timetable: Timetable
    bounds: dict[str, NDArray[np.int64]]


def plan_signer(
    signer: Signer, seconds: float | None, parameters: Parameters, difficulty: str, *, seed: int
) -> list[PlannedTake]:
    """Return all takes of one signer.

    The first annotator's times are made to fit Table B.1; the true boundaries lie around theirs as theirs would around
    the truth, and the second annotator's lie around the truth.

    Parameters
    ----------
    seconds
        Of this signer; None for full size.

    Raises
    ------
    InputError
        If there is no such difficulty, or the seconds are too few.
    """
    parameters.level(difficulty)
    if seconds is not None and not (np.isfinite(seconds) and seconds > 0):
        raise InputError(f"seconds: expected a positive number, but got {seconds}")
    number, names = signer.number, parameters.annotators["names"]
    scripts = write_scripts(parameters, corpus_size(parameters, seconds), random_stream(seed, "script", number))
    planned = []
    for p, protocol in enumerate(PROTOCOLS):
        chosen = [script for script in scripts if script.protocol == protocol]
        performed = [
            draw_instances(s, signer.style, parameters, difficulty, rng=random_stream(seed, "instance", number, p, t))
            for t, s in enumerate(chosen)
        ]
        labels, degrees = {}, {}
        for a, name in enumerate(names):
            seen = [
                see_steps(steps, parameters, difficulty, rng=random_stream(seed, "annotator", number, p, t, a))
                for t, steps in enumerate(performed)
            ]
            labels[name] = keep_enough(performed, [s[0] for s in seen], parameters)
            degrees[name] = [seen_degrees(s[1], kept, parameters) for s, kept in zip(seen, labels[name], strict=True)]
        timetables = schedule_protocol(
            chosen,
            labels[names[0]],
            parameters.profile(number),
            parameters,
            seconds,
            rng=random_stream(seed, "timetable", number, p),
        )
        for t, (script, instances, timetable) in enumerate(zip(chosen, performed, timetables, strict=True)):
            planned.append(
                PlannedTake(
                    name=f"{signer.code}_{script.name}",
                    number=t,
                    signer=signer,
                    script=script,
                    instances=instances,
                    labels={name: labels[name][t] for name in names},
                    degrees={name: degrees[name][t] for name in names},
                    timetable=timetable,
                    bounds=_draw_bounds(
                        timetable, parameters, rng=random_stream(seed, "annotator", number, p, t, len(names))
                    ),
                )
            )
    return planned


def _draw_bounds(
    timetable: Timetable, parameters: Parameters, *, rng: np.random.Generator
) -> dict[str, NDArray[np.int64]]:
    """Return the boundaries of the first annotator, of the truth, and of everybody else."""
    setting = parameters.annotators
    first, *others = zip(setting["names"], setting["jitter"], strict=True)
    truth = shift_boundaries(timetable.bounds, first[1] * parameters.rate, setting["jitter_share"], rng=rng)
    bounds = {first[0]: timetable.bounds, "truth": truth}
    for name, jitter in others:
        bounds[name] = shift_boundaries(truth, jitter * parameters.rate, setting["jitter_share"], rng=rng)
    return bounds
