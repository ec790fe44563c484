"""Degrees of intensity as an ordered target: machine, second annotator and protocol beside the reference.

A corpus keeps two tiers (Reverdy 2019, 4.3.2): ``intensity_asked``, what the protocol asked for, and
``intensity_seen``, what an annotator saw, with the labels 0 (counts as neutral) to 3. The machine learns the
reference's degrees on all other signers (:class:`mimique.models.labellers.OrdinalClassifier`, on what
:mod:`mimique.models.intensity_descriptors` computes) and gives one to each of the reference's segments, so borders play
no part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus.annotations.vocabulary import INTENSITIES
from ...corpus.store.view import CorpusView
from ...errors import InputError
from ...models import LabelledTake
from ...models.intensity_descriptors import describe_reach
from ...models.labelled_take import find_covering_labels
from ...models.labellers import OrdinalClassifier
from ...models.scores.label_scores import draw_takes, find_intervals
from ..progress import Reporter
from .evaluating import check_shapes
from .labelled_takes import ADJUDICATED, FROM_SCRATCH, WITH_PROPOSALS, choose_author, count_annotators, tell_reading
from .shape_weights import read_shape_weights

__all__ = ["IntensityEvaluation", "evaluate_intensity"]

SEEN, ASKED = "intensity_seen", "intensity_asked"
METHODS = {"cumulative-logits": "machine, cumulative logits", "binary": "machine, binary forests"}


@dataclass(frozen=True)
class IntensityEvaluation:
    """How well degrees are told.

    Parameters
    ----------
    tables
        ``scores``: one row a rater and reading, with mean absolute error in degrees, κ with quadratic and with linear
        weights, exact agreement, and 95 % intervals over takes; ``degrees``: how often each rater gave each degree;
        ``confusion``: reference by answer of the first machine.
    notes
        Sentences that a reader of the numbers should know.
    annotator
        Whose degrees are the reference.
    answers
        One row a segment: ``take, signer, onset, offset, reference`` and one column a rater.
    """

    tables: dict[str, pd.DataFrame]
    notes: tuple[str, ...]
    annotator: str
    answers: pd.DataFrame = field(repr=False)


def evaluate_intensity(
    corpus: CorpusView,
    *,
    annotator: str | None = None,
    signers: Sequence[str] | None = None,
    seed: int = 0,
    reporter: Reporter | None = None,
    n_draws: int = 1000,
) -> IntensityEvaluation:
    """Score degrees of intensity on signers that nothing was learned from; the corpus is only read.

    Parameters
    ----------
    corpus
        With weights and a tier ``intensity_seen`` of at least two signers.
    annotator, signers
        Whose degrees are the reference, by default of the one who annotated most; only these signers.
    seed
        Of the forests and the bootstrap.
    n_draws
        Of the bootstrap over takes.

    Raises
    ------
    MimiqueError
        If nobody annotated intensities, there are fewer than two signers, or weights are missing.
    """
    reporter = reporter or Reporter()
    whose = choose_author(corpus, SEEN, annotator)
    takes, readings = _read_degrees(corpus, whose, signers)
    if len({take.signer for take in takes}) < 2:
        raise InputError(
            f"intensity: expected segments of {SEEN!r} by {whose} from at least two signers, so that nobody is learned "
            "from and tested"
        )
    check_shapes(corpus, takes)
    notes: list[str] = []
    answers = _collect_segments(corpus, takes, notes, reporter)
    answers = _answer(answers, np.random.default_rng(seed), notes)
    raters = [*METHODS.values(), "best constant of the others"]
    people = _read_raters(corpus, takes, whose, notes)
    for name, (degrees, _) in people.items():
        answers[name] = [degrees.get((row.take, row.onset)) for row in answers.itertuples()]
    rows = []
    machines = [*raters, *_asked(answers)]
    whole = [name for name, (_, theirs) in people.items() if answers[name].notna().all() and theirs == readings]
    for reading in dict.fromkeys(readings.values()):
        own = answers[answers["take"].map(readings) == reading]
        heading = {"reading": reading, "segments": "all"}
        rows += [
            _score(own, rater, heading, seed, n_draws) for rater in [*whole, *machines] if own[rater].notna().any()
        ]
    for name, (_, theirs) in people.items():
        for reading in dict.fromkeys(theirs.values() if name not in whole else ()):
            own = answers[(answers["take"].map(theirs) == reading) & answers[name].notna()]
            heading = {"reading": reading, "segments": f"those of {name}"}
            rows += [
                _score(own, rater, heading, seed, n_draws) for rater in [name, *machines] if own[rater].notna().any()
            ]
    if not people:
        notes.append("no second person annotated intensities, so there is no human score to compare with")
    notes.append(
        "chance and constant answers have κ = 0; segments are the reference's own; the machine is not told the affect"
    )
    given = ["reference", *raters, *_asked(answers), *people]
    counts = [{"rater": name, **{k: int((answers[name] == int(k)).sum()) for k in INTENSITIES}} for name in given]
    first = pd.crosstab(answers["reference"], answers[raters[0]].rename("answer")).reset_index()
    tables = {"scores": pd.DataFrame(rows), "degrees": pd.DataFrame(counts), "confusion": first}
    return IntensityEvaluation(tables, tuple(notes), whose, answers)


def _asked(answers: pd.DataFrame) -> list[str]:
    return ["asked for"] if "asked for" in answers and answers["asked for"].notna().any() else []


def _read_degrees(
    corpus: CorpusView, whose: str, signers: Sequence[str] | None
) -> tuple[list[LabelledTake], dict[str, str]]:
    """Read the takes with the reference's degrees, and how each came about."""
    takes, readings = [], {}
    for row in corpus.takes().itertuples():
        name, listed = str(row.take), corpus.tiers(str(row.take))
        if not ((listed["tier"] == SEEN) & (listed["author"] == whose)).any() or (
            signers and row.signer not in signers
        ):
            continue
        if row.signer is None:
            raise InputError(f"take {name!r}: expected a signer; ingest it with --signer")
        tier = corpus.tier(name, SEEN, author=whose)
        wrong = tier[~tier["label"].isin(INTENSITIES)]
        if len(wrong):
            raise InputError(
                f"take {name!r}, tier {SEEN!r} of {whose}: expected the degrees {', '.join(INTENSITIES)}, but got "
                f"{wrong['label'].iloc[0]!r} at frame {wrong['onset'].iloc[0]}"
            )
        weights = read_shape_weights(corpus, name)["weights"].values
        takes.append(LabelledTake(name, str(row.signer), str(row.protocol or ""), float(row.rate), tier, weights))
        readings[name] = tell_reading(tier)
    return takes, readings


def _collect_segments(
    corpus: CorpusView, takes: Sequence[LabelledTake], notes: list[str], reporter: Reporter
) -> pd.DataFrame:
    """One row a segment: where, the reference's degree, what was asked for, and ``descriptors``."""
    table = corpus.takes()
    parts = []
    with reporter.stage("Describing intensities", len(takes), "takes") as finished:
        for signer in dict.fromkeys(take.signer for take in takes):
            own = [take for take in takes if take.signer == signer]
            rest = [
                _bare(corpus, str(row.take), signer, float(row.rate))
                for row in table[table["signer"] == signer].itertuples()
                if str(row.take) not in {take.name for take in own} and corpus.current_solve(str(row.take))
            ]
            for take in own:
                found = take.segments[["onset", "offset"]].copy()
                found.insert(0, "take", take.name)
                found["signer"] = signer
                found["reference"] = take.segments["label"].astype(int)
                asked = _read_tier(corpus, take, ASKED, None)
                found["asked for"] = _cover(found, asked) if asked is not None else None
                found["descriptors"] = list(describe_reach(found, take, [*own, *rest]))
                parts.append(found)
                finished(take.name)
    answers = pd.concat(parts, ignore_index=True)
    whole = np.isfinite(np.stack(answers["descriptors"].to_list())).all(axis=1)
    if not whole.all():
        notes.append(
            f"{int((~whole).sum())} of {len(whole)} segments have no weights, or do not differ from rest; left out"
        )
    return answers[whole].reset_index(drop=True)


def _bare(corpus: CorpusView, name: str, signer: str, rate: float) -> LabelledTake:
    """Read a take for its weights only."""
    nothing = pd.DataFrame({"onset": [], "offset": [], "label": []})
    return LabelledTake(name, signer, "", rate, nothing, read_shape_weights(corpus, name)["weights"].values)


def _answer(answers: pd.DataFrame, rng: np.random.Generator, notes: list[str]) -> pd.DataFrame:
    """Add the machines' degrees: each signer's by what all others taught; and the median degree of the others."""
    values = np.stack(answers["descriptors"].to_list())
    degrees = answers["reference"].to_numpy()
    found: dict[str, NDArray] = {name: np.zeros(len(answers), dtype=int) for name in METHODS.values()}
    found["best constant of the others"] = np.zeros(len(answers), dtype=int)
    for signer in answers["signer"].unique():
        own = (answers["signer"] == signer).to_numpy()
        learned = np.unique(degrees[~own])
        if len(learned) < 2:
            raise InputError(
                f"intensity: expected at least two degrees on the signers other than {signer}, but got "
                f"{', '.join(map(str, learned)) or 'none'}"
            )
        unknown = sorted(set(degrees[own]) - set(learned))
        if unknown:
            notes.append(f"signer {signer}: degree {', '.join(map(str, unknown))} is tested, but nobody else shows it")
        for method, name in METHODS.items():
            machine = OrdinalClassifier(method, random_state=int(rng.integers(2**31 - 1)))
            found[name][own] = machine.fit(values[~own], degrees[~own]).predict(values[own])
        found["best constant of the others"][own] = int(np.median(degrees[~own]))
    return answers.assign(**found).drop(columns="descriptors")


def _read_raters(
    corpus: CorpusView, takes: Sequence[LabelledTake], whose: str, notes: list[str]
) -> dict[str, tuple[dict[tuple[str, int], int], dict[str, str]]]:
    """Other people's degrees of the reference's segments by take and onset, and how the two readings came about."""
    people = {}
    for person in sorted(set(count_annotators(corpus, SEEN)) - {whose}):
        degrees: dict[tuple[str, int], int] = {}
        readings: dict[str, str] = {}
        for take in takes:
            other = _read_tier(corpus, take, SEEN, person)
            if other is None:
                continue
            both = {tell_reading(take.segments), tell_reading(other.segments)}
            if ADJUDICATED in both:
                continue
            readings[take.name] = WITH_PROPOSALS if WITH_PROPOSALS in both else FROM_SCRATCH
            given = _cover(take.segments, other)
            for onset, degree in zip(take.segments["onset"], given, strict=True):
                if degree is not None:
                    degrees[take.name, int(onset)] = degree
        if degrees:
            people[f"{person} (person)"] = degrees, readings
            missing = sum(len(take.segments) for take in takes if take.name in readings) - len(degrees)
            if missing:
                notes.append(
                    f"{person} gave no degree to {missing} of the reference's segments; these are not compared"
                )
    return people


def _read_tier(corpus: CorpusView, take: LabelledTake, tier: str, author: str | None) -> LabelledTake | None:
    """Return a take with another tier; by whoever it is, if nobody is named. None where there is none."""
    listed = corpus.tiers(take.name)
    whose = listed[(listed["tier"] == tier) & ((listed["author"] == author) if author else True)]["author"]
    if whose.empty:
        return None
    table = corpus.tier(take.name, tier, author=str(whose.iloc[0]))
    return LabelledTake(take.name, take.signer, take.protocol, take.rate, table, n_frames=take.n_frames)


def _cover(segments: pd.DataFrame, other: LabelledTake) -> list[int | None]:
    """Degree that covers most of each segment in another tier; None where nothing does, or it is no degree."""
    labels = find_covering_labels(segments["onset"], segments["offset"], other)[0]
    return [int(label) if label in INTENSITIES else None for label in labels]


def _score(answers: pd.DataFrame, rater: str, heading: Mapping[str, str], seed: int, n_draws: int) -> dict[str, Any]:
    """One row: how far a rater's degrees are from the reference's, with intervals over takes."""
    some = answers[answers[rater].notna()]
    n = len(INTENSITIES)
    cells = some["reference"].to_numpy(dtype=int) * n + some[rater].to_numpy(dtype=int)
    places, names = pd.factorize(some["take"])
    counts = np.zeros((len(names), n * n))
    np.add.at(counts, (places, cells), 1.0)
    often = draw_takes(len(names), np.random.default_rng(seed), n_draws)
    value = _rate(counts.sum(axis=0, keepdims=True))
    drawn = _rate(often @ counts)
    row: dict[str, Any] = {**heading, "rater": rater, "n_segments": len(some), "n_takes": len(names)}
    for name in value:
        row[name] = float(value[name][0])
        alone = len(names) < 2  # one take says nothing about others
        row[f"{name}_low"], row[f"{name}_high"] = (np.nan, np.nan) if alone else find_intervals(row[name], drawn[name])
    return row


def _rate(counts: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Scores of confusions ``(n, 16)``, reference by answer, as :mod:`mimique.models.scores.agreement` defines them."""
    n = len(INTENSITIES)
    observed = counts.reshape(-1, n, n)
    total = observed.sum(axis=(1, 2))
    away = np.abs(np.subtract.outer(np.arange(n), np.arange(n))).astype(float)
    chance = observed.sum(axis=2)[:, :, None] * observed.sum(axis=1)[:, None, :] / total[:, None, None]
    found = {"mae": (observed * away).sum(axis=(1, 2)) / total}
    for name, weight in (("kappa_quadratic", away**2), ("kappa_linear", away)):
        expected = (chance * weight).sum(axis=(1, 2))
        apart = (observed * weight).sum(axis=(1, 2))
        ratio = np.divide(apart, expected, out=np.full(len(total), np.nan), where=expected > 0)
        found[name] = 1 - ratio
    found["accuracy"] = np.trace(observed, axis1=1, axis2=2) / total
    return found
