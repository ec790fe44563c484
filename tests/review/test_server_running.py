"""``mimique review`` and ``mimique reviewer`` as they are typed: addresses, locks, ends, accounts, refusals."""

import io
import re
import signal
import socket
import sqlite3
import subprocess
import sys
import time

import httpx
import pytest
from mimique.corpus import Corpus
from mimique.workbench.cli import run
from mimique.workbench.review.context import open_database, review_folder
from mimique.workbench.review.people import passwords
from mimique.workbench.review.people.accounts import Accounts
from mimique.workbench.review.server.server_lock import find_last_port, lock_server, note_address

from .review_corpus import make_review_corpus
from .running_server import PROGRAM, Client, RunningServer

PASSWORD = "a long password"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return make_review_corpus(tmp_path_factory.mktemp("run") / "corpus", takes=("ab_IE_1",), n_frames=200).path


def refuse(capsys, *words):
    """Run a command that is refused, and return its one line."""
    assert run([str(word) for word in words]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


def test_one_person_is_let_in_by_the_token_and_found_again_after_a_crash(path):
    with RunningServer(path) as server:
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#token=[\w-]{40,}", server.address)
        assert httpx.get(server.origin + "/api/session").status_code == 401
        client = Client(server.origin, token=server.token)
        assert client.session["person"] == "ann" and client.session["is_lead"]
        assert not client.session["named"]
        assert [row["take"] for row in client.get("/api/corpus")["takes"]] == ["ab_IE_1"]
        before = server.address

        second = subprocess.run(
            [sys.executable, "-c", PROGRAM, "review", str(path), "--no-browser"], capture_output=True, text=True
        )
        assert second.returncode == 2
        assert f"already reviewed at {server.origin}/ (process {server.process.pid} on " in second.stderr
        assert server.token not in second.stderr and second.stderr.count("\n") == 1
        assert server.token not in (review_folder(path) / "server.json").read_text()

        server.kill()
        server.start()
        assert server.origin == before.split("/#")[0]  # the same port: pages that are open go on
        assert server.token != before.partition("token=")[2]
        assert client.get("/api/session") == client.session  # and so does the session
        answer = httpx.post(server.origin + "/api/session", json={"token": before.partition("token=")[2]})
        assert answer.status_code == 401
        client.http.close()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_when_told_to_even_with_answers_under_way(path, how):
    with RunningServer(path) as server:
        port = int(server.origin.rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port)) as busy:  # has sent half a request
            busy.sendall(b"POST /api/session HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n{")
            time.sleep(0.1)
            server.process.send_signal(how)
            code = server.process.wait(30)  # it would wait for the other half for ever
        said = server.process.stdout.read()
        assert "Traceback" not in said
        if how == signal.SIGINT:
            assert code == 0
            assert "edits that are not published are kept" in said


@pytest.mark.slow
def test_a_route_that_still_computes_does_not_hold_up_the_end(path, tmp_path):
    program = tmp_path / "slow.py"
    program.write_text(
        "import sys, time\n"
        "from fastapi import APIRouter\n"
        "from mimique.workbench.review.server import running\n"
        "def make(review, **options):\n"
        "    app = running.create_app(review, **options)\n"
        "    router = APIRouter()\n"
        "    @router.get('/slow')\n"
        "    def slow():\n"
        "        print('computing', flush=True)\n"
        "        time.sleep(60)\n"
        "    app.include_router(router)\n"
        "    app.router.routes.insert(0, app.router.routes.pop())\n"
        "    return app\n"
        "say = lambda line: print(line, flush=True)\n"
        "running.run_server(running.Serving(sys.argv[1], owner='ab'), say=say, open_browser=False, make_app=make)\n"
    )
    process = subprocess.Popen([sys.executable, program, str(path)], stdout=subprocess.PIPE, text=True)
    try:
        address = re.search(r"http://[^/]+", process.stdout.readline()).group()
        with socket.create_connection(("127.0.0.1", int(address.rpartition(":")[2]))) as asking:
            asking.sendall(b"GET /slow HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            while "computing" not in process.stdout.readline():
                pass
            process.send_signal(signal.SIGINT)
            assert process.wait(30) == 0  # far less than the minute that the route takes
        assert "are kept" in process.stdout.read()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


class SecureServer(RunningServer):
    """With a certificate that nobody vouches for."""

    def _wait_until_it_answers(self):
        httpx.get(self.origin + "/", timeout=30, verify=False)


@pytest.mark.slow
def test_people_with_names_log_in_over_https(path, tmp_path, capsys):
    certificate, key = make_certificate(tmp_path)
    Accounts(open_database(path)).add("lea", PASSWORD, is_lead=True)
    with SecureServer(path, "--host", "127.0.0.1", "--certificate", str(certificate), "--key", str(key)) as server:
        assert server.address.startswith("https://127.0.0.1:") and "token" not in server.address
        with httpx.Client(base_url=server.origin, verify=False) as http:
            assert http.post("/api/session", json={"token": "x"}).status_code == 401
            answer = http.post("/api/session", json={"person": "lea", "password": PASSWORD})
            assert answer.json()["named"] and "Secure" in answer.headers["set-cookie"]
            assert http.get("/api/corpus").status_code == 200
            Accounts(open_database(path)).change("lea", password="another password")
            assert http.get("/api/corpus").status_code == 401  # while the server runs
    capsys.readouterr()
    assert "cannot be used as a certificate" in refuse(
        capsys, "review", path, "--no-browser", "--host", "127.0.0.1", "--certificate", key, "--key", key
    )


def make_certificate(folder):
    """Make a certificate for this machine, with the system's openssl."""
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    try:
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=127.0.0.1"]
            + ["-keyout", key, "-out", certificate],
            check=True,
            capture_output=True,
        )
    except FileNotFoundError:
        pytest.skip("openssl is not at hand to make a certificate with")
    return certificate, key


def test_what_stands_in_the_way_is_one_line(tmp_path, capsys):
    path = make_review_corpus(tmp_path / "corpus", takes=("ab_IE_1",), n_frames=200, weights=False).path
    assert "no such folder" in refuse(capsys, "review", tmp_path / "nothing", "--no-browser")
    assert "no such folder" in refuse(capsys, "reviewer", "list", tmp_path / "nothing")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["corpus"]
    line = refuse(capsys, "review", path, "--no-browser", "--host", "127.0.0.1")
    assert "mimique reviewer add" in line and "--lead" in line
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert f"port {port}: cannot be listened at" in refuse(capsys, "review", path, "--port", port, "--no-browser")
    assert "port" in refuse(capsys, "review", path, "--no-browser", "--port", 70000)
    assert "author" in refuse(capsys, "review", path, "--no-browser", "--host", "127.0.0.1", "--author", "x")
    assert "--certificate" in refuse(capsys, "review", path, "--no-browser", "--key", path)
    with sqlite3.connect(review_folder(path) / "edits.sqlite") as connection:
        connection.execute("PRAGMA user_version = 99")
    assert "newer mimique" in refuse(capsys, "review", path, "--no-browser")


def test_reviewers_come_and_go(tmp_path, capsys, monkeypatch):
    path = Corpus.create(tmp_path / "corpus", author="test").path
    monkeypatch.setattr(passwords, "_hasher", passwords.PasswordHasher(time_cost=1, memory_cost=64, parallelism=1))

    def type_in(text):
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))

    assert run(["reviewer", "list", str(path)]) == 0
    assert "reviewer add" in capsys.readouterr().out
    type_in(PASSWORD + "\n")
    assert run(["reviewer", "add", str(path), "Zoé", "--lead", "--password-stdin"]) == 0
    assert capsys.readouterr().out == "Zoé: may log in and is a lead\n"
    type_in(PASSWORD + "\r\nanother line")
    assert run(["reviewer", "add", str(path), "bob", "--password-stdin"]) == 0
    accounts = Accounts(open_database(path))
    assert accounts.check_password("bob", PASSWORD) is not None
    type_in("another password\n")
    assert run(["reviewer", "password", str(path), "bob", "--password-stdin"]) == 0
    assert accounts.check_password("bob", "another password") is not None
    capsys.readouterr()
    assert run(["reviewer", "list", str(path), "--json"]) == 0
    assert '"person": "Zoé"' in capsys.readouterr().out
    type_in("short\n")
    assert "10 to 1024" in refuse(capsys, "reviewer", "add", path, "eve", "--password-stdin")
    assert "no account 'eve'" in refuse(capsys, "reviewer", "remove", path, "eve")
    assert "only lead" in refuse(capsys, "reviewer", "remove", path, "Zoé")
    assert run(["reviewer", "remove", str(path), "bob"]) == 0
    assert accounts.check_password("bob", "another password") is None


def test_the_lock_of_a_server_that_was_killed_is_free(tmp_path):
    program = (
        "import sys, time, pathlib\n"
        "from mimique.workbench.review.server.server_lock import lock_server\n"
        "with lock_server(pathlib.Path(sys.argv[1])):\n"
        "    print('held', flush=True)\n"
        "    time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(Exception, match="already reviewed by another process"), lock_server(tmp_path):
            pass
        holder.kill()
    with lock_server(tmp_path):
        pass


def test_the_last_port_is_read_with_care(tmp_path):
    assert find_last_port(tmp_path) == 0
    note_address(tmp_path, "http://127.0.0.1:1234/", 1234)
    assert find_last_port(tmp_path) == 1234
    for text in ("", "[]", '{"port": "x"}', '{"port": 80}', '{"port": 1e99}', "\0"):
        (tmp_path / "server.json").write_text(text)
        assert find_last_port(tmp_path) == 0
