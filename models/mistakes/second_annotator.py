"""A second person's tier as a witness about the first's: how likely their labels, and where their borders are.

What a second person says of a segment of class c is a draw from a row of the table of both people's labels over the
whole corpus: Dawid and Skene's model [1]_ with the first person's labels for the truth, most of which are right. Their
answer multiplies the probabilities of the models, as an independent witness's does. Two people who were taught the same
way, or who saw the same proposals, are less independent than that.

References
----------
.. [1] A. Dawid, A. Skene, "Maximum likelihood estimation of observer error-rates using the EM algorithm", Applied
   Statistics 1979.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..labelled_take import LabelledTake, find_covering_labels, find_transitions
from .label_evidence import LabelEvidence

__all__ = ["SecondReader", "match_borders"]

PRIOR = 0.3
"""Count that every pair of labels begins with: what was never seen is not impossible."""
FARTHEST = 0.8
"""s within which a border of the second person is taken for the same."""


class SecondReader:
    """How a second person reads the classes of the first.

    Parameters
    ----------
    tiers
        Segments of the first and of the second person, ``onset, offset, label``, of every take that both annotated.
    """

    def __init__(self, tiers: Sequence[tuple[pd.DataFrame, pd.DataFrame]]) -> None:
        self._counts: dict[tuple[str, str], int] = {}
        for first, second in tiers:
            stable = first[~find_transitions(first)]
            for label, answer in zip(stable["label"].astype(str), _read(stable, second), strict=True):
                self._counts[label, answer] = self._counts.get((label, answer), 0) + 1
        self._answers = sorted({answer for _, answer in self._counts})

    def weigh(self, evidence: LabelEvidence, segments: pd.DataFrame, second: pd.DataFrame) -> LabelEvidence:
        """Return the evidence with the probabilities of segments after the second person's answers.

        Parameters
        ----------
        evidence
            By models alone.
        segments, second
            Of the two people, in order of time.
        """
        table = np.array(
            [[self._counts.get((name, answer), 0) + PRIOR for answer in self._answers] for name in evidence.classes]
        )
        likely = table / table.sum(axis=1, keepdims=True)
        column = {answer: k for k, answer in enumerate(self._answers)}
        result = evidence.segments.copy()
        for row, answer in enumerate(_read(segments, second)):
            if answer in column:
                result[row] *= likely[:, column[answer]]
                result[row] /= result[row].sum()
        return replace(evidence, segments=result)


def match_borders(borders: pd.DataFrame, second: pd.DataFrame, rate: float) -> NDArray[np.float64]:
    """Find the second person's border for each of the first's.

    Parameters
    ----------
    borders
        ``onset, before, after, kind`` (:class:`mimique.models.mistakes.border_regression.Border`).
    second
        The second person's segments.
    rate
        Hz.

    Returns
    -------
    ``(n_borders,)`` frame of the nearest border within 0.8 s between the same two labels, else of the nearest of the
    same kind that has one of the two labels; NaN where there is none.
    """
    table = second.sort_values("onset", kind="stable")
    moves = find_transitions(table)
    labels = table["label"].astype(str).to_numpy()
    touching = np.flatnonzero(table["offset"].to_numpy()[:-1] == table["onset"].to_numpy()[1:])
    places = table["onset"].to_numpy()[touching + 1]
    before, after = labels[touching], labels[touching + 1]
    first_moves, next_moves = moves[touching], moves[touching + 1]
    kinds = np.where(~first_moves & next_moves, 0, np.where(first_moves & ~next_moves, 1, 2))
    result = np.full(len(borders), np.nan)
    for row, border in enumerate(borders.itertuples()):
        same = (before == border.before).astype(int) + (after == border.after)
        away = np.abs(places - border.onset)
        near = (away <= FARTHEST * rate) & (kinds == border.kind) & (same > 0)
        if near.any():
            best = near & (same == same[near].max())
            result[row] = places[best][away[best].argmin()]
    return result


def _read(segments: pd.DataFrame, second: pd.DataFrame) -> list[str]:
    """Return what the second person says of each segment: the label that covers most of it, "" for none."""
    end = int(max(second["offset"].max() if len(second) else 0, segments["offset"].max() if len(segments) else 0))
    take = LabelledTake("second", "", "", 1.0, second, n_frames=end)
    labels, moves, _ = find_covering_labels(segments["onset"], segments["offset"], take)
    return ["" if label is None or move else str(label) for label, move in zip(labels, moves, strict=True)]
