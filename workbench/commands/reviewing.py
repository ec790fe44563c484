"""The command that says what to review first: ``queue``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import At, CorpusPath, Json, Signers, TakeNames, print_table


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("queue")(queue)


def queue(
    corpus: CorpusPath,
    takes: TakeNames = None,
    signers: Signers = None,
    model: Annotated[str | None, typer.Option("--model", help="Only what this model proposed.")] = None,
    limit: Annotated[
        int | None, typer.Option("--limit", help="At most so many segments; all by default.", metavar="N")
    ] = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """List proposed labels to review, those first that are expected to be most worth a look.

    Each with how sure the model is, what else it could be, and what putting it right is expected to add to the macro
    F1. Changes nothing.
    """
    from ...corpus import Corpus
    from ..pipeline.queueing import queue_for_review
    from ..progress import ConsoleReporter

    table = queue_for_review(
        Corpus.open(corpus, at=at),
        takes=takes,
        signers=signers,
        model=model,
        limit=limit,
        reporter=ConsoleReporter(),
    )
    if not as_json:
        table = table.assign(gain=table["gain"].map(lambda gain: f"{gain:.5f}"))
    print_table(table, as_json)
