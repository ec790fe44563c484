"""The demo, shortened: every stage on simulated signers."""

import re

import pytest
from mimique.corpus import Corpus
from mimique.errors import ConflictError
from mimique.workbench.demo import run_demo


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo") / "out"
    return out, run_demo(out, seconds=60.0)


def test_it_leaves_what_it_says(made):
    out, text = made
    assert (out / "report.html").stat().st_size > 100_000
    assert (out / "film.mp4").stat().st_size > 10_000, text
    corpus = Corpus.open(out / "corpus", at="demo")
    takes = corpus.takes()
    assert 50 < takes["seconds"].sum() < 70
    assert set(takes["protocol"]) == {"IE", "SE", "IGE", "EU"}
    assert (takes["solve"] == "avatar-lsts").all()
    assert takes["signer"].nunique() == 2


def test_the_report_says_simulated_and_shows_the_evaluation(made):
    page = (made[0] / "report.html").read_text(encoding="utf-8")
    assert page.count("imulated") > 10
    for part in ("Table B.1", "Figure 4.4", "random-forest"):
        assert part in page


def test_labels_beat_the_most_frequent_one(made):
    """Not a figure of merit: the simulated signers are learnable, and the path from file to label loses nothing."""
    found = re.search(r"best\s+\S+ (\d+)% .*majority (\d+)%", made[1])
    assert int(found[1]) > int(found[2]) + 10


def test_a_folder_of_something_else_is_kept(tmp_path):
    (tmp_path / "thesis.txt").write_text("do not touch")
    with pytest.raises(ConflictError, match="something else"):
        run_demo(tmp_path)
    assert (tmp_path / "thesis.txt").read_text() == "do not touch"
