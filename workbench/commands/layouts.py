"""``layout``: how many markers, and where."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import At, Author, Branch, CorpusPath, Json, RigName, print_table

if TYPE_CHECKING:
    from ...corpus import Corpus
    from ...models.layouts import LayoutStudy
    from ...synthesis import Rig


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("layout")(layout)


def layout(
    corpus: CorpusPath,
    report: Annotated[Path | None, typer.Option(help="HTML report to write.", metavar="OUT.html")] = None,
    pdf: Annotated[Path | None, typer.Option(help="The same to print, A4.", metavar="OUT.pdf")] = None,
    tables: Annotated[Path | None, typer.Option(help="Folder for all tables as CSV.", metavar="DIR")] = None,
    markers: Annotated[
        int | None, typer.Option(help="Recommend a layout of so many markers, beside those of the head.")
    ] = None,
    store: Annotated[
        str | None, typer.Option(help="Keep the recommended layout as this marker map of the rig.", metavar="NAME")
    ] = None,
    map_file: Annotated[
        Path | None, typer.Option("--map", help="Write the layout as CSV, marker and vertex.", metavar="OUT.csv")
    ] = None,
    labels: Annotated[
        Path | None, typer.Option(help="Write the markers' names as labels of a C3D.", metavar="OUT.c3d")
    ] = None,
    rig: RigName = None,
    faces: Annotated[
        list[str] | None, typer.Option("--face", help="Rig that is an actor's face; may be given several times.")
    ] = None,
    range_of_motion: Annotated[
        list[str] | None,
        typer.Option("--range-of-motion", help="Take to learn from; those of protocol ROM by default.", metavar="TAKE"),
    ] = None,
    unseen: Annotated[
        list[str] | None,
        typer.Option("--unseen", help="Actor that nothing is learned from; the last third by default."),
    ] = None,
    sets: Annotated[
        list[str] | None, typer.Option("--set", help="Named marker set that must be compared, such as 'MPEG-4 53'.")
    ] = None,
    mirror: Annotated[bool, typer.Option("--mirror/--no-mirror", help="Recommend a mirror symmetric layout.")] = True,
    lids: Annotated[bool, typer.Option("--lids", help="Let chosen layouts have markers on the lids.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer sizes, seeds and frames.")] = False,
    seed: Annotated[int, typer.Option(help="Of everything random.")] = 0,
    author: Author = None,
    branch: Branch = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Choose marker layouts and measure what they are worth (Reverdy 2019, chapter 3).

    Compares k-means, chosen layouts and the marker sets of the literature on the corpus's rigs and performances, and
    recommends one. An interrupted study goes on where it was.
    """
    from ...corpus import Corpus
    from ...errors import InputError
    from ...synthesis import Rig
    from ..pipeline.studying_layouts import (
        LayoutOptions,
        store_layout,
        study_layouts,
        write_layout_map,
        write_layout_tables,
        write_marker_labels,
    )
    from ..progress import ConsoleReporter

    if at is not None and (store is not None or branch is not None):
        raise InputError("--at reads an older version; leave it out to --store a layout or to choose a --branch")
    if labels is not None and labels.suffix.lower() != ".c3d":
        raise InputError(f"--labels: expected a file name that ends in .c3d, but got {labels}")
    for path in (report, pdf, map_file, labels):
        if path is not None and not path.parent.is_dir():
            raise InputError(f"{path}: its folder does not exist")
    opened = Corpus.open(corpus, at=at or branch)
    options = LayoutOptions(
        rig=rig,
        faces=tuple(faces or ()),
        range_of_motion=tuple(range_of_motion or ()),
        unseen=tuple(unseen or ()),
        markers=markers,
        sets=tuple(sets or ()),
        quick=quick,
        mirror=mirror,
        lids=lids,
        seed=seed,
    )
    study = study_layouts(opened, options=options, reporter=ConsoleReporter())
    base = Rig.from_dataset(opened.rig(study.parameters["rig"]))
    written = _write_pages(opened, study, base, report, pdf)
    written += write_layout_tables(study, tables) if tables is not None else []
    written += [write_layout_map(study, map_file)] if map_file is not None else []
    written += [write_marker_labels(study, base, labels)] if labels is not None else []
    stored = store_layout(opened, study, store, author=author) if store is not None else None
    _print(study, written, stored, as_json)


def _write_pages(opened: Corpus, study: LayoutStudy, base: Rig, report: Path | None, pdf: Path | None) -> list[Path]:
    """Write the report as HTML and PDF where they are wanted."""
    if report is None and pdf is None:
        return []
    from datetime import UTC, datetime

    from ... import __version__
    from ..layout_reports.layout_report import LayoutFacts, write_layout_pdf, write_layout_report
    from ..pipeline.reporting import is_simulated

    facts = LayoutFacts(
        corpus=opened.name,
        snapshot=opened.snapshot,
        version=__version__,
        created=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        rig=base,
        rig_name=str(study.parameters["rig"]),
        simulated=is_simulated(opened),
        head=study.head_markers or None,
    )
    written = []
    if report is not None:
        written.append(write_layout_report(study, report, facts=facts))
    if pdf is not None:
        written.append(write_layout_pdf(study, pdf, facts=facts))
    return written


def _print(study: LayoutStudy, written: list[Path], stored: str | None, as_json: bool) -> None:
    """Print what was found: the mean error of each layout, the recommended one, the notes."""
    from ..pipeline.studying_layouts import describe_markers

    bands = study.tables["bootstrap"]
    solved = bands[bands["reconstruction"] == "solver"]
    # Errors on unseen actors where there are any.
    tested = "unseen" if (solved["tested"] == "unseen").any() else "training"
    table = solved[solved["tested"] == tested][["layout", "K", "n_pairs", "mean_mm", "low", "high"]]
    markers = describe_markers(study)
    if as_json:
        found = {
            "recommended": study.recommended,
            "markers": markers.to_dict("records"),
            "tested_on": tested,
            "errors": json.loads(table.to_json(orient="records")),
            "notes": list(study.notes),
            "parameters": study.parameters,
            "written": [str(path) for path in written],
            "stored": stored,
        }
        print(json.dumps(found, indent=2, ensure_ascii=False, default=str))
        return
    print(f"mean error of a vertex, mm, on {tested} actors, default solver")
    print_table(table, as_json=False)
    print(f"\nrecommended: {study.recommended} ({len(markers)} markers, {len(study.head_markers)} of them on the head)")
    for note in study.notes:
        print(f"note: {note}")
    if written:
        print("written: " + ", ".join(map(str, written)))
    if stored:
        print(stored)
