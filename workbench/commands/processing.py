"""Commands that compute: ``solve``, ``segment``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import Author, CorpusPath, Json, RigName, SolveName, TakeNames, print_table


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("solve")(solve)
    app.command("segment")(segment)


def solve(
    corpus: CorpusPath,
    rig: RigName = None,
    takes: TakeNames = None,
    method: Annotated[
        str | None, typer.Option(help="lsts, bounded, map, nnls or least-squares; see the guide.")
    ] = None,
    alpha: Annotated[float | None, typer.Option(help="Share of the thin-shell energy, 0 to 1.")] = None,
    form: Annotated[str | None, typer.Option(help="Of the thin-shell energy: energy or residual.")] = None,
    kernel: Annotated[str, typer.Option(help="Kernel of the morph map.")] = "triharmonic",
    smoothness: Annotated[
        float, typer.Option(help="Smoothness over time of bounded and map, s; 0.025 suits faces, 0 is none.")
    ] = 0.0,
    marker_map: Annotated[str, typer.Option("--map", help="Name of the rig's marker map.")] = "default",
    head_markers: Annotated[
        str | None, typer.Option(help="Markers on the skull, in place of those named at ingest: A,B,C.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the solve; RIG-METHOD by default.")] = None,
    author: Author = None,
    as_json: Json = False,
) -> None:
    """Solve takes for the weights of a rig's shapes.

    Takes out head motion, adapts the markers to the rig, and solves. Takes that are unchanged since they were solved
    are skipped. An interrupted solve goes on where it was.
    """
    from ...corpus import Corpus
    from ..pipeline.ingesting import split_names
    from ..pipeline.session_solver import DEFAULT_METHOD, SolveOptions
    from ..pipeline.solving import solve as run
    from ..progress import ConsoleReporter

    options = SolveOptions(
        rig=rig,
        marker_map=marker_map,
        method=method or DEFAULT_METHOD,
        alpha=alpha,
        form=form,
        kernel=kernel,
        smoothness=smoothness,
        name=name,
        head_markers=split_names(head_markers),
    )
    table = run(Corpus.open(corpus), options, takes=takes, author=author, reporter=ConsoleReporter())
    print_table(table, as_json)


def segment(
    corpus: CorpusPath,
    takes: TakeNames = None,
    solve: SolveName = None,
    threshold: Annotated[
        float, typer.Option(help="Least size of a movement, in units of the signer's restlessness; higher finds less.")
    ] = 10.0,
    borders: Annotated[
        str, typer.Option(help="flanks: transitions are segments of their own; peaks: one border a movement.")
    ] = "flanks",
    author: Author = None,
    as_json: Json = False,
) -> None:
    """Cut takes into segments by how their weights move."""
    from ...corpus import Corpus
    from ..pipeline.segmenting import segment as run
    from ..progress import ConsoleReporter

    table = run(
        Corpus.open(corpus),
        takes=takes,
        solve=solve,
        threshold=threshold,
        borders=borders,
        author=author,
        reporter=ConsoleReporter(),
    )
    print_table(table, as_json)
