"""The review page when something goes wrong: what it then says, what it keeps, and that it goes on afterwards."""

import resource
from contextlib import contextmanager

from mimique.corpus import Corpus
from mimique.corpus.store.locking import lock_corpus
from mimique.workbench.review.context import review_folder

from .page_driver import PAGE_TAKES, ReviewPage, new_context, plain
from .running_server import RunningServer


def proposed(review, *, but=""):
    """The first segments of a held label that nobody has looked at."""
    return [one for one in review.segments() if one["status"] == "proposed" and one["label"] in set("NADFJ") - {but}]


def relabel(review, segment, key):
    review.choose(segment)
    review.press(key)


def test_without_weights_the_page_names_the_command_and_labels_all_the_same(review, folder):
    review.says("mimique solve")
    command = review.ask("s.scene.value.problem.command")
    assert command == f"mimique solve {folder.name}", "who logs in by name is told no path of the server"
    first = proposed(review, but="A")[0]
    relabel(review, first["id"], "2")
    assert review.find(first["id"])["label"] == "A"


def test_a_corpus_without_takes_says_how_takes_come_in(browser, tmp_path):
    Corpus.create(tmp_path / "corpus", name="empty", author="test")
    with RunningServer(tmp_path / "corpus") as server, new_context(browser) as context:
        review = ReviewPage(context, server.address)
        review.says("no takes", "mimique ingest")
        assert "Everything is reviewed" not in review.text()
        for key in ("Enter", "n", "s", "1", "Delete", "Space", "?"):
            review.page.keyboard.press(key)
        review.page.get_by_role("dialog").wait_for()
        review.finished()


def test_a_locked_corpus_is_said_while_publishing_and_publishes_afterwards(review, folder, person):
    first = proposed(review)[0]
    relabel(review, first["id"], "6")
    before = plain(review.segments())
    commits = len(Corpus.open(folder).history())
    with lock_corpus(folder, purpose="solve"):
        review.press("Control+s")
        review.publish()
        review.says("Not published; your edits are kept.", "locked by", "solve")
        assert len(Corpus.open(folder).history()) == commits
        assert plain(review.segments()) == before
    review.publish()
    review.until("s.dialog.value", None)
    review.until("s.unpublished.value", 0)
    review.says("Published: ")
    assert len(Corpus.open(folder).history()) == commits + 1
    assert plain(Corpus.open(folder).tier(PAGE_TAKES[0], "affect", person).to_dict("records")) == before


@contextmanager
def no_room(server, folder):
    """Let no file of the server grow, as on a full disk."""
    usual = resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE)
    log = review_folder(folder) / "edits.sqlite-wal"
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (log.stat().st_size, usual[1]))
    try:
        yield
    finally:
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, usual)


def test_on_a_full_disk_the_edit_is_said_to_be_unsaved_until_there_is_room(review, server, folder):
    first, second = proposed(review, but="A")[:2]
    relabel(review, first["id"], "2")
    with no_room(server, folder):
        review.choose(second["id"])
        review.page.keyboard.press("2")
        review.says("Not saved", "make room on the disk", "It is kept in this browser")
        assert review.find(second["id"]) == second, "nothing is shown before it is saved"
        review.page.reload()
        review.until("s.saving.value.state", "unsaved")
    review.ready()
    review.until("s.draft.value.unpublished", 2)
    assert review.find(second["id"])["label"] == "A"
    assert review.find(second["id"])["revision"] == second["revision"] + 1
    assert review.find(first["id"])["label"] == "A"


def test_a_take_that_is_deleted_while_it_is_open_keeps_its_edits(review, folder, person, tmp_path):
    review.open_take(PAGE_TAKES[2])
    first, second = proposed(review, but="A")[:2]
    relabel(review, first["id"], "2")
    state = plain(review.segments())
    with Corpus.open(folder).transaction("Delete a take", author="bob") as edit:
        edit.delete_take(PAGE_TAKES[2])
    review.choose(second["id"])
    review.page.keyboard.press("2")
    review.says("This take was deleted from the corpus. Your edits are kept and can be exported for ELAN.")
    review.saved()
    assert plain(review.segments()) == state
    review.menu("ELAN")
    with review.page.expect_download() as download:
        review.page.get_by_role("dialog").get_by_role("link", name="Download .eaf").click()
    download.value.save_as(tmp_path / "kept.eaf")
    assert "<ANNOTATION_VALUE>A</ANNOTATION_VALUE>" in (tmp_path / "kept.eaf").read_text()
    review.press("Escape")
    review.press("Control+s")
    review.says(PAGE_TAKES[2], "is held back; your edits stay here and can be exported for ELAN.")
    review.press("Escape")
    review.open_take(PAGE_TAKES[1])
    other = proposed(review, but="A")[0]
    relabel(review, other["id"], "2")
    review.press("Control+s")
    review.publish()
    review.until("s.dialog.value", None)
    corpus = Corpus.open(folder)
    assert corpus.tier(PAGE_TAKES[1], "affect", person).set_index("id")["label"][int(other["id"])] == "A"


def test_two_tabs_of_one_person_follow_each_other_and_lose_nothing(review, server):
    other = ReviewPage(review.page.context, server.origin + "/")
    other.ready()
    other.open_take(PAGE_TAKES[0])
    first, second, third = proposed(review, but="A")[:3]
    relabel(review, first["id"], "2")
    other.until(f"s.activeSegments.value.find((one) => one.id === '{first['id']}').label", "A")
    assert plain(other.segments()) == plain(review.segments())

    # The first tab falls silent: the second goes on from an old state.
    review.page.evaluate("() => { BroadcastChannel.prototype.postMessage = () => undefined; }")
    version = other.ask("s.draft.value.version")
    relabel(review, second["id"], "2")
    assert other.ask("s.draft.value.version") == version
    relabel(other, third["id"], "2")  # another segment: applied to the newest state
    assert [other.find(one["id"])["label"] for one in (first, second, third)] == ["A", "A", "A"]
    review.until("s.draft.value.version", other.ask("s.draft.value.version"))
    relabel(review, third["id"], "6")
    other.choose(third["id"])
    other.page.keyboard.press("7")  # the same segment: the first tab was there before
    other.says("another tab changed the same segments. What you see now is the newest state.")
    assert other.find(third["id"])["label"] == "Sa"
    assert plain(other.segments()) == plain(review.segments())
    other.finished()


def test_a_wall_clock_that_jumps_changes_nothing(review, folder, person):
    first, second = proposed(review, but="A")[:2]
    review.seek(100)
    review.page.keyboard.press("Space")
    review.until("clock.frame.value > 110")
    review.page.evaluate("""() => {
        const Old = Date;
        window.Date = class extends Old { constructor(...of) { if (of.length) super(...of); else super(0); } };
        window.Date.now = () => 0;
    }""")
    before = review.ask("clock.frame.value")
    review.until(f"clock.frame.value > {before + 10}")
    review.page.keyboard.press("Space")
    review.until("clock.playing.value", False)
    relabel(review, first["id"], "2")
    relabel(review, second["id"], "2")
    review.press("Control+z", "Control+Shift+Z")
    state = plain(review.segments())
    review.press("Control+s")
    review.publish()
    review.until("s.dialog.value", None)
    assert plain(Corpus.open(folder).tier(PAGE_TAKES[0], "affect", person).to_dict("records")) == state
    review.until("s.pace.value.reviewed", 2)
    left = review.ask("s.pace.value.remaining")
    assert f"{left} left" in review.page.locator("span[data-left]").inner_text()
    assert "NaN" not in review.text()
