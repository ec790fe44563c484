"""Scenes, weights, markers, curves and rigs as the page gets them."""

import threading

import numpy as np
import pytest
import xarray as xr
from mimique.corpus import Corpus
from mimique.corpus.store.lazy_arrays import StoredArray
from mimique.corpus.take import make_take
from mimique.errors import InputError
from mimique.features import motion_energy
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.avatar import build_avatar
from mimique.workbench.pipeline.rig_weights import read_rig_weights
from mimique.workbench.review.showing import rig_model
from mimique.workbench.review.showing.routes import router
from mimique.workbench.review.showing.showing import find_showing, warm
from mimique.workbench.review.showing.shown_weights import open_weights

from .review_corpus import make_review_corpus
from .showing_app import make_client, make_review

TAKE = "ab_IE_1"
ODD = ("", "/", "..", "../..", "%", "%2e%2e", "a\nb", "\0", "é😀", "x" * 10_000, "takes/ab_IE_1", "'; --", "null", " ")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("showing")
    corpus = make_review_corpus(folder / "corpus", takes=(TAKE, "odd/.. %é\n😀"), n_frames=900)
    rng = np.random.default_rng(1)
    names = ["jawOpen", "browInnerUp_L", "browInnerUp_R", "HeadYaw", "mouthSmile_L"]
    values = rng.uniform(0, 1, (900, len(names)))
    values[400:410] = np.nan
    elsewhere = xr.Dataset(
        {"weights": (("time", "shape"), values)}, {"shape": names}, {"angles": ["HeadYaw"], "rig": "avatar"}
    )
    bare = make_take(np.zeros((50, 2, 3)), ["a", "b"], 5.0, signer="ef")
    with corpus.transaction("Add more", author="test") as edit:
        edit.put_weights(TAKE, elsewhere, solve="phone", current=False)
        edit.put_take("bare", bare)
        edit.put_take("slow", bare)
        edit.put_weights("slow", np.zeros((50, 51)), shapes=build_avatar().shapes, rig="avatar", method="map")
    return folder


@pytest.fixture
def review(place):
    return make_review(place / "corpus", place / "corpus.review")


@pytest.fixture
def client(review):
    return make_client(review, router)


def floats(answer):
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/octet-stream"
    return np.frombuffer(answer.content, dtype="<f4")


def test_a_scene_says_what_there_is(client):
    scene = client.get("/api/scene", params={"take": TAKE}).json()
    avatar = build_avatar()
    assert (scene["take"], scene["signer"], scene["protocol"], scene["simulated"]) == (TAKE, "ab", "IE", True)
    assert (scene["rate"], scene["frames"], scene["seconds"]) == (200.0, 900, 4.5)
    assert (scene["solve"], scene["solves"], scene["rig"]) == ("avatar-map", ["avatar-map", "phone"], "avatar")
    assert scene["shapes"] == list(avatar.shapes) and len(scene["markers"]) == 46
    assert [one["name"] for one in scene["curves"]] == ["velocity", "acceleration", "level", "residual"]
    assert scene["problem"] is None and scene["videos"] == []
    assert scene["residual"]["threshold"] >= 1.0
    assert scene["residual"]["stretches"] == [[300, 320]]


def test_the_strongest_shapes_are_those_that_vary_most(client, review):
    scene = client.get("/api/scene", params={"take": TAKE, "solve": "phone"}).json()
    whole = read_rig_weights(review.corpus(), TAKE, solve="phone")
    spread = np.nanstd(whole.weights, axis=0)
    expected = [whole.rig.shapes[n] for n in np.argsort(-spread, kind="stable")[:8] if spread[n] > 1e-6]
    assert scene["strongest"] == expected and expected


@pytest.mark.parametrize("solve", [None, "avatar-map", "phone"])
@pytest.mark.parametrize(("first", "count"), [(0, 900), (0, 1), (395, 30), (890, 100), (899, 8192)])
def test_weights_are_those_of_the_player(client, review, solve, first, count):
    whole = read_rig_weights(review.corpus(), TAKE, solve=solve).weights.astype(np.float32)
    found = floats(client.get("/api/weights", params={"take": TAKE, "first": first, "count": count, "solve": solve}))
    np.testing.assert_array_equal(found.reshape(-1, whole.shape[1]), whole[first : first + count])


def test_nothing_comes_beyond_the_end(client):
    assert floats(client.get("/api/weights", params={"take": TAKE, "first": 900, "count": 5})).size == 0


def test_only_the_asked_frames_are_read(client, monkeypatch):
    read = []
    original = StoredArray._read

    def spy(self, key):
        read.append((self.path, len(range(self.shape[0])[key[0]])))
        return original(self, key)

    monkeypatch.setattr(StoredArray, "_read", spy)
    for what in ("weights", "markers"):
        read.clear()
        floats(client.get(f"/api/{what}", params={"take": TAKE, "first": 100, "count": 7}))
        assert [n for _, n in read] == [7], read


def test_markers_lie_on_the_posed_rig(client, review):
    scene = client.get("/api/scene", params={"take": TAKE}).json()
    found = floats(client.get("/api/markers", params={"take": TAKE, "first": 200, "count": 10})).reshape(10, -1, 3)
    take = review.corpus().take(TAKE)
    assert scene["markers"] == [str(name) for name in take["marker"].values]
    np.testing.assert_allclose(found, take["position"].values[200:210], atol=1e-4)


def test_weights_from_elsewhere_have_no_markers(client):
    answer = client.get("/api/markers", params={"take": TAKE, "first": 0, "count": 10, "solve": "phone"})
    assert floats(answer).size == 0


@pytest.mark.parametrize("solve", ["avatar-map", "phone"])
def test_curves_are_those_of_the_whole_take(client, review, solve):
    whole = read_rig_weights(review.corpus(), TAKE, solve=solve)
    energy = motion_energy(whole.weights, 200.0)
    for name in ("velocity", "acceleration", "level"):
        found = floats(client.get("/api/curve", params={"take": TAKE, "solve": solve, "curve": name}))
        np.testing.assert_allclose(found, getattr(energy, name), rtol=1e-5, atol=1e-5)
    shape = floats(client.get("/api/curve", params={"take": TAKE, "solve": solve, "curve": "jawOpen"}))
    np.testing.assert_array_equal(shape, whole.weights[:, whole.rig.index("jawOpen")].astype(np.float32))


def test_the_residual_is_a_curve(client, review):
    found = floats(client.get("/api/curve", params={"take": TAKE, "curve": "residual"}))
    np.testing.assert_allclose(found, review.corpus().weights(TAKE)["residual"].values, rtol=1e-6)
    missing = client.get("/api/curve", params={"take": TAKE, "solve": "phone", "curve": "residual"})
    assert missing.status_code == 404


def test_a_slow_take_has_no_energies(client):
    scene = client.get("/api/scene", params={"take": "slow"}).json()
    assert scene["curves"] == [] and scene["strongest"] == []
    answer = client.get("/api/curve", params={"take": "slow", "curve": "level"})
    assert answer.status_code == 404 and "no curve 'level'" in answer.json()["error"]["message"]


def test_a_take_without_weights_names_the_command(client, place):
    scene = client.get("/api/scene", params={"take": "bare"}).json()
    assert scene["solve"] is None and scene["shapes"] == [] and scene["frames"] == 50
    assert scene["problem"]["command"] == f"mimique solve {place / 'corpus'}"
    answer = client.get("/api/weights", params={"take": "bare", "first": 0, "count": 1})
    assert answer.status_code == 404 and answer.json()["error"]["kind"] == "no-weights"


def test_a_corpus_without_rig_names_the_command(tmp_path):
    corpus = Corpus.create(tmp_path / "my corpus")
    with corpus.transaction("Add") as edit:
        edit.put_take("one", make_take(np.zeros((5, 1, 3)), ["a"], 100.0))
        edit.put_take("two", make_take(np.zeros((5, 1, 3)), ["a"], 100.0))
        edit.put_weights("two", np.zeros((5, 1)), shapes=["jawOpen"])
    client = make_client(make_review(tmp_path / "my corpus", tmp_path / "review"), router)
    problem = client.get("/api/scene", params={"take": "one"}).json()["problem"]
    assert problem["command"] == f"mimique rig add '{tmp_path}/my corpus' NAME FILE"
    without = client.get("/api/scene", params={"take": "two"}).json()
    assert "no rig" in without["problem"]["message"] and without["solves"] and without["frames"] == 5


def test_the_rig_is_the_corpus_rig_in_metres(client, tmp_path):
    answer = client.get("/api/rig", params={"rig": "avatar"})
    assert answer.status_code == 200 and answer.headers["content-type"] == "model/gltf-binary"
    (tmp_path / "rig.glb").write_bytes(answer.content)
    found, avatar = read_rig(tmp_path / "rig.glb"), build_avatar()
    assert found.shapes == avatar.shapes
    np.testing.assert_allclose(found.neutral, avatar.neutral, atol=1e-3)
    tag = answer.headers["etag"]
    again = client.get("/api/rig", params={"rig": "avatar"}, headers={"If-None-Match": tag})
    assert again.status_code == 304 and again.content == b"" and again.headers["etag"] == tag


def test_a_rig_is_made_once_for_all_who_ask(review, tmp_path, monkeypatch):
    review.folder = tmp_path
    made, start = [], threading.Barrier(6)
    original = rig_model.write_gltf
    monkeypatch.setattr(rig_model, "write_gltf", lambda *a, **k: (made.append(a), original(*a, **k))[1])
    client = make_client(review, router)

    def ask():
        start.wait()
        answers.append(client.get("/api/rig", params={"rig": "avatar"}).content)

    answers = []
    threads = [threading.Thread(target=ask) for _ in range(6)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(made) == 1 and len(set(answers)) == 1


def test_warming_makes_the_rigs_and_drops_what_is_of_no_use(review, client, tmp_path):
    review.folder = tmp_path
    client.get("/api/curve", params={"take": TAKE, "curve": "level"})
    client.get("/api/scene", params={"take": TAKE})
    shown = find_showing(review).files.folder
    kept = {path.name for path in shown.iterdir()}
    (shown / f"{'0' * 64}.npy").write_bytes(b"of a signer who was forgotten")
    warm(review)
    after = {path.name for path in shown.iterdir()}
    assert kept < after and set(after - kept) == {p.name for p in shown.glob("*.glb")}


def test_a_full_folder_is_one_line(review, tmp_path):
    (tmp_path / "file").write_text("no folder")
    review.folder = tmp_path / "file"
    client = make_client(review, router)
    answer = client.get("/api/rig", params={"rig": "avatar"})
    assert answer.status_code == 503 and "cannot be kept" in answer.json()["error"]["message"]
    # Curves need no file, they are only slower without.
    assert floats(client.get("/api/curve", params={"take": TAKE, "curve": "level"})).size == 900


def test_no_consent_shows_nothing(tmp_path):
    corpus = make_review_corpus(tmp_path / "corpus", takes=(TAKE,), n_frames=300)
    with corpus.transaction("Withdraw") as edit:
        edit.put_signer("ab", {"consent": "none"})
    client = make_client(make_review(tmp_path / "corpus", tmp_path / "review"), router, is_lead=True)
    asked = {
        "scene": {}, "weights": {"first": 0, "count": 1}, "markers": {"first": 0, "count": 1},
        "curve": {"curve": "level"}, "video": {"index": 0},
    }  # fmt: skip
    for what, parameters in asked.items():
        answer = client.get(f"/api/{what}", params={"take": TAKE, **parameters})
        assert answer.status_code == 403 and answer.json()["error"]["kind"] == "forbidden", what
        assert "consent" in answer.json()["error"]["message"]


@pytest.mark.parametrize("odd", ODD)
def test_odd_names_are_not_found(client, odd):
    for answer in (
        client.get("/api/scene", params={"take": odd}),
        client.get("/api/rig", params={"rig": odd}),
        client.get("/api/weights", params={"take": odd, "first": 0, "count": 1}),
        client.get("/api/markers", params={"take": odd, "first": 0, "count": 1}),
        client.get("/api/curve", params={"take": TAKE, "curve": odd}),
        client.get("/api/video", params={"take": odd, "index": 0}),
    ):
        assert answer.status_code in (404, 422), answer.text
        assert "\n" not in answer.json()["error"]["message"]
    solve = client.get("/api/scene", params={"take": TAKE, "solve": odd})
    assert solve.status_code in ((200,) if not odd else (404, 422))


@pytest.mark.parametrize(
    "query", [{"first": -1}, {"count": 0}, {"count": 8193}, {"first": "x"}, {"first": "9" * 5000}, {"first": 2**40}]
)
def test_frames_out_of_range_are_refused(client, query):
    answer = client.get("/api/weights", params={"take": TAKE, "first": 0, "count": 1, **query})
    assert answer.status_code == 422 and answer.json()["error"]["kind"] == "input"


def test_takes_with_odd_names_are_shown(client):
    name = "odd/.. %é\n😀"
    assert client.get("/api/scene", params={"take": name}).json()["take"] == name
    assert floats(client.get("/api/weights", params={"take": name, "first": 0, "count": 2})).size == 2 * 51


def test_weights_that_name_no_rig_move_the_rig_that_has_their_shapes(tmp_path):
    names = ("browUp", "jawOpen", "smile")
    neutral, triangles = np.eye(3) * 10, np.array([[0, 1, 2]])
    corpus = Corpus.create(tmp_path / "corpus")
    with corpus.transaction("Add") as edit:
        for rig, shapes in (("a", ("x", "y")), ("b", names[:1]), ("c", names)):
            edit.put_rig(rig, Rig(neutral, triangles, np.ones((len(shapes), 3, 3)), shapes).to_dataset())
        edit.put_take("t", make_take(np.empty((40, 0, 3)), [], 60.0, without_markers=True))
        edit.put_weights("t", np.zeros((40, 3)), shapes=names, solve="tracker")
        edit.put_take("u", make_take(np.empty((40, 0, 3)), [], 60.0, without_markers=True))
        edit.put_weights("u", np.zeros((40, 1)), shapes=["nothing alike"], solve="tracker")
    assert open_weights(corpus, "t").rig == "c"
    with pytest.raises(InputError, match="none of the rigs a, b, c has their shapes"):
        open_weights(corpus, "u")
