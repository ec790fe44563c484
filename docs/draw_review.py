"""Draw docs/images/review*.png: the review page on the demo's corpus, in Chromium without a screen.

python docs/draw_review.py [CORPUS]     # of `mimique demo`; made anew, which takes minutes, unless given
"""

from __future__ import annotations

import importlib.util
import shutil
import sys
import tempfile
from pathlib import Path
from types import ModuleType

from mimique.workbench.demo import run_demo
from mimique.workbench.progress import ConsoleReporter
from PIL import Image

IMAGES = Path(__file__).parent / "images"
TESTS = Path(__file__).resolve().parents[1] / "tests" / "review"
SIZE = (1440, 810)
TAKE = "s1_EU_surprise_1"


def load(name: str) -> ModuleType:
    """Import a module of the tests, which are no package that is installed."""
    spec = importlib.util.spec_from_file_location(name, TESTS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def draw(corpus: Path) -> None:
    """Review a little, as a person would, and take pictures on the way."""
    driver, running = load("page_driver"), load("running_server")
    with running.RunningServer(corpus) as server, driver.open_browser() as browser:
        window = {"width": SIZE[0], "height": SIZE[1]}
        with browser.new_context(viewport=window, locale="en-GB", color_scheme="light") as context:
            review = driver.ReviewPage(context, server.address)
            review.ready()
            review.page.wait_for_timeout(4000)  # the model's probabilities are found in the background
            for _ in range(6):
                review.press("Enter")
                review.ready()
            review.page.keyboard.press("3")
            review.saved()
            open_take(review)
            review.press("Tab", "Shift+Enter", "Tab", "Tab", "Shift+Enter", "Tab", "Tab")
            review.ask(
                "clock.seek(s.chosen.value ? Math.round((s.chosen.value.onset + s.chosen.value.offset) / 2) : 0)"
            )
            review.page.evaluate("() => document.querySelector('.queue-list').scrollTo(0, 0)")
            save(review, "review")
            review.page.keyboard.press("Control+s")
            review.page.get_by_role("dialog").wait_for()
            save(review, "review_publish")
            review.press("Escape")
            review.page.get_by_role("button", name="Overview").click()
            save(review, "review_overview")


def open_take(review) -> None:
    """Choose the take by the picker."""
    review.page.locator(".take-button").click()
    review.page.get_by_role("searchbox").fill(TAKE)
    review.page.keyboard.press("Enter")
    review.until("s.scene.value.take", TAKE)
    review.ready()


def save(review, name: str) -> None:
    """Save what the window shows."""
    review.page.wait_for_timeout(1500)
    path = IMAGES / f"{name}.png"
    review.page.screenshot(path=path)
    Image.open(path).convert("RGB").save(path, optimize=True)
    print(path)


def main() -> None:
    """Copy or make the corpus, then draw."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if len(sys.argv) > 1:
            shutil.copytree(sys.argv[1], folder / "corpus")
        else:
            run_demo(folder / "demo", reporter=ConsoleReporter())
            shutil.move(folder / "demo" / "corpus", folder / "corpus")
        draw(folder / "corpus")


if __name__ == "__main__":
    main()
