"""Working time that no clock can make longer, and how fast people go."""

import shutil
import threading

import numpy as np
import pytest
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.errors import NotFoundError
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts.records import DraftKey
from mimique.workbench.review.queueing import pace
from mimique.workbench.review.queueing.pace import (
    ActivityClock,
    compute_pace,
    get_activity_clock,
    measure_pace,
    record_activity,
)
from mimique.workbench.review.queueing.queue import list_queue
from mimique.workbench.review.server.app import create_app

from .page_client import PageClient
from .review_corpus import make_proposals


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    folder, rng = tmp_path_factory.mktemp("pace") / "corpus", np.random.default_rng(5)
    made = Corpus.create(folder)
    with made.transaction("Make", author="lead") as edit:
        for name in ("a", "b"):
            edit.put_take(name, make_take(np.zeros((1600, 1, 3)), ["M"], 200.0))
            proposals = make_proposals(1600, rng)
            edit.put_tier(name, "affect", proposals, author="old", provenance={"step": "label"})
    return folder


@pytest.fixture
def review(template, tmp_path):
    opened = open_review(shutil.copytree(template, tmp_path / "corpus"), owner="cr")
    yield opened
    opened.close()


def set_clock(review, times):
    review.part("activity clock", lambda: ActivityClock(lambda: times[-1]))


def accept(review, person, number):
    """Accept so many proposals, the most useful first."""
    for item in [one for one in list_queue(review, person)["items"] if one["status"] == "proposed"][:number]:
        key = DraftKey(person, item["take"])
        edit = {"kind": "accept", "tier": item["tier"], "segments": [int(item["id"])]}
        request = f"{item['id']:0>32}"[:32]
        review.drafts.edit(key, edit, request=request, version=review.drafts.open(key).version)


def test_no_more_time_is_counted_than_has_gone_by():
    times = [1000.0]
    clock = ActivityClock(lambda: times[-1])
    assert clock.grant("cr", 30.0) == 30.0  # nothing is known before
    times.append(1010.0)
    assert clock.grant("cr", 30.0) == pytest.approx(11.0)  # a second tab, or a page whose clock jumped
    assert clock.grant("xy", 500.0) == 120.0
    times.append(5000.0)
    assert clock.grant("cr", 20.0) == 20.0  # was away for an hour, and worked 20 s
    assert sum(clock.grant("cr", 20.0) for _ in range(100)) == pytest.approx(1.0)  # however often it is said


def test_pace_is_what_was_reviewed_in_the_last_active_minutes():
    assert compute_pace([]) is None
    assert compute_pace([(120.0, 4)]) is None  # how many there were before is not known
    assert compute_pace([(30.0, 0), (30.0, 2)]) is None  # too short to say
    assert compute_pace([(30.0, 10), (30.0, 12), (30.0, 14)]) == pytest.approx(4.0)
    assert compute_pace([(30.0, 10), (60.0, 5)]) == 0.0  # more was undone than done
    long = [(60.0, 0)] * 20 + [(60.0, 3 * minute) for minute in range(1, 11)]
    assert compute_pace(long) == pytest.approx(3.0)  # slow hours long ago do not count


def test_activity_adds_up_and_the_pace_follows(review):
    times = [0.0]
    set_clock(review, times)
    total = len(list_queue(review, "cr")["items"])
    assert measure_pace(review, "cr").per_minute is None
    assert record_activity(review, "cr", "a", 30.0) == 30.0
    for minute in range(1, 4):
        accept(review, "cr", 2)
        times.append(60.0 * minute)
        assert record_activity(review, "cr", "b", 60.0) == 60.0
    found = measure_pace(review, "cr")
    assert found.active_seconds == pytest.approx(210.0)
    assert (found.reviewed, found.remaining) == (6, total - 6)
    assert found.per_minute == pytest.approx(2.0)
    assert found.minutes_left == pytest.approx((total - 6) / 2.0)
    assert measure_pace(review, "somebody else").active_seconds == 0.0


def test_what_is_kept_is_bounded_and_survives_the_server(review, monkeypatch):
    monkeypatch.setattr(pace, "_MOST_KEPT", 5)
    times = [0.0]
    set_clock(review, times)
    for number in range(20):
        times.append(number * 60.0)
        record_activity(review, "cr", "a", 60.0)
    with review.database.read() as connection:
        assert connection.execute("SELECT COUNT(*) FROM pace").fetchone()[0] == 5
        assert connection.execute("SELECT COUNT(*) FROM activity").fetchone()[0] == 1
    again = open_review(review.location, owner="cr")
    assert measure_pace(again, "cr").active_seconds == pytest.approx(20 * 60.0)
    again.close()


def test_two_tabs_at_once_do_not_double_the_time(review):
    times = [0.0]
    set_clock(review, times)
    record_activity(review, "cr", "a", 1.0)
    times.append(60.0)
    threads = [threading.Thread(target=record_activity, args=(review, "cr", "a", 60.0)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert measure_pace(review, "cr").active_seconds <= 62.0


def test_the_routes(review):
    client = PageClient(create_app(review))
    assert client.get("/api/pace").json() == {
        "reviewed": 0,
        "remaining": len(list_queue(review, "cr")["items"]),
        "per_minute": None,
        "minutes_left": None,
        "active_seconds": 0.0,
    }
    assert client.post("/api/activity", json={"take": "a", "seconds": 20}).json() == {"seconds": 20.0}
    assert get_activity_clock(review).grant("cr", 100.0) < 20.0
    assert client.get("/api/pace").json()["active_seconds"] == 20.0
    for wrong in ({"take": "a", "seconds": -1}, {"take": "a", "seconds": 1e9}, {"take": "a"}, {"seconds": 1}, []):
        assert client.post("/api/activity", json=wrong).status_code == 422, wrong
    for name in ("", "/", "..", "%", "a\n", "\0", "🙂", "x" * 999):
        answer = client.post("/api/activity", json={"take": name, "seconds": 1})
        assert answer.status_code == 404 and answer.json()["error"]["kind"] == "not-found", name
    with pytest.raises(NotFoundError):
        record_activity(review, "cr", "gone", 1.0)
