"""``export``: what of a corpus is taken elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import At, CorpusPath, SolveName


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("export")(export)


def export(
    corpus: CorpusPath,
    take: Annotated[
        str | None, typer.Argument(help="Name of the take; left out with --bids.", metavar="[TAKE]")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Argument(
            help=".csv or .parquet weights; .eaf or .TextGrid tiers; .c3d, .trc or .nc markers; .glb, .usda or .usdc "
            "animation; a name without an ending: a folder of OBJ files.",
            metavar="[OUT]",
        ),
    ] = None,
    solve: SolveName = None,
    markers: Annotated[bool, typer.Option("--markers", help="Markers, where OUT is .csv or .parquet.")] = False,
    step: Annotated[
        str | None, typer.Option(help="Markers of this processing step (repaired, stabilised …), not as recorded.")
    ] = None,
    tiers: Annotated[
        list[str] | None,
        typer.Option("--tier", help="Only this tier, TIER or TIER@AUTHOR; may be given several times."),
    ] = None,
    authors: Annotated[
        list[str] | None, typer.Option("--author", help="Only tiers of this author; may be repeated.")
    ] = None,
    rig: Annotated[
        str | None, typer.Option(help="Rig that the weights shall move; the one that they were solved on by default.")
    ] = None,
    shapes: Annotated[
        str | None,
        typer.Option(
            help="Which shapes drive which where the rig's names are others: a CSV with the columns from,to,gain, or "
            "arkit-to-makehuman.",
            metavar="TABLE",
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Frames per second of weights and animations; the take's by default.")
    ] = None,
    livelink: Annotated[bool, typer.Option("--livelink", help="Weights as a Live Link Face CSV.")] = False,
    bids: Annotated[
        Path | None, typer.Option(help="Write all takes as a Motion-BIDS dataset into this folder.", metavar="FOLDER")
    ] = None,
    purpose: Annotated[
        str, typer.Option("--for", help="Whom the files are for: project, research or public; consent must cover it.")
    ] = "project",
    at: At = None,
) -> None:
    """Write one take's weights, tiers, markers or animation to a file, or all takes as a BIDS dataset.

    The suffix of the file says which.
    """
    from ...corpus import Corpus
    from ...errors import InputError
    from ..pipeline.exporting import export as run
    from ..pipeline.exporting import export_bids
    from ..progress import ConsoleReporter

    if bids is not None:
        if take is not None or out is not None:
            raise InputError("--bids writes all takes; give no take and no file with it")
        table, refusals = export_bids(Corpus.open(corpus, at=at), bids, purpose=purpose)
        for line in refusals:
            print(line)
        print(f"{bids}: {len(table)} takes, {len(refusals)} left out")
        return
    if take is None or out is None:
        raise InputError("expected a take and a file to write, or --bids with a folder")
    opened = Corpus.open(corpus, at=at)
    print(
        run(
            opened,
            take,
            out,
            content="markers" if markers else None,
            solve=solve,
            step=step,
            tiers=tiers,
            authors=authors,
            format="livelink" if livelink else None,
            rig=rig,
            shapes=shapes,
            rate=rate,
            purpose=purpose,
            reporter=ConsoleReporter(),
        )
    )
