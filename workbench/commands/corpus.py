"""Commands about the corpus itself: ``init``, ``ingest``, ``rig add``, ``log``, ``show``, ``tag``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from . import rigs
from .options import At, Author, Branch, CorpusPath, Json, print_record, print_table

rig_app = typer.Typer(help="Rigs of a corpus.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("init")(init)
    app.command("ingest")(ingest)
    rigs.register(rig_app)
    app.add_typer(rig_app, name="rig")
    app.command("log")(log)
    app.command("show")(show)
    app.command("tag")(tag)


def init(
    corpus: CorpusPath,
    name: Annotated[str | None, typer.Option(help="What the corpus is called; the folder's name by default.")] = None,
    author: Author = None,
) -> None:
    """Make an empty corpus in a new folder."""
    from ...corpus import Corpus

    made = Corpus.create(corpus, name=name, author=author)
    print(f"{corpus}: corpus {made.name!r}, snapshot {made.snapshot}")


def ingest(
    corpus: CorpusPath,
    files: Annotated[
        list[Path] | None,
        typer.Argument(help="Recordings (.c3d, .trc) and annotations (.eaf, .TextGrid).", metavar="FILES"),
    ] = None,
    signer: Annotated[str | None, typer.Option(help="Code of the person recorded.")] = None,
    protocol: Annotated[str | None, typer.Option(help="Code of what was asked: IE, SE, IGE, EU, ROM …")] = None,
    head_markers: Annotated[
        str | None, typer.Option(help="Markers on the skull, at least three: A,B,C.", metavar="A,B,C")
    ] = None,
    neutral: Annotated[int | None, typer.Option(help="A frame in which the face is neutral, if known.")] = None,
    recordings: Annotated[
        Path | None,
        typer.Option(
            "--list", help="CSV of recordings: file,tiers,signer,protocol,head_markers,neutral.", metavar="CSV"
        ),
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Let another take of the same name give way.")] = False,
    author: Author = None,
    branch: Branch = None,
    as_json: Json = False,
) -> None:
    """Read recordings and annotations into the corpus.

    Each take is named after its file. The same bytes again change nothing. Annotations belong to the take of the same
    name.
    """
    from ...corpus import Corpus
    from ...errors import InputError
    from ..pipeline.ingesting import ingest as run
    from ..pipeline.ingesting import plan_recordings, read_recording_list, split_names
    from ..progress import ConsoleReporter

    plan = plan_recordings(
        files or [], signer=signer, protocol=protocol, head_markers=split_names(head_markers), neutral=neutral
    )
    if recordings is not None:
        plan += read_recording_list(recordings)
    if not plan:
        raise InputError("nothing to ingest; name recordings, or a list of them with --list")
    table = run(Corpus.open(corpus, at=branch), plan, replace=replace, author=author, reporter=ConsoleReporter())
    print_table(table, as_json)


@rig_app.command("add")
def rig_add(
    corpus: CorpusPath,
    name: Annotated[str, typer.Argument(help="What the rig is called in the corpus.", metavar="NAME")],
    path: Annotated[
        str,
        typer.Argument(help="Folder of OBJ files, .npz, .glb or .gltf; 'avatar' for the embedded one.", metavar="PATH"),
    ],
    unit: Annotated[str | None, typer.Option(help="Unit of its lengths: mm, cm, dm, m, in.")] = None,
    markers: Annotated[Path | None, typer.Option(help="CSV with the columns marker,vertex.", metavar="MAP.csv")] = None,
    marker_map: Annotated[str, typer.Option("--map", help="Name of the marker map.")] = "default",
    author: Author = None,
    branch: Branch = None,
) -> None:
    """Add a rig, and which of its vertices each marker sits on."""
    from ...corpus import Corpus
    from ..pipeline.rigging import add_rig

    print(
        add_rig(
            Corpus.open(corpus, at=branch),
            name,
            path,
            unit=unit,
            marker_map=markers,
            map_name=marker_map,
            author=author,
        )
    )


def log(corpus: CorpusPath, at: At = None, as_json: Json = False) -> None:
    """List the commits, the newest first."""
    from ...corpus import Corpus

    opened = Corpus.open(corpus, at=at)
    table = opened.history()
    tags: dict[str, list[str]] = {}
    for tag_name, snapshot in opened.tags().items():
        tags.setdefault(snapshot, []).append(tag_name)
    table["tags"] = [", ".join(tags.get(snapshot, [])) for snapshot in table["snapshot"]]
    if not as_json:
        table["time"] = table["time"].dt.strftime("%Y-%m-%d %H:%M:%S")
    print_table(table, as_json)


def show(
    corpus: CorpusPath,
    take: Annotated[str | None, typer.Argument(help="Name of a take; all takes if left out.", metavar="[TAKE]")] = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Show what the corpus, or one take, holds."""
    from ...corpus import Corpus
    from ..pipeline.describing import describe_corpus, describe_take

    opened = Corpus.open(corpus, at=at)
    if take is not None:
        print_record(describe_take(opened, take), as_json)
        return
    if not as_json:
        print_record(describe_corpus(opened), as_json)
        print()
    columns = ["take", "signer", "protocol", "rate", "seconds", "markers", "solve"]
    print_table(opened.takes()[columns], as_json, empty="no takes yet")


def tag(
    corpus: CorpusPath,
    name: Annotated[
        str | None, typer.Argument(help="Of the tag; lists the tags if left out.", metavar="[NAME]")
    ] = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Name a snapshot for good, or list the names.

    Commands that read take ``--at NAME``.
    """
    import pandas as pd

    from ...corpus import Corpus

    opened = Corpus.open(corpus)
    if name is None:
        rows = sorted(opened.tags().items())
        print_table(pd.DataFrame(rows, columns=["tag", "snapshot"]), as_json, empty="no tags yet")
        return
    print(f"{name} is snapshot {opened.create_tag(name, at=at)}")
