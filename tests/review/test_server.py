"""The web application in process: who is let in, what is refused and how, what the page is told."""

import gzip
import json
import time
from types import SimpleNamespace

import icechunk
import pytest
from fastapi import APIRouter, Body
from mimique.errors import ConflictError, CorpusError, InputError, NotFoundError
from mimique.workbench.review.context import open_review
from mimique.workbench.review.people import passwords
from mimique.workbench.review.server import app as app_module
from mimique.workbench.review.server.errors import Refusal
from mimique.workbench.review.server.guard import BODY_LIMIT, UPLOAD_LIMIT, name_hosts
from mimique.workbench.review.server.static_page import StaticPage

from .page_client import HOST, PageClient, stranger
from .review_corpus import make_review_corpus

PASSWORD = "a long password"
PLAIN_REQUEST = SimpleNamespace(headers={})


@pytest.fixture(scope="module")
def corpus_path(tmp_path_factory):
    return make_review_corpus(tmp_path_factory.mktemp("server") / "corpus", n_frames=400).path


@pytest.fixture(scope="module")
def app(corpus_path, tmp_path_factory):
    """An application with a few routes of its own that fail, each in another way."""
    review = open_review(corpus_path, owner="ab")
    odd = APIRouter()

    @odd.get("/api/odd")
    def fail(how: str):
        errors = {
            "input": InputError("an input"),
            "not-found": NotFoundError("no such thing"),
            "conflict": ConflictError("it is there"),
            "corpus": CorpusError("the corpus is away"),
            "stale": Refusal(409, "stale", "it is stale"),
            "icechunk": icechunk.IcechunkError("x session error\n  | and more\n"),
            "server": RuntimeError("a secret of the program"),
            "overflow": OverflowError("Python int too large to convert to SQLite INTEGER"),
        }
        raise errors[how]

    @odd.post("/api/elan/length")
    def measure(data: bytes = Body(media_type="application/octet-stream")):
        return len(data)

    @odd.get("/api/numbers")
    def numbers(n: int):
        return list(range(n))

    page = tmp_path_factory.mktemp("static")
    (page / "assets").mkdir()
    (page / "index.html").write_text("<!doctype html>" + " " * 1000)
    (page / "assets" / "main-abc123.js").write_text("export const x = 1;\n" * 100)
    made = app_module.create_app(review, hosts=["review.example.org"], static_folder=page)
    # Before the page's, which takes whatever is left.
    made.include_router(odd)
    made.router.routes.insert(0, made.router.routes.pop())
    yield made
    review.close()


@pytest.fixture
def named_app(corpus_path, tmp_path, monkeypatch):
    monkeypatch.setattr(passwords, "_hasher", passwords.PasswordHasher(time_cost=1, memory_cost=64, parallelism=1))
    location = make_review_corpus(tmp_path / "corpus", takes=("ab_IE_1",), n_frames=200, weights=False).path
    review = open_review(location)
    review.people.accounts.add("lea", PASSWORD, is_lead=True)
    review.people.accounts.add("bob", PASSWORD)
    yield app_module.create_app(review)
    review.close()


def kind_of(answer):
    assert set(answer.json()) == {"error"} and set(answer.json()["error"]) == {"kind", "message"}
    assert "\n" not in answer.json()["error"]["message"]
    return answer.status_code, answer.json()["error"]["kind"]


# Sessions


def test_the_token_makes_a_session_in_a_cookie_that_scripts_cannot_read(app):
    client = stranger(app)
    assert kind_of(client.get("/api/session")) == (401, "no-session")
    assert kind_of(client.post("/api/session", json={"token": "x"})) == (401, "no-session")
    answer = client.post("/api/session", json={"token": app.state.review.people.token})
    assert answer.json() == client.get("/api/session").json()
    assert answer.json()["person"] == "ab" and answer.json()["is_lead"] and not answer.json()["named"]
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie and "Secure" not in cookie
    assert app.state.review.people.token not in cookie
    secure = PageClient(app, login={})
    secure.base_url = HOST.replace("http", "https")
    cookie = secure.post("/api/session", json={"token": app.state.review.people.token}).headers["set-cookie"]
    assert "Secure" in cookie


def test_logging_out_ends_the_session_for_good(app):
    client = PageClient(app)
    secret = dict(client.cookies)
    assert client.delete("/api/session").status_code == 204
    assert not client.cookies
    for name, value in secret.items():
        client.cookies.set(name, value)
    assert kind_of(client.get("/api/session")) == (401, "no-session")


def test_what_changes_something_needs_the_csrf_token(app):
    client = PageClient(app)
    assert client.put("/api/settings", json={"language": "fr"}).json() == {"language": "fr"}
    for wrong in ("", "x", client.csrf[:-1], PageClient(app).csrf):
        answer = client.put("/api/settings", json={"language": "en"}, headers={"X-Mimique-CSRF": wrong})
        assert kind_of(answer) == (403, "csrf")
    assert client.get("/api/session").json()["settings"] == {"language": "fr"}
    client.put("/api/settings", json={})


def test_every_route_needs_a_session_but_those_that_give_one(app):
    open_to_all = {("/api/session", "post")}
    described = app.openapi()["paths"]
    client = stranger(app)
    for path, methods in described.items():
        if path in ("/api/odd", "/api/elan/length", "/api/numbers"):
            continue
        for method, operation in methods.items():
            if (path, method) in open_to_all:
                continue
            assert {"session": []}.items() <= operation["security"][0].items(), (method, path)
            needed = {one["name"]: "1" for one in operation.get("parameters", ()) if one["required"]}
            answer = client.request(method, path, params=needed, json={} if "requestBody" in operation else None)
            assert kind_of(answer) == (401, "no-session"), (method, path, answer.text)
            if method != "get":
                assert operation["security"] == [{"session": [], "csrf": []}], (method, path)


# Accounts


def test_people_log_in_by_name(named_app):
    client = PageClient(named_app, {"person": "bob", "password": PASSWORD})
    session = client.get("/api/session").json()
    assert (session["person"], session["is_lead"], session["named"]) == ("bob", False, True)
    for login in ({"person": "bob", "password": "wrong wrong"}, {"person": "eve", "password": PASSWORD}):
        answer = stranger(named_app).post("/api/session", json=login)
        assert kind_of(answer) == (401, "no-session")
    assert answer.json()["error"]["message"] == "name or password are wrong; a lead can give you another password"
    answer = stranger(named_app).post("/api/session", json={"token": named_app.state.review.people.token})
    assert kind_of(answer) == (401, "no-session")


def test_only_leads_manage_accounts(named_app):
    bob = PageClient(named_app, {"person": "bob", "password": PASSWORD})
    lea = PageClient(named_app, {"person": "lea", "password": PASSWORD})
    new = {"person": "Zoé 😀", "password": PASSWORD, "is_lead": False}
    assert kind_of(bob.get("/api/accounts")) == (403, "forbidden")
    assert kind_of(bob.post("/api/accounts", json=new)) == (403, "forbidden")
    assert kind_of(bob.delete("/api/accounts", params={"person": "lea"})) == (403, "forbidden")
    assert lea.post("/api/accounts", json=new).json() == {"person": "Zoé 😀", "is_lead": False, "is_active": True}
    assert lea.post("/api/accounts", json={**new, "password": None, "is_lead": True}).json()["is_lead"]
    assert PageClient(named_app, {"person": "Zoé 😀", "password": PASSWORD}).get("/api/accounts").status_code == 200
    assert kind_of(lea.delete("/api/accounts", params={"person": "lea"})) == (409, "conflict")
    assert kind_of(lea.delete("/api/accounts", params={"person": "nobody"})) == (404, "not-found")
    assert lea.delete("/api/accounts", params={"person": "bob"}).status_code == 204
    assert kind_of(bob.get("/api/session")) == (401, "no-session")  # at once
    rows = {row["person"]: row["is_active"] for row in lea.get("/api/accounts").json()}
    assert rows == {"lea": True, "bob": False, "Zoé 😀": True}
    for wrong in (
        {**new, "person": ""},
        {**new, "person": "x", "password": None},
        {**new, "person": "x", "password": "short"},
        {"person": "x"},
    ):
        assert kind_of(lea.post("/api/accounts", json=wrong)) == (422, "input")


def test_too_many_wrong_passwords_have_to_wait(named_app):
    client = stranger(named_app)
    answers = [client.post("/api/session", json={"person": "bob", "password": f"wrong {n:09}"}) for n in range(7)]
    assert [answer.status_code for answer in answers] == [401] * 5 + [429] * 2
    assert kind_of(answers[-1]) == (429, "too-many")
    assert 0 < int(answers[-1].headers["retry-after"]) <= 300


# Refusals


@pytest.mark.parametrize(
    ("how", "status", "kind"),
    [
        ("input", 422, "input"),
        ("not-found", 404, "not-found"),
        ("conflict", 409, "conflict"),
        ("corpus", 503, "corpus"),
        ("stale", 409, "stale"),
        ("icechunk", 503, "corpus"),
        ("overflow", 422, "input"),
        ("server", 500, "server"),
    ],
)
def test_each_refusal_has_the_one_shape(app, how, status, kind):
    answer = PageClient(app).get("/api/odd", params={"how": how})
    assert kind_of(answer) == (status, kind)
    assert "secret" not in answer.text
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["content-security-policy"]


def test_what_is_not_there_or_not_as_described_has_that_shape_too(app):
    client = PageClient(app)
    assert kind_of(client.get("/api/nothing")) == (404, "not-found")
    assert kind_of(client.get("/api/odd")) == (422, "input")
    assert kind_of(client.patch("/api/session")) == (405, "input")
    assert kind_of(client.put("/api/settings", content=b"{", headers={"Content-Type": "application/json"})) == (
        422,
        "input",
    )


@pytest.mark.parametrize(
    "body",
    [
        b'{"a": NaN}',
        b'{"a": 1e999}',
        b'{"a": "\\ud800"}',
        b'{"a": "\xff"}',
        b'{"a":' * 300 + b"1" + b"}" * 300,
        b"[" * 100_000,
        b'{"a":' + b"1" * 5000 + b"}",
        b'{"a": "' + b"x" * 70_000 + b'"}',
        b"[]",
        b"null",
        b"",
    ],
)
def test_odd_json_is_refused_and_changes_nothing(app, body):
    client = PageClient(app)
    answer = client.put("/api/settings", content=body, headers={"Content-Type": "application/json"})
    assert kind_of(answer) in ((400, "input"), (422, "input"))
    assert client.get("/api/session").json()["settings"] == {}


# The guard


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:8000", "", "a b", "[::1", "localhost.evil"])
def test_a_foreign_name_for_this_server_is_refused(app, host):
    answer = PageClient(app).get("/api/session", headers={"Host": host})
    assert kind_of(answer) == (403, "forbidden")
    assert "csrf" not in answer.json()


@pytest.mark.parametrize("host", ["localhost:8000", "127.0.0.1", "[::1]:9", "192.168.1.7:80", "Review.Example.org:443"])
def test_own_names_and_plain_addresses_are_right(app, host):
    assert PageClient(app).get("/api/session", headers={"Host": host}).status_code == 200


def test_the_hosts_own_names():
    assert name_hosts(None) == {"localhost"}
    assert {"localhost", "lab.example.org", "proxy"} <= name_hosts("Lab.example.org", ["proxy"])


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:9999", "http://[", ""])
def test_a_page_of_another_origin_may_not_change_anything(app, origin):
    client = PageClient(app)
    assert kind_of(client.put("/api/settings", json={"a": 1}, headers={"Origin": origin})) == (403, "forbidden")
    login = {"token": app.state.review.people.token}
    assert kind_of(client.post("/api/session", json=login, headers={"Origin": origin})) == (403, "forbidden")
    assert client.get("/api/session").json()["settings"] == {}
    assert client.put("/api/settings", json={}, headers={"Origin": HOST}).status_code == 200


def test_another_site_may_not_even_ask(app):
    client = PageClient(app)
    asked = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}
    assert kind_of(client.get("/api/session", headers=asked)) == (403, "forbidden")
    followed = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}  # a link in a mail
    assert client.get("/", headers=followed).status_code == 200


def test_bodies_have_a_limit_whether_or_not_they_tell_their_length(app):
    client = PageClient(app)
    for path, limit in (("/api/settings", BODY_LIMIT), ("/api/elan/length", UPLOAD_LIMIT)):
        method = "PUT" if path == "/api/settings" else "POST"
        sent = 0

        def pieces(limit=limit):
            nonlocal sent
            while sent < 3 * limit:
                sent += 100_000
                yield b" " * 100_000

        answers = [
            client.request(method, path, content=b" " * (limit + 1)),
            client.request(method, path, content=pieces()),
        ]
        for answer in answers:
            assert kind_of(answer) == (413, "too-large")
            assert answer.headers["content-security-policy"]
    assert client.post("/api/elan/length", content=b"x" * UPLOAD_LIMIT).json() == UPLOAD_LIMIT


def test_every_answer_has_the_security_headers(app):
    client = PageClient(app)
    for path in ("/", "/api/session", "/api/nothing", "/assets/main-abc123.js", "/api/odd?how=server"):
        headers = client.get(path).headers
        policy = dict(part.strip().partition(" ")[::2] for part in headers["content-security-policy"].split(";"))
        assert policy["default-src"] == policy["script-src"] == policy["style-src"] == "'self'"
        assert policy["frame-ancestors"] == policy["object-src"] == policy["base-uri"] == "'none'"
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert "camera=()" in headers["permissions-policy"]
        assert "server" not in headers


# What is sent


def test_json_is_compressed_for_whoever_takes_it(app):
    client = PageClient(app)
    plain = client.get("/api/numbers?n=30000", headers={"Accept-Encoding": "identity"})
    packed = client.get("/api/numbers?n=30000", headers={"Accept-Encoding": "gzip"})
    assert packed.json() == plain.json() == list(range(30000))
    assert packed.headers["content-encoding"] == "gzip" and "content-encoding" not in plain.headers
    assert int(packed.headers["content-length"]) < int(plain.headers["content-length"]) / 2
    assert "Accept-Encoding" in packed.headers["vary"]
    small = client.get("/api/numbers?n=3", headers={"Accept-Encoding": "gzip"})
    assert "content-encoding" not in small.headers
    client.put("/api/settings", json={"a": "x" * 5000})
    session = client.get("/api/session", headers={"Accept-Encoding": "gzip"})
    assert "content-encoding" not in session.headers  # holds the CSRF token
    client.put("/api/settings", json={})


def test_the_page_is_served_whole_and_kept(app):
    client = stranger(app)
    first = client.get("/", headers={"Accept-Encoding": "gzip"})
    assert first.status_code == 200 and first.headers["content-type"].startswith("text/html")
    assert first.headers["cache-control"] == "no-cache"
    assert client.get("/", headers={"If-None-Match": first.headers["etag"]}).status_code == 304
    assert client.get("/index.html").text == first.text
    script = client.get("/assets/main-abc123.js", headers={"Accept-Encoding": "gzip"})
    assert script.headers["content-type"].startswith("text/javascript")
    assert script.headers["content-encoding"] == "gzip" and script.text == "export const x = 1;\n" * 100
    assert "immutable" in script.headers["cache-control"]
    plain = client.get("/assets/main-abc123.js", headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers and plain.text == script.text
    assert client.head("/").status_code == 200 and client.head("/").content == b""


@pytest.mark.parametrize(
    "path", ["/..%2f..%2fetc/passwd", "/assets/../../errors.py", "/%00", "/assets", "/assets/", "/%ff", "//etc/passwd"]
)
def test_nothing_but_the_page_is_served(app, path):
    assert kind_of(stranger(app).get(path))[0] == 404


def test_a_copy_without_the_page_says_how_to_build_it(tmp_path):
    answer = StaticPage(tmp_path).answer(PLAIN_REQUEST, "")
    assert answer.status_code == 503
    assert b"make page" in answer.body and answer.body.count(b"\n") == 1


def test_a_page_built_anew_is_seen(tmp_path):
    page = StaticPage(tmp_path)
    (tmp_path / "index.html").write_text("one")
    assert page.answer(PLAIN_REQUEST, "").body == b"one"
    time.sleep(0.01)
    (tmp_path / "index.html").write_text("two")
    assert page.answer(PLAIN_REQUEST, "").body == b"two"


# The description


def test_the_description_refers_to_what_it_has_and_to_nothing_elsewhere(app):
    described = PageClient(app).get("/api/openapi.json").json()
    text = json.dumps(described)
    names = set(described["components"]["schemas"])
    assert {part.split('"')[0] for part in text.split("#/components/schemas/")[1:]} <= names
    assert "HTTPValidationError" not in text
    assert "http://" not in text and "https://" not in text
    for path in ("/docs", "/redoc"):  # FastAPI's would load scripts from elsewhere
        assert stranger(app).get(path).status_code == 404
    answer = stranger(app).get("/api/openapi.json", headers={"Accept-Encoding": "gzip"})
    assert len(gzip.compress(answer.content)) < len(answer.content)
