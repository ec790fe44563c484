"""What is shown of a take of a corpus: its markers in all their forms, two takes on one clock, films and sheets."""

import numpy as np
import pytest
from mimique.corpus import Corpus
from mimique.errors import MimiqueError, NotFoundError
from mimique.synthesis.drawing import open_plotter
from mimique.workbench import cli
from mimique.workbench.pipeline.playing import parse_size, prepare_beside, prepare_performance
from PIL import Image

from .small_face import HEAD, make_rig, make_weights, marker_vertices, write_performance, write_rig


def run(words):
    """Run the program and return its exit status."""
    return cli.run([str(word) for word in words])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A corpus with one solved take, solved in two ways."""
    folder = tmp_path_factory.mktemp("playing")
    rig, table = write_rig(folder)
    write_performance(folder / "joy.trc", make_weights([(0.6, {"mouthSmile_L": 0.8, "jawOpen": 0.5})]))
    corpus = folder / "corpus"
    assert run(["init", corpus]) == 0
    assert run(["rig", "add", corpus, "face", rig, "--unit", "cm", "--markers", table]) == 0
    assert run(["ingest", corpus, folder / "joy.trc", "--signer", "s1", "--head-markers", ",".join(HEAD)]) == 0
    assert run(["solve", corpus, "--method", "nnls"]) == 0
    assert run(["solve", corpus, "--method", "bounded"]) == 0
    return folder


@pytest.fixture(scope="module")
def corpus(folder):
    return Corpus.open(folder / "corpus")


def test_adapted_fitted_and_raw_markers_lie_where_they_should(corpus):
    shown = prepare_performance(corpus, "joy")
    stored = corpus.processed("joy", "adapted-face-bounded")
    np.testing.assert_allclose(shown.markers, stored["position"].values, atol=1e-6)
    vertices = marker_vertices(make_rig())
    names = [str(name) for name in stored["marker"].values]
    np.testing.assert_array_equal(shown.marker_vertices, [vertices[name] for name in names])
    # The fitted markers are the rig's vertices; their distances are the residuals that the solve stored.
    frame = 120
    np.testing.assert_allclose(shown.fitted_at(frame), shown.rig.pose(shown.weights[frame])[shown.marker_vertices])
    rms = np.sqrt(np.nanmean(shown.residuals_at(frame) ** 2))
    assert rms == pytest.approx(float(corpus.weights("joy")["residual"].values[frame]), rel=1e-3)
    # The raw ones are the signer's, moved and turned but never stretched: distances stay as recorded.
    stabilised = corpus.processed("joy", "stabilised")["position"].values[frame]
    assert shown.raw_markers.shape[1:] == stabilised.shape
    seen = np.isfinite(stabilised).all(axis=1)
    one, two = (np.linalg.norm(np.diff(p[seen], axis=0), axis=1) for p in (stabilised, shown.raw_markers[frame]))
    np.testing.assert_allclose(one, two, rtol=1e-4)
    places = [list(corpus.take("joy")["marker"].values).index(name) for name in names]
    apart = np.linalg.norm(shown.raw_markers[0, places] - shown.rig.neutral[shown.marker_vertices], axis=1)
    assert np.nanmedian(apart) < 5  # another size, but in the rig's place


def test_another_solve_and_another_take_stand_beside(corpus):
    assert prepare_beside(corpus, "joy", ":face-nnls").note.endswith("face-nnls")
    assert prepare_beside(corpus, "else", "joy:face-nnls").title == "joy"
    with pytest.raises(NotFoundError):
        prepare_beside(corpus, "joy", "sadness")
    with pytest.raises(NotFoundError):
        prepare_beside(corpus, "joy", "joy:lsts")


@pytest.fixture
def drawing():
    try:
        open_plotter((64, 64), off_screen=True).close()
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")


def test_a_film_and_a_sheet_from_the_command_line(folder, drawing, capsys):
    film, sheet = folder / "joy.gif", folder / "joy.png"
    words = ["play", folder / "corpus", "joy", "--movie", film, "--sheet", sheet, "--every", "0.5", "--seconds", "0.4"]
    words += ["--size", "201x151", "--fps", "10", "--beside", ":face-nnls", "--heat", "residual", "--curves"]
    assert run([*words, "--markers", "beside", "--show", "raw,adapted,fitted,residuals"]) == 0
    said = capsys.readouterr().out
    assert "joy.gif: 0.4 s at 10 pictures per second" in said and "joy.png: " in said
    with Image.open(film) as pictures:
        assert pictures.size == (201, 151)
    with Image.open(sheet) as page:
        assert page.width > 400


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["--markers", "under"], "overlay, beside or none"),
        (["--show", "raw,boiled"], "boiled"),
        (["--heat", "fever"], "displacement or residual"),
        (["--camera", "back"], "front, three-quarter or side"),
        (["--movie", "film.avi"], ".mp4 or .gif"),
        (["--movie", "nowhere/film.gif"], "nowhere"),
        (["--sheet", "sheet.jpg"], ".png"),
        (["--sheet", "sheet.png", "--every", "0"], "positive"),
        (["--sheet", "sheet.png", "--beside", "sadness"], "sadness"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wishes_that_cannot_be_met_are_one_line(folder, words, part, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert run(["play", folder / "corpus", "joy", *words]) == 2
    error = capsys.readouterr().err
    assert part in error and len(error.strip().splitlines()) == 1
    assert not [p for p in folder.iterdir() if p.name.startswith((".", "film", "sheet"))]


def test_sizes():
    assert parse_size("1920x1080") == (1920, 1080)
