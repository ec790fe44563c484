"""How far confidence can be believed, what a review queue saves, and which planted mistakes are found."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus.annotations.tier_rules import check_tier
from ...corpus.store.view import CorpusView
from ...errors import InputError
from ...features import segment as segment_weights
from ...models import LabelledTake
from ...models.confidence.review_queue import compare_review_orders, order_for_review, probability_columns
from ...models.evaluation.segment_answers import (
    ClassifierMethod,
    LabellerMethod,
    Method,
    SegmentAnswers,
    answer_across_signers,
)
from ...models.labellers import has_torch
from ...models.mistakes.finding_scores import count_findings, score_border_oracle, score_counts
from ...models.mistakes.label_checks import find_label_mistakes
from ...models.mistakes.label_evidence import collect_label_evidence, make_temporal_labeller
from ...models.mistakes.planted_faults import AFFECT_CODES, plant_faults
from ...models.scores.calibration_metrics import brier_score, expected_calibration_error, log_loss, reliability_table
from ..progress import Reporter
from .checking_labels import read_second_annotator
from .labelled_takes import choose_author, read_labelled_takes
from .segmenting import read_segments

__all__ = ["ConfidenceEvaluation", "evaluate_confidence"]

CLASSIFIER = "random-forest"
TARGETS = (0.9, 0.95, 0.99)
LEAST = 1e-4
"""As in calibration: a probability of 0 would make the log loss infinite."""


@dataclass(frozen=True)
class ConfidenceEvaluation:
    """What was measured.

    Parameters
    ----------
    tables
        ``calibration``, ``calibration_signers``, ``reliability``, ``queue``, ``mistakes``, ``mistakes_protocols``,
        ``shifts`` and, where the true borders were given, ``oracle``.
    notes
        Sentences that a reader of the numbers should know.
    """

    tables: dict[str, pd.DataFrame] = field(repr=False)
    notes: tuple[str, ...]

    def plot_reliability(self, path: str | Path) -> None:
        """Draw the reliability diagram of the annotator's segments as a PNG, readable in black and white."""
        from .reliability_plot import draw_reliability

        draw_reliability(self.tables["reliability"], path)


def evaluate_confidence(
    corpus: CorpusView,
    *,
    annotator: str | None = None,
    signers: Sequence[str] | None = None,
    seed: int = 0,
    reporter: Reporter | None = None,
    n_folds: int = 5,
    n_inner: int = 3,
    n_plantings: int = 2,
    temporal: bool = True,
    truth: Mapping[str, pd.DataFrame] | None = None,
) -> ConfidenceEvaluation:
    """Measure confidences, the review queue and the search for mistakes on signers held out; the corpus is only read.

    Parameters
    ----------
    corpus
        With weights and an annotated tier ``affect`` of at least four signers.
    annotator, signers
        Whose tier is the reference, the one who annotated most if left out; only takes of these signers.
    seed
        Of folds, methods, random orders and planted mistakes.
    n_folds, n_inner
        Signers are dealt into so many folds, and those who teach once more to calibrate by.
    n_plantings
        How many times mistakes are planted; 0 leaves this part out.
    temporal
        Whether a labeller of frames in time is measured too and looks for mistakes: minutes of work.
    truth
        True segments by the name of the take, which simulated signers have: for the oracle of borders.

    Raises
    ------
    MimiqueError
        If there are too few signers, or nothing is annotated or solved.
    """
    reporter = reporter or Reporter()
    whose = choose_author(corpus, author=annotator)
    takes = read_labelled_takes(corpus, whose, signers=signers)
    if not takes:
        raise InputError(f"{whose} has labelled no take of the signers asked for")
    methods = _make_methods(corpus, takes, temporal)
    notes = [
        "each signer is judged by models and calibrators that learned from other signers only",
        "automatic segments are those of the energies for the classifier, and the labeller's own for the labeller; the "
        "reviewer of the queue is perfect, and relabels segments without moving borders",
    ]
    if temporal and not has_torch():
        notes.append("PyTorch is not installed: the labeller in time is a forest with merging; install mimique[gpu]")
    answers: dict[str, SegmentAnswers] = {}
    folds = min(n_folds, len({take.signer for take in takes}))
    with reporter.stage("Calibrating", len(methods) * folds * (n_inner + 1)) as finished:
        for name, method in methods.items():
            rng = np.random.default_rng(seed)
            answers[name] = answer_across_signers(
                takes, method, rng=rng, n_folds=n_folds, n_inner=n_inner, finished=lambda word: finished(word)
            )
            notes.append(
                f"{name}: {answers[name].left_out} automatic segments cover mostly a transition or nothing of the "
                "reference and are left out"
            )
    tables = {
        "calibration": _score(answers, []),
        "calibration_signers": _score(answers, ["signer"]),
        "reliability": _tabulate_reliability(answers),
        "queue": _replay(answers, seed),
    }
    if n_plantings:
        second = read_second_annotator(corpus, takes, whose)
        tables |= _study_mistakes(takes, second, n_plantings, seed, temporal, truth, reporter)
        notes.append(
            "mistakes are planted in the first annotator's tier only; what is found and was not planted counts as "
            "false, although the annotator's own slips are among it"
        )
        if not second:
            notes.append("nobody else annotated these takes: no search with a second annotator")
    return ConfidenceEvaluation(tables, tuple(notes))


def _make_methods(corpus: CorpusView, takes: Sequence[LabelledTake], temporal: bool) -> dict[str, Method]:
    automatic = {}
    for take in takes:
        segments = read_segments(corpus, take.name)
        if segments is None and take.weights is not None:
            segments = segment_weights(take.weights, take.rate)
        if segments is not None:
            automatic[take.name] = segments
    methods: dict[str, Method] = {CLASSIFIER: ClassifierMethod(CLASSIFIER, automatic)}
    if temporal:
        name = "tcn" if has_torch() else "forest-merging"
        methods[name] = LabellerMethod(name, make_temporal_labeller)
    return methods


def _score(answers: Mapping[str, SegmentAnswers], by: Sequence[str]) -> pd.DataFrame:
    """Score probabilities before and after calibration, pooled or by signer."""
    rows = []
    for name, own in answers.items():
        for key, some in own.rows.groupby(["segmentation", *by], sort=False):
            at = some.index.to_numpy()
            row: dict[str, Any] = {"method": name, **dict(zip(["segmentation", *by], key, strict=True)), "n": len(at)}
            truth = some["reference"].to_numpy(dtype=object)
            row["accuracy"] = float((np.array(own.classes)[own.raw[at].argmax(axis=1)] == truth).mean())
            for when, p in (("before", own.raw[at]), ("after", own.calibrated[at])):
                p = np.clip(p, LEAST, None)
                p = p / p.sum(axis=1, keepdims=True)
                row[f"ece_{when}"] = expected_calibration_error(p, truth, own.classes)
                row[f"brier_{when}"] = brier_score(p, truth, own.classes)
                row[f"log_loss_{when}"] = log_loss(p, truth, own.classes)
            rows.append(row)
    return pd.DataFrame(rows)


def _tabulate_reliability(answers: Mapping[str, SegmentAnswers]) -> pd.DataFrame:
    tables = []
    for name, own in answers.items():
        for kind, some in own.rows.groupby("segmentation", sort=False):
            at = some.index.to_numpy()
            for when, p in (("before", own.raw[at]), ("after", own.calibrated[at])):
                table = reliability_table(p, some["reference"].to_numpy(dtype=object), own.classes, n_bins=10)
                table.insert(0, "calibration", when)
                table.insert(0, "segmentation", str(kind))
                table.insert(0, "method", name)
                tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _replay(answers: Mapping[str, SegmentAnswers], seed: int) -> pd.DataFrame:
    """Replay the review of each method's segments, most useful first, least sure first, and in random orders."""
    rows = []
    for name, own in answers.items():
        for kind, some in own.rows.groupby("segmentation", sort=False):
            at = some.index.to_numpy()
            p = own.calibrated[at]
            truth, given = some["reference"].to_numpy(), np.array(own.classes)[p.argmax(axis=1)]
            orders = {
                "expected gain": order_for_review(probability_columns(p, own.classes).assign(label=given)),
                "least sure": np.argsort(p.max(axis=1), kind="stable"),
            }
            for order_name, order in orders.items():
                rng = np.random.default_rng(seed)
                replay = compare_review_orders(truth, given, order, rng=rng, targets=TARGETS)
                facts = {"method": name, "segmentation": str(kind), "order": order_name}
                known = replay.table.assign(**facts, segments=len(truth), start=float(replay.curve[0]))
                rows.append(known)
    table = pd.concat(rows, ignore_index=True)
    first = ["method", "segmentation", "order", "segments", "start"]
    return table[[*first, *[column for column in table.columns if column not in first]]]


def _study_mistakes(
    takes: Sequence[LabelledTake],
    second: Mapping[str, pd.DataFrame],
    n_plantings: int,
    seed: int,
    temporal: bool,
    truth: Mapping[str, pd.DataFrame] | None,
    reporter: Reporter,
) -> dict[str, pd.DataFrame]:
    """Plant mistakes, look for them by one annotator and by two, and count; detectors see tiers and weights alone."""
    counts, by_protocol, shifts, oracles = [], [], [], []
    protocols = {take.name: take.protocol for take in takes}
    with reporter.stage("Looking for planted mistakes", n_plantings * 5) as finished:
        for number in range(n_plantings):
            faulty, faults = _plant(takes, np.random.default_rng([seed, number]))
            rules = {take.name: _check_rules(take) for take in faulty}
            evidence = collect_label_evidence(
                faulty,
                rng=np.random.default_rng([seed, 1000 + number]),
                temporal=make_temporal_labeller if temporal else None,
                finished=finished,
            )
            for people, other in ((1, None), (2, second)):
                if other is not None and not other:
                    continue
                found = find_label_mistakes(faulty, evidence, rules=rules, second=other)
                found = found.assign(protocol=found["take"].map(protocols))
                counts.append(count_findings(faults, found).assign(annotators=people))
                by_protocol.append(count_findings(faults, found, ("problem", "protocol")).assign(annotators=people))
                shifts.append(_find_by_size(faults, found).assign(annotators=people))
            if truth is not None:
                tiers = {take.name: take.segments for take in faulty}
                oracles.append(score_border_oracle(tiers, faults, truth, takes[0].rate))
    tables = {
        "mistakes": _with_total(_add(counts, ["annotators", "problem"])),
        "mistakes_protocols": score_counts(_add(by_protocol, ["annotators", "problem", "protocol"])),
        "shifts": _recall(_add(shifts, ["annotators", "protocol", "shift"])),
    }
    if oracles:
        tables["oracle"] = pd.concat(oracles, ignore_index=True)
    return tables


def _plant(takes: Sequence[LabelledTake], rng: np.random.Generator) -> tuple[list[LabelledTake], pd.DataFrame]:
    faulty, planted = [], []
    for take in takes:
        tier, faults = plant_faults(take.segments, take.rate, rng=rng)
        faulty.append(dataclasses.replace(take, segments=tier))
        planted.append(faults.assign(take=take.name, protocol=take.protocol, rate=take.rate))
    return faulty, pd.concat(planted, ignore_index=True)


def _check_rules(take: LabelledTake) -> pd.DataFrame:
    """Check the rules in codes, of which the names of transitions are made."""
    coded = take.segments["label"].map(lambda name: AFFECT_CODES.get(name, name))
    return check_tier(take.segments.assign(label=coded), rate=take.rate)


def _find_by_size(faults: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    from ...models.mistakes.finding_scores import match_findings

    moved = faults[faults["problem"] == "shifted boundary"].reset_index(drop=True)
    size = (moved["onset"] - moved["true_onset"]).abs() / moved["rate"]
    bins = pd.cut(size, [0.0, 0.15, 0.2, 0.3, np.inf], labels=["to 0.15 s", "to 0.20 s", "to 0.30 s", "more"])
    hits = moved.assign(shift=bins.astype(str), right=match_findings(moved, found))
    table = hits.groupby(["protocol", "shift"])["right"].agg(planted="size", right="sum").reset_index()
    return table.astype({"planted": "int64", "right": "int64"})


def _add(tables: Sequence[pd.DataFrame], keys: Sequence[str]) -> pd.DataFrame:
    """Add up the plantings."""
    joined = pd.concat(tables, ignore_index=True)
    return joined.groupby(list(keys), sort=False, as_index=False).sum(numeric_only=True)


def _with_total(counts: pd.DataFrame) -> pd.DataFrame:
    totals = counts.groupby("annotators", as_index=False)[["planted", "found", "right"]].sum()
    joined = pd.concat([counts, totals.assign(problem="all")], ignore_index=True)
    return score_counts(joined.sort_values("annotators", kind="stable", ignore_index=True))


def _recall(counts: pd.DataFrame) -> pd.DataFrame:
    planted: NDArray = counts["planted"].to_numpy(dtype=float)
    return counts.assign(recall=counts["right"].to_numpy() / planted)
