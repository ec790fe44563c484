"""The whole API against its own description: odd requests of every kind, with and without a session.

Bounded: a few dozen requests a route. No answer is a failure of the server, none has a status or a form that the
description does not name, and without a session nothing changes.
"""

import sqlite3
import warnings

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.errors import Unsatisfiable
from mimique.corpus import Corpus
from mimique.workbench.review.context import open_review
from mimique.workbench.review.people import passwords
from mimique.workbench.review.server.app import create_app

from .page_client import HOST, PageClient, stranger
from .review_corpus import make_review_corpus

schemathesis = pytest.importorskip("schemathesis")
openapi_checks = pytest.importorskip("schemathesis.specs.openapi.checks")

CHECKS = [
    schemathesis.checks.not_a_server_error,
    openapi_checks.status_code_conformance,
    openapi_checks.content_type_conformance,
    openapi_checks.response_schema_conformance,
]
"""Not among them: that what is refused by a rule that a schema cannot say (a name that is taken) is an error."""

EXAMPLES = 8
"""Requests a route and kind; raise it to look for rarer failures."""


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    patch = pytest.MonkeyPatch()
    patch.setattr(passwords, "_hasher", passwords.PasswordHasher(time_cost=1, memory_cost=64, parallelism=1))
    corpus = make_review_corpus(tmp_path_factory.mktemp("api") / "corpus", takes=("ab_IE_1",), n_frames=300)
    review = open_review(corpus.path, owner="ab")
    yield create_app(review)
    review.close()
    patch.undo()


@pytest.fixture(scope="module")
def schema(app):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return schemathesis.openapi.from_dict(app.openapi())


def list_rows(path):
    """Return all rows of all tables."""
    with sqlite3.connect(f"file:{path}?mode=ro", uri=True) as connection:
        tables = [row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        return {table: connection.execute(f"SELECT * FROM {table}").fetchall() for table in tables}


def send(client, case):
    """Send a request as it was made up, but for what says who asks: that is the client's."""
    made = case.as_transport_kwargs(base_url=HOST)
    headers = {
        name: value for name, value in made["headers"].items() if name.lower() not in ("x-mimique-csrf", "cookie")
    }
    body = {"json": made["json"]} if "json" in made else {"content": made.get("data")}
    if isinstance(body.get("content"), dict | list):
        body = {"content": repr(body["content"]).encode("utf-8", "replace")}
    return client.request(made["method"], made["url"], params=made.get("params"), headers=headers, **body)


def ask_everything(schema, mode, make_client, check):
    """Make up requests of one mode for each route, and look at each answer."""
    for result in schema.get_all_operations():
        operation = result.ok()

        @settings(
            max_examples=EXAMPLES,
            deadline=None,
            database=None,
            derandomize=True,
            phases=[Phase.explicit, Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=operation.as_strategy(generation_mode=mode))
        def ask(case):
            check(case, send(make_client(case), case))

        try:
            ask()
        except (Unsatisfiable, schemathesis.errors.InvalidSchema):
            continue  # no request of that kind: whatever one sends is as described


@pytest.mark.parametrize("mode", list(schemathesis.GenerationMode))
def test_with_a_session_every_answer_is_as_described(app, schema, mode):
    client, asked = PageClient(app), set()

    def make_client(case):
        ends = (case.method, case.path) == ("DELETE", "/api/session")
        return PageClient(app) if ends else client

    def check(case, answer):
        asked.add((case.method, case.path, answer.status_code))
        case.validate_response(answer, checks=CHECKS)

    ask_everything(schema, mode, make_client, check)
    assert len({path for _, path, _ in asked}) == len(app.openapi()["paths"])
    if mode is schemathesis.GenerationMode.POSITIVE:
        assert ("GET", "/api/corpus", 200) in asked  # somebody was let in
        assert not any(status == 401 for method, path, status in asked if path != "/api/session")


def test_without_a_session_nothing_is_told_and_nothing_changes(app, schema):
    review = app.state.review
    before, snapshot = list_rows(review.database.path), Corpus.open(review.location).snapshot
    client = stranger(app)

    def check(case, answer):
        case.validate_response(answer, checks=CHECKS)
        assert answer.status_code in (400, 401, 403, 413, 422, 429), (case.method, case.path, answer.status_code)
        assert set(answer.json()) == {"error"}

    ask_everything(schema, schemathesis.GenerationMode.POSITIVE, lambda case: client, check)
    assert list_rows(review.database.path) == before
    assert Corpus.open(review.location).snapshot == snapshot
