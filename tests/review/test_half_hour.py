"""A reviewer's half hour in a real browser: what the screen shows is what the corpus then holds."""

import threading
import time

import pytest
from mimique.corpus import Corpus

from .page_driver import SIZE, ReviewPage, open_browser, plain, require_browser
from .review_corpus import MODEL, make_review_corpus
from .running_server import RunningServer


@pytest.fixture(scope="module")
def browser():
    require_browser()
    with open_browser() as opened:
        yield opened


@pytest.fixture
def corpus_folder(tmp_path):
    make_review_corpus(tmp_path / "corpus", takes=("ab_IE_1", "cd_IE_1"), n_frames=1600)
    return tmp_path / "corpus"


def new_context(browser):
    return browser.new_context(viewport={"width": SIZE[0], "height": SIZE[1]}, locale="en-GB")


def held(segments):
    return [one for one in segments if one["label"] in ("N", "A", "D", "F", "J", "Sa", "Su")]


def test_a_reviewers_half_hour(browser, corpus_folder):
    with RunningServer(corpus_folder) as server, new_context(browser) as context:
        review = ReviewPage(context, server.address)
        review.ready()
        assert "token" not in review.page.url
        before = Corpus.open(corpus_folder)
        proposals = before.segments(tier="affect", author=MODEL)
        n_held = int(proposals["label"].isin(("N", "A", "D", "F", "J", "Sa", "Su")).sum())
        assert review.ask("s.shownQueue.value.length") == n_held
        review.shoot("opened")

        # Playing follows the clock, whatever is drawn.
        review.ask("clock.seek(0)")
        review.page.keyboard.press("Space")
        review.until("clock.playing.value")
        start, began = review.ask("clock.frame.value"), time.monotonic()
        review.page.wait_for_timeout(1500)
        review.page.keyboard.press("Space")
        review.until("clock.playing.value", False)
        played, lasted = review.ask("clock.frame.value") - start, time.monotonic() - began
        assert 0 < played <= lasted * 200 + 40
        review.shoot("played")

        # Accept goes on to the next of the queue.
        first = review.ask("s.shownQueue.value[0]")
        review.until("s.scene.value.take", first["take"])
        review.choose(first["id"])
        review.press("Enter")
        review.until("s.selection.value[0] !== null && s.opening.value === null")
        review.ready()
        taken = {take: review_of(server, review, take) for take in ("ab_IE_1", "cd_IE_1")}
        accepted = next(one for one in taken[first["take"]] if one["id"] == first["id"])
        assert (accepted["status"], accepted["origin"], accepted["label"]) == ("reviewed", "model", first["label"])
        review.shoot("accepted")

        # Relabel by a digit.
        target = next(one for one in held(review.segments()) if one["status"] == "proposed" and one["label"] != "J")
        review.choose(target["id"])
        review.press("5")
        changed = find(review, target["id"])
        assert (changed["label"], changed["status"], changed["origin"]) == ("J", "reviewed", "human")
        review.shoot("relabelled")

        # A boundary by key, one frame and ten, and by mouse: the neighbour gives way.
        review.press("Alt+ArrowRight", "Alt+Shift+ArrowRight")
        assert find(review, target["id"])["onset"] == target["onset"] + 11
        drag_boundary(review, target["id"], frames=20)
        assert find(review, target["id"])["onset"] > target["onset"] + 11
        review.shoot("moved")

        # Split at the playhead, merge again.
        moved = find(review, target["id"])
        middle = (moved["onset"] + moved["offset"]) // 2
        count = len(review.segments())
        review.seek(middle)
        review.press("s")
        assert len(review.segments()) == count + 1
        assert find(review, target["id"])["offset"] == middle
        review.shoot("split")
        review.choose(target["id"])
        review.press("m")
        assert len(review.segments()) == count
        review.shoot("merged")

        # In, out, a label; what lay below gives way. Then delete a segment.
        review.seek(1000)
        review.press("i")
        review.seek(1060)
        review.press("o", "6")
        added = [one for one in review.segments() if (one["onset"], one["offset"]) == (1000, 1060)]
        assert [one["label"] for one in added] == ["Sa"]
        review.choose(added[0]["id"])
        review.press("Delete")
        assert not [one for one in review.segments() if one["id"] == added[0]["id"]]

        # Hold a key while playing.
        review.ask("clock.setSpeed(0.25)")
        review.seek(1200)
        review.press("Escape")
        review.page.keyboard.down("Shift")
        review.page.keyboard.down("7")
        review.page.wait_for_timeout(1200)
        review.page.keyboard.up("7")
        review.page.keyboard.up("Shift")
        review.saved()
        review.until("s.activeSegments.value.some((one) => one.onset === 1200 && one.label === 'Su')")
        review.ask("clock.setSpeed(1)")
        review.shoot("held")

        # Undo everything of this take, redo everything: the same.
        state = plain(review.segments())
        steps = 0
        while review.ask("s.draft.value.undo") is not None:
            review.press("Control+z")
            steps += 1
        assert all(one["status"] == "proposed" for one in review.segments())
        for _ in range(steps):
            review.press("Control+Shift+Z")
        assert plain(review.segments()) == state
        review.press("Control+z", "Control+y")
        assert plain(review.segments()) == state

        # Reload: nothing is lost, and undo is still there.
        take = review.ask("s.scene.value.take")
        review.page.reload()
        review.ready()
        open_take(review, take)
        assert plain(review.segments()) == state
        assert review.ask("s.draft.value.undo") is not None
        review.shoot("reloaded")

        # The server is killed in the middle of an edit: the page says so, keeps it, sends it again, once.
        victim = next(one for one in held(review.segments()) if one["status"] == "proposed" and one["label"] != "A")
        review.choose(victim["id"])
        server.kill()
        review.page.keyboard.press("2")
        review.until("s.saving.value.state", "unsaved")
        assert find(review, victim["id"])["label"] == victim["label"], "not shown before it is saved"
        review.shoot("server-killed")
        server.start()
        review.saved()
        assert find(review, victim["id"])["label"] == "A"
        assert find(review, victim["id"])["revision"] == victim["revision"] + 1
        review.shoot("server-back")

        # Killed between many edits that follow each other: whatever was said to be saved is there afterwards.
        kill_between_edits(review, server)
        state = plain(review.segments())

        # Publish: the difference first, then one commit.
        review.press("Control+s")
        review.page.get_by_role("dialog").wait_for()
        review.page.wait_for_timeout(500)
        review.shoot("publish")
        snapshots = len(Corpus.open(corpus_folder).history())
        review.page.get_by_role("dialog").get_by_role("button", name="Publish").last.click()
        review.until("s.dialog.value", None)
        review.until("s.unpublished.value", 0)
        review.shoot("published")
        corpus = Corpus.open(corpus_folder)
        assert len(corpus.history()) == snapshots + 1
        assert corpus.history().iloc[0]["author"] == "ann"
        for name in ("ab_IE_1", "cd_IE_1"):
            open_take(review, name)
            shown = plain(review.segments())
            if name == take:
                assert shown == state
            assert plain(corpus.tier(name, "affect", "ann").to_dict("records")) == shown
            assert len(review.shown_list()) == min(len(shown), 51)
        assert plain(corpus.segments(tier="affect", author=MODEL).to_dict("records")) == plain(
            proposals.to_dict("records")
        ), "the model's own tiers are as they were"
        review.press("?")
        review.page.get_by_role("dialog").wait_for()
        review.shoot("keys")
        review.press("Escape")
        assert review.faults == []
        assert review.outside == []


def find(review, segment):
    return next(one for one in review.segments() if one["id"] == segment)


def review_of(server, review, take):
    """The draft of a take as the server has it."""
    answer = review.page.request.get(f"{server.origin}/api/draft", params={"take": take, "purpose": "own"})
    return next(tier for tier in answer.json()["tiers"] if tier["tier"] == "affect")["segments"]


def open_take(review, take):
    """Choose a take as the take picker does."""
    if review.ask("s.scene.value.take") != take:
        review.page.get_by_role("button", name="Take").first.click()
        review.page.get_by_role("option", name=take).first.click()
    review.until("s.scene.value.take", take)
    review.until("s.draft.value.take", take)
    review.ready()


def drag_boundary(review, segment, frames):
    """Drag a segment's onset by so many frames with the mouse."""
    found = find(review, segment)
    review.choose(segment)
    first, last = review.ask("[s.range.value.first, s.range.value.last]")
    area = review.page.locator(".timeline-area").bounding_box()
    row = review.page.locator(".timeline-gutter [role=radio][aria-checked=true]").bounding_box()
    scale = area["width"] / (last - first)
    x, y = area["x"] + (found["onset"] - first) * scale, row["y"] + row["height"] / 2
    review.page.mouse.move(x, y)
    review.page.mouse.down()
    review.page.mouse.move(x + frames * scale / 2, y, steps=3)
    review.page.mouse.move(x + frames * scale, y, steps=3)
    review.page.mouse.up()
    review.page.wait_for_timeout(200)
    review.saved()


def kill_between_edits(review, server):
    """Press keys in a row while the server dies and comes back; the page ends with every edit that it showed."""
    targets = [one for one in held(review.segments()) if one["status"] == "proposed"][:4]

    def die_and_return():
        time.sleep(0.15)
        server.kill()
        time.sleep(0.5)
        server.start()

    killer = threading.Thread(target=die_and_return)
    killer.start()
    for target in targets:
        review.choose(target["id"])
        review.page.keyboard.press("4")
        review.page.wait_for_timeout(80)
    killer.join()
    review.saved()
    for target in targets:
        found = find(review, target["id"])
        if found["label"] != "F":  # refused while the server was away: the page said so, and nothing was shown
            review.choose(target["id"])
            review.press("4")
        assert find(review, target["id"])["label"] == "F"
