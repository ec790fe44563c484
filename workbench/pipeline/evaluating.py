"""Evaluations of classifiers on a corpus: the thesis's (Reverdy 2019, 4.5), and across signers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from ...corpus.store.view import CorpusView
from ...errors import InputError, MimiqueError
from ...models import CLASSIFIERS, Evaluation, LabelledTake
from ...models.evaluation.annotator_comparison import compare_annotators
from ...models.evaluation.protocols import PROTOCOLS, evaluate_across_signers, evaluate_reverdy2019
from .labelled_takes import (
    ADJUDICATED,
    AFFECT_TIER,
    FROM_SCRATCH,
    WITH_PROPOSALS,
    choose_author,
    count_annotators,
    name_affects,
    read_labelled_takes,
    refuse_unlabelled_signers,
    tell_reading,
)
from .segmenting import read_segments
from .shape_weights import read_shape_weights
from .training import TRAIN_PROTOCOLS

TEST_PROTOCOLS = ("EU",)


@dataclass(frozen=True)
class CorpusEvaluation(Evaluation):
    """What was measured on a corpus.

    Parameters
    ----------
    people
        :func:`.compare_annotators` for each further annotator, under one another.
    protocol, annotator
        What was done, and whose tier is the reference.
    notes
        Sentences that a reader of the numbers should know.
    """

    people: pd.DataFrame = field(repr=False, default_factory=pd.DataFrame)
    protocol: str = PROTOCOLS[0]
    annotator: str = ""
    notes: tuple[str, ...] = ()


def evaluate(
    corpus: CorpusView,
    *,
    protocol: str = PROTOCOLS[0],
    annotator: str | None = None,
    signers: Sequence[str] | None = None,
    classifiers: Sequence[str] = CLASSIFIERS,
    train_protocols: Sequence[str] = TRAIN_PROTOCOLS,
    test_protocols: Sequence[str] = TEST_PROTOCOLS,
    per_second: float | None = 10.0,
    strict: bool = False,
    seed: int = 0,
) -> CorpusEvaluation:
    """Score classifiers on manual and on automatic segments; the corpus is only read.

    Parameters
    ----------
    corpus
        With weights and an annotated tier ``affect``; stored automatic segments are used where there are any.
    protocol
        ``"reverdy2019"`` or ``"across-signers"``, see :mod:`mimique.models.evaluation.protocols`.
    annotator
        Whose tier is the reference; the one who annotated most if left out.
    signers, classifiers, train_protocols, test_protocols, per_second, seed
        See :func:`mimique.models.evaluate_reverdy2019`.
    strict
        Whether signers without a reference tier, and classes on one side of the split only, are refused. A report shows
        what there is; a figure that is published should not leave anything out without a word.

    Raises
    ------
    MimiqueError
        If there is nothing to train or to test on.
    """
    if protocol not in PROTOCOLS:
        raise InputError(f"protocol: expected {' or '.join(PROTOCOLS)}, but got {protocol!r}")
    whose = choose_author(corpus, author=annotator)
    used = [*train_protocols, *test_protocols]
    takes = read_labelled_takes(corpus, whose, signers=signers, protocols=used, with_weights=True)
    if strict or signers:
        refuse_unlabelled_signers(corpus, takes, whose, used, signers)
    if not takes:
        raise InputError(f"{whose} has labelled no take of the protocols {', '.join(used)}")
    check_shapes(corpus, takes)
    automatic = {}
    for take in takes:
        segments = read_segments(corpus, take.name)
        if segments is not None:
            automatic[take.name] = segments
    rng = np.random.default_rng(seed)
    run = evaluate_across_signers if protocol == "across-signers" else evaluate_reverdy2019
    found = run(
        takes,
        rng=rng,
        automatic=automatic,
        classifiers=classifiers,
        train_protocols=train_protocols,
        test_protocols=test_protocols,
        per_second=per_second,
        strict=strict,
    )
    tested = [take for take in takes if take.protocol in test_protocols]
    people, notes = _compare_people(corpus, found, tested, whose, np.random.default_rng(seed))
    return CorpusEvaluation(
        found.table, found.answers, found.confusions, found.classes, people, protocol, whose, tuple(notes)
    )


@dataclass(frozen=True)
class SecondTier:
    """A take with another annotator's tier; ``reading`` says how the two tiers came about, by the less independent."""

    annotator: str
    take: LabelledTake
    reading: str


def read_second_tiers(
    corpus: CorpusView, tested: Sequence[LabelledTake], whose: str
) -> tuple[list[SecondTier], list[str]]:
    """Read what everybody but the reference's annotator made of some takes.

    Adjudicated tiers, on either side, are nobody's own reading and are left out; so are tiers that cannot be read, with
    a note: the reference is good, and a bad second tier must not stop an evaluation.

    Returns
    -------
    The tiers, annotator by annotator, and the notes.
    """
    second, notes = [], []
    reference = {take.name: tell_reading(corpus.tier(take.name, AFFECT_TIER, author=whose)) for take in tested}
    for other in sorted(set(count_annotators(corpus)) - {whose}):
        for take in tested:
            listed = corpus.tiers(take.name)
            if not ((listed["tier"] == AFFECT_TIER) & (listed["author"] == other)).any():
                continue
            tier = corpus.tier(take.name, AFFECT_TIER, author=other)
            both = {reference[take.name], tell_reading(tier)}
            if ADJUDICATED in both:
                continue
            try:
                labelled = LabelledTake(
                    take.name, take.signer, take.protocol, take.rate, name_affects(tier), n_frames=take.n_frames
                )
            except MimiqueError as error:
                notes.append(f"{other} is not compared there: {error}")
                continue
            second.append(SecondTier(other, labelled, WITH_PROPOSALS if WITH_PROPOSALS in both else FROM_SCRATCH))
    return second, notes


def check_shapes(corpus: CorpusView, takes: Sequence[LabelledTake]) -> None:
    """Refuse takes whose weights are of other shapes, or in another order: columns would mean different things."""
    first: tuple[str, list[str]] | None = None
    for take in takes:
        shapes = [str(shape) for shape in read_shape_weights(corpus, take.name)["shape"].values]
        if first is not None and shapes != first[1]:
            differing = sorted(set(shapes) ^ set(first[1]))
            what = f"they differ in {', '.join(differing[:5])}" if differing else "their order differs"
            raise InputError(f"takes {first[0]} and {take.name}: expected weights of the same shapes, but {what}")
        first = first or (take.name, shapes)


def _compare_people(
    corpus: CorpusView, found: Evaluation, tested: Sequence[LabelledTake], whose: str, rng: np.random.Generator
) -> tuple[pd.DataFrame, list[str]]:
    """Score every other annotator of the tested takes as the machine is scored; readings with proposals apart."""
    reference = {take.name: tell_reading(corpus.tier(take.name, AFFECT_TIER, author=whose)) for take in tested}
    notes = []
    for reading, what in (
        (WITH_PROPOSALS, "began from a machine's proposals, which flatters machines"),
        (ADJUDICATED, "is adjudicated, so that no single person stands beside the machine there"),
    ):
        names = [name for name, known in reference.items() if known == reading]
        if names:
            notes.append(f"the reference of {len(names)} of {len(tested)} tested takes {what}: {', '.join(names[:5])}")
    tables = []
    second, unreadable = read_second_tiers(corpus, tested, whose)
    notes += unreadable
    for other in dict.fromkeys(tier.annotator for tier in second):
        theirs = [tier for tier in second if tier.annotator == other]
        readings = {tier.take.name: tier.reading for tier in theirs}
        table = compare_annotators(found.answers, [tier.take for tier in theirs], other, rng=rng, readings=readings)
        if len(table):
            tables.append(table)
    if not tables:
        notes.append("no second person annotated the tested takes, so there is no human score to compare with")
        return pd.DataFrame(), notes
    return pd.concat(tables, ignore_index=True), notes
