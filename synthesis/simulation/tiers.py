"""Tiers of a simulated take: the annotators', the instructions, and the truth.

A tier is a table with onset, offset (whole frames, half-open) and label; a transition also says from which label to
which.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .confounders import Confounders
from .parameters import NEUTRAL, TRANSITION, Parameters
from .planning import PlannedTake
from .protocols import Script

CONFOUNDER_TIERS = ("blink", "gaze", "mouthing", "grammar", "cheeks")


def annotate_take(take: PlannedTake, parameters: Parameters) -> dict[str, pd.DataFrame]:
    """Return the tiers that go with a recording.

    Returns
    -------
    ``affect@A1`` and ``affect@A2``, one for each annotator; ``instruction``; in graded takes also ``intensity_asked``
    and ``intensity_seen@A1`` and ``@A2``. ``attrs`` name the author and the participant.
    """
    tiers = {}
    graded = take.script.protocol == "IGE"
    for name in parameters.annotators["names"]:
        table = affect_tier(take.bounds[name], take.labels[name], parameters.codes)
        if name == parameters.annotators["names"][0]:
            first, last = take.timetable.annotated
            table["onset"], table["offset"] = table["onset"].clip(lower=first), table["offset"].clip(upper=last)
        tiers[f"affect@{name}"] = _sign(table, name, take)
        if graded:
            seen = [
                None if step.affect == NEUTRAL else str(degree)
                for step, degree in zip(take.script.steps, take.degrees[name], strict=True)
            ]
            tiers[f"intensity_seen@{name}"] = _sign(step_tier(take.bounds[name], seen), name, take)
    reaction = parameters.frames(parameters.annotators["reaction"])
    tiers["instruction"] = _sign(instruction_tier(take.bounds["truth"], take.script, reaction), "protocol", take)
    if graded:
        asked = [None if step.degree is None else str(step.degree) for step in take.script.steps]
        tiers["intensity_asked"] = _sign(step_tier(take.bounds["truth"], asked), "protocol", take)
    return tiers


def true_tiers(take: PlannedTake, confounders: Confounders, parameters: Parameters) -> dict[str, pd.DataFrame]:
    """Return true segments: affect as performed, and one tier for each kind of confounder."""
    performed = [instance.affect for instance in take.instances]
    tiers = {"affect": affect_tier(take.bounds["truth"], performed, parameters.codes)}
    for kind in CONFOUNDER_TIERS:
        tiers[kind] = make_tier((onset, offset, label) for onset, offset, label, k in confounders.events if k == kind)
    return tiers


def affect_tier(bounds: NDArray[np.int64], labels: Sequence[str], codes: Mapping[str, str]) -> pd.DataFrame:
    """Return the affect tier: stable segments by name, transitions by two codes (NA: neutral to anger).

    Parameters
    ----------
    bounds
        2·n_steps frames: step, transition, step, …; one more than there are pieces.
    labels
        Of the steps. Neighbours with the same label become one segment, with what lies between them.
    """
    rows: list[list] = []
    for piece in range(len(bounds) - 1):
        before, after = labels[piece // 2], labels[(piece + 1) // 2]
        onset, offset = int(bounds[piece]), int(bounds[piece + 1])
        if rows and before == after == rows[-1][2]:
            rows[-1][1] = offset
        elif before == after:
            rows.append([onset, offset, before, "", ""])
        else:
            rows.append([onset, offset, codes[before] + codes[after], before, after])
    return make_tier(rows, ("onset", "offset", "label", "from_label", "to_label"))


def step_tier(bounds: NDArray[np.int64], labels: Sequence[str | None]) -> pd.DataFrame:
    """Return a tier with one segment for each step that has a label."""
    return make_tier(
        (int(bounds[2 * i]), int(bounds[2 * i + 1]), label) for i, label in enumerate(labels) if label is not None
    )


def instruction_tier(bounds: NDArray[np.int64], script: Script, reaction: int) -> pd.DataFrame:
    """Return what was asked for, when: each instruction comes ``reaction`` frames before the face follows it."""
    starts = [0, *(max(int(b) - reaction, 1) for b in bounds[1:-1:2])]
    if script.utterances:
        # A sentence is asked for as a whole, from the end of one rest to the beginning of the next.
        return make_tier((starts[a + 1], starts[b], script.affect) for a, b in script.utterances)
    ends = [*starts[1:], int(bounds[-1])]
    return make_tier(
        (onset, offset, step.affect)
        for onset, offset, step in zip(starts, ends, script.steps, strict=True)
        if offset > onset
    )


def make_tier(rows: Iterable[Sequence], columns: Sequence[str] = ("onset", "offset", "label")) -> pd.DataFrame:
    """Return a tier table from rows."""
    table = pd.DataFrame([list(row) for row in rows], columns=list(columns))
    return table.astype({c: "int64" if c in ("onset", "offset") else "str" for c in columns})


def recording_times(tiers: Iterable[pd.DataFrame], rate: float) -> dict[str, float]:
    """Return the seconds of each stable label, and of all transitions together, over some affect tiers."""
    times: dict[str, float] = {}
    for tier in tiers:
        labels = tier["label"].where(tier["from_label"] == "", TRANSITION)
        for label, frames in (tier["offset"] - tier["onset"]).groupby(labels).sum().items():
            times[str(label)] = times.get(str(label), 0.0) + float(frames) / rate
    return times


def _sign(table: pd.DataFrame, author: str, take: PlannedTake) -> pd.DataFrame:
    table.attrs = {"author": author, "participant": take.signer.code}
    return table
