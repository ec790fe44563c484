"""The lead's way through the page: two people code a take blind, the lead compares, settles and publishes."""

import pytest
from mimique.corpus import Corpus

from .page_driver import ReviewPage, add_people, new_context, open_page, start_browser
from .review_corpus import MODEL, copy_review_corpus
from .running_server import RunningServer

TAKES = ("ab_IE_1", "cd_IE_1")
# What the two see: one border that is theirs alone to choose, another label, and one that only bob has.
BOB = ((0, 200, "1"), (200, 500, "2"), (500, 900, "5"), (1000, 1100, "7"))
CIA = ((0, 204, "1"), (204, 500, "2"), (500, 900, "4"))


@pytest.fixture(scope="module")
def browser():
    yield from start_browser()


@pytest.fixture
def folder(tmp_path):
    copy_review_corpus(tmp_path / "corpus", takes=TAKES, n_frames=1200, weights=False)
    add_people(tmp_path / "corpus", "bob", "cia", leads=("lea",))
    return tmp_path / "corpus"


class Answers:
    """Everything that the server told a page."""

    def __init__(self, review):
        self.waiting, self.read = [], []
        review.page.on("requestfinished", lambda request: self.waiting.append(request))

    def text(self):
        """Read it; the browser forgets the answers when a page is left."""
        while self.waiting:
            request = self.waiting.pop(0)
            if "/api/" in request.url:
                self.read.append(f"{request.url}\n{request.response().text()}")
        return "\n".join(self.read)


def log_in(context, server, person):
    review = ReviewPage(context, server.origin + "/")
    answers = Answers(review)
    review.page.get_by_label("Name").fill(person)
    review.page.get_by_label("Password").fill("wrong password")
    review.click("Log in")
    review.says("Name or password is not right.")
    review.log_in(person)
    return review, answers


def draw(lead):
    """Draw half of the takes for bob and cia, in the dialog."""
    lead.menu("Double coding")
    dialog = lead.page.get_by_role("dialog")
    dialog.get_by_label("bob", exact=True).check()
    dialog.get_by_label("cia", exact=True).check()
    dialog.locator("input[type=range]").fill("50")
    lead.says("1 take of 2")
    lead.click("Draw the takes", within="dialog")
    lead.says("1 take is drawn", "at work")
    take = lead.page.get_by_role("dialog").locator("tbody tr td").first.inner_text()
    lead.click("Close", within=".dialog-foot")
    return take


def code(review, segments):
    for onset, offset, key in segments:
        review.press("Escape")
        review.seek(onset)
        review.press("i")
        review.seek(offset)
        review.press("o", key)
    assert len(review.segments()) == len(segments)


def ids_of(review):
    return {one["id"] for one in review.segments()}


def test_double_coding_from_the_draw_to_the_settled_tier(browser, folder):
    with (
        RunningServer(folder, "--host", "127.0.0.1") as server,
        new_context(browser) as leads,
        new_context(browser) as bobs,
        new_context(browser) as cias,
    ):
        lead, lead_answers = log_in(leads, server, "lea")
        lead.ready()
        take = draw(lead)
        open_take = next(one for one in TAKES if one != take)
        proposals = {str(one) for one in Corpus.open(folder).tier(take, "affect", MODEL)["id"]}
        assert len(proposals) > 3

        (bob, bob_answers), (cia, cia_answers) = log_in(bobs, server, "bob"), log_in(cias, server, "cia")
        for coder, segments in ((bob, BOB), (cia, CIA)):
            coder.until("s.corpus.value !== null && s.queue.value !== null")
            coder.open_take(take)
            coder.says("blind", "You see neither the machine's proposals nor anybody else's labels.")
            assert coder.segments() == []
            assert coder.ask("s.draft.value.others") == []
            assert take not in {item["take"] for item in coder.ask("s.queue.value.items")}
            code(coder, segments)

        # Neither of them is told anything of the machine's or of the other's; nor is the lead before both are done.
        bobs_ids, cias_ids = ids_of(bob), ids_of(cia)
        assert proposals.isdisjoint(bobs_ids | cias_ids) and bob_answers.text()
        bob.page.reload()
        bob.ready()
        bob.says("Blind coding")
        for coder, answers, own, foreign in (
            (bob, bob_answers, bobs_ids, cias_ids),
            (cia, cia_answers, cias_ids, bobs_ids),
            (lead, lead_answers, set(), bobs_ids | cias_ids),
        ):
            told, shown = answers.text(), coder.page.content()
            assert all(one in told for one in own), "the answers are recorded"
            assert not [one for one in foreign if one in told or one in shown]
            if coder is not lead:
                assert not [one for one in proposals if one in told or one in shown]
        assert MODEL in bob_answers.text(), "of the other take proposals are shown"

        # The lead cannot look before all are done.
        lead.click("Overview")
        lead.says("No take has been finished by two people yet.", "blind")
        bob.click("I am done with this take")
        bob.says("You said that you are done. The lead compares when all coders are.")
        lead.click("Refresh")
        lead.says("No take has been finished by two people yet.", "done")
        cia.click("I am done with this take")
        cia.until("s.draft.value.done")
        assert not [one for one in bobs_ids if one in cia.page.content()]

        # Agreement, then the disagreements, one key each.
        lead.click("Refresh")
        lead.says("bob – cia", "κ", "Settle")
        assert open_take in lead.text()
        row = lead.page.get_by_role("row").filter(has=lead.page.get_by_role("button", name="Settle: "))
        assert "0 / 2" in row.inner_text()
        row.get_by_role("button", name="Settle: ").click()
        lead.says("2 disagreements", "0 of 2 settled", "What holds here?")
        lead.until("s.draft.value && s.draft.value.purpose === 'adjudication'")
        lead.until("s.marked.value.onset", 500)
        lead.press("4")
        lead.says("1 of 2 settled")
        lead.until("s.marked.value.onset", 1000)
        lead.press("x")
        lead.says("2 of 2 settled", "Everything is settled here.")
        lead.press("Control+z")
        lead.says("1 of 2 settled")
        lead.press("Control+Shift+Z")
        lead.says("2 of 2 settled")
        assert [(one["onset"], one["label"]) for one in lead.segments()][-1] == (500, "F")
        lead.click("Publish…")
        lead.says("adjudicated")
        assert "settle" in lead.page.get_by_role("dialog").locator(".dialog-foot input").input_value()
        lead.publish()
        lead.until("s.dialog.value", None)
        lead.says("Published")

        settled = Corpus.open(folder).tier(take, "affect", "adjudicated")
        assert list(settled["label"]) == ["N", "A", "F"]
        assert set(settled["status"]) == {"adjudicated"}
        assert (int(settled["onset"].iloc[-1]), int(settled["offset"].iloc[-1])) == (500, 900)
        assert Corpus.open(folder).history().iloc[0]["author"] == "lea"
        lead.click("Overview", within=".top-bar")
        lead.says("all settled")

        # Once all are done the coders see how they differ, and their own readings go into the corpus as theirs.
        for coder, segments in ((bob, BOB), (cia, CIA)):
            coder.press("Control+s")
            coder.publish()
            coder.until("s.dialog.value", None)
            author = coder.ask("s.session.value.person")
            assert len(Corpus.open(folder).tier(take, "affect", author)) == len(segments)
            coder.finished()
        lead.finished()


def test_what_leads_do_is_not_offered_to_others(browser, folder):
    with RunningServer(folder, "--host", "127.0.0.1") as server, open_page(browser, server, "bob") as bob:
        bob.ready()
        assert bob.page.get_by_role("button", name="Overview").count() == 0
        bob.page.locator("header .popover").last.locator("button").first.click()
        offered = bob.page.get_by_role("menuitem").all_inner_texts()
        assert not [one for one in offered if one.startswith(("Overview", "Double coding", "Accounts"))]
        bob.page.keyboard.press("Escape")
        for page in ("overview", "adjudication"):
            bob.ask(f"(s.page.value = '{page}')")
            bob.page.wait_for_timeout(300)
            assert "κ" not in bob.text() and "Agreement" not in bob.text()
        bob.ask("(s.page.value = 'review')")
        for dialog in ("coding", "accounts"):
            bob.ask(f"(s.dialog.value = '{dialog}')")
            bob.page.wait_for_timeout(300)
            assert bob.page.get_by_role("dialog").count() == 0
        bob.ask("(s.dialog.value = 'scheme')")
        bob.says("Only a lead can change the scheme.")
        bob.press("Escape")
        bob.menu("Log out")
        bob.page.get_by_label("Password").wait_for()
        assert bob.ask("s.draft.value") is None
