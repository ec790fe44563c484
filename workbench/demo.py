"""The demo: the whole pipeline on simulated signers and the embedded avatar."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

from ..corpus import Corpus
from ..errors import ConflictError, InputError, MimiqueError
from .pipeline.evaluating import evaluate
from .pipeline.ingesting import ingest, read_recording_list
from .pipeline.labelling import label
from .pipeline.playing import render_movie
from .pipeline.reporting import write_report
from .pipeline.rigging import AVATAR, add_rig
from .pipeline.segmenting import segment
from .pipeline.session_solver import SolveOptions
from .pipeline.solving import solve
from .pipeline.training import train
from .progress import Reporter
from .simulation_files import RECORDING_LIST, write_simulated_corpus

MARK = "made-by-mimique-demo"
"""File that tells a folder of an earlier demo, which may be replaced, from anybody's own."""

FILM_SECONDS = 12.0

THESIS_ALPHA = 0.3
"""The demo follows the thesis to its Figure 4.4, so it solves as the thesis does (Reverdy 2019, 6.3)."""


def run_demo(out: Path, *, seconds: float = 120.0, seed: int = 0, reporter: Reporter | None = None) -> str:
    """Simulate, ingest, solve, segment, train, label, evaluate, report and film.

    Parameters
    ----------
    out
        Folder to make; one of an earlier demo is replaced.
    seconds
        Length of the simulated corpus.
    seed
        The same seed gives the same corpus.

    Returns
    -------
    Lines that say what was made, and where.

    Raises
    ------
    ConflictError
        If the folder holds something else than an earlier demo.
    MimiqueError
        If a stage fails.
    """
    reporter = reporter or Reporter()
    begin = time.perf_counter()
    _prepare_folder(out)
    write_simulated_corpus(out / "simulated", seconds=seconds, seed=seed, reporter=reporter)

    corpus = Corpus.create(out / "corpus", name="demo (simulated)")
    add_rig(corpus, "avatar", AVATAR)
    ingest(corpus, read_recording_list(out / "simulated" / RECORDING_LIST), reporter=reporter)
    solve(corpus, SolveOptions(method="lsts", alpha=THESIS_ALPHA), reporter=reporter)
    segment(corpus, reporter=reporter)
    train(corpus, reporter=reporter)
    label(corpus, reporter=reporter)
    corpus.create_tag("demo")
    with reporter.stage("Evaluating", 1) as finished:
        result = evaluate(corpus, seed=seed)
        finished("")
    write_report(corpus, out / "report.html", evaluation=result, reporter=reporter)

    takes = corpus.takes()
    take = str(takes.loc[takes[takes["protocol"] == "EU"]["seconds"].idxmax(), "take"])
    made = {
        "corpus": f"{out / 'corpus'}   ({len(takes)} takes, {takes['seconds'].sum():.0f} s, tag 'demo')",
        "report": f"{out / 'report.html'}",
    }
    try:
        render_movie(corpus, take, out / "film.mp4", seconds=FILM_SECONDS, reporter=reporter)
        made["film"] = f"{out / 'film.mp4'}   (take {take})"
    except MimiqueError as error:  # everything but the picture is there; say how to get that too
        made["film"] = f"not made: {error}"
    best = result.table[(result.table["signer"] == "all") & (result.table["segmentation"] == "manual")]
    top = best.loc[best["accuracy"].idxmax()]
    made["best"] = (
        f"{top['classifier']}, {top['accuracy']:.0%} of the simulated EU segments (majority {top['majority']:.0%})"
    )
    made["next"] = f"mimique review {out / 'corpus'}   mimique play {out / 'corpus'} {take}"
    made["time"] = f"{time.perf_counter() - begin:.0f} s"
    return "\n".join(f"{key:<8}{value}" for key, value in made.items())


def _prepare_folder(out: Path) -> None:
    try:
        if out.exists():
            if not out.is_dir() or (any(out.iterdir()) and not (out / MARK).exists()):
                raise ConflictError(f"{out}: it holds something else than an earlier demo; choose another folder")
            shutil.rmtree(out)
        out.mkdir(parents=True)
        (out / MARK).touch()
    except OSError as error:
        if isinstance(error, MimiqueError):
            raise
        raise InputError(f"{out}: cannot be written ({error.strerror}); choose another folder") from error
