"""Every control of the review page has a name, and every text can be read in a small window, in both languages."""

from pathlib import Path

import pytest

from .page_driver import ReviewPage, add_people, new_context, start_browser
from .review_corpus import make_review_corpus
from .running_server import RunningServer

AUDIT = Path(__file__).with_name("page_audit.js").read_text()
CONTRAST = Path(__file__).with_name("page_contrast.js").read_text()
DIALOGS = ("help", "publish", "manual", "scheme", "elan", "settings", "coding", "accounts")


@pytest.fixture(scope="module")
def browser():
    yield from start_browser()


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("access") / "corpus"
    make_review_corpus(folder, takes=("ab_IE_1", "cd_IE_1"), n_frames=1200)
    add_people(folder, "bob", leads=("lea",))
    with RunningServer(folder, "--host", "127.0.0.1") as running:
        yield running


@pytest.mark.parametrize(("language", "theme"), [("en", "light"), ("fr", "dark")])
def test_every_control_has_a_name_and_every_text_can_be_read(browser, server, language, theme):
    locale = {"en": "en-GB", "fr": "fr-FR"}[language]
    with new_context(browser, locale=locale, color_scheme=theme) as context:
        review = ReviewPage(context, server.origin + "/")
        wrong = {}

        def look(where):
            review.page.wait_for_timeout(150)
            found = review.page.evaluate(AUDIT) + review.page.evaluate(CONTRAST)
            if found:
                wrong[where] = found

        review.page.locator("input[name=password]").wait_for()
        look("login")
        review.log_in("lea")
        review.ready()
        assert review.page.locator("html").get_attribute("lang") == language
        look("review, nothing chosen")
        first = review.segments()[0]
        review.choose(first["id"])
        look("review")
        review.press("b")
        look("two faces")
        review.press("b")
        review.press("2" if first["label"] != "A" else "3")
        look("after an edit")
        review.page.locator(".take-button").click()
        look("list of takes")
        review.page.keyboard.press("Escape")
        review.page.locator("header .popover").last.locator("button").first.click()
        look("menu")
        review.page.keyboard.press("Escape")
        for name in DIALOGS:
            review.ask(f"(s.dialog.value = '{name}')")
            review.page.locator("dialog[open]").wait_for()
            review.page.wait_for_timeout(400)
            look(name)
            tabs = review.page.locator("dialog[open] [role=tab]")
            for place in range(1, tabs.count()):
                tabs.nth(place).click()
                look(f"{name}, tab {place + 1}")
            review.ask("(s.dialog.value = null)")
        for name in ("overview", "adjudication"):
            review.ask(f"(s.page.value = '{name}')")
            review.page.locator("main.page").wait_for()
            review.page.wait_for_timeout(500)
            look(name)
        review.ask("(s.page.value = 'review')")
        review.press("Control+z")
        assert not wrong, "\n".join(f"{where}: {one}" for where, found in wrong.items() for one in found)
        review.finished()


def test_the_audit_sees_what_is_wrong(browser, server):
    with new_context(browser) as context:
        review = ReviewPage(context, server.origin + "/")
        review.page.locator("input[name=password]").wait_for()
        assert review.page.evaluate(AUDIT) == review.page.evaluate(CONTRAST) == []
        review.page.evaluate("""() => {
            document.querySelector("dialog").close();
            const place = document.body;
            const add = (name, text, style) => {
                const one = place.appendChild(document.createElement(name));
                one.textContent = text;
                Object.assign(one.style, style);
            };
            add("button", "×", {});
            add("input", "", {});
            add("p", "pale", { background: "#fff", color: "#999" });
            add("p", "far away", { position: "absolute", left: "1270px", width: "200px" });
            add("p", "far below", { position: "fixed", top: "715px" });
            add("p", "a long text that is cut off", { width: "40px", overflow: "hidden", whiteSpace: "nowrap" });
            add("p", "a long text that is pushed aside", { width: "40px", overflow: "auto", whiteSpace: "nowrap" });
            add("button", "a long text that runs out of its button", { width: "40px", whiteSpace: "nowrap" });
        }""")
        found = "\n".join(review.page.evaluate(AUDIT) + review.page.evaluate(CONTRAST))
        for one in (
            "no name: button",
            "no name: input",
            "beyond the side: p",
            "beyond the end: p",
            "cut off: p",
            "scrolls sideways: p",
            "contrast 2.85: p",
            "runs out of its button",
        ):
            assert one in found
