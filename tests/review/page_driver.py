"""A person at the review page: Debian's Chromium, keys and clicks, and what the page then shows."""

import os
import re
import shutil
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
SIZE = (1280, 720)
PAGE_TAKES = ("ab_IE_1", "cd_IE_1", "ef_IE_1")
PATIENCE = 30.0  # s; drawn by software on a busy machine, the page may take its time
PASSWORD = "a long password"
SEGMENT = ("id", "onset", "offset", "label", "status", "origin")


def require_browser():
    """Skip, visibly, where there is no browser or no built page."""
    import mimique

    pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("no Chromium is at hand; on Debian: apt-get install chromium")
    if not (Path(mimique.__file__).parent / "workbench" / "review" / "static" / "index.html").is_file():
        pytest.skip("the review page is not built: run make page")


@contextmanager
def open_browser():
    """Chromium without a screen."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-dev-shm-usage"])
        try:
            yield browser
        finally:
            browser.close()


def start_browser():
    """What a fixture named ``browser`` yields from: Chromium for the tests of a module."""
    require_browser()
    with open_browser() as opened:
        yield opened


def new_context(browser, **options):
    """A person's browser profile at the size of a small screen."""
    return browser.new_context(**{"viewport": {"width": SIZE[0], "height": SIZE[1]}, "locale": "en-GB", **options})


def add_people(corpus: Path, *names: str, leads: tuple[str, ...] = ()) -> None:
    """Let people log in by name and PASSWORD."""
    from mimique.workbench.review.context import open_database
    from mimique.workbench.review.people.accounts import Accounts

    database = open_database(corpus)
    for name in (*names, *leads):
        Accounts(database).add(name, PASSWORD, is_lead=name in leads)
    database.close()


@contextmanager
def open_page(browser, server, person: str, **options):
    """A person who has logged in by name, in a browser profile of their own; in the end nothing was thrown."""
    with new_context(browser, **options) as context:
        review = ReviewPage(context, server.origin + "/")
        review.log_in(person)
        yield review
        review.finished()


class ReviewPage:
    """One tab; every fault that the page throws is collected in ``faults``."""

    def __init__(self, context, address: str, *, pictures: str | None = None) -> None:
        self.page = context.new_page()
        self.faults: list[str] = []
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("console", self._listen)
        self.outside: list[str] = []
        origin = address.split("/#")[0].rstrip("/")
        self.page.on("request", lambda request: self._note_request(request.url, origin))
        self.pictures = pictures or os.environ.get("MIMIQUE_REVIEW_PICTURES")
        self.count = 0
        self.page.goto(address)

    def _listen(self, message) -> None:
        # A server that was killed on purpose leaves such lines; the driver's own pictures make the GPU stall.
        expected = ("Failed to load resource", "GPU stall", "ERR_CONNECTION")
        if message.type in ("error", "warning") and not any(part in message.text for part in expected):
            self.faults.append(message.text)

    def _note_request(self, url: str, origin: str) -> None:
        if not url.startswith((origin, "blob:", "data:")):
            self.outside.append(url)

    def ask(self, expression: str):
        """Value of an expression over ``s``, the page's state, ``clock`` and ``faces``."""
        return self.page.evaluate(
            f"() => {{ const {{state: s, clock, faces}} = window.mimique; return {expression}; }}"
        )

    def until(self, expression: str, wanted=True, *, patience: float = PATIENCE):
        """Wait until an expression has a value; the policy of the page allows no other way to wait for one."""
        end = time.monotonic() + patience
        while True:
            found = self.ask(expression)
            if found == wanted:
                return
            assert time.monotonic() < end, f"{expression}: expected {wanted!r}, but it stays {found!r}; {self.notice()}"
            self.page.wait_for_timeout(30)

    def notice(self) -> str:
        return str(self.ask("s.notice.value && s.notice.value.text"))

    def log_in(self, person: str, password: str = PASSWORD) -> None:
        """Fill in the form and wait until the person is known."""
        self.page.locator("input[name=person]").fill(person)
        self.page.locator("input[name=password]").fill(password)
        self.page.keyboard.press("Enter")
        self.until("s.session.value && s.session.value.person", person)
        self.until("s.login.value", None)

    def ready(self) -> None:
        """Wait until a take is open, its face is drawn and everything is saved."""
        self.until("s.draft.value !== null && s.scene.value !== null && s.opening.value === null")
        self.until("s.scene.value.solve === null || (faces.length > 0 && faces[0].frame >= 0)")
        self.saved()

    def saved(self) -> None:
        self.until("s.saving.value.state", "saved")

    def press(self, *keys: str) -> None:
        """Press keys; each is waited for until all it did is on disk."""
        for key in keys:
            self.page.keyboard.press(key)
            self.page.wait_for_timeout(60)
            self.saved()

    def segments(self, tier: str = "affect") -> list[dict]:
        """The segments of a tier as the page holds them."""
        return self.ask(f"s.draft.value.tiers.find((one) => one.tier === {tier!r}).segments")

    def chosen(self) -> dict | None:
        return self.ask("s.chosen.value")

    def choose(self, segment: str, *, seek: bool = True) -> None:
        """Choose a segment by the list that screen readers walk."""
        place = next(n for n, one in enumerate(self.segments(), start=1) if one["id"] == segment)
        self.page.evaluate(f"() => document.querySelector('li[aria-posinset=\"{place}\"] button').click()")
        self.until("s.selection.value[0]", segment)

    def seek(self, frame: int) -> None:
        """Type a frame into the transport's field."""
        self.ask(f"clock.seek({frame})")
        self.until("clock.frame.value", frame)

    def find(self, segment: str, tier: str = "affect") -> dict:
        """A segment as the page holds it."""
        return next(one for one in self.segments(tier) if one["id"] == segment)

    def text(self) -> str:
        """What can be read on the screen."""
        return " ".join(self.page.inner_text("body").split())

    def says(self, *words: str, patience: float = PATIENCE) -> None:
        """Wait until words can be read on the screen."""
        end = time.monotonic() + patience
        while missing := [one for one in words if one not in self.text()]:
            assert time.monotonic() < end, f"the page does not say {missing}; it says: {self.text()}"
            self.page.wait_for_timeout(50)

    def click(self, name: str | re.Pattern, role: str = "button", *, within: str = "body", exact: bool = True) -> None:
        """Click what a screen reader calls by this name."""
        self.page.locator(within).last.get_by_role(role, name=name, exact=exact).first.click()

    def command(self, name: str) -> None:
        """Click the button of a command, and wait until all it did is on disk."""
        self.page.locator(f"[data-command='{name}']").first.click()
        self.page.wait_for_timeout(60)
        self.saved()

    def menu(self, item: str) -> None:
        """Choose something in the menu at the right of the top bar."""
        self.page.locator("header .popover").last.locator("button").first.click()
        self.page.get_by_role("menuitem", name=item).first.click()

    def publish(self) -> None:
        """Publish what the dialog shows."""
        self.page.locator("dialog .dialog-foot .button-primary:enabled").click()

    def open_take(self, take: str) -> None:
        """Choose a take by the list behind its name."""
        if self.ask("s.scene.value && s.scene.value.take") != take:
            self.page.locator(".take-button").click()
            self.page.locator(".take-list .menu-item").filter(has_text=take).first.click()
        self.until("s.scene.value && s.scene.value.take", take)
        self.until("s.draft.value && s.draft.value.take", take)
        self.ready()

    def finished(self) -> None:
        """Nothing was thrown, and nobody outside was asked."""
        assert self.faults == []
        assert self.outside == []

    def shown_list(self) -> list[str]:
        """What a screen reader reads of the active tier."""
        return self.page.eval_on_selector_all("ul.timeline-hidden li button", "all => all.map(one => one.textContent)")

    def shoot(self, name: str) -> None:
        """Take a picture at both sizes, where pictures are wanted."""
        self.count += 1
        if not self.pictures:
            return
        for width, height in (SIZE, (1920, 1080)):
            self.page.set_viewport_size({"width": width, "height": height})
            self.page.wait_for_timeout(700)
            self.page.screenshot(path=f"{self.pictures}/{self.count:02d}-{name}-{width}.png")
        self.page.set_viewport_size({"width": SIZE[0], "height": SIZE[1]})


def plain(segments) -> list[tuple]:
    """Segments as sets of facts that corpus and page share."""
    return sorted(tuple(str(one[key]) for key in SEGMENT) for one in segments)
