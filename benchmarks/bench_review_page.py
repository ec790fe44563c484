"""How soon the review page shows a face, how soon a seek, and what a picture costs the browser's scripts.

A take of ten minutes at 200 Hz on a face of the size of ICT's (that rig where a folder is given, else the avatar) is
served and opened in Chromium without a screen. Peers in the same run: fetching the same bytes without drawing them.
Drawing by software says nothing of a graphics card, so pictures per second are not told::

    python benchmarks/bench_review_page.py [RIG UNIT]

``docs/write_review_figures.py`` puts what it finds into the documentation.
"""

from __future__ import annotations

import gzip
import sys
import tempfile
import time
from pathlib import Path

import httpx
import mimique
import numpy as np
from bench_review import load
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.synthesis import read_rig
from mimique.synthesis.avatar import build_avatar

RATE, SECONDS = 200.0, 600
SEEKS, PLAYED = 40, 8  # seeks; s of playing


def make_corpus(folder: Path, rig_path: str | None, unit: str | None) -> dict[str, float]:
    """A long take on which every shape comes and goes; returns how large the face is."""
    rig = build_avatar() if rig_path is None else read_rig(rig_path, unit=unit)
    n_frames = round(RATE * SECONDS)
    phase = np.arange(rig.n_shapes) * 1.7
    time_s = np.arange(n_frames)[:, None] / RATE
    weights = np.clip(np.sin(0.9 * time_s + phase) - 0.5, 0, 1)
    labels = load("review_corpus").make_proposals(n_frames, np.random.default_rng(0))
    corpus = Corpus.create(folder)
    with corpus.transaction("Add a long take") as edit:
        edit.put_rig("face", rig.to_dataset())
        edit.put_take("long", make_take(np.empty((n_frames, 0, 3)), [], RATE, without_markers=True, signer="s"))
        edit.put_weights("long", weights, shapes=rig.shapes, residual=np.full(n_frames, 0.3), rig="face", method="map")
        edit.put_weights("long", 0.8 * weights, shapes=rig.shapes, solve="milder", rig="face", current=False)
        edit.put_tier("long", "affect", labels, author="forest", provenance={"step": "label"})
    print(f"{rig.n_vertices} vertices, {rig.n_shapes} shapes, {n_frames} frames, {len(labels)} segments")
    return {"vertices": rig.n_vertices, "shapes": rig.n_shapes}


def wait(page, expression: str, limit: float = 60.0) -> float:
    """Seconds until an expression over ``s``, ``clock`` and ``faces`` is true, seen by the page itself."""
    script = f"""() => new Promise((resolve) => {{
        const begin = performance.now();
        const look = () => {{
            const {{ state: s, clock, faces }} = window.mimique ?? {{ state: {{}}, clock: {{}}, faces: [] }};
            if ({expression}) resolve(performance.now() - begin);
            else if (performance.now() - begin > {limit * 1000}) resolve(NaN);
            else setTimeout(look, 1);
        }};
        look();
    }})"""
    return page.evaluate(script) / 1000


def tell(what: str, seconds: list[float]) -> None:
    """Print median, 95th percentile and the worst in ms."""
    values = np.array(seconds) * 1000
    print(
        f"{what:>44}: median {np.median(values):.1f}, p95 {np.quantile(values, 0.95):.1f}, most {values.max():.1f} ms"
    )


def watch(server, driver) -> dict[str, float]:
    """Open, seek, play; returns the figures, in ms."""
    figures: dict[str, float] = {}
    shown = "faces.length > 0 && faces[0].frame >= 0 && faces[0].drawn > 0 && s.draft.value !== null"
    with driver.open_browser() as browser, browser.new_context(viewport={"width": 1280, "height": 720}) as context:
        page = context.new_page()
        opened = []
        for _ in range(6):
            page.goto("about:blank")
            begin = time.perf_counter()
            page.goto(server.address, wait_until="commit")
            wait(page, shown)
            opened.append(time.perf_counter() - begin)
        tell("first picture, nothing kept by the browser", opened[:1])
        tell("first picture, opened again", opened[1:])
        figures |= {"first": opened[0] * 1000, "again": float(np.median(opened[1:])) * 1000}
        page.wait_for_timeout(3000)

        rng = np.random.default_rng(1)
        frames = [int(frame) for frame in rng.choice(int(RATE * SECONDS) // 1024, SEEKS, replace=False) * 1024 + 500]
        cookies = {one["name"]: one["value"] for one in context.cookies()}
        fetched, seeks = [], []
        with httpx.Client(base_url=server.origin, cookies=cookies) as http:
            for place, frame in enumerate(frames):
                if place % 2:
                    query = {"take": "long", "first": frame - 500, "count": 1024}
                    begin = time.perf_counter()
                    http.get("/api/weights", params=query).raise_for_status()
                    fetched.append(time.perf_counter() - begin)
                else:
                    seeks.append(
                        page.evaluate(
                            f"""() => new Promise((resolve) => {{
                            const begin = performance.now();
                            window.mimique.clock.seek({frame});
                            const look = () => window.mimique.faces[0].frame === {frame}
                                ? resolve(performance.now() - begin) : setTimeout(look, 1);
                            look();
                        }})"""
                        )
                        / 1000
                    )
                page.wait_for_timeout(600)
        tell("seek to where nothing was fetched", seeks)
        tell("peer: fetching these frames", fetched)
        figures |= {"seek": float(np.median(seeks)) * 1000, "slowest seek": max(seeks) * 1000}

        session = context.new_cdp_session(page)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})  # not what other programs take

        def spent() -> tuple[float, int]:
            metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
            return metrics["ScriptDuration"], page.evaluate("() => window.mimique.faces[0].drawn")

        for what, key in (("take as it is", None), ("with two faces", "b")):
            if key:
                page.keyboard.press(key)
                assert wait(page, "faces.length === 2 && faces[1].drawn > 0") < 60, "no second face"
            page.keyboard.press("Space")
            page.wait_for_timeout(1000)
            before = spent()
            page.wait_for_timeout(PLAYED * 1000)
            after = spent()
            page.keyboard.press("Space")
            pictures = after[1] - before[1]
            each = (after[0] - before[0]) / max(pictures, 1) * 1000
            figures |= {f"scripts {what}": each, f"pictures {what}": pictures / PLAYED}
            own = page.evaluate("() => window.mimique.faces.map((one) => one.milliseconds)")
            print(f"{'scripts a picture, ' + what:>44}: {each:.2f} ms ({pictures} pictures; last face {own[0]:.2f} ms)")
    return figures


def measure(rig: str | None = None, unit: str | None = None) -> dict[str, float]:
    """Run, print what was found, and return the figures."""
    static = Path(mimique.__file__).parent / "workbench" / "review" / "static"
    size = sum(
        len(gzip.compress(path.read_bytes())) for path in static.rglob("*") if path.suffix in (".js", ".css", ".html")
    )
    print(f"the page: {size / 1000:.0f} kB gzipped")
    running, driver = load("running_server"), load("page_driver")
    with tempfile.TemporaryDirectory() as name:
        figures = {"size": size / 1000, **make_corpus(Path(name) / "corpus", rig, unit)}
        with running.RunningServer(Path(name) / "corpus") as server:
            time.sleep(5)  # the rig is made ready in the background
            return figures | watch(server, driver)


if __name__ == "__main__":
    measure(*sys.argv[1:3])
