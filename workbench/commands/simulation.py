"""Commands that need no recording: ``demo``, ``simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Difficulty = Annotated[str, typer.Option(help="easy, medium or hard.")]
SignerCount = Annotated[int, typer.Option(help="How many people.")]
SeedOption = Annotated[int, typer.Option(help="The same seed simulates the same corpus.")]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("demo")(demo)
    app.command("simulate")(simulate)


def demo(
    out: Annotated[Path, typer.Argument(help="Folder to make.", metavar="OUT")] = Path("demo"),
    seconds: Annotated[float, typer.Option(help="Length of the simulated corpus.")] = 120.0,
    seed: SeedOption = 0,
) -> None:
    """Run the whole pipeline on simulated signers.

    Leaves a corpus, a report and a short film.
    """
    from ..demo import run_demo
    from ..progress import ConsoleReporter

    print(run_demo(out, seconds=seconds, seed=seed, reporter=ConsoleReporter()))


def simulate(
    out: Annotated[Path, typer.Argument(help="Folder to make.", metavar="OUT")],
    seconds: Annotated[
        float | None, typer.Option(help="Length of the whole corpus; by default all of it, 2357 s for two signers.")
    ] = None,
    signers: SignerCount = 2,
    difficulty: Difficulty = "medium",
    seed: SeedOption = 0,
) -> None:
    """Write a simulated corpus as files.

    C3D recordings, ELAN tiers of two annotators, a list to ingest, and, apart from them, the truth.
    """
    from ..progress import ConsoleReporter
    from ..simulation_files import write_simulated_corpus

    reporter = ConsoleReporter()
    manifest = write_simulated_corpus(out, signers, difficulty, seconds, seed=seed, reporter=reporter)
    total = float((manifest["n_frames"] / manifest["rate"]).sum())
    print(f"{out}: {len(manifest)} simulated takes, {total:.1f} s; ingest them with --list {out / 'recordings.csv'}")
