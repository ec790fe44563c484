"""A review server in a process of its own, as a person starts it, and a client that talks to it."""

import os
import re
import signal
import subprocess
import sys
import time
import uuid
from pathlib import Path

import httpx

PROGRAM = "from mimique.workbench.cli import main; main()"


def run_mimique(*words, text=""):
    """Run one command and return what it printed."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *map(str, words)], input=text, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


class RunningServer:
    """``mimique review`` on a corpus; started again it serves the same edits."""

    def __init__(self, corpus: Path, *words: str) -> None:
        self.corpus = corpus
        self.words = words
        self.process: subprocess.Popen | None = None
        self.address = ""
        self.start()

    def start(self) -> None:
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", "MIMIQUE_AUTHOR": "ann"}
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, "review", str(self.corpus), "--no-browser", *self.words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
        )
        said = []
        for line in self.process.stdout:
            said.append(line)
            found = re.search(r"https?://\S+", line)
            if found:
                self.address = found.group().rstrip(".,;)")
                break
        else:
            raise AssertionError("the server did not start: " + "".join(said))
        self._wait_until_it_answers()

    @property
    def origin(self) -> str:
        return self.address.split("/#")[0].rstrip("/")

    @property
    def token(self) -> str:
        return self.address.partition("token=")[2]

    def kill(self) -> None:
        """End it at once, as a power cut would."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()

    def stop(self) -> None:
        """End it as Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        if not self.process.stdout.closed:
            self.process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def _wait_until_it_answers(self) -> None:
        for _ in range(200):
            try:
                httpx.get(self.origin + "/", timeout=5)
                return
            except httpx.TransportError:
                time.sleep(0.05)
        raise AssertionError("the server does not answer")


class Client:
    """A person who is logged in, without a browser."""

    def __init__(self, origin: str, **login: str) -> None:
        self.http = httpx.Client(base_url=origin, headers={"Origin": origin}, timeout=60)
        answer = self.http.post("/api/session", json=login)
        answer.raise_for_status()
        self.session = answer.json()
        self.http.headers["X-Mimique-CSRF"] = self.session["csrf"]

    def get(self, path: str, **query):
        answer = self.http.get(path, params=query)
        answer.raise_for_status()
        return answer.json()

    def post(self, path: str, body):
        return self.http.post(path, json=body)

    def draft(self, take: str, purpose: str = "own"):
        return self.get("/api/draft", take=take, purpose=purpose)

    def edit(self, take: str, version: int, operation, *, request: str | None = None, purpose: str = "own"):
        body = {
            "take": take,
            "purpose": purpose,
            "request": request or str(uuid.uuid4()),
            "version": version,
            "operation": operation,
        }
        return self.post("/api/draft/edit", body)
