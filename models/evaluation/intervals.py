"""Scores of tested segments as a table, each with an interval over takes, and what stands beside them.

Every score is a function of a table of counts (reference by label), and the counts of takes add up. So each take gives
one table of segments and one of seconds, and the bootstrap draws takes and adds their tables.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..metrics import score_labels
from ..scores.bootstrap import bootstrap_interval

__all__ = ["accuracy_of", "add_intervals", "count_by_take", "kappa_of", "macro_f1_of", "score_answers"]

LEFT_OUT = ("left_out_transition", "left_out_unlabelled", "left_out_missing")
Counts = NDArray[np.float64]


def accuracy_of(counts: Counts) -> float:
    """Part on the diagonal of ``(n_classes, n_classes)`` counts; NaN if they are all 0."""
    total = counts.sum()
    return float(np.trace(counts) / total) if total > 0 else float("nan")


def macro_f1_of(counts: Counts) -> float:
    """Mean F1 over the classes that a row (reference) or a column (label) of the counts contains."""
    asked, given = counts.sum(axis=1), counts.sum(axis=0)
    either = asked + given > 0
    return float((2 * np.diag(counts)[either] / (asked + given)[either]).mean()) if either.any() else float("nan")


def kappa_of(counts: Counts) -> float:
    """Cohen's κ of the two label sets that the counts cross; NaN where both are one and the same label."""
    total = counts.sum()
    if not total > 0:
        return float("nan")
    expected = float(counts.sum(axis=1) @ counts.sum(axis=0)) / total**2
    return (accuracy_of(counts) - expected) / (1 - expected) if expected < 1 else float("nan")


def count_by_take(answers: pd.DataFrame, classes: Sequence[str]) -> tuple[list[Counts], list[Counts]]:
    """Cross the reference with the label, take by take.

    Parameters
    ----------
    answers
        Columns ``take, reference, label, seconds``.
    classes
        Order of rows and columns; every label is among them.

    Returns
    -------
    numbers, seconds
        One ``(n_classes, n_classes)`` table a take: of segments, and of their durations.
    """
    place = {name: index for index, name in enumerate(classes)}
    numbers, seconds = [], []
    for _, some in answers.groupby("take", sort=False):
        cell = some["reference"].map(place).to_numpy(), some["label"].map(place).to_numpy()
        each, timed = np.zeros((2, len(classes), len(classes)))
        np.add.at(each, cell, 1.0)
        np.add.at(timed, cell, some["seconds"].to_numpy())
        numbers.append(each)
        seconds.append(timed)
    return numbers, seconds


def add_intervals(
    record: dict[str, Any],
    name: str,
    tables: Sequence[Counts],
    score: Callable[[Counts], float],
    rng: np.random.Generator,
    n_draws: int,
) -> None:
    """Put ``name``, ``name_low`` and ``name_high`` (95 %, bootstrap over takes) into a record; NaN without takes."""
    value, low, high = float("nan"), float("nan"), float("nan")
    if len(tables):
        value, low, high = bootstrap_interval(tables, lambda drawn: score(np.sum(drawn, axis=0)), rng, n=n_draws)
    record.update({name: value, f"{name}_low": low, f"{name}_high": high})


def score_answers(
    rows: pd.DataFrame, answers: pd.DataFrame, *, rng: np.random.Generator, n_draws: int
) -> tuple[pd.DataFrame, dict[tuple[str, str, str], pd.DataFrame]]:
    """Score the answers of each signer, classifier and segmentation, and those of all signers together.

    Parameters
    ----------
    rows
        One row per signer, classifier and segmentation with ``n_train``, ``chance`` and the numbers left out.
    answers
        As in :class:`mimique.models.Evaluation`.
    rng, n_draws
        Of the bootstrap.

    Returns
    -------
    The table and the confusions of :class:`mimique.models.Evaluation`.
    """
    pooled = rows.groupby(["classifier", "segmentation"], sort=False).agg(
        {**dict.fromkeys(("n_train", *LEFT_OUT), "sum"), "chance": "min"}
    )
    rows = pd.concat([rows, pooled.reset_index().assign(signer="all")], ignore_index=True)
    classes = sorted({*answers["reference"], *answers["label"]})
    confusions: dict[tuple[str, str, str], pd.DataFrame] = {}
    scored = []
    for row in rows.to_dict("records"):
        chosen = (answers["classifier"] == row["classifier"]) & (answers["segmentation"] == row["segmentation"])
        if row["signer"] != "all":
            chosen &= answers["signer"] == row["signer"]
        some = answers[chosen]
        reference, given = some["reference"].to_numpy(), some["label"].to_numpy()
        each = score_labels(reference, given, classes=classes)
        timed = score_labels(reference, given, weights=some["seconds"].to_numpy(), classes=classes)
        confusions[row["signer"], row["classifier"], row["segmentation"]] = each.confusion.astype(int)
        numbers, seconds = count_by_take(some, classes)
        record: dict[str, Any] = {key: row[key] for key in ("signer", "classifier", "segmentation", "n_train")}
        record |= {"n_takes": len(numbers), "n_segments": each.n_items, "seconds": float(some["seconds"].sum())}
        add_intervals(record, "accuracy", numbers, accuracy_of, rng, n_draws)
        add_intervals(record, "accuracy_duration", seconds, accuracy_of, rng, n_draws)
        add_intervals(record, "macro_f1", numbers, macro_f1_of, rng, n_draws)
        record |= {
            "balanced_accuracy": each.balanced_accuracy,
            "kappa": kappa_of(each.confusion.to_numpy()),
            "majority": each.majority,
            "majority_duration": timed.majority,
            "chance": row["chance"],
            **{key: int(row[key]) for key in LEFT_OUT},
        }
        scored.append(record)
    return pd.DataFrame(scored), confusions
