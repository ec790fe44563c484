"""The queue: what a person may review, most useful first, before and after the model has judged."""

import time

import numpy as np
import pandas as pd
import pytest
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.workbench.pipeline.labelling import label
from mimique.workbench.pipeline.queueing import queue_for_review
from mimique.workbench.pipeline.segmenting import segment
from mimique.workbench.pipeline.training import train
from mimique.workbench.review.coding.plan import save_plan
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts.records import DraftKey
from mimique.workbench.review.people.person import Person
from mimique.workbench.review.queueing.judgements import get_judgements
from mimique.workbench.review.queueing.messages import Queue
from mimique.workbench.review.queueing.queue import count_held, list_queue
from mimique.workbench.review.server.app import create_app
from mimique.workbench.review.server.dependencies import get_person
from pydantic_core import to_json

from .page_client import PageClient
from .review_corpus import make_proposals

RATE, SHAPES = 50.0, [f"shape{k}" for k in range(6)]
AFFECTS = ("neutral", "joy", "fear", "anger")
CODES = {"neutral": "N", "joy": "J", "fear": "F", "anger": "A"}
POSES = dict(zip(AFFECTS, np.vstack([np.zeros(6), np.eye(6)[:3]]), strict=True))


def perform(rng):
    """Affects in turn with neutral, a second each and 0.4 s between."""
    order = ["neutral"]
    for name in rng.permutation(AFFECTS[1:]):
        order += [str(name), "neutral"]
    rows, parts, frame = [], [], 0
    for k, name in enumerate(order):
        if k:
            s = (np.arange(20)[:, None] + 0.5) / 20
            parts.append(POSES[order[k - 1]] + s * (POSES[name] - POSES[order[k - 1]]))
            rows.append((frame, frame + 20, CODES[order[k - 1]] + CODES[name]))
            frame += 20
        parts.append(np.repeat(POSES[name][None], 50, axis=0))
        rows.append((frame, frame + 50, name))
        frame += 50
    return np.concatenate(parts) + 0.25 * rng.standard_normal((frame, 6)), pd.DataFrame(
        rows, columns=["onset", "offset", "label"]
    )


@pytest.fixture(scope="module")
def labelled(tmp_path_factory):
    """Two takes that a person annotated, and two that a model of theirs labelled."""
    folder = tmp_path_factory.mktemp("queue") / "corpus"
    made, rng = Corpus.create(folder), np.random.default_rng(4)
    with made.transaction("Make", author="lead") as edit:
        for name in ("s1_IE", "s1_SE", "s1_EU", "s1_EU2"):
            weights, tier = perform(rng)
            take = make_take(np.zeros((len(weights), 2, 3)), ["M1", "M2"], RATE, signer="s1", protocol=name[3:5])
            edit.put_take(name, take)
            edit.put_weights(name, weights, shapes=SHAPES, solve="known")
            if "EU" not in name:
                edit.put_tier(name, "affect", tier, author="A1")
    segment(made)
    train(made, classifier="linear-svm")
    label(made, takes=["s1_EU", "s1_EU2"])
    return folder


@pytest.fixture
def review(labelled, tmp_path):
    import shutil

    shutil.copytree(labelled, tmp_path / "corpus")
    made = open_review(tmp_path / "corpus", owner="cr")
    yield made
    made.close()


@pytest.fixture
def plain(tmp_path):
    """Takes whose proposals come from nobody whom the corpus knows as a model."""
    folder, rng = tmp_path / "plain", np.random.default_rng(1)
    made = Corpus.create(folder)
    with made.transaction("Make", author="lead") as edit:
        for name in ("ab_IE_1", "ab_SE_1", "cd_IE_1"):
            edit.put_take(name, make_take(np.zeros((1600, 1, 3)), ["M"], 200.0, signer=name[:2], protocol=name[3:5]))
            edit.put_tier(name, "affect", make_proposals(1600, rng), author="old", provenance={"step": "label"})
    made = open_review(folder, owner="cr")
    yield made
    made.close()


def of_models(queue):
    return [item for item in queue["items"] if "EU" in item["take"]]


def test_before_anything_is_reviewed_the_order_is_that_of_the_command(review):
    corpus = review.corpus()
    assert get_judgements(review).wait(corpus, 60)
    queue = list_queue(review, "cr")
    assert queue["ready"]
    expected = queue_for_review(corpus)
    found = of_models(queue)
    assert [(item["take"], item["onset"]) for item in found] == list(
        expected[["take", "onset"]].itertuples(index=False, name=None)
    )
    assert [item["gain"] for item in found] == pytest.approx(expected["gain"].tolist())
    assert [item["second"] for item in found] == expected["second"].tolist()
    assert {item["take"] for item in queue["items"]} == {"s1_EU", "s1_EU2"}  # A1's own tiers are nobody's proposals
    Queue.model_validate(queue)


def test_judgements_follow_segments_into_drafts_and_are_not_found_twice(review):
    judgements = get_judgements(review)
    assert judgements.wait(review.corpus(), 60)
    before = judgements.get(review.corpus())[0]
    first = list_queue(review, "cr")["items"][0]
    key = DraftKey("cr", first["take"])
    state = review.drafts.open(key)
    edit = {"kind": "accept", "tier": "affect", "segments": [int(first["id"])]}
    review.drafts.edit(key, edit, request="11111111-1111-1111-1111-111111111111", version=state.version)
    items = list_queue(review, "cr")["items"]
    assert items[-1]["id"] == first["id"] and items[-1]["gain"] == 0.0 and items[-1]["status"] == "reviewed"
    assert all(item["second"] for item in of_models({"items": items}) if item["status"] == "proposed")
    # Another snapshot in which no tier or model changed: nothing is judged again.
    own = Corpus.open(review.location)
    with own.transaction("Something else", author="x") as other:
        other.put_take("z", make_take(np.zeros((10, 1, 3)), ["M"], RATE, signer="s9"))
    list_queue(review, "cr")
    assert judgements.wait(review.corpus(), 60)
    after = judgements.get(review.corpus())[0]
    assert after and all(after[place] is before[place] for place in after)


def test_without_a_model_the_least_sure_come_first_and_transitions_are_left_out(plain):
    assert get_judgements(plain).wait(plain.corpus(), 30)
    queue = list_queue(plain, "cr")
    corpus = plain.corpus()
    expected = {}
    for take in corpus.takes()["take"]:
        for row in corpus.tier(take, "affect", author="old").itertuples():
            if row.label in ("N", "A", "D", "F", "J", "Sa", "Su"):
                expected[str(row.id)] = (take, row.onset, row.offset, row.label, row.confidence)
    assert {
        item["id"]: (item["take"], item["onset"], item["offset"], item["label"], item["confidence"])
        for item in queue["items"]
    } == expected
    gains = [item["gain"] for item in queue["items"]]
    assert gains == sorted(gains, reverse=True)
    of_joy = [item["confidence"] for item in queue["items"] if item["label"] == "J"]
    assert of_joy == sorted(of_joy)
    counts = count_held(plain, "cr")
    assert (counts.remaining, counts.reviewed) == (len(expected), 0)


def test_takes_that_are_coded_blind_or_without_consent_have_no_part(plain):
    own = Corpus.open(plain.location)
    with own.transaction("Consent", author="x") as edit:
        edit.put_signer("cd", {"consent": "none"})
    drawn = save_plan(plain, tier="affect", share=0.5, coders=("cr", "xy"), coders_per_take=2, seed=1)
    taken = {one.take for one in drawn.takes}
    assert len(taken) == 1 and "cd_IE_1" not in taken
    for person in ("cr", "xy", "somebody else"):
        assert {item["take"] for item in list_queue(plain, person)["items"]} == {"ab_IE_1", "ab_SE_1"} - taken


def test_unknown_confidence_comes_first_with_no_gain(plain):
    own = Corpus.open(plain.location)
    table = own.tier("cd_IE_1", "affect", author="old")
    table.loc[2, "confidence"] = np.nan
    with own.transaction("Forget", author="x") as edit:
        edit.put_tier("cd_IE_1", "affect", table, author="old", provenance={"step": "label"})
    items = list_queue(plain, "cr")["items"]
    assert items[0]["id"] == str(table["id"][2]) and items[0]["gain"] is None and items[0]["confidence"] is None


def test_the_route_answers_in_time_once_warm(tmp_path, rng):
    """16 takes with 10 240 segments: under 200 ms at the median."""
    folder = tmp_path / "large"
    made = Corpus.create(folder)
    with made.transaction("Make", author="lead") as edit:
        for number in range(16):
            name = f"take{number:02d}"
            edit.put_take(name, make_take(np.zeros((6400, 1, 3)), ["M"], 200.0, signer=f"s{number % 4}"))
            onsets = np.arange(0, 6400, 10)
            proposals = pd.DataFrame({"onset": onsets, "offset": onsets + 10, "label": rng.choice(list("NAJ"), 640)})
            proposals = proposals.assign(confidence=rng.uniform(0.3, 0.99, 640), origin="model", status="proposed")
            edit.put_tier(name, "affect", proposals, author="old", provenance={"step": "label"})
    review = open_review(folder, owner="cr")
    client = PageClient(create_app(review))
    items = client.get("/api/queue").json()["items"]
    assert len(items) == 10_240
    spent = []
    for _ in range(7):
        began = time.thread_time()  # of this thread alone, so that a busy machine fails no test
        to_json(list_queue(review, "cr"))
        spent.append(time.thread_time() - began)
    assert sorted(spent)[3] < 0.2
    Queue.model_validate_json(client.get("/api/queue").content)
    review.close()


def test_nobody_sees_a_queue_without_a_session(plain):
    app = create_app(plain)
    stranger = PageClient(app, login={})
    for path in ("/api/queue", "/api/pace"):
        assert stranger.get(path).status_code == 401
    assert stranger.post("/api/activity", json={"take": "ab_IE_1", "seconds": 5}).status_code in (401, 403)
    app.dependency_overrides[get_person] = lambda: Person("cr", False)
    assert stranger.get("/api/queue").status_code == 200
