"""Likely mistakes in the tiers that people made, over a whole corpus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ...corpus.annotations.label_vocabulary import LabelVocabulary
from ...corpus.annotations.tier_rules import check_tier
from ...corpus.annotations.vocabulary_change import declared_vocabulary
from ...corpus.store.view import CorpusView
from ...errors import InputError, MimiqueError, NotFoundError
from ...models import LabelledTake
from ...models.mistakes.label_checks import COLUMNS, find_label_mistakes
from ...models.mistakes.label_evidence import LabelEvidence, collect_label_evidence, make_temporal_labeller
from ..progress import Reporter
from .labelled_takes import AFFECT_TIER, choose_author, count_annotators, known_labels, name_affects
from .shape_weights import read_shape_weights

__all__ = ["LabelCheck", "check_labels", "read_second_annotator"]


@dataclass(frozen=True)
class LabelCheck:
    """Likely mistakes of one annotator.

    Parameters
    ----------
    findings
        ``take, problem, onset, offset, label, suggestion, score, reason``, the surest first; see
        :func:`mimique.models.mistakes.label_checks.find_label_mistakes`.
    annotator
        Whose tiers they are in.
    second
        Takes that someone else annotated too.
    notes
        What could not be looked at, and why.
    """

    findings: pd.DataFrame
    annotator: str
    second: int
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Take:
    """A take whose segments may overlap."""

    name: str
    protocol: str
    rate: float
    segments: pd.DataFrame


def check_labels(
    corpus: CorpusView,
    *,
    annotator: str | None = None,
    takes: Sequence[str] | None = None,
    least_score: float = 0.5,
    temporal: bool = True,
    seed: int = 0,
    reporter: Reporter | None = None,
) -> LabelCheck:
    """Find likely mistakes in an annotator's tiers ``affect``; the corpus is only read.

    Models learn from all takes that the annotator labelled, each judged by the others; where a second person annotated
    a take, their tier is a witness. What overlaps or has no weights is checked by the tier alone.

    Parameters
    ----------
    annotator
        The one who annotated most if left out.
    takes
        Only findings in these; models learn from all the same.
    least_score
        From 0, all that was suspected at all, to 1, only what the tier itself shows to be wrong.
    temporal
        Whether a labeller of frames in time helps: minutes for a large corpus.
    seed
        Of the folds and models.

    Raises
    ------
    MimiqueError
        If nobody has such a tier, or a take is not there or not annotated.
    """
    if not 0 <= least_score <= 1:
        raise InputError(f"least score: expected 0 to 1, but got {least_score}")
    reporter = reporter or Reporter()
    whose = choose_author(corpus, author=annotator)
    vocabulary = _vocabulary(corpus)
    known = known_labels(corpus)
    checked: list[LabelledTake | _Take] = []
    learned: list[LabelledTake] = []
    rules: dict[str, pd.DataFrame] = {}
    notes: list[str] = []
    for row in corpus.takes().itertuples():
        name = str(row.take)
        listed = corpus.tiers(name)
        if not ((listed["tier"] == AFFECT_TIER) & (listed["author"] == whose)).any():
            continue
        tier = corpus.tier(name, AFFECT_TIER, author=whose)
        rules[name] = check_tier(tier, vocabulary, float(row.rate))
        segments = name_affects(tier)
        take, why = _read_take(corpus, row, segments, known)
        if take is None:
            checked.append(_Take(name, str(row.protocol or ""), float(row.rate), segments))
            notes.append(f"{name}: checked by its tier alone, {why}")
        else:
            checked.append(take)
            learned.append(take)
    _check_names(takes, [take.name for take in checked], whose)
    second = read_second_annotator(corpus, learned, whose)
    evidence = _collect(learned, temporal, seed, reporter, notes)
    found = find_label_mistakes(checked, evidence, rules=rules, second=second, least_score=least_score)
    if takes is not None:
        found = found[found["take"].isin(list(takes))].reset_index(drop=True)
    return LabelCheck(found[COLUMNS], whose, len(second), tuple(notes))


def read_second_annotator(corpus: CorpusView, takes: Sequence[LabelledTake], whose: str) -> dict[str, pd.DataFrame]:
    """Return the segments of the other person who annotated most of the takes, by take; overlapping ones left out."""
    counts = {name: count for name, count in count_annotators(corpus).items() if name != whose}
    if not counts:
        return {}
    other = min(counts, key=lambda name: (-counts[name], name))
    found = {}
    for take in takes:
        try:
            table = name_affects(corpus.tier(take.name, AFFECT_TIER, author=other))
            read = LabelledTake(take.name, take.signer, take.protocol, take.rate, table, n_frames=take.n_frames)
        except MimiqueError:  # not annotated by the other, or not usable as a witness
            continue
        found[take.name] = read.segments
    return found


def _vocabulary(corpus: CorpusView) -> LabelVocabulary | None:
    try:
        return declared_vocabulary(corpus, AFFECT_TIER)
    except NotFoundError:
        return None


def _read_take(  # type: ignore[no-untyped-def]  # a row of the table of takes
    corpus: CorpusView, row, segments: pd.DataFrame, known: set[str] | None
) -> tuple[LabelledTake | None, str]:
    """Return the take as the models see it, or None and the reason."""
    name = str(row.take)
    moving = (segments["from_label"] != "") & (segments["from_label"] != segments["to_label"])
    if known is not None and not segments.loc[~moving, "label"].isin(known).all():
        return None, "for it has labels that the vocabulary does not know"
    try:
        weights = read_shape_weights(corpus, name)["weights"].values
    except NotFoundError:
        return None, "for it has no weights; run: mimique solve CORPUS"
    if not np.isfinite(weights).all(axis=1).any():
        return None, "for all its weights are gaps"
    try:
        signer, protocol = str(row.signer or ""), str(row.protocol or "")
        return LabelledTake(name, signer, protocol, float(row.rate), segments, weights), ""
    except InputError as error:
        return None, str(error)


def _collect(
    learned: Sequence[LabelledTake], temporal: bool, seed: int, reporter: Reporter, notes: list[str]
) -> Mapping[str, LabelEvidence]:
    """Evidence of models, or none, with the reason among the notes."""
    if len({take.rate for take in learned}) > 1:
        temporal = False
    n_folds = min(5, max(len(learned), 1))
    try:
        with reporter.stage("Judging each take by the others", n_folds) as finished:
            return collect_label_evidence(
                learned,
                rng=np.random.default_rng(seed),
                n_folds=n_folds,
                temporal=make_temporal_labeller if temporal else None,
                finished=finished,
            )
    except InputError as error:
        notes.append(f"no model looked for mistakes, only the rules: {error}")
        return {}


def _check_names(takes: Sequence[str] | None, annotated: Sequence[str], whose: str) -> None:
    missing = sorted(set(takes or ()) - set(annotated))
    if missing:
        raise NotFoundError(f"take {missing[0]!r}: {whose} has no tier {AFFECT_TIER!r} there")
