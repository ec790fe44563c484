"""A person at the review page: Debian's Chromium, keys and clicks, and what the page then shows."""

import os
import shutil
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
SIZE = (1280, 720)
PATIENCE = 30.0  # s; drawn by software on a busy machine, the page may take its time
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
