"""The whole path on the simulated corpus at the thesis's size: how long each stage takes, and the table of Figure 4.4.

Run ``python benchmarks/bench_simulated_corpus.py``; ``--seconds 120`` for a quick one. ``--out FILE`` writes a page of
the documentation. Needs about 2 GB of disk in the temporary folder.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
from mimique.corpus import Corpus
from mimique.models import recording_times
from mimique.workbench.pipeline.evaluating import evaluate
from mimique.workbench.pipeline.ingesting import ingest, read_recording_list
from mimique.workbench.pipeline.labelled_takes import choose_author, read_labelled_takes
from mimique.workbench.pipeline.rigging import AVATAR, add_rig
from mimique.workbench.pipeline.segmenting import segment
from mimique.workbench.pipeline.session_solver import SolveOptions
from mimique.workbench.pipeline.solving import solve
from mimique.workbench.simulation_files import RECORDING_LIST, write_simulated_corpus

SOLVES = {"lsts, α = 0.3 (the thesis's)": SolveOptions(method="lsts", alpha=0.3), "map (default)": SolveOptions()}
PAGE = """# The simulated corpus

Written by `benchmarks/bench_simulated_corpus.py --out docs/simulated_corpus.md`.

**Simulated signers: the numbers below say how the methods work on them, not how people are recognised.**
{takes} takes of {signers} signers, {seconds:.0f} s, difficulty medium, seed {seed}. The parameters of the simulation
were fixed before any classifier was tuned; the defaults of the segmentation were chosen while looking at a simulated
corpus of another seed.

## Recording times

Seconds by the first annotator's tier, as in Reverdy 2019, Table B.1 (cr is s1, cl2cr is s2).

{times}

## Labels of the EU takes

Trained on IE and SE, tested on EU, per signer (Reverdy 2019, Figure 4.4); both signers together. *Duration* is the
accuracy weighted by the segments' length, *majority* what always naming the most frequent label would reach.

{labels}

## Time

On two cores; seconds of recording per second of work in brackets. The whole run held at most {memory:.1f} GB.

{stages}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    stages: dict[str, float] = {}

    def timed(name: str, work: Callable[[], Any]) -> Any:
        start = time.perf_counter()
        result = work()
        stages[name] = time.perf_counter() - start
        print(f"{name}: {stages[name]:.1f} s", flush=True)
        return result

    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        timed("simulate", lambda: write_simulated_corpus(root / "s", seconds=arguments.seconds, seed=arguments.seed))
        corpus = Corpus.create(root / "corpus", name="simulated")
        add_rig(corpus, "avatar", AVATAR)
        timed("ingest", lambda: ingest(corpus, read_recording_list(root / "s" / RECORDING_LIST)))
        tables = []
        for name, options in SOLVES.items():
            timed(f"solve, {options.method}", lambda options=options: solve(corpus, options))
            timed(f"segment, {options.method}", lambda: segment(corpus))
            result = timed(f"train and test five classifiers, {options.method}", lambda: evaluate(corpus))
            tables.append(result.table.assign(solve=name))
        takes = corpus.takes()
        labelled = read_labelled_takes(corpus, choose_author(corpus), with_weights=False)
        times = recording_times(labelled).round(1).reset_index()

    everyone = pd.concat(tables).query("signer == 'all'")
    columns = [
        "solve",
        "classifier",
        "segmentation",
        "n_segments",
        "accuracy",
        "accuracy_duration",
        "balanced_accuracy",
        "majority",
    ]
    labels = (
        everyone[columns].rename(columns={"accuracy_duration": "duration", "balanced_accuracy": "balanced"}).round(3)
    )
    seconds = float(takes["seconds"].sum())
    rows = [(name, f"{spent:.1f} s ({seconds / spent:.0f} ×)") for name, spent in stages.items()]
    print(labels.to_string(index=False))
    if arguments.out is not None:
        arguments.out.write_text(
            PAGE.format(
                takes=len(takes),
                signers=takes["signer"].nunique(),
                seconds=seconds,
                seed=arguments.seed,
                times=as_markdown(times),
                labels=as_markdown(labels),
                stages=as_markdown(pd.DataFrame(rows, columns=["stage", "time"])),
                memory=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
            ),
            encoding="utf-8",
        )


def as_markdown(table: pd.DataFrame) -> str:
    """Return a table in Markdown."""
    rows = [list(table.columns), ["---"] * table.shape[1], *table.astype(object).to_numpy().tolist()]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows)


if __name__ == "__main__":
    main()
