"""The page's own tests (vitest), and that the built copy is that of the sources."""

import os
import runpy
import subprocess
from pathlib import Path

import mimique
import pytest

PAGE = Path(mimique.__file__).parent / "workbench" / "review" / "page"


@pytest.fixture(scope="module")
def building():
    return runpy.run_path(str(PAGE / "build_page.py"))


def test_the_built_page_is_that_of_the_sources(building):
    if not building["is_built"]():
        pytest.skip("the review page is not built (MIMIQUE_SKIP_FRONTEND): run make page")
    assert building["is_fresh"](), "the review page was changed since it was built: run make page"


def test_units_of_the_page(building):
    vitest = PAGE / "node_modules" / "vitest" / "vitest.mjs"
    if not vitest.is_file():
        pytest.skip("the page's packages are not installed: run make page")
    node, _ = building["find_node"]()
    done = subprocess.run(
        [str(node), str(vitest), "run", "--reporter=dot"],
        cwd=PAGE,
        capture_output=True,
        text=True,
        env={**os.environ, "CI": "true", "NO_COLOR": "1"},
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
