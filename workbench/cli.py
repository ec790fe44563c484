"""The command line: ``mimique COMMAND``.

Each command is a thin wrapper: it parses, calls one function of the pipeline, prints. What a user can cause ends as
one line on standard error and exit code 2, with the corpus as it was.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer

from .. import __version__
from ..errors import MimiqueError
from .commands import (
    ancestry,
    checking,
    corpus,
    evaluation,
    exporting,
    labels,
    layouts,
    media,
    outputs,
    processing,
    reviewing,
    simulation,
    versions,
    vocabulary,
)
from .warning_lines import warnings_in_one_line

app = typer.Typer(
    name="mimique",
    help="A workbench for facial motion-capture corpora: from marker recordings to labelled segments to watch.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mimique {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: bool = typer.Option(False, "--version", callback=_show_version, is_eager=True, help="Print the version."),
) -> None:
    pass


for group in (
    simulation,
    corpus,
    media,
    checking,
    processing,
    labels,
    evaluation,
    layouts,
    reviewing,
    vocabulary,
    versions,
    ancestry,
    outputs,
    exporting,
):
    group.register(app)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code.

    Parameters
    ----------
    arguments
        Words after ``mimique``; those of the process by default.
    """
    try:
        with warnings_in_one_line():
            words = None if arguments is None else list(arguments)
            code = app(args=words, standalone_mode=False, prog_name="mimique")
    except MimiqueError as error:
        return _refuse(str(error))
    except typer.TyperException as error:
        context = getattr(error, "ctx", None)
        if message := error.format_message():
            place = context.command_path if context is not None else "mimique"
            return _refuse(f"{message.rstrip('.')}; see {place} --help")
        return 2
    except (KeyboardInterrupt, typer.Abort):
        code = 130
    if code == 130:  # typer turns Ctrl-C into this code
        return _refuse("interrupted; the corpus is as it was, and finished takes are reused by the next run")
    return int(code or 0)


def _refuse(text: str) -> int:
    print("mimique: " + " ".join(text.split()), file=sys.stderr)
    return 2


def main() -> None:
    """Entry point of the ``mimique`` program."""
    sys.exit(run())
