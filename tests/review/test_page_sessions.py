"""Who sits at the page: a session that ends over work, and two people in one browser."""

import pytest

from .page_driver import PASSWORD, ReviewPage, add_people, new_context, open_page, start_browser
from .review_corpus import copy_review_corpus
from .running_server import Client, RunningServer

TAKES = ("ab_IE_1", "cd_IE_1", "ef_IE_1")
TAKE = TAKES[0]
OTHER = "quite another one"


@pytest.fixture(scope="module")
def browser():
    yield from start_browser()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sessions") / "corpus"
    copy_review_corpus(folder, takes=TAKES, n_frames=1200, weights=False)
    add_people(folder, "bob", "cia", leads=("lea",))
    return folder


@pytest.fixture(scope="module")
def server(folder):
    with RunningServer(folder, "--host", "127.0.0.1") as running:
        yield running


def held(review):
    return [one for one in review.segments() if one["status"] == "proposed" and one["label"] in set("NDFJ")]


def affect_of(server, person, password=PASSWORD):
    """What the server has of a person's tier: id to label."""
    client = Client(server.origin, person=person, password=password)
    segments = next(one for one in client.draft(TAKE)["tiers"] if one["tier"] == "affect")["segments"]
    client.http.close()
    return {one["id"]: one["label"] for one in segments}


def test_an_edit_outlives_the_session_that_made_it(browser, server):
    with open_page(browser, server, "bob") as review:
        review.ready()
        review.open_take(TAKE)
        first, second = held(review)[:2]
        review.choose(first["id"])
        review.press("2")
        review.choose(second["id"])
        # Quickly, so that the edit is the first thing for which the session is missed.
        lead = Client(server.origin, person="lea", password=PASSWORD)
        lead.post("/api/accounts", {"person": "bob", "password": OTHER, "is_lead": False}).raise_for_status()
        review.page.keyboard.press("2")
        lead.http.close()
        review.says("Your session has ended. Log in again; what you were doing is still here.")
        assert review.find(second["id"])["label"] == second["label"], "not shown before it is saved"
        assert affect_of(server, "bob", OTHER)[second["id"]] == second["label"]
        review.log_in("bob", OTHER)
        review.saved()
        review.until(f"s.activeSegments.value.find((one) => one.id === '{second['id']}').label", "A")
        assert affect_of(server, "bob", OTHER)[second["id"]] == "A"
        assert review.find(second["id"])["revision"] == second["revision"] + 1


def test_nobodys_edit_is_saved_as_another_persons(browser, server):
    with new_context(browser) as context:
        first = ReviewPage(context, server.origin + "/")
        first.log_in("cia")
        first.ready()
        first.open_take(TAKE)
        target = held(first)[0]
        # The other tab is deaf and dumb, so that only the server and the cookie can tell who is who.
        second = ReviewPage(context, server.origin + "/")
        second.ready()
        for review in (first, second):
            review.page.evaluate("() => { BroadcastChannel.prototype.postMessage = () => undefined; }")
        second.menu("Log out")
        second.log_in("lea")
        second.ready()
        assert first.ask("s.session.value.person") == "cia"
        first.choose(target["id"])
        first.page.keyboard.press("2")
        first.says("Your session has ended. Log in again; what you were doing is still here.")
        assert affect_of(server, "lea")[target["id"]] == target["label"]
        assert affect_of(server, "cia")[target["id"]] == target["label"]
        first.log_in("cia")
        first.saved()
        first.until(f"s.activeSegments.value.find((one) => one.id === '{target['id']}').label", "A")
        assert affect_of(server, "cia")[target["id"]] == "A"
        assert affect_of(server, "lea")[target["id"]] == target["label"]
        first.finished()
        second.finished()
