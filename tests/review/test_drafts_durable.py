"""Edits that were acknowledged are there, though the process was killed or the disk was full."""

import ast
import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts.records import DraftKey

from .review_corpus import TAKES, copy_review_corpus

KEY = DraftKey("ab", TAKES[0])


@pytest.fixture
def folder(tmp_path):
    return copy_review_corpus(tmp_path / "corpus", takes=TAKES[:1], weights=False, n_frames=1200)


class Worker:
    def __init__(self):
        program = Path(__file__).with_name("draft_worker.py")
        self.process = subprocess.Popen(
            [sys.executable, str(program)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def start(self, *words):
        """Start a process and return its number."""
        self.process.stdin.write("\t".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        return int(self.hear("process")[0])

    def hear(self, expected):
        """Return the rest of the next line that begins so."""
        for line in self.process.stdout:
            word, *rest = line.split(maxsplit=5)
            if word == expected:
                return rest
            assert word in ("ack", "ended", "process"), line
        raise AssertionError("the worker ended")


@pytest.fixture(scope="module")
def worker():
    worker = Worker()
    yield worker
    worker.process.stdin.close()
    assert worker.process.wait(30) == 0
    worker.process.stdout.close()


def test_what_was_acknowledged_survives_being_killed_ten_times(folder, worker):
    chance = random.Random(4)
    first = 0
    for _ in range(10):
        process = worker.start("kill", folder, first)
        for _ in range(chance.randrange(2, 25)):
            acknowledged, version = map(int, worker.hear("ack"))
        os.kill(process, signal.SIGKILL)
        for line in worker.process.stdout:  # what it had acknowledged before it ended
            word, *rest = line.split()
            if word == "ended":
                break
            acknowledged, version = map(int, rest)
        review = open_review(folder, owner="ab")
        state = review.drafts.open(KEY)
        # One more edit, with its undo and redo, may be on disk that nobody was told of.
        assert version <= state.version <= version + 3
        while state.redo is not None:
            review.drafts.redo(KEY, request=f"again-{state.version}", version=state.version)
            state = review.drafts.open(KEY)
        labels = {row["label"] for row in state.tiers["affect"].rows}
        done = [number for number in range(600) if f"e{number}" in labels]
        assert done == list(range(len(done)))
        assert acknowledged + 1 <= len(done) <= acknowledged + 2
        with review.database.read() as connection:
            assert connection.execute("PRAGMA integrity_check").fetchone()[0] == "ok"
        review.close()
        first = len(done)


def test_a_full_disk_is_said_and_the_edit_goes_through_once_there_is_room(folder, worker):
    worker.start("full", folder, 150_000)
    number, version, seen, after, refusal = worker.hear("full")
    assert int(number) > 3
    assert "make room on the disk" in refusal
    assert "\n" not in ast.literal_eval(refusal)
    assert (int(seen), int(after)) == (int(version), int(version) + 1)
    review = open_review(folder, owner="ab")
    labels = {row["label"] for row in review.drafts.open(KEY).tiers["affect"].rows}
    assert {f"e{one}" for one in range(int(number) + 1)} <= labels
    review.close()
