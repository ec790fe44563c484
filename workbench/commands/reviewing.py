"""Commands of reviewing: ``review`` (the page), ``reviewer`` (who may log in), ``queue`` (what to look at first)."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import pandas as pd
import typer

from .options import At, Author, CorpusPath, Json, Signers, TakeNames, print_table

if TYPE_CHECKING:
    from ..review.people.accounts import Accounts

reviewer_app = typer.Typer(help="People who log in to the review page by name.", no_args_is_help=True)

PersonName = Annotated[str, typer.Argument(help="Name of the person; the author of their tiers.", metavar="NAME")]
PasswordFromInput = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password from standard input, one line, instead of asking.")
]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command("review")(review)
    reviewer_app.command("add")(add_reviewer)
    reviewer_app.command("list")(list_reviewers)
    reviewer_app.command("remove")(remove_reviewer)
    reviewer_app.command("password")(change_password)
    app.add_typer(reviewer_app, name="reviewer")
    app.command("queue")(queue)


def review(
    corpus: CorpusPath,
    host: Annotated[
        str | None,
        typer.Option(
            help="Listen at this address for people who log in by name (see 'mimique reviewer'); 0.0.0.0 for all of "
            "this computer's. Without it only this computer is let in, by a token in the opened address.",
            metavar="ADDRESS",
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(help="The port; a free one by default, the same as last time if it is free.", min=1, max=65535),
    ] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open the browser.")] = False,
    author: Author = None,
    certificate: Annotated[
        Path | None, typer.Option(help="Serve https with this certificate (PEM).", metavar="FILE")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="The certificate's key (PEM).", metavar="FILE")] = None,
    name: Annotated[
        list[str] | None,
        typer.Option(
            "--name", help="A name that the server is known by besides its own, as a proxy's.", metavar="NAME"
        ),
    ] = None,
) -> None:
    """Review labels in the browser: check, correct and publish them; until Ctrl-C."""
    from ...corpus.store.repository import commit_metadata
    from ..review.server.running import Serving, run_server

    if host is not None and author is not None:
        raise typer.BadParameter("with --host everybody is the author of their own edits; leave --author out")
    # Whom a commit would name: --author, MIMIQUE_AUTHOR, the login name.
    owner = commit_metadata(None, None, author=author, base="")["author"]
    if host not in (None, "127.0.0.1", "::1", "localhost") and certificate is None:
        _tell("mimique: without --certificate passwords and data travel unencrypted; use it in a network you trust")
    run_server(
        Serving(corpus, host, port, owner, certificate, key, tuple(name or ())),
        say=_tell,
        open_browser=not no_browser,
    )


def add_reviewer(
    corpus: CorpusPath,
    name: PersonName,
    lead: Annotated[
        bool, typer.Option("--lead", help="They may plan double coding, settle disagreements and manage accounts.")
    ] = False,
    password_stdin: PasswordFromInput = False,
) -> None:
    """Let somebody log in to the review page."""
    from ...corpus import Corpus
    from ..review.people.accounts import check_free_name, check_name

    name = check_name(name)
    check_free_name(Corpus.open(corpus), name)
    with _open_accounts(corpus) as accounts:
        account = accounts.add(name, _ask_password(name, password_stdin), is_lead=lead)
    print(f"{account.person}: may log in{' and is a lead' if account.is_lead else ''}")


def list_reviewers(corpus: CorpusPath, as_json: Json = False) -> None:
    """List who may log in, or might once."""
    with _open_accounts(corpus) as accounts:
        rows = [(one.person, one.is_lead, one.is_active) for one in accounts.list()]
    table = pd.DataFrame(rows, columns=["person", "is_lead", "is_active"])
    print_table(table, as_json, empty="nobody; add somebody with 'mimique reviewer add'")


def remove_reviewer(corpus: CorpusPath, name: PersonName) -> None:
    """Let somebody in no more; their edits stay."""
    with _open_accounts(corpus) as accounts:
        accounts.remove(name)
    print(f"{name}: may not log in any more; their edits stay")


def change_password(corpus: CorpusPath, name: PersonName, password_stdin: PasswordFromInput = False) -> None:
    """Give somebody another password; they must log in again."""
    with _open_accounts(corpus) as accounts:
        account = accounts.find(name)
        accounts.change(name, password=_ask_password(account.person, password_stdin))
    print(f"{account.person}: has another password, and is logged out everywhere")


@contextmanager
def _open_accounts(corpus: Path) -> Iterator[Accounts]:
    from ...corpus import Corpus
    from ..review.context import open_database
    from ..review.people.accounts import Accounts

    database = open_database(Corpus.open(corpus).path)
    try:
        yield Accounts(database)
    finally:
        database.close()


def _ask_password(name: str, from_input: bool) -> str:
    if from_input:
        return sys.stdin.readline().rstrip("\r\n")
    return str(typer.prompt(f"Password of {name}", hide_input=True, confirmation_prompt=True))


def _tell(line: str) -> None:
    print(line, flush=True)


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
