"""``rig show``: what a rig of the corpus is made of."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from .options import At, CorpusPath, Json, print_record, print_table


def register(rig_app: typer.Typer) -> None:
    """Add the command to ``mimique rig``."""
    rig_app.command("show")(rig_show)


def rig_show(
    corpus: CorpusPath,
    name: Annotated[str, typer.Argument(help="Name of the rig.", metavar="RIG")],
    at: At = None,
    as_json: Json = False,
) -> None:
    """Show a rig's parts and shapes, their ARKit names, and what did not map."""
    from ...corpus import Corpus
    from ..pipeline.rig_description import describe_stored_rig

    summary, shapes, parts = describe_stored_rig(Corpus.open(corpus, at=at), name)
    if as_json:
        tables = {"shape_names": shapes.to_dict("records"), "part_sizes": parts.to_dict("records")}
        print(json.dumps(summary | tables, indent=2, ensure_ascii=False))
        return
    print_record({key: value for key, value in summary.items() if value != ""}, as_json=False)
    if len(parts) > 1:
        print()
        print_table(parts, as_json=False)
    print()
    print_table(shapes, as_json=False)
