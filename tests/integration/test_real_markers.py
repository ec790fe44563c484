"""Real markers of a real face, from file to film."""

import numpy as np
import pytest
from mimique.corpus import Corpus
from mimique.synthesis import Rig
from mimique.workbench.cli import run

HEAD = "ForeHead_M,ForeHead_L,ForeHead_R,NoseTop"


@pytest.fixture(scope="module")
def corpus(shared_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("real")
    path = folder / "corpus"
    table = __file__.replace("integration/test_real_markers.py", "data/animface_ict_markers.csv")
    takes = sorted((shared_data / "facial_markers").glob("*.trc"))
    for line in (
        ["init", path],
        ["rig", "add", path, "ict", shared_data / "ict_facekit" / "rig.npz", "--unit", "cm", "--markers", table],
        ["ingest", path, *takes, "--signer", "x", "--protocol", "ROM", "--head-markers", HEAD],
        ["solve", path],
        ["segment", path],
    ):
        assert run([str(word) for word in line]) == 0
    return path


def test_brow_and_eye_shapes_move_in_the_eyebrow_take(corpus):
    opened = Corpus.open(corpus)
    rig = Rig.from_dataset(opened.rig("ict"))
    size = np.linalg.norm(rig.deltas.reshape(rig.n_shapes, -1), axis=1)
    upper = np.array([name.startswith(("brow", "eye")) for name in rig.shapes])
    share = {}
    for take in opened.takes()["take"]:
        motion = np.nanstd(opened.weights(take)["weights"].values, axis=0) * size
        share[take] = motion[upper].sum() / motion.sum()
    others = max(share["animface_nose"], share["animface_cheeks"])
    assert share["animface_eyebrows"] >= 3 * others


def test_the_solved_face_follows_the_markers(corpus):
    opened = Corpus.open(corpus)
    for take in opened.takes()["take"]:
        solve = opened.current_solve(take)
        residual = opened.weights(take)["residual"].values
        adapted = opened.processed(take, f"adapted-{solve}")["position"].values
        motion = np.sqrt(((adapted - np.median(adapted, axis=0)) ** 2).sum(axis=2).mean(axis=1))
        assert np.median(residual) < 2.5
        busy = motion > np.quantile(motion, 0.8)
        assert np.median(residual[busy]) < 0.8 * np.median(motion[busy])


def test_a_film_of_a_real_take(corpus, tmp_path):
    film = tmp_path / "brows.mp4"
    words = ["play", corpus, "animface_eyebrows", "--movie", film, "--seconds", "0.4", "--size", "320x180"]
    assert run([str(word) for word in words]) == 0
    assert film.stat().st_size > 1000
