"""What the page is told of the corpus, and where its edits are kept."""

import pytest
from mimique.corpus import Corpus
from mimique.corpus.store.locking import lock_corpus
from mimique.errors import CorpusError
from mimique.workbench.review.context import open_review, review_folder
from mimique.workbench.review.server.app import create_app

from .page_client import PageClient
from .review_corpus import LABELS, make_review_corpus


@pytest.fixture(scope="module")
def corpus_path(tmp_path_factory):
    return make_review_corpus(tmp_path_factory.mktemp("listing") / "corpus", n_frames=400).path


@pytest.fixture(scope="module")
def app(corpus_path):
    review = open_review(corpus_path, owner="ab")
    yield create_app(review)
    review.close()


def test_the_corpus_is_listed(app, corpus_path):
    message = PageClient(app).get("/api/corpus").json()
    corpus = Corpus.open(corpus_path)
    assert (message["name"], message["snapshot"], message["rigs"]) == ("review", corpus.snapshot, ["avatar"])
    assert message["problems"] == []
    assert [row["take"] for row in message["takes"]] == ["ab_IE_1", "ab_SE_2", "cd_IE_1"]
    for row in message["takes"]:
        assert (row["rate"], row["frames"], row["seconds"], row["simulated"]) == (200.0, 400, 2.0, True)
        assert (row["mode"], row["refusal"], row["reviewed"], row["unpublished"]) == ("review", None, 0, 0)
        labels = corpus.tier(row["take"], "affect", "forest")["label"]
        assert row["proposed"] == int(labels.isin(list(LABELS)).sum()) < len(labels)  # transitions are not asked about


def test_a_take_that_is_coded_blind_tells_nothing(app):
    review, client = app.state.review, PageClient(app)
    with review.database.write() as connection:
        connection.execute("INSERT INTO coding (take, person, tier, done) VALUES ('ab_IE_1', 'cd', 'affect', 0)")
        connection.execute("INSERT INTO coding (take, person, tier, done) VALUES ('ab_SE_2', 'ab', 'affect', 1)")
        connection.execute("INSERT INTO coding (take, person, tier, done) VALUES ('ab_SE_2', 'cd', 'affect', 0)")
    try:
        rows = {row["take"]: row for row in client.get("/api/corpus").json()["takes"]}
        assert [rows[take]["mode"] for take in rows] == ["none", "blind", "review"]
        assert (rows["ab_IE_1"]["proposed"], rows["ab_SE_2"]["proposed"]) == (0, 0)
        assert [rows[take]["done"] for take in rows] == [False, True, False]
    finally:
        with review.database.write() as connection:
            connection.execute("DELETE FROM coding")


def test_a_corpus_that_cannot_be_shown_says_which_command_helps(tmp_path):
    folder = tmp_path / "a corpus"
    Corpus.create(folder, author="test")
    review = open_review(folder, owner="ab")
    client = PageClient(create_app(review))
    assert [one["command"] for one in client.get("/api/corpus").json()["problems"]] == [
        f"mimique ingest '{folder}' FILES"
    ]
    review.close()
    bare = make_review_corpus(tmp_path / "bare", takes=("ab_IE_1",), n_frames=200, weights=False)
    review = open_review(bare.path, owner="ab")
    client = PageClient(create_app(review))
    (problem,) = client.get("/api/corpus").json()["problems"]
    assert problem["command"] == f"mimique solve {bare.path}"
    with bare.transaction("The signer withdrew", author="test") as edit:  # seen at once, by everybody
        edit.put_signer("ab", {"consent": "none"})
    message = client.get("/api/corpus").json()
    assert "consent" in message["takes"][0]["refusal"]
    assert any("not shown" in one["message"] for one in message["problems"])
    review.close()


def test_a_locked_corpus_is_said_and_does_not_stop_anybody(app, corpus_path):
    client = PageClient(app)
    with lock_corpus(corpus_path, purpose="solve all"):
        (problem,) = client.get("/api/corpus").json()["problems"]
        assert "solve all" in problem["message"] and "Edits are kept" in problem["message"]
    assert client.get("/api/corpus").json()["problems"] == []


def test_the_corpus_in_use_never_moves_on(tmp_path):
    corpus = make_review_corpus(tmp_path / "corpus", takes=("ab_IE_1",), n_frames=200, weights=False)
    review = open_review(corpus.path, owner="ab")
    before = review.corpus()
    assert review.corpus() is before
    snapshot = before.snapshot
    with corpus.transaction("Without the take", author="test") as edit:
        edit.delete_take("ab_IE_1")
    after = review.corpus()
    assert after.snapshot == corpus.snapshot and not after.has_take("ab_IE_1")
    assert before.snapshot == snapshot and before.has_take("ab_IE_1")
    review.close()


def test_edits_are_kept_beside_the_corpus_or_among_the_users_data(tmp_path, monkeypatch):
    assert review_folder(tmp_path / "corpus") == tmp_path / "corpus.review"
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    folder = review_folder("s3://bucket/a/corpus")
    assert folder.parent == tmp_path / "data" / "mimique" and folder.suffix == ".review"
    assert review_folder("s3://bucket/another") != folder


def test_only_the_user_may_look_into_the_edits(app):
    assert app.state.review.folder.stat().st_mode & 0o077 == 0


def test_what_is_no_corpus_is_said_and_nothing_is_made(tmp_path):
    with pytest.raises(CorpusError, match="no such folder"):
        open_review(tmp_path / "nothing", owner="ab")
    assert list(tmp_path.iterdir()) == []
