"""Segments from the motion of the weights, for all takes of a corpus (Reverdy 2019, 4.4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import Any

import pandas as pd

from ...corpus import Corpus
from ...corpus.store.provenance import describe_step
from ...corpus.store.view import CorpusView
from ...errors import InputError, NotFoundError
from ...features import segment as segment_weights
from ...features.segmentation import SegmentationSettings, measure_joint_restlessness
from ...models import LabelledTake
from ...models.segmentation.tuning import GRID, SegmentationTuning, tune_segmentation
from ..progress import Reporter
from .labelled_takes import choose_author, read_labelled_takes
from .shape_weights import read_shape_weights
from .tier_makers import MACHINE, SEGMENT_TIER

FIXED_ONCE = {"window": 0.25, "tau": 0.05, "directness": 0.3, "flank": 0.8, "min_duration": 0.1}
"""What steps were made with that do not name these parameters."""


def segment(
    corpus: Corpus,
    *,
    takes: Sequence[str] | None = None,
    solve: str | None = None,
    threshold: float | None = None,
    borders: str = "flanks",
    tune: bool = False,
    annotator: str | None = None,
    author: str | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Cut takes into stable segments and transitions and store them as the tier ``segments``, in one commit.

    How quiet a face is at rest is measured over all of a signer's chosen takes together, so that a take without rest is
    not cut more sparingly than the others.

    Parameters
    ----------
    corpus
        With weights.
    takes
        Names; all takes that have weights if left out.
    solve
        Which weights; each take's current ones if left out.
    threshold, borders
        See :func:`mimique.features.segment`; its own threshold if left out.
    tune
        Choose window, τ, threshold, directness and flank by how well they find the borders of an annotator
        (:mod:`mimique.models.segmentation.tuning`), over all takes that they annotated. What is chosen is stored with
        each tier, and told with its score on signers who had no part in the choice.
    annotator
        Whose tier `affect` to tune by; the one who annotated most if left out.

    Returns
    -------
    DataFrame
        One row a take: ``take, outcome, segments`` (stable ones) and ``transitions``.

    Raises
    ------
    NotFoundError
        If a take or its weights are not there, or nobody annotated a take to tune by.
    InputError
        If a number is out of range, or a threshold is given although it is to be chosen.
    """
    reporter = reporter or Reporter()
    if tune and threshold is not None:
        raise InputError("segment: expected a threshold, or that one is chosen (tune), but got both; leave one out")
    settings = SegmentationSettings(borders=borders)
    if threshold is not None:
        settings = replace(settings, threshold=threshold)
    chosen = solved_takes(corpus, takes, solve)
    tuning: dict[str, Any] = {}
    if tune:
        settings, tuning = _tune(corpus, settings, solve, annotator, reporter)
    table = corpus.takes().set_index("take")
    parameters = {**asdict(settings), **tuning, "solve": solve}
    rows: list[dict[str, Any]] = []
    message = f"Segment {len(chosen)} takes" if len(chosen) > 1 else f"Segment {chosen[0]}"
    groups: dict[str, list[str]] = {}
    for name in chosen:
        signer = table.loc[name, "signer"]
        groups.setdefault(f"take {name}" if signer is None else f"signer {signer}", []).append(name)
    with corpus.transaction(message, command="segment", parameters=parameters, author=author) as edit:
        with reporter.stage("Segmenting", len(chosen)) as finished:
            for names in groups.values():
                restlessness = _measure_signer(corpus, names, solve, settings)
                for name in names:
                    which = solve or corpus.current_solve(name)
                    provenance = describe_step(
                        "segment",
                        inputs={"weights": corpus.fingerprint(name, "weights", which)},
                        parameters={**asdict(settings), "solve": which, "restlessness": round(restlessness, 9)},
                    )
                    outcome = "unchanged"
                    if not corpus.is_done(provenance, name, "tier", SEGMENT_TIER, MACHINE):
                        found = segment_again(corpus, name, provenance["parameters"])
                        edit.put_tier(name, SEGMENT_TIER, found, author=MACHINE, provenance=provenance)
                        outcome = "segmented"
                    labels = edit.tier(name, SEGMENT_TIER, author=MACHINE)["label"]
                    counts = {
                        "segments": int((labels == "stable").sum()),
                        "transitions": int((labels == "transition").sum()),
                    }
                    rows.append({"take": name, "outcome": outcome, **counts})
                    finished(name)
    columns = ["take", "outcome", "segments", "transitions"]
    return pd.DataFrame(rows, columns=columns).sort_values("take", ignore_index=True)


def solved_takes(corpus: CorpusView, takes: Sequence[str] | None, solve: str | None) -> list[str]:
    """Return the takes to work on: those named, else all that have weights.

    Raises
    ------
    NotFoundError
        If a named take has no such weights, or no take has any.
    InputError
        If the list is empty.
    """
    table = corpus.takes()
    known = table["take"].tolist()
    if takes is None:
        with_weights = [n for n in known if (solve in corpus.solves(n) if solve else corpus.current_solve(n))]
        if not with_weights:
            raise NotFoundError("no take has weights yet; run: mimique solve CORPUS")
        return with_weights
    if not takes:
        raise InputError("expected at least one take")
    for name in takes:
        corpus.weights(name, solve)
    return list(takes)


def segment_again(corpus: CorpusView, take: str, parameters: Mapping[str, Any]) -> pd.DataFrame:
    """Return the tier that the parameters of a step ``segment`` give: settings, solve and restlessness.

    Steps that name no window, τ, directness, flank or least duration were made when these were fixed numbers.
    """
    known = {**FIXED_ONCE, **parameters}
    settings = SegmentationSettings(**{field.name: known[field.name] for field in fields(SegmentationSettings)})
    weights = read_shape_weights(corpus, take, str(known["solve"]))
    found = segment_weights(
        weights["weights"].values,
        float(weights.attrs["rate"]),
        restlessness=float(known["restlessness"]),
        **asdict(settings),
    )
    return found.rename(columns={"kind": "label"}).assign(origin="model", status="proposed")


def tune_on(
    takes: Sequence[LabelledTake],
    settings: SegmentationSettings | None = None,
    *,
    grid: Mapping[str, Sequence[float]] = GRID,
    reporter: Reporter | None = None,
) -> SegmentationTuning:
    """Try a grid of settings on takes (:mod:`mimique.models.segmentation.tuning`), with a progress bar."""
    with (reporter or Reporter()).stage("Trying settings of the segmentation", len(takes), "takes") as finished:
        return tune_segmentation(takes, grid=grid, default=settings, finished=finished)


def _tune(
    corpus: CorpusView,
    settings: SegmentationSettings,
    solve: str | None,
    annotator: str | None,
    reporter: Reporter,
) -> tuple[SegmentationSettings, dict[str, Any]]:
    """Return the chosen settings, and what the commit tells of the choice."""
    whose = choose_author(corpus, author=annotator)
    takes = read_labelled_takes(corpus, whose, solve=solve)
    tuning = tune_on(takes, settings, reporter=reporter)
    chosen: SegmentationSettings = tuning.choose()
    told: dict[str, Any] = {"tuned_by": whose, "tuned_takes": len(takes)}
    words = ", ".join(f"{name} {getattr(chosen, name):g}" for name in tuning.varying)
    line = f"chosen by the borders of {whose} in {len(takes)} takes: {words}"
    if len(takes) > 1:
        apart = tuning.leave_one_out()
        score = 2 * apart["matched"].sum() / max(int((apart["found"] + apart["reference"]).sum()), 1)
        told["held_out_f1"] = round(float(score), 4)
        before = tuning.score(tuning.settings[0])
        line += f"; F1 of borders within 0.1 s on those left out {score:.3f}, with the defaults {before:.3f}"
    reporter.say(line)
    return chosen, told


def _measure_signer(
    corpus: CorpusView, names: Sequence[str], solve: str | None, settings: SegmentationSettings
) -> float:
    """Return how much a signer's weights move while the face is quiet, over all of the takes together, 1/s."""
    weights = (read_shape_weights(corpus, name, solve) for name in names)
    return measure_joint_restlessness(
        ((some["weights"].values, float(some.attrs["rate"])) for some in weights), settings
    )


def read_segments(corpus: CorpusView, take: str) -> pd.DataFrame | None:
    """Return the automatic segments of a take, ``onset, offset, kind`` (stable, transition); None if it has none."""
    try:
        table = corpus.tier(take, SEGMENT_TIER, author=MACHINE)
    except NotFoundError:
        return None
    return table[["onset", "offset", "label"]].rename(columns={"label": "kind"})
