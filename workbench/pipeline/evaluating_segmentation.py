"""Where takes are cut: by energies, by change points, by labellers and by people, side by side and class-blind.

Everything that is chosen or learned is chosen or learned on other signers: the signers are dealt into folds, and each
fold is cut with what was best on, or learned from, the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError
from ...features.segmentation import SegmentationSettings, cut_motion, measure_joint_restlessness, measure_motion
from ...models import LabelledTake
from ...models.evaluation.labeller_comparison import deal_signers, is_network, train_labeller
from ...models.labellers import has_torch, segments_of_labels, stack_takes
from ...models.scores.label_scores import draw_takes, find_intervals
from ...models.scores.segment_metrics import OVERLAPS, TOLERANCES
from ...models.scores.segmentation_scores import prepare_reference, score_cut
from ...models.segmentation.change_points import (
    METHODS,
    cut_by_change_points,
    has_ruptures,
    prepare_signals,
    tune_change_points,
)
from ...models.segmentation.tuning import GRID
from ..progress import Reporter
from .evaluating import check_shapes, read_second_tiers
from .labelled_takes import ADJUDICATED, AFFECT_TIER, choose_author, read_labelled_takes, tell_reading
from .segmenting import tune_on

__all__ = ["SegmentationEvaluation", "evaluate_segmentation"]

LABELLERS = ("forest-merging", "tcn")
"""Labellers whose borders are compared: the best of single frames with merging, and the best over time."""

Cuts = dict[str, pd.DataFrame]


@dataclass(frozen=True)
class SegmentationEvaluation:
    """How well takes are cut.

    Parameters
    ----------
    tables
        ``borders`` and ``segments``: one row a way to cut, on all takes of one reading, and with every second annotator
        on the takes of both; ``settings``: what was chosen for each fold of signers.
    notes
        Sentences that a reader of the numbers should know.
    annotator
        Whose tier is the reference.
    cuts
        For each way to cut the segments of each take.
    """

    tables: dict[str, pd.DataFrame]
    notes: tuple[str, ...]
    annotator: str
    cuts: dict[str, Cuts] = field(repr=False, default_factory=dict)


def evaluate_segmentation(
    corpus: CorpusView,
    *,
    annotator: str | None = None,
    signers: Sequence[str] | None = None,
    seed: int = 0,
    reporter: Reporter | None = None,
    labellers: Sequence[str] | None = None,
    answers: Mapping[str, Mapping[str, NDArray[np.object_]]] | None = None,
    grid: Mapping[str, Sequence[float]] = GRID,
    n_folds: int = 5,
    n_draws: int = 1000,
) -> SegmentationEvaluation:
    """Compare ways to cut the takes of signers who had no part in any choice; the corpus is only read.

    Parameters
    ----------
    corpus
        With weights and an annotated tier ``affect`` of at least two signers.
    annotator, signers
        Whose tier is the reference, by default of the one who annotated most; only these signers.
    seed
        Of the folds, the labellers and the bootstrap.
    labellers
        Names of labellers whose borders are compared; ``()`` for none. Those that can run here if left out.
    answers
        Labels of frames by labeller and take, of an evaluation of labellers on other signers; then none is trained.
    grid
        What is tried for the energies.
    n_folds
        Into which the signers are dealt; as many as there are signers, if there are fewer.
    n_draws
        Of the bootstrap over takes.

    Raises
    ------
    MimiqueError
        If there are fewer than two annotated signers, or weights are missing.
    """
    reporter = reporter or Reporter()
    whose = choose_author(corpus, author=annotator)
    takes = read_labelled_takes(corpus, whose, signers=signers)
    known = len({take.signer for take in takes})
    folds = deal_signers([take.signer for take in takes], max(2, min(n_folds, known)), np.random.default_rng(seed))
    check_shapes(corpus, takes)
    notes: list[str] = []
    cuts, settings = _cut_by_energies(takes, folds, grid, reporter)
    if has_ruptures():
        _cut_by_change_points(takes, folds, cuts, settings, reporter)
    else:
        notes.append("ruptures is not installed, so change points were left out; install mimique[compare]")
    if answers is None:
        names, missing = _choose_labellers(labellers)
        notes += missing
        answers = _label(takes, folds, names, seed, reporter) if names else {}
    for name, some in answers.items():
        cuts[name] = {take: segments_of_labels(labels)[["onset", "offset"]] for take, labels in some.items()}
    cuts["at random, as many"] = _cut_at_random(takes, cuts["energies, tuned"], np.random.default_rng((seed, 1)))
    second, unreadable = read_second_tiers(corpus, takes, whose)
    notes += unreadable
    readings = {take.name: tell_reading(corpus.tier(take.name, AFFECT_TIER, author=whose)) for take in takes}
    rows = []
    people = {(one.annotator, one.reading): Cuts() for one in second}
    for one in second:
        people[one.annotator, one.reading][one.take.name] = one.take.segments
    for reading in dict.fromkeys(readings.values()):
        own = [take for take in takes if readings[take.name] == reading]
        # Who annotated all of them stands in the same table; others in one of their own, with all on the same takes.
        whole = {key: theirs for key, theirs in people.items() if key[1] == reading and len(theirs) == len(own)}
        persons = {f"{person} (person)": people.pop((person, way)) for person, way in whole}
        rows += _score({**persons, **cuts}, own, {"reading": reading, "takes": "all"}, seed, n_draws)
    for (person, reading), theirs in people.items():
        own = [take for take in takes if take.name in theirs]
        heading = {"reading": reading, "takes": f"those of {person}"}
        rows += _score({f"{person} (person)": theirs, **cuts}, own, heading, seed, n_draws)
    if not second:
        notes.append("no second person annotated the takes, so there is no human score to compare with")
    if ADJUDICATED in readings.values():
        notes.append("adjudicated takes are nobody's own reading; they are scored apart, without people beside them")
    notes.append(
        "'at random' shows what as many borders at random places reach; tuned settings, penalties and labellers were "
        "chosen or learned on other signers than those they are scored on"
    )
    table = pd.DataFrame(rows)
    who = ["reading", "takes", "cut", "n_takes"]
    at = [name for name in table.columns if name.startswith("within_") or name.startswith(("late_", "away_"))]
    rest = [name for name in table.columns if name.startswith("f1_")]
    tables = {
        "borders": table[[*who, "n_borders", "n_reference_borders", *at]],
        "segments": table[[*who, "n_segments", "n_reference_segments", *rest]],
        "settings": pd.DataFrame(settings),
    }
    return SegmentationEvaluation(tables, tuple(notes), whose, cuts)


def _cut_by_energies(
    takes: Sequence[LabelledTake],
    folds: Sequence[Sequence[str]],
    grid: Mapping[str, Sequence[float]],
    reporter: Reporter,
) -> tuple[dict[str, Cuts], list[dict[str, Any]]]:
    default = SegmentationSettings()
    tuning = tune_on(takes, grid=grid, reporter=reporter)
    cuts: dict[str, Cuts] = {"energies, default": {}, "energies, tuned": {}}
    rows = []
    for fold in folds:
        chosen = tuning.choose([take.signer for take in takes if take.signer not in fold])
        rows.append({"cut": "energies, tuned", "signers": ", ".join(fold), **_tell(chosen, tuning.varying)})
        for name, settings in (("energies, default", default), ("energies, tuned", chosen)):
            for signer in fold:
                cuts[name] |= _cut_signer([take for take in takes if take.signer == signer], settings)
    return cuts, rows


def _cut_signer(own: Sequence[LabelledTake], settings: SegmentationSettings) -> Cuts:
    quiet = measure_joint_restlessness(((take.weights, take.rate) for take in own), settings)  # type: ignore[misc]
    found = {}
    for take in own:
        motion = measure_motion(take.weights, take.rate, tau=settings.tau, window=settings.window)  # type: ignore[arg-type]
        found[take.name] = cut_motion(motion, settings, quiet)
    return found


def _cut_by_change_points(
    takes: Sequence[LabelledTake],
    folds: Sequence[Sequence[str]],
    cuts: dict[str, Cuts],
    settings: list[dict[str, Any]],
    reporter: Reporter,
) -> None:
    """Add the cuts of each search, with the signal and the penalty that are best on the other signers."""
    with reporter.stage("Change points", len(METHODS) * len(takes), "takes") as finished:
        tunings = {method: tune_change_points(takes, method, finished=finished) for method in METHODS}
    for method in METHODS:
        cuts[f"ruptures, {method}"] = {}
    for fold in folds:
        others = [take.signer for take in takes if take.signer not in fold]
        chosen = {method: tuning.choose(others) for method, tuning in tunings.items()}
        for method, one in chosen.items():
            row = {"cut": f"ruptures, {method}", "signers": ", ".join(fold)}
            settings.append({**row, **_tell(one, tunings[method].varying)})
        for signer in fold:
            own = [take for take in takes if take.signer == signer]
            signals = prepare_signals(own)
            for take in own:
                for method, one in chosen.items():
                    cut = cut_by_change_points(signals[one.signal][take.name], take.rate, one)
                    cuts[f"ruptures, {method}"][take.name] = cut


def _choose_labellers(wanted: Sequence[str] | None) -> tuple[list[str], list[str]]:
    names = list(LABELLERS if wanted is None else wanted)
    if has_torch():
        return names, []
    networks = [name for name in names if is_network(name)]
    if wanted and networks:
        raise InputError(f"{', '.join(networks)}: needs PyTorch, which is not installed; install mimique[gpu]")
    note = [f"PyTorch is not installed, so {', '.join(networks)} was left out"] if networks else []
    return [name for name in names if name not in networks], note


def _label(
    takes: Sequence[LabelledTake], folds: Sequence[Sequence[str]], names: Sequence[str], seed: int, reporter: Reporter
) -> dict[str, dict[str, NDArray[np.object_]]]:
    """Labels of every take by labellers that learned from the other folds' signers."""
    frames = stack_takes(takes)
    bare = {take.name: ~np.isfinite(take.weights).all(axis=1) for take in takes if take.weights is not None}
    answers: dict[str, dict[str, NDArray[np.object_]]] = {name: {} for name in names}
    with reporter.stage("Labellers on unseen signers", len(names) * len(folds), "folds") as finished:
        for name in names:
            for number, fold in enumerate(folds):
                test = np.isin(frames.signers.astype(str), list(fold))
                _, predict = train_labeller(frames, name, ~test, (seed, number))
                labels = predict(test)
                for take in dict.fromkeys(frames.groups[test]):
                    own = labels[frames.groups[test] == take]
                    own[bare[str(take)]] = None
                    answers[name][str(take)] = own
                finished(f"{name}, fold {number + 1}")
    return answers


def _cut_at_random(takes: Sequence[LabelledTake], like: Cuts, rng: np.random.Generator) -> Cuts:
    """As many borders as another way found, anywhere in the take."""
    found = {}
    for take in takes:
        n_borders = min(max(len(like[take.name]) - 1, 0), take.n_frames - 1)
        inside = np.sort(rng.choice(np.arange(1, take.n_frames), n_borders, replace=False))
        ends = np.concatenate(([0], inside, [take.n_frames])).astype(np.int64)
        found[take.name] = pd.DataFrame({"onset": ends[:-1], "offset": ends[1:]})
    return found


def _score(
    cuts: Mapping[str, Cuts], takes: Sequence[LabelledTake], heading: Mapping[str, str], seed: int, n_draws: int
) -> list[dict[str, Any]]:
    """One row for each way to cut: the pooled scores of these takes, with intervals over takes."""
    references = {take.name: prepare_reference(take) for take in takes}
    often = draw_takes(len(takes), np.random.default_rng(seed), n_draws)  # all ways to cut see the same draws
    rows = []
    for name, some in cuts.items():
        counts = [score_cut(references[take.name], some[take.name][["onset", "offset"]], take.rate) for take in takes]
        table = pd.DataFrame(counts)
        total = table.sum()
        row: dict[str, Any] = {**heading, "cut": name, "n_takes": len(takes)}
        for column in ("borders", "reference_borders", "segments", "reference_segments"):
            row[f"n_{column}"] = int(total[column])
        value = _rate(total.to_frame().T)
        drawn = _rate(pd.DataFrame(often @ table.to_numpy(), columns=table.columns))
        for title in value.columns:
            row[title] = float(value[title].iloc[0])
            row[f"{title}_low"], row[f"{title}_high"] = find_intervals(row[title], drawn[title].to_numpy())
        rows.append(row)
    return rows


def _rate(counts: pd.DataFrame) -> pd.DataFrame:
    """Scores of pooled counts, one row for each row; NaN where there is nothing to count."""
    scores = {}
    for tolerance in TOLERANCES:
        right = counts[f"matched_{tolerance}"]
        scores[f"within_{tolerance}_precision"] = _share(right, counts["borders"])
        scores[f"within_{tolerance}_recall"] = _share(right, counts["reference_borders"])
        scores[f"within_{tolerance}_f1"] = _share(2 * right, counts["borders"] + counts["reference_borders"])
    scores["late_ms"] = _share(1000 * counts["offset"], counts["pairs"])
    scores["away_ms"] = _share(1000 * counts["distance"], counts["pairs"])
    for overlap in OVERLAPS:
        right = counts[f"found_{round(100 * overlap)}"]
        both = counts["segments"] + counts["reference_segments"]
        scores[f"f1_{round(100 * overlap)}"] = _share(2 * right, both)
    return pd.DataFrame(scores)


def _share(part: pd.Series, whole: pd.Series) -> pd.Series:
    return part / whole.where(whole > 0)


def _tell(settings: Any, varying: Sequence[str]) -> dict[str, Any]:
    return {name: value for name, value in asdict(settings).items() if name in varying}
