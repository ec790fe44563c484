"""How long everything lasts: durations that add up to Table B.1 (Reverdy 2019, annexe B), or to a shorter corpus."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .parameters import NEUTRAL, PROTOCOLS, TRANSITION, UNANNOTATED, Parameters
from .protocols import Script, corpus_size, write_scripts

# A weak expression that the annotator does not see lies within a neutral segment, and so do its transitions.
HIDDEN_STEP, HIDDEN_TRANSITION = 0.5, 0.35


@dataclass(frozen=True)
class Timetable:
    """When one take's pieces begin and end, as the first annotator sees them.

    Parameters
    ----------
    bounds
        2·n_steps frames from 0 to n_frames: step, transition, step, …
    annotated
        First frame that the first annotator labels, and the frame after the last one.
    """

    bounds: NDArray[np.int64]
    annotated: tuple[int, int]

    @property
    def n_frames(self) -> int:
        """Length of the take."""
        return int(self.bounds[-1])


def schedule_protocol(
    scripts: Sequence[Script],
    labels: Sequence[Sequence[str]],
    profile: str,
    parameters: Parameters,
    seconds: float | None,
    *,
    rng: np.random.Generator,
) -> list[Timetable]:
    """Return the timetables of all takes of one signer and protocol.

    Parameters
    ----------
    scripts
        Of one protocol.
    labels
        What the first annotator takes each step for; the table counts by these.
    profile
        Row group of the table.
    seconds
        Per signer, over all protocols; None for the times of the table.
    rng
        Random numbers of this signer and protocol.

    Raises
    ------
    InputError
        If ``seconds`` are too few for every affect to occur.
    """
    pieces = [
        (take, *_piece(script, take_labels, i))
        for take, (script, take_labels) in enumerate(zip(scripts, labels, strict=True))
        for i in range(2 * len(script.steps) - 1)
    ]
    takes, columns, weights = (np.array(values) for values in zip(*pieces, strict=True))
    weights = weights * np.exp(parameters.protocols["duration_spread"] * rng.standard_normal(len(weights)))
    protocol = scripts[0].protocol
    gaps = np.zeros(len(scripts), dtype=np.int64)
    if seconds is None:
        durations = _fill_table(columns, weights, parameters.table[profile][protocol], parameters)
        gaps = _place_gaps(len(scripts), parameters.table[profile][protocol], parameters, rng)
    else:
        durations = _fill_seconds(columns, weights, profile, protocol, seconds, parameters)
    timetables = []
    for take, gap in enumerate(gaps):
        bounds = np.concatenate([[0], np.cumsum(durations[takes == take])])
        if rng.random() < 0.5:  # the annotator begins late …
            bounds[1:] += gap
            timetables.append(Timetable(bounds, (int(gap), int(bounds[-1]))))
        else:  # … or stops early
            bounds[-1] += gap
            timetables.append(Timetable(bounds, (0, int(bounds[-1] - gap))))
    return timetables


def apportion(weights: NDArray[np.float64], total: int, floor: int) -> NDArray[np.int64]:
    """Return whole numbers that sum to ``total``, each at least ``floor``, the rest in proportion to ``weights``.

    Raises
    ------
    InputError
        If the floors alone exceed the total.
    """
    spare = total - floor * len(weights)
    if spare < 0:
        raise InputError(f"timetable: {len(weights)} pieces of at least {floor} frames do not fit into {total} frames")
    ends = np.round(np.cumsum(weights) / weights.sum() * spare).astype(np.int64)
    return floor + np.diff(ends, prepend=0)


def _piece(script: Script, labels: Sequence[str], i: int) -> tuple[str, float]:
    """Return the column of the table that piece ``i`` counts in, and its weight there."""
    before, after = labels[i // 2], labels[(i + 1) // 2]
    if i % 2:
        return (TRANSITION, 1.0) if before != after else (before, HIDDEN_TRANSITION)
    return before, HIDDEN_STEP if before == NEUTRAL != script.steps[i // 2].affect else 1.0


def _fill_table(
    columns: NDArray, weights: NDArray[np.float64], row: Sequence[float], parameters: Parameters
) -> NDArray[np.int64]:
    """Return durations in frames that add up to one row of the table, column by column."""
    durations = np.zeros(len(columns), dtype=np.int64)
    floor = parameters.frames(parameters.protocols["floor"]["any"])
    for column, seconds in zip(parameters.table["columns"], row, strict=True):
        chosen = columns == column
        if column != UNANNOTATED and chosen.any():
            durations[chosen] = apportion(weights[chosen], parameters.frames(seconds), floor)
    return durations


def _place_gaps(
    n_takes: int, row: Sequence[float], parameters: Parameters, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Return unannotated frames per take: stretches of about ``annotators.gap_length`` at ends of some takes."""
    total = parameters.frames(row[parameters.table["columns"].index(UNANNOTATED)])
    gaps = np.zeros(n_takes, dtype=np.int64)
    if total:
        n_gaps = int(np.clip(round(total / parameters.frames(parameters.annotators["gap_length"])), 1, n_takes))
        gaps[rng.permutation(n_takes)[:n_gaps]] = apportion(rng.uniform(0.5, 1.5, n_gaps), total, 1)
    return gaps


def _fill_seconds(
    columns: NDArray,
    weights: NDArray[np.float64],
    profile: str,
    protocol: str,
    seconds: float,
    parameters: Parameters,
) -> NDArray[np.int64]:
    """Return durations in frames that add up to about ``seconds``: the table's means, scaled alike, above a floor."""
    share = corpus_size(parameters, seconds)["share"][protocol]
    means = mean_durations(profile, parameters)[protocol]
    floors = parameters.protocols["floor"]
    natural = weights * np.array([means[column] for column in columns])
    least = np.array([floors.get(column, floors["affect"]) for column in columns])
    if least.sum() > share * seconds:
        raise InputError(
            f"seconds: every affect in every protocol takes at least {np.ceil(least.sum() / share):.0f} s a signer, "
            f"but got {seconds:.0f} s a signer; ask for more"
        )
    factor = _bisect(lambda f: float(np.maximum(least, f * natural).sum()), share * seconds)
    return np.round(np.maximum(least, factor * natural) * parameters.rate).astype(np.int64)


def mean_durations(profile: str, parameters: Parameters) -> dict[str, Mapping[str, float]]:
    """Return the mean duration (s) of each label in each protocol, by Table B.1 and the full scripts."""
    scripts = write_scripts(parameters, corpus_size(parameters, None), np.random.default_rng(0))
    means: dict[str, Mapping[str, float]] = {}
    for protocol in PROTOCOLS:
        chosen = [s for s in scripts if s.protocol == protocol]
        names = [step.affect for script in chosen for step in script.steps]
        counts = {name: names.count(name) for name in set(names)}
        counts[TRANSITION] = sum(len(script.steps) - 1 for script in chosen)
        row = dict(zip(parameters.table["columns"], parameters.table[profile][protocol], strict=True))
        means[protocol] = {name: row[name] / count for name, count in counts.items()}
    return means


def _bisect(function: Callable[[float], float], target: float) -> float:
    """Return where a rising function of a non-negative number reaches a target."""
    low, high = 0.0, 1.0
    while function(high) < target:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) < target else (low, middle)
    return high
