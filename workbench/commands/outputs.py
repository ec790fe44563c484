"""Commands that give something to look at: ``report``, ``play``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

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
        Path | None, typer.Option(help="Render to this file, .mp4 or .gif, instead of a window.", metavar="FILE")
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option(help="Draw the face once a second on one page, .png.", metavar="FILE.png")
    ] = None,
    solve: SolveName = None,
    rig: RigName = None,
    shapes: Annotated[
        str | None,
        typer.Option(help="Table from,to,gain of shapes where the rig's names are others, or its name in mimique."),
    ] = None,
    beside: Annotated[
        str | None,
        typer.Option(
            help="Show another take, or with :SOLVE another solve of this one, on the same clock.",
            metavar="TAKE[:SOLVE]",
        ),
    ] = None,
    tiers: Annotated[
        list[str] | None, typer.Option("--tier", help="Tier to show, TIER or TIER@AUTHOR; may be given several times.")
    ] = None,
    markers: Annotated[str, typer.Option(help="Where: overlay, beside or none.")] = "overlay",
    show: Annotated[
        str, typer.Option(help="Which, separated by commas: raw (stabilised), adapted, fitted, residuals.")
    ] = "adapted",
    heat: Annotated[
        str | None, typer.Option(help="Colour the skin by displacement (from the neutral) or residual, in mm.")
    ] = None,
    camera: Annotated[str, typer.Option(help="front, three-quarter or side.")] = "front",
    curves: Annotated[bool, typer.Option("--curves", help="Burn labels, tiers and curves into the film.")] = False,
    start: Annotated[float, typer.Option(help="First second of the film.")] = 0.0,
    seconds: Annotated[float | None, typer.Option(help="Length of the film; all by default.")] = None,
    fps: Annotated[float, typer.Option(help="Pictures per second of the film.")] = 25.0,
    size: Annotated[str, typer.Option(help="Of the film, in pixels.", metavar="WxH")] = "960x540",
    every: Annotated[float, typer.Option(help="Seconds from face to face on the sheet.")] = 1.0,
    at: At = None,
) -> None:
    """Watch a take in a window, or render a film or a contact sheet.

    Space plays and pauses, arrows step, n and p go to the next and previous segment, the timeline seeks; h lists all
    keys.
    """
    from ...corpus import Corpus
    from ...synthesis.view import View
    from ..pipeline.playing import parse_size, prepare_beside, prepare_performance, render_movie, render_sheet
    from ..progress import ConsoleReporter

    view = View(
        markers=markers,
        show=tuple(word.strip() for word in show.split(",") if word.strip()),
        heat=heat,
        camera=camera,
        curves=curves or movie is None,
    )
    pixels = parse_size(size)
    opened = Corpus.open(corpus, at=at)
    shared: dict[str, Any] = {"solve": solve, "rig": rig, "shapes": shapes, "tiers": tiers}
    told: dict[str, Any] = {"view": view, "beside": beside, "reporter": ConsoleReporter()}
    if movie is not None:
        print(render_movie(opened, take, movie, start=start, seconds=seconds, fps=fps, size=pixels, **shared, **told))
    if sheet is not None:
        print(render_sheet(opened, take, sheet, every=every, **shared, **told))
    if movie is None and sheet is None:
        from ...synthesis.playback import play as open_window

        performance = prepare_performance(opened, take, **shared)
        other = None if beside is None else prepare_beside(opened, take, beside, rig=rig, shapes=shapes)
        open_window(performance, view=view, beside=other)
