"""How soon an edit is acknowledged while eight annotators edit at once, and whether any is lost.

A server is started as a person starts it, on a simulated corpus; eight people log in by name and edit their drafts of
the same takes as fast as they are answered. Every edit is on disk before it is acknowledged, so in the same run the
peers are: a durable write of SQLite alone, and the server's shortest answer under the same load. Then all publish, and
the edits are counted in the database and in the corpus::

    python benchmarks/bench_review.py [EDITS_PER_PERSON]

``docs/write_review_figures.py`` puts what it finds into the documentation.
"""

from __future__ import annotations

import importlib.util
import sqlite3
import sys
import tempfile
import threading
import time
from pathlib import Path
from types import ModuleType

import numpy as np
from mimique.corpus import Corpus

PEOPLE = tuple(f"annotator {n}" for n in range(1, 9))
PASSWORD = "a long enough password"
TESTS = Path(__file__).resolve().parents[1] / "tests" / "review"


def load(name: str) -> ModuleType:
    """Import a module of the tests, which are no package that is installed."""
    spec = importlib.util.spec_from_file_location(name, TESTS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def time_sqlite(path: Path, count: int = 300) -> np.ndarray:
    """Seconds of durable inserts of half a kilobyte, one after the other."""
    connection = sqlite3.connect(path, isolation_level=None)
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=FULL")
    connection.execute("CREATE TABLE edits (text TEXT)")
    times = []
    for _ in range(count):
        begin = time.perf_counter()
        connection.execute("INSERT INTO edits VALUES (?)", ("x" * 500,))
        times.append(time.perf_counter() - begin)
    connection.close()
    return np.array(times)


def annotate(client, take: str, edits: int, rng: np.random.Generator, barrier: threading.Barrier, out: dict) -> None:
    """Relabel, move, split, merge and accept until so many edits are acknowledged."""
    draft = client.draft(take)
    version = draft["version"]
    segments = {one["id"]: one for one in next(t for t in draft["tiers"] if t["tier"] == "affect")["segments"]}
    labels = ("N", "A", "D", "F", "J", "Sa", "Su")
    times, idle, refused = [], [], 0
    barrier.wait()
    while len(times) < edits:
        chosen = segments[list(segments)[int(rng.integers(len(segments)))]]
        kind = ("relabel", "split", "accept", "relabel")[int(rng.integers(4))]
        middle = (chosen["onset"] + chosen["offset"]) // 2
        if kind == "split" and middle > chosen["onset"] and len(segments) < 200:
            operation = {"kind": "split", "tier": "affect", "segment": chosen["id"], "frame": middle}
        elif kind == "accept" and chosen["status"] == "proposed":
            operation = {"kind": "accept", "tier": "affect", "segments": [chosen["id"]]}
        else:
            label = str(rng.choice([one for one in labels if one != chosen["label"]]))
            operation = {"kind": "relabel", "tier": "affect", "segments": [chosen["id"]], "label": label}
        begin = time.perf_counter()
        answer = client.edit(take, version, operation)
        times.append(time.perf_counter() - begin)
        if answer.status_code != 200:
            refused += 1
            print(answer.text)
            break
        body = answer.json()
        version = body["version"]
        for change in body["changes"]:
            for name in change["removed"]:
                segments.pop(name, None)
            segments.update({one["id"]: one for one in change["added"]})
        if len(times) % 10 == 0:
            begin = time.perf_counter()
            client.get("/api/session")
            idle.append(time.perf_counter() - begin)
    out[client.session["person"]] = (np.array(times), np.array(idle), refused, segments)


def measure(edits: int = 100) -> dict[str, float]:
    """Run, print what was found, and return the figures."""
    running = load("running_server")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "corpus"
        load("review_corpus").make_review_corpus(folder)
        for person in PEOPLE:
            lead = ["--lead"] if person == PEOPLE[0] else []
            words = ["reviewer", "add", folder, person, "--password-stdin", *lead]
            running.run_mimique(*words, text=PASSWORD + "\n")
        peer = time_sqlite(Path(name) / "peer.sqlite")
        with running.RunningServer(folder, "--host", "127.0.0.1") as server:
            clients = [running.Client(server.origin, person=person, password=PASSWORD) for person in PEOPLE]
            out: dict = {}
            barrier = threading.Barrier(len(clients))
            threads = [
                threading.Thread(
                    target=annotate, args=(client, "ab_IE_1", edits, np.random.default_rng(n), barrier, out)
                )
                for n, client in enumerate(clients)
            ]
            begin = time.perf_counter()
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            seconds = time.perf_counter() - begin
            times = np.concatenate([one[0] for one in out.values()])
            idle = np.concatenate([one[1] for one in out.values()])
            print(
                f"{len(times)} edits by {len(clients)} people in {seconds:.1f} s, {len(times) / seconds:.0f} a second"
            )
            for what, some in (("edit acknowledged", times), ("GET /api/session", idle), ("SQLite alone", peer)):
                low, high = np.quantile(some, [0.5, 0.99]) * 1000
                print(f"{what:>20}: median {low:.1f} ms, p99 {high:.1f} ms")
            print(f"ratio of medians: {np.median(times) / np.median(idle):.2f} to the shortest answer")
            draft_edits = {one["person"]: one["edits"] for one in overview(clients[0])}
            for client in clients:
                plan = client.get("/api/publish")
                body = {"plan": plan["plan"], "message": "Bench", "choices": {}}
                answer = client.post("/api/publish", body)
                answer.raise_for_status()
            corpus = Corpus.open(folder)
            lost = 0
            for person, (_, _, refused, segments) in out.items():
                table = corpus.tier("ab_IE_1", "affect", person)
                there = {
                    (str(row.id), int(row.onset), int(row.offset), row.label, row.status) for row in table.itertuples()
                }
                shown = {(s["id"], s["onset"], s["offset"], s["label"], s["status"]) for s in segments.values()}
                lost += len(there ^ shown) + refused + abs(draft_edits[person] - edits)
            print(f"edits counted in the database: {sum(draft_edits.values())}; differences to the corpus: {lost}")
    median, high = np.quantile(times, [0.5, 0.99]) * 1000
    return {
        "edits": len(times),
        "pace": len(times) / seconds,
        "median": float(median),
        "high": float(high),
        "lost": lost,
    }


def overview(client) -> list[dict]:
    """Return the lead's overview of the people."""
    return list(client.get("/api/overview")["people"])


if __name__ == "__main__":
    measure(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
