"""Drafts and publishing as the page asks for them."""

import uuid

import pytest
from mimique.corpus import Corpus
from mimique.corpus.store.locking import lock_corpus
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts import routes
from mimique.workbench.review.people.person import Person
from mimique.workbench.review.server.app import create_app
from mimique.workbench.review.server.dependencies import get_person

from .page_client import PageClient, stranger
from .review_corpus import MODEL, TAKES, copy_review_corpus


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return copy_review_corpus(tmp_path_factory.mktemp("drafts_server") / "corpus", weights=False, n_frames=1200)


@pytest.fixture
def app(folder):
    review = open_review(folder, owner="ab")
    yield create_app(review)
    review.close()


@pytest.fixture
def page(app):
    return PageClient(app)


def draft_of(page, take, purpose="own"):
    answer = page.get("/api/draft", params={"take": take, "purpose": purpose})
    assert answer.status_code == 200, answer.text
    return answer.json()


def post_edit(page, draft, operation, request=None):
    body = {
        "take": draft["take"],
        "purpose": draft["purpose"],
        "request": request or str(uuid.uuid4()),
        "version": draft["version"],
        "operation": {"tier": "affect", **operation},
    }
    return page.post("/api/draft/edit", json=body)


def refused(answer, status, kind):
    assert answer.status_code == status, answer.text
    error = answer.json()["error"]
    assert error["kind"] == kind
    assert error["message"]
    assert "\n" not in error["message"]


def test_a_draft_is_shown_edited_undone_and_redone(page):
    draft = draft_of(page, TAKES[0])
    assert (draft["author"], draft["mode"], draft["unpublished"], draft["done"]) == ("ab", "review", 0, False)
    (tier,) = draft["tiers"]
    assert (tier["tier"], tier["source"]) == ("affect", MODEL)
    assert [(one["author"], one["made_by"]) for one in draft["others"]] == [(MODEL, "model")]
    first = tier["segments"][0]
    assert isinstance(first["id"], str)
    answer = post_edit(page, draft, {"kind": "relabel", "segments": [first["id"]], "label": "J"}).json()
    # The transition behind it is named after it.
    assert answer["changes"][0]["removed"] == [first["id"], tier["segments"][1]["id"]]
    added = answer["changes"][0]["added"][0]
    assert (added["label"], added["status"], added["origin"], added["confidence"]) == ("J", "reviewed", "human", None)
    assert (answer["undo"], answer["redo"], answer["unpublished"]) == ("relabel", None, 1)
    step = {"take": TAKES[0], "purpose": "own", "request": str(uuid.uuid4()), "version": answer["version"]}
    undone = page.post("/api/draft/undo", json=step).json()
    assert undone["changes"][0]["added"] == tier["segments"][:2]
    assert page.post("/api/draft/undo", json=step).json() == undone
    step = {**step, "request": str(uuid.uuid4()), "version": undone["version"]}
    assert page.post("/api/draft/redo", json=step).json()["changes"][0]["added"] == answer["changes"][0]["added"]


def test_another_window_is_told(page):
    draft = draft_of(page, TAKES[1])
    name = draft["tiers"][0]["segments"][0]["id"]
    assert post_edit(page, draft, {"kind": "accept", "segments": [name]}).status_code == 200
    refused(post_edit(page, draft, {"kind": "delete", "segments": [name]}), 409, "stale")


@pytest.mark.parametrize("take", ["", "/", "..", "%", "a\nb", "😀", "x" * 10_000, "a\0b"])
def test_odd_names_are_takes_that_are_not_there(page, take):
    expected = (404, "not-found") if take else (422, "input")
    refused(page.get("/api/draft", params={"take": take}), *expected)
    draft = {"take": take, "purpose": "own", "version": 0}
    refused(post_edit(page, draft, {"kind": "accept", "segments": ["1"]}), *expected)
    step = {"take": take, "purpose": "own", "request": str(uuid.uuid4()), "version": 0}
    refused(page.post("/api/draft/undo", json=step), 422, "input")


@pytest.mark.parametrize(
    "operation",
    [
        {"kind": "paint"},
        {"kind": "accept", "segments": ["x"]},
        {"kind": "accept", "segments": ["99999999999999999999"]},
        {"kind": "add", "onset": -1, "offset": 3, "label": "A"},
        {"kind": "add", "onset": 0, "offset": 10**30, "label": "A"},
        {"kind": "add", "onset": 0, "offset": 3, "label": "x" * 2000},
        {"kind": "settle", "onset": 0, "offset": 3, "label": "A"},
        {"kind": "accept", "segments": ["1"], "tier": "segments"},
        {"kind": "accept", "segments": ["1"], "further": 1},
    ],
)
def test_what_cannot_be_is_refused_in_one_line(page, operation):
    refused(post_edit(page, draft_of(page, TAKES[2]), operation), 422, "input")


def test_nobody_changes_anything_without_a_session(app, folder):
    page = stranger(app)
    refused(page.get("/api/draft", params={"take": TAKES[0]}), 401, "no-session")
    draft = {"take": TAKES[0], "purpose": "own", "version": 1}
    assert post_edit(page, draft, {"kind": "accept", "segments": ["1"]}).status_code in (401, 403)
    assert page.post("/api/publish", json={"plan": "", "message": "", "choices": {}}).status_code in (401, 403)


def test_only_leads_adjudicate(app, page):
    assert draft_of(page, TAKES[0], "adjudication")["author"] == "adjudicated"
    app.dependency_overrides[get_person] = lambda: Person("ef", False)
    refused(page.get("/api/draft", params={"take": TAKES[0], "purpose": "adjudication"}), 403, "forbidden")


def test_publishing_with_its_diff_its_lock_and_a_conflict(page, folder, monkeypatch):
    draft = draft_of(page, TAKES[2])
    segments = draft["tiers"][0]["segments"]
    post_edit(page, draft, {"kind": "relabel", "segments": [segments[0]["id"]], "label": "J"})
    plan = page.get("/api/publish").json()
    change = next(one for one in plan["changes"] if one["take"] == TAKES[2])
    assert (change["kind"], change["after"][0]["label"]) == ("edited", "J")
    body = {"plan": plan["plan"], "message": "By the page", "choices": {}}
    monkeypatch.setattr(routes, "LOCK_TIMEOUT", 0.05)
    with lock_corpus(folder, purpose="solve"):
        answer = page.post("/api/publish", json=body)
    refused(answer, 503, "corpus")
    assert "locked by" in answer.json()["error"]["message"]
    done = page.post("/api/publish", json=body).json()
    assert done["snapshot"] == Corpus.open(folder).snapshot
    assert Corpus.open(folder).tier(TAKES[2], "affect", "ab")["label"][0] == "J"
    refused(page.post("/api/publish", json={**body, "plan": "old"}), 409, "stale")
    # Somebody changes the same segment in another way.
    post_edit(page, draft_of(page, TAKES[2]), {"kind": "relabel", "segments": [segments[1]["id"]], "label": "A"})
    corpus = Corpus.open(folder)
    table = corpus.tier(TAKES[2], "affect", "ab")
    table.loc[1, "label"] = "Theirs"
    with corpus.transaction("By another hand", author="cd") as put:
        put.put_tier(TAKES[2], "affect", table, author="ab")
    (conflict,) = page.get("/api/publish").json()["conflicts"]
    assert (conflict["author"], conflict["message"]) == ("cd", "By another hand")
    assert (conflict["ours"][0]["label"], conflict["theirs"][0]["label"]) == ("A", "Theirs")
    body = {"plan": page.get("/api/publish").json()["plan"], "message": "", "choices": {}}
    refused(page.post("/api/publish", json=body), 422, "input")
    page.post("/api/publish", json={**body, "choices": {conflict["key"]: "theirs"}})
    assert draft_of(page, TAKES[2])["tiers"][0]["segments"][1]["label"] == "Theirs"
    assert page.get("/api/publish").json()["conflicts"] == []
