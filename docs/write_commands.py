"""Write docs/commands.md, the reference of the command line, from the program itself."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import typer
from mimique.workbench.cli import app

PLACEHOLDERS = {int: "N", float: "NUMBER", Path: "PATH"}

HEAD = """# Commands

Written by `docs/write_commands.py` from the program itself; a test holds it up to date. `mimique COMMAND --help` says
the same.

Every command that changes a corpus is one commit, or changes nothing. What cannot be done ends with one line on
standard error and exit code 2. Results go to standard output, progress to standard error.
"""


def list_commands(group: Any, prefix: str = "mimique") -> list[tuple[str, Any]]:
    """Return the commands of a group and of its groups, with the words that call them, in the program's order."""
    found = []
    for name, command in group.commands.items():
        words = f"{prefix} {name}"
        found += list_commands(command, words) if hasattr(command, "commands") else [(words, command)]
    return found


def describe(words: str, command: Any) -> str:
    """Return a command's section."""
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]
    usage = " ".join([words, *(_metavar(p) for p in arguments), *(["[OPTIONS]"] if options else [])])
    lines = [f"## {words.removeprefix('mimique ')}", "", f"    {usage}", "", inspect.cleandoc(command.help or ""), ""]
    if options:
        lines += ["| option | meaning |", "|---|---|"]
        lines += [f"| `{_option(p)}` | {_escape(p.help or '')}{_default(p)} |" for p in options]
        lines.append("")
    if arguments:
        lines += [f"- `{_metavar(p)}`: {_escape(p.help or '')}" for p in arguments]
        lines.append("")
    return "\n".join(lines)


def _metavar(parameter: Any) -> str:
    name = parameter.metavar or parameter.name.upper()
    return name if parameter.required or name.startswith("[") else f"[{name}]"


def _option(parameter: Any) -> str:
    words = ", ".join(parameter.opts)
    value = parameter.metavar or PLACEHOLDERS.get(parameter.type_descriptor.annotation, "TEXT")
    return words if parameter.is_flag else f"{words} {value}"


def _default(parameter: Any) -> str:
    if parameter.is_flag or parameter.default in (None, "", ()) or callable(parameter.default):
        return ""
    return f" Default: {parameter.default}."


def _escape(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def write_reference() -> str:
    """Return the text of docs/commands.md."""
    sections = [describe(words, command) for words, command in list_commands(typer.main.get_command(app))]
    return HEAD + "\n" + "\n".join(sections).rstrip() + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("commands.md").write_text(write_reference(), encoding="utf-8")
