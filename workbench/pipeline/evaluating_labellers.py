"""The labellers of a corpus on signers whom they never saw, beside the second annotator, fold by fold."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus import Corpus
from ...corpus.store.provenance import describe_step
from ...errors import InputError
from ...models import LabelledTake
from ...models.evaluation.labeller_comparison import check_classes, deal_signers, is_network, kind_of, train_labeller
from ...models.labellers import LABELLERS, LabelledFrames, frame_labels, has_torch, stack_takes
from ...models.scores.rater_scores import PERSON, Rater, ScoredRaters, count_classes, score_raters
from ...models.scores.segment_metrics import TOLERANCES
from ..progress import Reporter
from ..scratch import Scratch
from .evaluating import SecondTier, check_shapes, read_second_tiers
from .labelled_takes import (
    AFFECT_TIER,
    FROM_SCRATCH,
    choose_author,
    read_labelled_takes,
    refuse_unlabelled_signers,
    tell_reading,
)

__all__ = ["LabellersEvaluation", "evaluate_labellers"]

ALL_TAKES = "all"
FRAMES = ("accuracy", "macro_f1", "kappa", "alpha")
SEGMENTS = ("f1_10", "f1_25", "f1_50", "f1_50_stable", "edit", "agreement", "staccato")


@dataclass(frozen=True)
class LabellersEvaluation:
    """What labellers and people reached.

    Parameters
    ----------
    tables
        ``frames``, ``segments``, ``borders`` (one row a rater and tolerance), ``differences`` (temporal labellers less
        the best merged per-frame one), ``classes`` (what is asked), ``parts`` (by signer and protocol), ``mistakes``
        (most frequent confusions) and ``times``. All but ``classes`` and ``times`` begin with ``reading`` (from
        scratch, with proposals …) and ``takes`` (all, or those that a second annotator labelled too).
    notes
        Sentences that a reader of the numbers should know.
    annotator
        Whose tier is the reference.
    answers
        For each labeller the labels of the frames of each take.
    """

    tables: dict[str, pd.DataFrame]
    notes: tuple[str, ...]
    annotator: str
    answers: dict[str, dict[str, NDArray[np.object_]]] = field(repr=False, default_factory=dict)


def evaluate_labellers(
    corpus: Corpus,
    *,
    annotator: str | None = None,
    signers: Sequence[str] | None = None,
    seed: int = 0,
    reporter: Reporter | None = None,
    labellers: Sequence[str] | None = None,
    n_folds: int = 5,
    train_protocols: Sequence[str] | None = None,
    test_protocols: Sequence[str] | None = None,
    strict: bool = False,
    training_seed: int | None = None,
    n_draws: int = 1000,
) -> LabellersEvaluation:
    """Train every labeller on other signers and score it on those it has not seen; the corpus is only read.

    What an interrupted run has finished is kept beside the corpus, labeller by labeller and fold by fold, and used
    again.

    Parameters
    ----------
    corpus
        With weights and an annotated tier ``affect`` of at least two signers.
    annotator, signers
        Whose tier is the reference, by default of the one who annotated most; only these signers.
    seed
        Of the folds, the labellers and the bootstrap.
    reporter
        Told of every fold that a labeller has finished.
    labellers
        Names among :data:`mimique.models.labellers.LABELLERS`; all that can run here if left out.
    n_folds
        Into which the signers are dealt; as many as there are signers, if there are fewer.
    train_protocols, test_protocols
        Takes to learn from and to test on; all if left out. They may be the same, since signers are apart.
    strict
        Whether signers without a reference tier, and classes that nobody but a tested signer shows, are refused.
    training_seed
        Of the labellers, if other than `seed`, so that several trainings share their folds.
    n_draws
        Of the bootstrap.

    Raises
    ------
    MimiqueError
        If there is nothing to train or to test on, or a labeller is not known or cannot run here.
    """
    reporter = reporter or Reporter()
    whose = choose_author(corpus, author=annotator)
    names, notes = _choose_labellers(labellers)
    takes = read_labelled_takes(corpus, whose, signers=signers, with_weights=True)
    protocols = [
        {take.protocol for take in takes} if some is None else set(some) for some in (train_protocols, test_protocols)
    ]
    takes = [take for take in takes if take.protocol in protocols[0] | protocols[1]]
    if strict or signers:
        refuse_unlabelled_signers(corpus, takes, whose, sorted(protocols[0] | protocols[1]), signers)
    if not takes:
        raise InputError(
            f"{whose} has labelled no take of the protocols {', '.join(sorted(protocols[0] | protocols[1]))}"
        )
    folds = deal_signers([take.signer for take in takes], _count_folds(takes, n_folds), np.random.default_rng(seed))
    check_shapes(corpus, takes)
    frames = stack_takes(takes)
    of_take = {take.name: take for take in takes}
    learning = np.array([of_take[name].protocol in protocols[0] for name in frames.groups], dtype=bool)
    asking = np.array([of_take[name].protocol in protocols[1] for name in frames.groups], dtype=bool)
    splits = []
    for fold in folds:
        inside = np.isin(frames.signers.astype(str), fold)
        split = learning & ~inside, asking & inside
        if not strict and not split[1].any():
            notes.append(f"signers {', '.join(fold)}: no take to test on")
            continue
        unknown = check_classes(frames, *split, f"signers {', '.join(fold)}")
        if unknown and strict:
            raise InputError(f"{unknown}; annotate takes with it, or score what there is with --lenient (strict=False)")
        notes += [unknown] if unknown else []
        splits.append(split)
    parameters = {"seed": seed if training_seed is None else training_seed, "folds": [list(fold) for fold in folds]}
    parameters["protocols"] = [sorted(some) for some in protocols]
    work = _Work(corpus, frames, {take.name: _fingerprint_take(corpus, take.name, whose) for take in takes}, parameters)
    answers, times = work.answer(names, splits, reporter)
    tested = [take for take in takes if take.name in answers[names[0]]]
    second, unreadable = read_second_tiers(corpus, tested, whose)
    readings = {take.name: tell_reading(corpus.tier(take.name, AFFECT_TIER, author=whose)) for take in tested}
    tables = _score(tested, readings, second, answers, np.random.default_rng(seed), n_draws, reporter)
    tables["times"] = times
    work.drop()
    if not second:
        notes.append("no second person annotated the tested takes, so there is no human score to compare with")
    apart = [name for name, reading in readings.items() if reading != FROM_SCRATCH]
    if apart:
        notes.append(
            f"the reference of {len(apart)} of {len(tested)} tested takes began from a machine's proposals or is "
            f"adjudicated; these are scored apart: {', '.join(apart[:5])}"
        )
    notes += unreadable + _remark(tables, len({take.signer for take in tested}))
    return LabellersEvaluation(tables, tuple(notes), whose, answers)


def _choose_labellers(wanted: Sequence[str] | None) -> tuple[list[str], list[str]]:
    for name in wanted or ():
        if name not in LABELLERS:
            raise InputError(f"labeller: expected one of {', '.join(LABELLERS)}, but got {name!r}")
    names = list(dict.fromkeys(wanted or LABELLERS))
    if has_torch():
        return names, []
    networks = [name for name in names if is_network(name)]
    if wanted and networks:
        raise InputError(f"{', '.join(networks)}: needs PyTorch, which is not installed; install mimique[gpu]")
    rest = [name for name in names if name not in networks]
    return rest, [f"PyTorch is not installed, so {', '.join(networks)} were left out"] if networks else []


def _count_folds(takes: Sequence[LabelledTake], n_folds: int) -> int:
    if n_folds < 2:
        raise InputError(f"--folds: expected at least 2, but got {n_folds}")
    return max(2, min(n_folds, len({take.signer for take in takes})))


def _fingerprint_take(corpus: Corpus, take: str, whose: str) -> str:
    """Fingerprints of all that an answer depends on."""
    weights = corpus.fingerprint(take, "weights", corpus.current_solve(take))
    return f"{weights} {corpus.fingerprint(take, 'tier', AFFECT_TIER, whose)}"


@dataclass
class _Work:
    """Answers, fold by fold; finished ones are kept in the scratch folder until all is scored."""

    corpus: Corpus
    frames: LabelledFrames
    inputs: dict[str, str]
    parameters: dict[str, Any]
    kept: list[str] = field(default_factory=list)

    def answer(
        self, names: Sequence[str], splits: Sequence[tuple[NDArray, NDArray]], reporter: Reporter
    ) -> tuple[dict[str, dict[str, NDArray[np.object_]]], pd.DataFrame]:
        """Labels of every tested take by every labeller, and the time that training and labelling took."""
        answers: dict[str, dict[str, NDArray[np.object_]]] = {name: {} for name in names}
        rows = []
        with reporter.stage("Labellers on unseen signers", len(names) * len(splits), "folds") as finished:
            for name in names:
                spent = np.zeros(3)
                for fold, (train, test) in enumerate(splits):
                    codes, classes, seconds = self._answer_fold(name, fold, train, test, reporter)
                    labels = np.where(codes < 0, None, classes.astype(object)[codes])
                    for take in dict.fromkeys(self.frames.groups[test]):
                        answers[name][str(take)] = labels[self.frames.groups[test] == take]
                    spent += (*seconds, test.sum() / self.frames.rate)
                    finished(f"{name}, fold {fold + 1}")
                rows.append((name, kind_of(name), spent[0] / len(splits), spent[2] / max(spent[1], 1e-9)))
        columns = ["rater", "kind", "training_cpu_s", "times_real_time_cpu"]
        return answers, pd.DataFrame(rows, columns=columns)

    def _answer_fold(
        self, name: str, fold: int, train: NDArray, test: NDArray, reporter: Reporter
    ) -> tuple[NDArray, NDArray, NDArray]:
        parameters = {**self.parameters, "labeller": name, "fold": fold, "versions": _versions(name)}
        fingerprint = describe_step("evaluate labellers", inputs=self.inputs, parameters=parameters)["fingerprint"]
        self.kept.append(fingerprint)
        scratch = Scratch(self.corpus.path)
        found = scratch.get(fingerprint)
        if found is None:
            begin = time.process_time()
            seed = (int(self.parameters["seed"]), fold)
            labeller, predict = train_labeller(self.frames, name, train, seed)
            trained = time.process_time()
            labels = predict(test)
            seconds = np.array([trained - begin, time.process_time() - trained])
            classes = np.array([str(label) for label in labeller.classes_])
            place = {label: code for code, label in enumerate(classes)}
            codes = np.array([-1 if label is None else place[str(label)] for label in labels], dtype=np.int16)
            found = {"codes": codes, "classes": classes, "seconds": seconds}
            with suppress(OSError):  # beside a corpus that can only be read nothing can be kept
                scratch.put(fingerprint, found)
        return found["codes"], found["classes"], found["seconds"]

    def drop(self) -> None:
        """Forget what was kept, now that all of it is scored."""
        with suppress(OSError):
            Scratch(self.corpus.path).drop(self.kept)


def _versions(name: str) -> dict[str, str]:
    packages = ["numpy", "scikit-learn", *(["torch"] if is_network(name) else [])]
    return {package: version(package) for package in packages}


def _score(
    takes: Sequence[LabelledTake],
    readings: Mapping[str, str],
    second: Sequence[SecondTier],
    answers: Mapping[str, Mapping[str, NDArray[np.object_]]],
    rng: np.random.Generator,
    n_draws: int,
    reporter: Reporter,
) -> dict[str, pd.DataFrame]:
    """Score machines on all takes of one reading, and people with them on the takes that both labelled."""
    reference = {take.name: frame_labels(take) for take in takes}
    for take in takes:
        if take.weights is not None:  # nobody is asked about frames that have no weights
            reference[take.name][~np.isfinite(take.weights).all(axis=1)] = None
    signers = {take.name: take.signer for take in takes}
    protocols = {take.name: take.protocol for take in takes}
    machines = [Rater(name, kind_of(name), some) for name, some in answers.items()]
    found: dict[str, list[pd.DataFrame]] = {}
    groups = _group(takes, readings, second)
    with reporter.stage("Scoring", len(groups), "sets of takes") as finished:
        for (reading, which, names), tiers in groups.items():
            people = [
                Rater(
                    person if person not in answers else f"{person} (person)",
                    PERSON,
                    {tier.take.name: frame_labels(tier.take) for tier in some},
                )
                for person, some in tiers.items()
            ]
            chosen = {name: reference[name] for name in names}
            scored = score_raters(chosen, [*people, *machines], signers, takes[0].rate, rng=rng, n_draws=n_draws)
            for title, table in _tabulate(scored, signers, protocols).items():
                table.insert(0, "takes", which)
                table.insert(0, "reading", reading)
                found.setdefault(title, []).append(table)
            finished(f"{reading}, {which}")
    tables = {title: pd.concat(some, ignore_index=True) for title, some in found.items()}
    classes = count_classes(reference, signers, takes[0].rate)
    first = ("frames", "segments", "borders", "differences")
    return {**{title: tables.pop(title) for title in first}, "classes": classes, **tables}


def _group(
    takes: Sequence[LabelledTake], readings: Mapping[str, str], second: Sequence[SecondTier]
) -> dict[tuple[str, str, tuple[str, ...]], dict[str, list[SecondTier]]]:
    """Find sets of takes of one reading, and who else labelled every one of a set; others get a set of their own."""
    groups: dict[tuple[str, str, tuple[str, ...]], dict[str, list[SecondTier]]] = {}
    for reading in dict.fromkeys(readings[take.name] for take in takes):
        groups[reading, ALL_TAKES, tuple(take.name for take in takes if readings[take.name] == reading)] = {}
    for person in dict.fromkeys(tier.annotator for tier in second):
        theirs = [tier for tier in second if tier.annotator == person]
        for reading in dict.fromkeys(tier.reading for tier in theirs):
            some = [tier for tier in theirs if tier.reading == reading]
            names = tuple(tier.take.name for tier in some)
            which = ALL_TAKES if (reading, ALL_TAKES, names) in groups else f"those of {person}"
            groups.setdefault((reading, which, names), {})[person] = some
    return groups


def _tabulate(
    scored: ScoredRaters, signers: Mapping[str, str], protocols: Mapping[str, str]
) -> dict[str, pd.DataFrame]:
    table = scored.table()
    who = ["rater", "kind", "n_takes", "n_signers"]
    borders = []
    for row in table.to_dict("records"):
        for tolerance in TOLERANCES:
            line = {"rater": row["rater"], "kind": row["kind"], "within_frames": tolerance}
            for what in ("precision", "recall", "f1"):
                line |= {f"{what}{end}": row[f"border_{what}_{tolerance}{end}"] for end in ("", "_low", "_high")}
            borders.append(line)
    return {
        "frames": table[[*who, "n_frames", "n_missed", *_with_ends(FRAMES), "majority", "chance"]].copy(),
        "segments": table[["rater", "kind", *_with_ends([*SEGMENTS, "offset_ms", "distance_ms"])]].copy(),
        "borders": pd.DataFrame(borders),
        "differences": scored.differences(),
        "parts": pd.concat([scored.by_part(protocols, "protocol"), scored.by_part(signers, "signer")]),
        "mistakes": scored.mistakes(),
    }


def _with_ends(scores: Sequence[str]) -> list[str]:
    return [f"{score}{end}" for score in scores for end in ("", "_low", "_high")]


def _remark(tables: Mapping[str, pd.DataFrame], n_signers: int) -> list[str]:
    notes = []
    for row in tables["differences"].drop_duplicates(["reading", "takes"]).to_dict("records"):
        notes.append(
            f"best temporal labeller less best merged per-frame one, F1@50 ({row['reading']}, takes: {row['takes']}): "
            f"{row['rater']} - {row['against']} = {100 * row['difference']:+.1f} points "
            f"[{100 * row['difference_low']:+.1f}, {100 * row['difference_high']:+.1f}] over takes, "
            f"[{100 * row['difference_signers_low']:+.1f}, {100 * row['difference_signers_high']:+.1f}] over signers; "
            "which is best was read from the same scores"
        )
    notes.append(
        f"intervals are bootstrapped over takes, with the same draws for all raters; the {n_signers} signers and the "
        "seeds of the trainings are held fixed"
    )
    return notes
