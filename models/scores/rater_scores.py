"""People and labellers on the same takes, in one table: every score beside that of the second annotator.

A person's tier is scored against the reference by the same rules as a labeller's answers. Agreement of people who
labelled from scratch and of people who began from a machine's proposals are different readings: call
:func:`score_raters` once for each, and never for both together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ..labellers import TRANSITION
from .frame_labels import code_frames, find_runs
from .label_scores import SCORES, LabelCounts, add_counts, count_labels, draw_takes, find_intervals, score_counts

__all__ = ["MERGING", "PERSON", "PER_FRAME", "TEMPORAL", "Rater", "ScoredRaters", "count_classes", "score_raters"]

PERSON, PER_FRAME, MERGING, TEMPORAL = "person", "per frame", "per frame, merged", "temporal"
"""Kinds of raters: people, classifiers of single frames, these with equal neighbours merged and a least duration, and
labellers that see the sequence."""

N_DRAWS = 1000


@dataclass(frozen=True)
class Rater:
    """Who labelled: ``kind`` is :data:`PERSON` or one of the other kinds; ``answers`` the labels by take."""

    name: str
    kind: str
    answers: Mapping[str, NDArray[np.object_]] = field(repr=False)


@dataclass(frozen=True)
class ScoredRaters:
    """Raters of the same takes, scored against the same reference; made by :func:`score_raters`.

    Parameters
    ----------
    takes, signers
        Names of the takes, and the signer of each.
    classes
        Labels, in the order of the counts.
    kinds
        Kind of each rater by name, in order.
    counts
        For each rater the counts of each take.
    draws, signer_draws
        Multiplicities of the takes in the bootstrap over takes, and over signers.
    """

    takes: tuple[str, ...]
    signers: tuple[str, ...]
    classes: tuple[str, ...]
    kinds: dict[str, str]
    counts: dict[str, list[LabelCounts]] = field(repr=False)
    draws: NDArray[np.float64] = field(repr=False)
    signer_draws: NDArray[np.float64] = field(repr=False)

    def table(self) -> pd.DataFrame:
        """Score every rater.

        Returns
        -------
        One row a rater: ``rater, kind, n_takes, n_signers, n_frames, n_missed`` (frames without an answer, wrong),
        ``majority, chance``, and each of :data:`.label_scores.SCORES` with ``…_low`` and ``…_high``, a 95 % interval
        bootstrapped over takes (NaN with a single take).
        """
        rows = []
        for name, kind in self.kinds.items():
            summed = add_counts(self.counts[name])
            found, drawn = score_counts(summed), score_counts(add_counts(self.counts[name], self.draws))
            row: dict[str, Any] = {"rater": name, "kind": kind, "n_takes": len(self.takes)}
            row["n_signers"] = len(set(self.signers))
            row["n_frames"] = int(summed.confusion.sum() + summed.missed.sum())
            row["n_missed"] = int(summed.missed.sum())
            row |= {"majority": float(found["majority"]), "chance": float(found["chance"])}
            for score in SCORES:
                ends = find_intervals(float(found[score]), drawn[score]) if len(self.takes) > 1 else (np.nan, np.nan)
                row |= {score: float(found[score]), f"{score}_low": ends[0], f"{score}_high": ends[1]}
            rows.append(row)
        return pd.DataFrame(rows)

    def differences(self, score: str = "f1_50") -> pd.DataFrame:
        """Each temporal labeller less the best merged per-frame one, on the same takes.

        Returns
        -------
        One row a temporal labeller, the best first: ``rater, against, score, difference``, ``…_low, …_high`` (95 %,
        bootstrap over takes) and ``…_signers_low, …_signers_high`` (over signers; NaN with fewer than three). Which is
        best is read from the very scores that are compared, so the first row favours itself a little, and so does its
        opponent. Empty where a kind is missing.
        """
        merged = {name: self._value(name, score) for name, kind in self.kinds.items() if kind == MERGING}
        temporal = {name: self._value(name, score) for name, kind in self.kinds.items() if kind == TEMPORAL}
        columns = ["rater", "against", "score", "difference", "difference_low", "difference_high"]
        columns += ["difference_signers_low", "difference_signers_high"]
        if not merged or not temporal:
            return pd.DataFrame(columns=columns)
        best = max(merged, key=lambda name: merged[name])
        rows = []
        for name in sorted(temporal, key=lambda one: -temporal[one]):
            value = temporal[name] - merged[best]
            row: list[Any] = [name, best, score, value]
            for draws, least in ((self.draws, len(self.takes) > 1), (self.signer_draws, len(set(self.signers)) > 2)):
                both = [score_counts(add_counts(self.counts[one], draws))[score] for one in (name, best)]
                row += find_intervals(value, both[0] - both[1]) if least else (np.nan, np.nan)
            rows.append(row)
        return pd.DataFrame(rows, columns=columns)

    def by_part(self, parts: Mapping[str, str], what: str) -> pd.DataFrame:
        """Scores of parts of the takes: one row a part and rater.

        Parameters
        ----------
        parts
            The part (signer, protocol) of each take.
        what
            Name of the first column.
        """
        rows = []
        for part in sorted(set(parts.values())):
            places = [place for place, take in enumerate(self.takes) if parts[take] == part]
            for name, kind in self.kinds.items() if places else ():
                found = score_counts(add_counts([self.counts[name][place] for place in places]))
                row = {"part": what, "of": part, "rater": name, "kind": kind, "n_takes": len(places)}
                shown = ("accuracy", "macro_f1", "f1_50", "f1_50_stable", "edit", "border_f1_10", "distance_ms")
                rows.append(row | {score: float(found[score]) for score in shown})
        return pd.DataFrame(rows)

    def mistakes(self, most: int = 3) -> pd.DataFrame:
        """List the most frequent confusions of each rater.

        Returns
        -------
        ``rater, reference, answer, share`` of the frames of that reference, ``share_of_all`` frames.
        """
        rows = []
        for name in self.kinds:
            summed = add_counts(self.counts[name])
            wrong = summed.confusion - np.diag(np.diag(summed.confusion))
            asked = summed.confusion.sum(axis=1) + summed.missed
            for place in np.argsort(-wrong, axis=None, kind="stable")[:most]:
                row, column = np.unravel_index(place, wrong.shape)
                if wrong[row, column]:
                    labels = {"reference": self.classes[row], "answer": self.classes[column]}
                    share, of_all = wrong[row, column] / asked[row], wrong[row, column] / asked.sum()
                    rows.append({"rater": name, **labels, "share": float(share), "share_of_all": float(of_all)})
        return pd.DataFrame(rows, columns=["rater", "reference", "answer", "share", "share_of_all"])

    def _value(self, name: str, score: str) -> float:
        value = float(score_counts(add_counts(self.counts[name]))[score])
        return value if np.isfinite(value) else -np.inf


def score_raters(
    reference: Mapping[str, NDArray[np.object_]],
    raters: Sequence[Rater],
    signers: Mapping[str, str],
    rate: float,
    *,
    rng: np.random.Generator,
    n_draws: int = N_DRAWS,
) -> ScoredRaters:
    """Score raters on the same takes.

    Parameters
    ----------
    reference
        Labels of the frames of each take, ``None`` for gaps; every rater must have answered every take.
    raters
        Who labelled; a name comes once.
    signers
        Of each take.
    rate
        Hz.
    rng, n_draws
        Of the bootstrap, and of Staccato's random segmentations.

    Raises
    ------
    InputError
        If there is no take, or no rater, or a rater has not answered a take, or a name comes twice.
    """
    takes = tuple(reference)
    if not takes or not raters:
        raise InputError("raters: expected at least one rater and one take, but got none")
    names = [rater.name for rater in raters]
    if len(set(names)) < len(names):
        raise InputError(f"raters: expected each name once, but got {', '.join(names)}")
    for rater in raters:
        absent = [take for take in takes if take not in rater.answers]
        if absent:
            raise InputError(f"raters: expected answers to every take, but {rater.name} has none of {absent[0]}")
    some = [*reference.values(), *(rater.answers[take] for rater in raters for take in takes)]
    classes = tuple(sorted({str(label) for labels in some for label in set(labels) if label is not None}))
    over_takes, over_signers, chance = rng.spawn(3)
    counts = {
        rater.name: [
            count_labels(reference[take], rater.answers[take], classes, rate, rng=chance.spawn(1)[0], moving=TRANSITION)
            for take in takes
        ]
        for rater in raters
    }
    whose = tuple(signers[take] for take in takes)
    return ScoredRaters(
        takes=takes,
        signers=whose,
        classes=classes,
        kinds={rater.name: rater.kind for rater in raters},
        counts=counts,
        draws=draw_takes(len(takes), over_takes, n_draws),
        signer_draws=draw_takes(len(takes), over_signers, n_draws, whose),
    )


def count_classes(
    reference: Mapping[str, NDArray[np.object_]], signers: Mapping[str, str], rate: float
) -> pd.DataFrame:
    """Count what is asked: ``label, n_signers, n_takes, n_segments, seconds, share`` of the labelled time."""
    rows = []
    for take, labels in reference.items():
        (codes,), names = code_frames(labels)
        for code, onset, offset in zip(*find_runs(codes), strict=True):
            rows.append((str(names[code]), signers[take], take, (offset - onset) / rate))
    table = pd.DataFrame(rows, columns=["label", "signer", "take", "seconds"])
    counted = table.groupby("label", as_index=False).agg(
        n_signers=("signer", "nunique"),
        n_takes=("take", "nunique"),
        n_segments=("take", "size"),
        seconds=("seconds", "sum"),
    )
    return counted.assign(share=counted["seconds"] / counted["seconds"].sum())
