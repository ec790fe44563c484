"""Compare everything that labels faces, on simulated signers: the page ``docs/labels_study.md`` and its pictures.

Run ``python benchmarks/labels_study.py --save FOLDER``. It makes six simulated corpora (ten signers and two signers,
each at three difficulties, seeds that nothing was tuned on), takes them through the whole path with its defaults, and
runs the protocols of ``mimique evaluate``. Every finished piece is a file in FOLDER, so that a run can be cut short and
go on; ``--only`` names pieces, ``--list`` lists them, ``--page`` only writes the page from what is there. ``--quick``
takes short corpora and fast labellers, to see that all works. Two runs may share FOLDER once the corpora are made
(``--only corpus``), for instance ``--only labellers-m training`` beside the others.

The figures are simulated, and say nothing about real signers.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import pandas as pd
from labels_study_page import write_page
from labels_study_plots import draw
from mimique.corpus import Corpus
from mimique.models.evaluation.labeller_comparison import is_network, kind_of
from mimique.models.labellers import LABELLERS, has_torch
from mimique.models.scores.rater_scores import TEMPORAL
from mimique.workbench.pipeline.evaluating import evaluate
from mimique.workbench.pipeline.evaluating_labellers import evaluate_labellers
from mimique.workbench.pipeline.ingesting import ingest, read_recording_list
from mimique.workbench.pipeline.rigging import AVATAR, add_rig
from mimique.workbench.pipeline.segmenting import segment
from mimique.workbench.pipeline.solving import solve
from mimique.workbench.progress import ConsoleReporter
from mimique.workbench.simulation_files import RECORDING_LIST, TRUTH, read_truth, write_simulated_corpus
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).resolve().parents[1]
IMAGES = "images"
PARTS = {
    "confidence": ("evaluating_confidence", "evaluate_confidence"),
    "segmentation": ("evaluating_segmentation", "evaluate_segmentation"),
    "intensity": ("evaluating_intensity", "evaluate_intensity"),
}


@dataclass(frozen=True)
class Made:
    """A simulated corpus. No seed here was ever looked at while something was designed or tuned."""

    signers: int
    difficulty: str
    seconds: float
    seed: int

    @property
    def name(self) -> str:
        return f"{self.signers}-signers-{self.difficulty}"


CORPORA = (
    Made(10, "easy", 600, 3101),
    Made(10, "medium", 900, 3102),
    Made(10, "hard", 600, 3103),
    Made(2, "easy", 600, 3104),
    Made(2, "medium", 900, 3105),
    Made(2, "hard", 600, 3106),
)
MEDIUM = "10-signers-medium"
MORE_TRAININGS = (1, 2)
"""Seeds of further trainings of the networks at the middle difficulty; the first has the seed 0."""


class Study:
    """Where pieces and corpora are kept.

    Parameters
    ----------
    folder
        Made if it is not there.
    quick
        Short corpora of the middle difficulty, and labellers that train in seconds.
    """

    def __init__(self, folder: Path, quick: bool) -> None:
        self.folder, self.quick = folder, quick
        self.folder.mkdir(parents=True, exist_ok=True)
        self.networks = [name for name in LABELLERS if is_network(name)] if has_torch() and not quick else []
        slow = [name for name in LABELLERS if is_network(name)]
        self.labellers = [name for name in LABELLERS if name not in slow] + self.networks
        if quick:
            self.labellers = [name for name in self.labellers if kind_of(name) != TEMPORAL or name == "hmm"]

    def corpus(self, name: str) -> Corpus:
        return Corpus.open(self.folder / "corpora" / name)

    def truth_path(self, name: str) -> Path:
        return self.folder / "corpora" / f"{name}-truth.json"

    def pieces(self) -> dict[str, Callable[[], dict[str, Any] | None]]:
        """All pieces by name, in the order in which they are best run; corpora come first."""
        pieces: dict[str, Callable[[], dict[str, Any] | None]] = {}
        corpora = [made for made in CORPORA if made.difficulty == "medium" or not self.quick]
        for made in corpora:
            pieces[f"corpus-{made.name}"] = partial(self.make, made)
        for made in corpora:
            if made.signers == 2:
                pieces[f"reverdy2019-{made.difficulty}"] = partial(self.score_classifiers, made.name, "reverdy2019")
        pieces["across-signers-medium"] = partial(self.score_classifiers, MEDIUM, "across-signers")
        for part in PARTS:
            pieces[part] = partial(self.score_part, part)
        for made in sorted(corpora, key=lambda one: one.difficulty != "medium"):
            if made.signers == 10:
                pieces[f"labellers-{made.difficulty}"] = partial(self.score_labellers, made.name)
        for seed in MORE_TRAININGS:
            for name in self.networks:
                pieces[f"training-{seed}-{name}"] = partial(self.train_again, name, seed)
        return pieces

    def make(self, made: Made) -> dict[str, Any]:
        """Simulate and take the whole path: ingest, solve, segment, with the defaults."""
        seconds = min(made.seconds, 30.0 * made.signers) if self.quick else made.seconds
        final = self.folder / "corpora" / made.name
        part = final.with_name(f"{made.name}.part")
        for old in (part, final):
            shutil.rmtree(old, ignore_errors=True)
        simulated = part / "simulated"
        simulated.parent.mkdir(parents=True)
        seed = made.seed - 1000 if self.quick else made.seed  # a look at a quick run leaves the study's seeds unseen
        write_simulated_corpus(simulated, made.signers, made.difficulty, seconds, seed=seed)
        corpus = Corpus.create(part / made.name)
        add_rig(corpus, "avatar", AVATAR)
        ingest(corpus, read_recording_list(simulated / RECORDING_LIST))
        solve(corpus, reporter=ConsoleReporter())
        segment(corpus)
        table = corpus.takes()
        truth = {take: read_truth(simulated / TRUTH / f"{take}.npz")[1]["affect"] for take in table["take"]}
        records = {take: tier[["onset", "offset", "label"]].to_dict("records") for take, tier in truth.items()}
        self.truth_path(made.name).write_text(json.dumps(records), encoding="utf-8")
        (part / made.name).rename(final)
        shutil.rmtree(part)
        facts = {"corpus": made.name, "signers": made.signers, "difficulty": made.difficulty, "seed": seed}
        facts |= {"takes": len(table), "seconds": float(table["seconds"].sum())}
        return {"tables": {"corpus": pd.DataFrame([facts])}, "notes": []}

    def score_classifiers(self, corpus: str, protocol: str) -> dict[str, Any]:
        per_second = None if protocol == "reverdy2019" else 10.0  # as the command does
        found = evaluate(self.corpus(corpus), protocol=protocol, per_second=per_second)
        tables = {"scores": found.table, "people": found.people, "classes": found.classes}
        return {"tables": tables, "notes": list(found.notes)}

    def score_labellers(self, corpus: str) -> dict[str, Any]:
        folds = 3 if self.quick else 5
        found = evaluate_labellers(
            self.corpus(corpus), labellers=self.labellers, n_folds=folds, reporter=ConsoleReporter()
        )
        return {"tables": found.tables, "notes": list(found.notes)}

    def train_again(self, name: str, seed: int) -> dict[str, Any]:
        """Train a network with another seed on the same folds, beside the merged per-frame labellers of that seed."""
        found = evaluate_labellers(
            self.corpus(MEDIUM), labellers=[name], training_seed=seed, reporter=ConsoleReporter()
        )
        return {"tables": {title: found.tables[title] for title in ("frames", "segments")}, "notes": []}

    def score_part(self, part: str) -> dict[str, Any] | None:
        """Run a protocol of its own on the ten signers of the middle difficulty; None where it is not there."""
        module, function = PARTS[part]
        try:
            run = getattr(import_module(f"mimique.workbench.pipeline.{module}"), function)
        except ModuleNotFoundError as error:
            print(f"{part}: left out, {error}")
            return None
        more: dict[str, Any] = {}
        if part == "confidence" and self.truth_path(MEDIUM).exists():  # only for the oracle that knows the true borders
            records = json.loads(self.truth_path(MEDIUM).read_text(encoding="utf-8"))
            more["truth"] = {take: pd.DataFrame(rows) for take, rows in records.items()}
        found = run(self.corpus(MEDIUM), seed=0, reporter=ConsoleReporter(), **more)
        if hasattr(found, "plot_reliability"):
            found.plot_reliability(self.folder / "labels_reliability.png")
        return {"tables": dict(found.tables), "notes": list(found.notes)}

    def path(self, piece: str) -> Path:
        return self.folder / f"{piece}.json"

    def run(self, piece: str, work: Callable[[], dict[str, Any] | None]) -> None:
        """Do a piece, unless it is done, and keep it whole or not at all."""
        if self.path(piece).exists():
            return
        start = time.perf_counter()
        found = work()
        if found is None:
            return
        record = {
            "tables": {name: json.loads(table.to_json(orient="records")) for name, table in found["tables"].items()},
            "notes": found["notes"],
            "seconds": time.perf_counter() - start,
        }
        part = self.path(piece).with_suffix(f".{os.getpid()}.part")
        part.write_text(json.dumps(record, ensure_ascii=False), encoding="utf-8")
        part.replace(self.path(piece))
        print(f"{piece}: {record['seconds']:.0f} s", flush=True)

    def results(self) -> dict[str, dict[str, Any]]:
        """Every finished piece, with its tables as tables."""
        found = {}
        for piece in self.pieces():
            if self.path(piece).exists():
                record = json.loads(self.path(piece).read_text(encoding="utf-8"))
                record["tables"] = {name: pd.DataFrame(rows) for name, rows in record["tables"].items()}
                found[piece] = record
        return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--save", type=Path, required=True, help="folder of finished pieces and of the corpora")
    parser.add_argument("--only", nargs="+", metavar="PIECE", help="only pieces whose names begin so; no page")
    parser.add_argument("--list", action="store_true", help="list the pieces and whether they are done")
    parser.add_argument("--page", action="store_true", help="only write the page, from the pieces that are there")
    parser.add_argument("--quick", action="store_true", help="short corpora and fast labellers")
    parser.add_argument("--out", type=Path, help="folder of the page and its images; docs by default")
    arguments = parser.parse_args()
    study = Study(arguments.save, arguments.quick)
    pieces = study.pieces()
    if arguments.list:
        for name in pieces:
            print(f"{'done' if study.path(name).exists() else 'open'}  {name}")
        return
    if not arguments.page:
        for name, work in pieces.items():
            if not arguments.only or name.startswith(tuple(arguments.only)):
                study.run(name, work)
    if arguments.only:
        return
    out = arguments.out or (study.folder / "page" if arguments.quick else ROOT / "docs")
    (out / IMAGES).mkdir(parents=True, exist_ok=True)
    results = study.results()
    drawn = draw(results, out / IMAGES)
    reliability = study.folder / "labels_reliability.png"
    if reliability.exists():
        shutil.copyfile(reliability, out / IMAGES / reliability.name)
        drawn.append(reliability.name)
    write_page(out / "labels_study.md", results, drawn, [name for name in pieces if name not in results])
    print(out / "labels_study.md")


if __name__ == "__main__":
    # One thread: the matrices are small, and threads that wait for each other make a busy machine crawl.
    with threadpool_limits(1):
        main()
