"""Where two people labelled the same takes: how well they agree, and the machine with the same reference, side by side.

The second person is scored as the machine is: on the segments of the reference, where their answer is the label that
covers most of the segment's frames. A segment where that is a transition or nothing is left out for everybody, and
counted, so that all rows of a table are about the same segments.

Two readings are never mixed: people who both labelled from scratch, and takes where one of them began from a machine's
proposals. Whoever corrects proposals tends to agree with them, and with everybody else who saw them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..labelled_take import LabelledTake, find_covering_labels
from .intervals import accuracy_of, add_intervals, count_by_take, kappa_of, macro_f1_of

__all__ = ["compare_annotators"]

COLUMNS = ("reading", "signer", "segmentation", "rater", "kind", "n_takes", "n_segments", "left_out")


def compare_annotators(
    answers: pd.DataFrame,
    second: Sequence[LabelledTake],
    name: str,
    *,
    rng: np.random.Generator,
    readings: Mapping[str, str] | None = None,
    n_draws: int = 1000,
) -> pd.DataFrame:
    """Score a second person and the classifiers against the same reference, on the same segments.

    Parameters
    ----------
    answers
        Those of :class:`mimique.models.Evaluation`.
    second
        The tested takes with the second person's tier; takes without one are not compared. Weights are not needed.
    name
        What the second person is called in the table.
    rng, n_draws
        Of the bootstrap over takes.
    readings
        For each take how the two tiers came about, for example ``"from scratch"``; each is scored on its own.

    Returns
    -------
    One row per reading, signer (and ``"all"``), segmentation and rater: ``reading, signer, segmentation, rater, kind``
    (person, machine), ``n_takes, n_segments, left_out``, then ``accuracy``, ``accuracy_duration``, ``macro_f1``,
    ``kappa`` (per segment) and ``kappa_duration`` (weighted by duration, so per frame of these segments), each with
    ``…_low`` and ``…_high``. Empty where there is nothing to compare.
    """
    tiers = {take.name: take for take in second}
    both = answers[answers["take"].isin(list(tiers))].reset_index(drop=True)
    if both.empty:
        return pd.DataFrame(columns=list(COLUMNS))
    seen = _read_second(both, tiers)
    both = both.assign(
        second=seen,
        reading=[(readings or {}).get(take, "from scratch") for take in both["take"]],
        rater=both["classifier"],
    )
    compared = both[both["second"] != ""]
    first_classifier = str(both["classifier"].iloc[0])
    people = compared[compared["classifier"] == first_classifier].assign(rater=name, label=lambda t: t["second"])
    classes = sorted({*both["reference"], *both["label"], *both["second"]} - {""})
    rows: list[dict[str, Any]] = []
    for reading in dict.fromkeys(both["reading"]):
        for signer in (*dict.fromkeys(both["signer"]), "all"):
            for segmentation in dict.fromkeys(both["segmentation"]):
                asked = _choose(both, reading, signer, segmentation)
                n_asked = int((asked["classifier"] == first_classifier).sum())
                if not n_asked:
                    continue
                for kind, answered in (("person", people), ("machine", compared)):
                    some = _choose(answered, reading, signer, segmentation)
                    for rater, theirs in some.groupby("rater", sort=False):
                        record = {"reading": reading, "signer": signer, "segmentation": segmentation, "rater": rater}
                        record |= {"kind": kind, "n_takes": theirs["take"].nunique()}
                        record |= {"n_segments": len(theirs), "left_out": n_asked - len(theirs)}
                        numbers, seconds = count_by_take(theirs, classes)
                        add_intervals(record, "accuracy", numbers, accuracy_of, rng, n_draws)
                        add_intervals(record, "accuracy_duration", seconds, accuracy_of, rng, n_draws)
                        add_intervals(record, "macro_f1", numbers, macro_f1_of, rng, n_draws)
                        add_intervals(record, "kappa", numbers, kappa_of, rng, n_draws)
                        add_intervals(record, "kappa_duration", seconds, kappa_of, rng, n_draws)
                        rows.append(record)
    return pd.DataFrame(rows) if rows else pd.DataFrame(columns=list(COLUMNS))


def _choose(table: pd.DataFrame, reading: str, signer: str, segmentation: str) -> pd.DataFrame:
    chosen = (table["reading"] == reading) & (table["segmentation"] == segmentation)
    return table[chosen & (table["signer"] == signer)] if signer != "all" else table[chosen]


def _read_second(answers: pd.DataFrame, tiers: Mapping[str, LabelledTake]) -> list[str]:
    """Return the second person's steady label for each row; empty where they have none."""
    found: dict[tuple[str, int, int], str] = {}
    for take, some in answers.groupby("take", sort=False):
        pieces = some[["onset", "offset"]].drop_duplicates()
        labels, moving, _ = find_covering_labels(pieces["onset"], pieces["offset"], tiers[str(take)])
        for onset, offset, label, moves in zip(pieces["onset"], pieces["offset"], labels, moving, strict=True):
            found[str(take), int(onset), int(offset)] = "" if label is None or moves else str(label)
    places = zip(answers["take"], answers["onset"], answers["offset"], strict=True)
    return [found[str(take), int(onset), int(offset)] for take, onset, offset in places]
