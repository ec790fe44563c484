"""The house: folders, packages, layers and imports agree."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import mimique
import pytest

ROOT = Path(mimique.__file__).parent
SOURCE_FOLDERS = ("corpus", "features", "models", "synthesis", "workbench")
MAY_IMPORT = {
    "corpus": set(),
    "features": set(),
    "synthesis": set(),
    "models": {"features", "synthesis"},
    "workbench": {"corpus", "features", "models", "synthesis"},
}


def source_files():
    return sorted(path for folder in SOURCE_FOLDERS for path in (ROOT / folder).rglob("*.py"))


def test_package_list_matches_the_folders():
    with (ROOT / "pyproject.toml").open("rb") as file:
        listed = tomllib.load(file)["tool"]["setuptools"]["packages"]
    found = {"mimique"} | {
        ".".join(("mimique", *path.parent.relative_to(ROOT).parts))
        for path in source_files()
        if path.name == "__init__.py"
    }
    assert sorted(listed) == sorted(found)


@pytest.mark.parametrize("path", source_files(), ids=lambda p: str(p.relative_to(ROOT)))
def test_layers_import_only_what_they_may(path):
    parts = path.relative_to(ROOT).parts
    depth = len(parts) - 1
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert not any(alias.name.split(".")[0] == "mimique" for alias in node.names), "use a relative import"
        if isinstance(node, ast.ImportFrom):
            if node.level == 0:
                assert (node.module or "").split(".")[0] != "mimique", "use a relative import"
            elif node.level == depth + 1 and node.module:
                other = node.module.split(".")[0]
                if other in MAY_IMPORT and other != parts[0]:
                    assert other in MAY_IMPORT[parts[0]], f"{parts[0]} may not import {other}"


def test_import_does_nothing_visible():
    """Importing prints nothing and loads neither VTK nor torch, so that commands start quickly."""
    code = (
        "import sys, mimique.corpus, mimique.synthesis, mimique.features, mimique.models, mimique.workbench.cli;"
        "heavy = {'vtk', 'vtkmodules', 'pyvista', 'torch'} & set(sys.modules); assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_works_beside_other_packages_called_models(tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "__init__.py").write_text("raise RuntimeError('the wrong models')")
    code = "from mimique.models import metrics; print(metrics.__name__)"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "mimique.models.metrics", done.stderr
