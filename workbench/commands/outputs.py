"""Commands that give something to look at: ``report``, ``play``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import At, CorpusPath, RigName, SolveName, TakeName


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("report")(report)
    app.command("play")(play)


def report(
    corpus: CorpusPath,
    out: Annotated[Path, typer.Argument(help="HTML file to write.", metavar="OUT.html")] = Path("report.html"),
    annotator: Annotated[
        str | None, typer.Option(help="Whose tier 'affect' is the reference; who annotated most by default.")
    ] = None,
    example: Annotated[str | None, typer.Option(help="Take whose segmentation is drawn.")] = None,
    at: At = None,
) -> None:
    """Write one HTML page about the corpus.

    Recording times (Reverdy 2019, Table B.1), residuals, a segmentation, the evaluation (Figure 4.4), the history.
    """
    from ...corpus import Corpus
    from ..pipeline.reporting import write_report
    from ..progress import ConsoleReporter

    opened = Corpus.open(corpus, at=at)
    print(write_report(opened, out, annotator=annotator, example=example, reporter=ConsoleReporter()))


def play(
    corpus: CorpusPath,
    take: TakeName,
    movie: Annotated[
        Path | None, typer.Option(help="Render to this file instead of a window.", metavar="FILE.mp4")
    ] = None,
    solve: SolveName = None,
    rig: RigName = None,
    tiers: Annotated[
        list[str] | None, typer.Option("--tier", help="Tier to show, TIER or TIER@AUTHOR; may be given several times.")
    ] = None,
    start: Annotated[float, typer.Option(help="First second of the film.")] = 0.0,
    seconds: Annotated[float | None, typer.Option(help="Length of the film; all by default.")] = None,
    fps: Annotated[float, typer.Option(help="Pictures per second of the film.")] = 25.0,
    size: Annotated[str, typer.Option(help="Of the film, in pixels.", metavar="WxH")] = "960x540",
    at: At = None,
) -> None:
    """Watch a take in a window, or render a film.

    Shows the face, the adapted markers and the labels. Space plays and pauses, arrows step, the timeline seeks.
    """
    from ...corpus import Corpus
    from ..pipeline.playing import parse_size, prepare_performance, render_movie
    from ..progress import ConsoleReporter

    opened = Corpus.open(corpus, at=at)
    if movie is None:
        from ...synthesis.playback import play as show

        show(prepare_performance(opened, take, solve=solve, rig=rig, tiers=tiers))
        return
    print(
        render_movie(
            opened,
            take,
            movie,
            solve=solve,
            rig=rig,
            tiers=tiers,
            start=start,
            seconds=seconds,
            fps=fps,
            size=parse_size(size),
            reporter=ConsoleReporter(),
        )
    )
