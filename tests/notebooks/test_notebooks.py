"""The notebooks run from the first cell to the last, on the small simulated corpus that they make themselves."""

import os
import subprocess
import sys
from pathlib import Path

import mimique
import pytest

NOTEBOOKS = sorted((Path(mimique.__file__).parent / "notebooks").glob("*.py"))


# What each prints of its result.
RESULTS = {
    "choosing_a_marker_layout": ("recommended (simulated): ", "mouth corner"),
    "reproducing_the_thesis_evaluation": ("random-forest",),
    "training_your_own_labeller": ("forest-merging",),
}


def test_all_notebooks_are_there():
    assert [path.stem for path in NOTEBOOKS] == list(RESULTS)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """Where the first notebook makes a corpus and the second finds it."""
    return tmp_path_factory.mktemp("notebooks") / "corpus"


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path, corpus):
    env = {**os.environ, "MIMIQUE_CORPUS": str(corpus), "MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1"}
    env["MIMIQUE_AUTHOR"] = "notebook"
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path)],
        env=env,
        cwd=corpus.parent,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert "(simulated)" in done.stdout
    for result in RESULTS[path.stem]:
        assert result in done.stdout, done.stdout


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_a_percent_script_that_tells_a_story(path):
    text = path.read_text(encoding="utf-8")
    cells = text.split("\n# %%")
    told = [cell for cell in cells if cell.startswith(" [markdown]")]
    assert len(told) >= 5
    assert len(cells) - len(told) >= 5
    assert "**simulated**" in text
