"""Arguments and options that several commands share, so that they read the same everywhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

CorpusPath = Annotated[Path, typer.Argument(help="Folder of the corpus, or s3://bucket/prefix.", metavar="CORPUS")]
TakeName = Annotated[str, typer.Argument(help="Name of the take.", metavar="TAKE")]
TakeNames = Annotated[
    list[str] | None, typer.Option("--take", help="Only this take; may be given several times.", metavar="TAKE")
]
At = Annotated[str | None, typer.Option("--at", help="Read at this tag, branch or snapshot.", metavar="VERSION")]
Author = Annotated[
    str | None, typer.Option("--author", help="Who does this; MIMIQUE_AUTHOR or the login name by default.")
]
Branch = Annotated[
    str | None, typer.Option("--branch", help="Commit to this branch; main by default.", metavar="BRANCH")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for a script.")]
RigName = Annotated[str | None, typer.Option("--rig", help="Name of the rig; needed only if there are several.")]
SolveName = Annotated[str | None, typer.Option("--solve", help="Name of the solve; the take's current one by default.")]
Signers = Annotated[
    list[str] | None, typer.Option("--signer", help="Only takes of this signer; may be given several times.")
]
Annotator = Annotated[
    str | None, typer.Option(help="Whose tier 'affect' is the reference; who annotated most by default.")
]


def print_table(table: pd.DataFrame, as_json: bool, empty: str = "nothing") -> None:
    """Print a table for people, or as a JSON list of records."""
    if as_json:
        print(json.dumps(json.loads(table.to_json(orient="records", date_format="iso")), indent=2, ensure_ascii=False))
    elif table.empty:
        print(empty)
    else:
        print(table.to_string(index=False, na_rep="", float_format=lambda x: f"{x:.3f}".rstrip("0").rstrip(".")))


def print_record(record: dict[str, Any], as_json: bool) -> None:
    """Print one record for people, a line a field, or as JSON."""
    if as_json:
        print(json.dumps(record, indent=2, ensure_ascii=False, default=str))
        return
    width = max((len(key) for key in record), default=0)
    for key, value in record.items():
        print(f"{key:<{width}}  {value}")
