"""What tests of the page share: a browser, a server that people log in to by name, and somebody who is new there."""

import pytest

from .page_driver import PAGE_TAKES, add_people, open_page, start_browser
from .review_corpus import copy_review_corpus
from .running_server import RunningServer


@pytest.fixture(scope="module")
def browser():
    yield from start_browser()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A corpus without weights: no face has to be drawn where none is asked about."""
    folder = tmp_path_factory.mktemp("page") / "corpus"
    copy_review_corpus(folder, takes=PAGE_TAKES, n_frames=1200, weights=False)
    add_people(folder, leads=("lea",))
    return folder


@pytest.fixture(scope="module")
def server(folder):
    with RunningServer(folder, "--host", "127.0.0.1") as running:
        yield running


@pytest.fixture
def person(folder, request):
    """Somebody who is in this test alone: nobody sees another's edits before they are published."""
    name = request.node.name.removeprefix("test_")
    add_people(folder, name)
    return name


@pytest.fixture
def review(browser, server, person):
    """The page of the person, open on the first take."""
    with open_page(browser, server, person) as review:
        review.ready()
        review.open_take(PAGE_TAKES[0])
        yield review
