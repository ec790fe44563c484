"""Commands that compute: ``solve``, ``segment``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import At, Author, Branch, CorpusPath, Json, RigName, SolveName, TakeNames, print_table

prior_app = typer.Typer(help="Priors over weights, learned from performances.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    prior_app.command("add")(prior_add)
    prior_app.command("list")(prior_list)
    app.add_typer(prior_app, name="prior")
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
    kernel: Annotated[str, typer.Option(help="Kernel of the morph map; the thesis's is triharmonic.")] = "multiquadric",
    ridge: Annotated[float, typer.Option(help="Smoothness of the morph map; 0 passes through every marker.")] = 1.0,
    smoothness: Annotated[float, typer.Option(help="Smoothness over time of bounded and map, s; 0 for none.")] = 0.025,
    prior: Annotated[
        str | None, typer.Option(help="Prior of the corpus for the method map; the signer's own by default.")
    ] = None,
    marker_map: Annotated[str, typer.Option("--map", help="Name of the rig's marker map.")] = "default",
    head_markers: Annotated[
        str | None, typer.Option(help="Markers on the skull, in place of those named at ingest: A,B,C.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the solve; RIG-METHOD by default.")] = None,
    author: Author = None,
    branch: Branch = None,
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
        method=method or (DEFAULT_METHOD if prior is None else "map"),
        alpha=alpha,
        form=form,
        kernel=kernel,
        ridge=ridge,
        smoothness=smoothness,
        prior=prior,
        name=name,
        head_markers=split_names(head_markers),
    )
    table = run(Corpus.open(corpus, at=branch), options, takes=takes, author=author, reporter=ConsoleReporter())
    print_table(table, as_json)


def prior_add(
    corpus: CorpusPath,
    name: Annotated[str, typer.Argument(help="What the prior is called.", metavar="NAME")],
    files: Annotated[
        list[Path] | None,
        typer.Argument(help="Weights of performances: Live Link Face CSV, CSV or Parquet.", metavar="FILES"),
    ] = None,
    takes: TakeNames = None,
    rig: RigName = None,
    author: Author = None,
    branch: Branch = None,
) -> None:
    """Learn which weights are likely from performances, for ``solve --prior NAME``.

    Shapes are matched by name or ARKit name; shapes that never move in the files are left free. With --take, the
    current weights of takes of the corpus count.
    """
    from ...corpus import Corpus
    from ..pipeline.priors import add_prior
    from ..pipeline.solving import choose_rig

    opened = Corpus.open(corpus, at=branch)
    print(add_prior(opened, name, choose_rig(opened, rig), files or [], takes or [], author=author))


def prior_list(corpus: CorpusPath, at: At = None, as_json: Json = False) -> None:
    """List the priors of the corpus."""
    from ...corpus import Corpus
    from ..pipeline.priors import list_priors

    print_table(list_priors(Corpus.open(corpus, at=at)), as_json, empty="no priors yet")


def segment(
    corpus: CorpusPath,
    takes: TakeNames = None,
    solve: SolveName = None,
    threshold: Annotated[
        float | None,
        typer.Option(
            help="Least size of a movement, in units of the signer's restlessness; 14 by default, higher finds less."
        ),
    ] = None,
    borders: Annotated[
        str, typer.Option(help="flanks: transitions are segments of their own; peaks: one border a movement.")
    ] = "flanks",
    tune: Annotated[
        bool,
        typer.Option("--tune", help="Choose threshold, smoothing and flanks by the borders that a person annotated."),
    ] = False,
    annotator: Annotated[
        str | None, typer.Option(help="Whose tier 'affect' --tune looks at; who annotated most by default.")
    ] = None,
    author: Author = None,
    branch: Branch = None,
    as_json: Json = False,
) -> None:
    """Cut takes into segments by how their weights move.

    With --tune, what is chosen is told with its score on signers who had no part in the choice, and stored with every
    tier that is cut.
    """
    from ...corpus import Corpus
    from ..pipeline.segmenting import segment as run
    from ..progress import ConsoleReporter

    table = run(
        Corpus.open(corpus, at=branch),
        takes=takes,
        solve=solve,
        threshold=threshold,
        borders=borders,
        tune=tune,
        annotator=annotator,
        author=author,
        reporter=ConsoleReporter(),
    )
    print_table(table, as_json)
