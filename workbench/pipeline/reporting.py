"""Everything that a report of a corpus shows, gathered from one snapshot."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd

from ... import __version__
from ...corpus import Corpus
from ...errors import InputError, MimiqueError
from ...features import motion_energy
from ...models import Evaluation, recording_times
from ...synthesis.diagnosis import find_conspicuous_frames
from ..progress import Reporter
from ..reports.corpus_quality import Quality
from ..reports.corpus_report import ReportData, SegmentationExample, build_report
from ..text_files import write_text
from .checking import check_corpus
from .evaluating import TEST_PROTOCOLS, evaluate
from .labelled_takes import choose_author, read_labelled_takes
from .playing import choose_tiers, prepare_performance
from .segmenting import SEGMENT_TIER, read_segments
from .shape_weights import read_shape_weights

EXAMPLE_SECONDS = 20.0
CONSPICUOUS = 3.0
"""A take stands out where its median residual is this many times the corpus's median."""


def is_simulated(corpus: Corpus) -> bool:
    """Return whether any take says that it is simulated."""
    return any(bool(corpus.take_attributes(take).get("simulated")) for take in corpus.takes()["take"])


def write_report(
    corpus: Corpus,
    path: Path,
    *,
    annotator: str | None = None,
    evaluation: Evaluation | None = None,
    example: str | None = None,
    portrait: bool = True,
    reporter: Reporter | None = None,
) -> str:
    """Write a self-contained HTML report of what the corpus shows.

    Parameters
    ----------
    corpus
        The snapshot to report.
    path
        File to write.
    annotator
        Whose tier is the reference; the one who annotated most if left out.
    evaluation
        Computed already; computed here if left out and the corpus has what it takes.
    example
        Name of the take whose segmentation is drawn; a test take of the reference tier if left out.
    portrait
        Whether a picture of the face is drawn, where this machine can.

    Returns
    -------
    A line that says what was written.

    Raises
    ------
    MimiqueError
        If the corpus is empty or the file cannot be written.
    """
    reporter = reporter or Reporter()
    with reporter.stage("Reporting", 5) as finished:
        takes = corpus.takes()
        if takes.empty:
            raise InputError("the corpus has no takes to report; ingest some first")
        whose = _try_author(corpus, annotator)
        residuals = _gather_residuals(corpus)
        finished("residuals")
        checked = check_corpus(corpus)
        finished("quality")
        if evaluation is None and whose is not None:
            evaluation = _try_evaluation(corpus, whose)
        finished("evaluation")
        shown = example or _choose_example(corpus, whose)
        data = ReportData(
            corpus=corpus.name,
            snapshot=corpus.snapshot,
            version=__version__,
            created=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
            simulated=is_simulated(corpus),
            takes=_table_of_takes(takes),
            recording_times=None if whose is None else _table_of_times(corpus, whose),
            residuals=residuals,
            example=None if shown is None else _gather_example(corpus, shown),
            evaluation=None if evaluation is None else evaluation.table,
            people=getattr(evaluation, "people", None),
            confusions={} if evaluation is None else _pick_confusions(evaluation),
            quality=Quality(checked.findings, checked.markers),
            quality_notes=_note_quality(corpus, residuals),
            history=_table_of_history(corpus),
            parameters=_gather_parameters(corpus, whose),
            portrait=_draw_portrait(corpus, shown) if portrait and shown is not None else None,
        )
        finished("portrait")
        write_text(path, build_report(data))
        finished("page")
    return f"{path}: {len(takes)} takes at snapshot {corpus.snapshot}"


def _try_author(corpus: Corpus, annotator: str | None) -> str | None:
    """Return whose tier is the reference, None where nobody annotated; a named one must exist."""
    if annotator is not None:
        return choose_author(corpus, author=annotator)
    try:
        return choose_author(corpus)
    except MimiqueError:
        return None


def _try_evaluation(corpus: Corpus, annotator: str) -> Evaluation | None:
    """Evaluate where the corpus has what it takes; a report of half a corpus is still a report."""
    try:
        return evaluate(corpus, annotator=annotator)
    except MimiqueError:
        return None


def _table_of_takes(takes: pd.DataFrame) -> pd.DataFrame:
    columns = ["take", "signer", "protocol", "rate", "frames", "seconds", "markers", "solve"]
    return takes[columns].rename(columns={"markers": "n_markers", "frames": "n_frames"})


def _table_of_times(corpus: Corpus, annotator: str) -> pd.DataFrame:
    labelled = read_labelled_takes(corpus, annotator, with_weights=False)
    times = recording_times(labelled).drop(columns="total")
    rows = [row for row in times.index if row != ("all", "")]
    times = times.loc[rows]
    times.index = pd.Index([f"{signer}_{protocol}" for signer, protocol in rows], name="signer_protocol")
    return times


def _gather_residuals(corpus: Corpus) -> pd.DataFrame | None:
    rows = []
    for take in corpus.takes()["take"]:
        if corpus.current_solve(take) is None:
            continue
        weights = corpus.weights(take)
        if "residual" not in weights:  # weights that came from elsewhere
            continue
        residual = np.asarray(weights["residual"].values)
        solved = residual[np.isfinite(residual)]
        if len(solved):
            rows.append(
                {
                    "take": take,
                    "solve": corpus.current_solve(take),
                    "median": float(np.median(solved)),
                    "mean": float(solved.mean()),
                    "p95": float(np.quantile(solved, 0.95)),
                    "max": float(solved.max()),
                    "unsolved": int(len(residual) - len(solved)),
                    "conspicuous": int(find_conspicuous_frames(residual).sum()),
                }
            )
    return pd.DataFrame(rows) if rows else None


def _choose_example(corpus: Corpus, annotator: str | None) -> str | None:
    """Return a solved take to show: of a test protocol and annotated if possible, else the first."""
    takes = corpus.takes()
    solved = takes[takes["solve"].notna()]
    if solved.empty:
        return None
    tested = solved[solved["protocol"].isin(TEST_PROTOCOLS)]
    if annotator is not None:
        for take in tested["take"]:
            listed = corpus.tiers(take)
            if (listed["author"] == annotator).any():
                return str(take)
    return str((tested if len(tested) else solved)["take"].iloc[0])


def _gather_example(corpus: Corpus, take: str) -> SegmentationExample:
    weights = read_shape_weights(corpus, take)
    rate = float(weights.attrs["rate"])
    energy = motion_energy(weights["weights"].values, rate)
    tiers = choose_tiers(corpus, take, None)
    segments = read_segments(corpus, take)
    if segments is not None:
        tiers = {**tiers, SEGMENT_TIER: segments.rename(columns={"kind": "label"})}
    return SegmentationExample(
        take=take,
        rate=rate,
        energies={"velocity E_vel": energy.velocity, "acceleration τ E_acc": energy.tau * energy.acceleration},
        tiers=tiers,
        stop=min(len(energy.velocity), round(EXAMPLE_SECONDS * rate)),
    )


def _pick_confusions(evaluation: Evaluation) -> dict[str, pd.DataFrame]:
    """Return the confusions of the best classifier on manual and automatic segments, all signers together."""
    everyone = evaluation.table[evaluation.table["signer"] == "all"]
    table = everyone if len(everyone) else evaluation.table
    picked = {}
    for segmentation in ("manual", "automatic"):
        part = table[table["segmentation"] == segmentation].dropna(subset=["accuracy"])
        if part.empty:
            continue
        best = part.loc[part["accuracy"].idxmax()]
        key = (str(best["signer"]), str(best["classifier"]), segmentation)
        picked[f"{key[1]} on {segmentation} segments"] = evaluation.confusions[key]
    return picked


def _note_quality(corpus: Corpus, residuals: pd.DataFrame | None) -> list[str]:
    notes = []
    if residuals is not None:
        typical = float(residuals["median"].median())
        for row in residuals.itertuples():
            if float(row.median) > CONSPICUOUS * typical:
                notes.append(
                    f"{row.take}: its median residual of {row.median:.2f} mm is more than {CONSPICUOUS:g} times the "
                    f"corpus's {typical:.2f} mm; look at its head markers and its neutral."
                )
        for row in residuals[residuals["conspicuous"] > 0].itertuples():
            notes.append(f"{row.take}: {row.conspicuous} frames have a residual that stands out from the take's own.")
        unsolved = residuals[residuals["unsolved"] > 0]
        for row in unsolved.itertuples():
            notes.append(f"{row.take}: {row.unsolved} frames have no weights, for lack of visible markers.")
    unsolved_takes = [t for t in corpus.takes()["take"] if corpus.current_solve(t) is None]
    if unsolved_takes:
        notes.append(f"Not solved: {', '.join(unsolved_takes)}.")
    return notes


def _table_of_history(corpus: Corpus) -> pd.DataFrame:
    history = corpus.history()
    history["time"] = history["time"].dt.strftime("%Y-%m-%d %H:%M:%S")
    return history


def _gather_parameters(corpus: Corpus, annotator: str | None) -> dict[str, object]:
    facts: dict[str, object] = {}
    if annotator is not None:
        facts["reference annotator"] = annotator
    for take in corpus.takes()["take"]:
        solve = corpus.current_solve(take)
        if solve is None:
            continue
        for key, value in corpus.provenance(take, "weights", solve).get("parameters", {}).items():
            if key in ("method", "alpha", "form", "kernel"):
                facts[f"solve {key}"] = "default" if value is None else value
        break
    return facts


def _draw_portrait(corpus: Corpus, take: str) -> bytes | None:
    """Draw the face where it is most expressive in the example; None where this machine cannot draw."""
    from ...synthesis.scene import Scene

    performance = prepare_performance(corpus, take)
    expressive = np.nan_to_num(np.linalg.norm(performance.weights, axis=1))
    try:
        with Scene(performance, (960, 540)) as scene:
            return scene.png(int(expressive.argmax()))
    except MimiqueError:
        return None
