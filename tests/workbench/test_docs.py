"""The documentation says what the program does."""

import importlib.util
import re
from pathlib import Path

import mimique
import pytest
import typer
from mimique.workbench.cli import app

ROOT = Path(mimique.__file__).parent
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")])


@pytest.fixture(scope="module")
def reference():
    spec = importlib.util.spec_from_file_location("write_commands", ROOT / "docs" / "write_commands.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_command_reference_is_up_to_date(reference):
    written = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert written == reference.write_reference(), "run: python docs/write_commands.py"


def test_every_command_and_option_says_what_it_does(reference):
    for words, command in reference.list_commands(typer.main.get_command(app)):
        assert command.help, words
        for parameter in command.params:
            assert parameter.help, f"{words}: {parameter.name}"


def test_commands_in_the_pages_exist(reference):
    known = {words for words, _ in reference.list_commands(typer.main.get_command(app))}
    for page in PAGES:
        for block in re.findall(r"^```\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL):
            for line in re.findall(r"^mimique .*", block, flags=re.MULTILINE):
                words = line.split()
                assert {" ".join(words[:2]), " ".join(words[:3])} & known, f"{page.name}: {line}"


def test_links_and_pictures_in_the_pages_exist():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            assert target.startswith("https://") or (page.parent / target).exists(), f"{page.name}: {target}"
