"""The study of marker layouts on real performances: does what Reverdy 2019 found in chapter 3 hold here?

Run ``python benchmarks/layouts_study.py --data DIR [--corpus FOLDER] [--actors 5] [--own-shapes] [--quick] [--out
docs/marker_layouts.md]``; DIR holds ``ict_facekit`` and ``arkit_recordings``. A corpus is made (or found) in FOLDER:
the ICT rig, identities of ICT as faces (sums of standard-normal weights times identity modes), and ARKit performances
as takes with weights; then the study runs on it as the command ``mimique layout`` does. An interrupted run goes on
where it was. With ``--own-shapes`` every identity moves in its own way, each shape 0.7 to 1.3 times as strong in soft
regions; else the identities share their displacements, which is kinder than people are.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
from mimique.corpus import Corpus
from mimique.models.layouts import LayoutStudy, measure_asymmetry
from mimique.synthesis import Rig
from mimique.workbench.pipeline.ingesting import Recording, ingest
from mimique.workbench.pipeline.studying_layouts import LayoutOptions, study_layouts
from mimique.workbench.progress import ConsoleReporter
from study_data import RANGE_OF_MOTION, TESTS, ict_scene, vary_shapes

ROOT = Path(__file__).resolve().parents[1]
Finding = tuple[str, str, str]
"""What the thesis found, whether it holds, and the numbers."""


IDENTITIES = 61
"""Seed of the faces: none of them was looked at while anything was chosen."""
N_UNSEEN = 2


def make_corpus(folder: Path, data: Path, n_actors: int, own_shapes: bool) -> Corpus:
    """Make the corpus, or open it where it is."""
    if folder.exists():
        return Corpus.open(folder)
    corpus = Corpus.create(folder)
    scene = ict_scene(data, n_actors, IDENTITIES)
    faces = [vary_shapes(a, np.random.default_rng([7, i])) if own_shapes else a for i, a in enumerate(scene.actors)]
    with corpus.transaction("Take the rig and its faces") as edit:
        edit.put_rig("ict", scene.rig.to_dataset())
        for number, face in enumerate(faces):
            edit.put_rig(f"ict-{chr(ord('A') + number)}", face.to_dataset())
    takes = data / "arkit_recordings" / "livelinkface"
    recordings = [Recording(takes / f"{RANGE_OF_MOTION}.csv", signer="arkit", protocol="ROM")]
    recordings += [Recording(takes / f"{take}.csv", signer="arkit", protocol="speech") for take in TESTS]
    ingest(corpus, recordings)
    return corpus


def judge_findings(study: LayoutStudy) -> list[Finding]:
    """Tell whether each finding of the thesis holds, in its own terms (regression, same actor) where there are such."""
    errors = study.tables["errors"]
    how = "sogp" if (errors["reconstruction"] == "sogp").any() else "solver"
    found = []
    for reconstruction in dict.fromkeys((how, "solver")):
        some = errors[errors["reconstruction"] == reconstruction]
        found += [
            _judge_curve(some, reconstruction),
            _judge_sets(some, reconstruction),
            _judge_actors(some, reconstruction),
        ]
    found += [_judge_symmetry(study), _judge_regions(study, how), _judge_choice(study)]
    return found


def _mean(errors: pd.DataFrame, method: str) -> pd.Series:
    return errors[errors["method"] == method].groupby("K")["mean_mm"].mean()


def _judge_curve(errors: pd.DataFrame, how: str) -> Finding:
    curve = _mean(errors, "k-means median")
    name = f"error falls steeply to 30 to 40 markers, then hardly ({how})"
    numbers = "k-means: " + ", ".join(f"{value:.3f} at {size}" for size, value in curve.items()) + " mm"
    if not ((curve.index >= 30) & (curve.index < curve.index[-1])).any():
        return name, "not asked", f"{numbers}; needs a size of 30 or more, and a larger one"
    first, middle, last = curve.iloc[0], curve[curve.index[curve.index >= 30][0]], curve.iloc[-1]
    steep, flat = (first - middle) / first, (middle - last) / first
    holds = "holds" if steep > 0.25 and flat < 0.1 else "fails"
    return name, holds, numbers


def _judge_sets(errors: pd.DataFrame, how: str) -> Finding:
    curve = _mean(errors, "k-means median")
    better, told = 0, []
    sets = errors[errors["set"] != ""].groupby(["set", "K"])["mean_mm"].mean()
    for (name, size), value in sets.items():
        # Between two sizes of k-means, and beyond the largest its own.
        other = float(np.interp(size, curve.index, curve.to_numpy()))
        better += other < value
        told.append(f"{name} {value:.3f} : {other:.3f}")
    holds = "holds" if better == len(sets) else "fails" if better == 0 else f"holds for {better} of {len(sets)}"
    return f"k-means beats the empirical sets at equal K ({how})", holds, "; ".join(told) + " mm"


def _judge_actors(errors: pd.DataFrame, how: str) -> Finding:
    one, several = _mean(errors, "k-means one actor"), _mean(errors, "k-means several actors")
    if one.empty or several.empty:
        return f"one actor or several: no difference ({how})", "not asked", "only one actor in training"
    ratio = (one / several).dropna()
    holds = "holds" if ratio.sub(1).abs().max() < 0.1 else "fails"
    numbers = ", ".join(f"{value:.2f} at {size}" for size, value in ratio.items())
    return f"clusters of one actor are as good as those of several ({how})", holds, f"error, one : several: {numbers}"


def _judge_symmetry(study: LayoutStudy) -> Finding:
    table = study.tables["symmetry"]
    one = table[table["method"] == "k-means one actor"].groupby("K")["asymmetry_mm"].mean()
    several = table[table["method"] == "k-means several actors"].groupby("K")["asymmetry_mm"].mean()
    if one.empty or several.empty:
        return "clusters of several actors are more symmetric", "not asked", "only one actor in training"
    lower = int((several < one).sum())
    holds = "holds" if lower == len(one) and (several / one).mean() < 0.9 else "fails" if lower == 0 else "hardly"
    numbers = ", ".join(f"{several[k]:.1f} : {one[k]:.1f} at {k}" for k in one.index)
    return "clusters of several actors are more symmetric", holds, f"several : one, mm from the mirror image: {numbers}"


def _judge_regions(study: LayoutStudy, how: str) -> Finding:
    name = "the published sets hardly differ overall, but by region"
    errors, regions = study.tables["errors"], study.tables["regions"]
    star = errors[(errors["method"] == "STAR") & (errors["reconstruction"] == how)].groupby("layout")["mean_mm"].mean()
    parts = regions[(regions["method"] == "STAR") & (regions["reconstruction"] == how)]
    if star.empty or parts.empty:
        return name, "not asked", "the rig carries no such set"
    by_region = parts.groupby(["region", "layout"])["mean_mm"].mean().unstack()
    overall = star.max() / star.min()
    spread = by_region.max(axis=1) / by_region.min(axis=1)
    holds = "holds" if overall < 1.2 and spread.max() > overall + 0.2 else "fails"
    told = f"largest : smallest {overall:.2f} overall; " + ", ".join(f"{r} {v:.2f}" for r, v in spread.items())
    return name, holds, f"{told} ({how})"


def _judge_choice(study: LayoutStudy) -> Finding:
    errors = study.tables["errors"]
    some = errors[(errors["reconstruction"] == "solver") & ~errors["same_actor"]]
    some = some if len(some) else errors[errors["reconstruction"] == "solver"]
    base = _mean(some, "k-means median")
    told = []
    for method in ("greedy + swaps", "greedy", "greedy, mirrored", "pivoted QR"):
        ratio = (_mean(some, method) / base).dropna()
        told.append(f"{method} " + ", ".join(f"{v:.2f} at {k}" for k, v in ratio.items()))
    return "chosen layouts against k-means on unseen actors (solver)", "measured", "error as a part: " + "; ".join(told)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--corpus", type=Path, help="folder of the corpus; a temporary one by default")
    parser.add_argument("--actors", type=int, default=5, help=f"faces, of which the last {N_UNSEEN} are unseen")
    parser.add_argument("--own-shapes", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, help="page to write, with pictures beside it")
    options = parser.parse_args()
    folder = options.corpus or Path(tempfile.mkdtemp()) / "corpus"
    corpus = make_corpus(folder, options.data, options.actors, options.own_shapes)
    unseen = tuple(sorted(rig for rig in corpus.rigs() if rig != "ict")[-N_UNSEEN:])
    start = time.perf_counter()
    study = study_layouts(corpus, options=LayoutOptions(quick=options.quick, unseen=unseen), reporter=ConsoleReporter())
    print(f"study: {time.perf_counter() - start:.0f} s; recommended: {study.recommended}")
    base = Rig.from_dataset(corpus.rig("ict"))
    places = base.neutral[study.layout()["vertex"].to_numpy()]
    print(f"its asymmetry: {measure_asymmetry(places):.1f} mm")
    findings = judge_findings(study)
    print("| finding | here | numbers |\n|---|---|---|")
    for row in findings:
        print("| " + " | ".join(row) + " |")
    for title in ("losses", "mismatch", "stability", "symmetry"):
        print(f"\n{title}\n{study.tables[title].round(3).to_string(index=False)}")
    for note in study.notes:
        print(f"note: {note}")
    if options.out is not None:
        _write_page(study, corpus, base, options.out, findings, options.own_shapes)


def _write_page(
    study: LayoutStudy, corpus: Corpus, base: Rig, path: Path, findings: list[Finding], own_shapes: bool
) -> None:
    from layouts_study_page import write_page
    from mimique import __version__
    from mimique.workbench.layout_reports.layout_report import LayoutFacts

    facts = LayoutFacts(corpus.name, corpus.snapshot, __version__, "", base, "ict", head=study.head_markers or None)
    write_page(study, path, path.parent / "images" / path.stem, facts=facts, findings=findings, own_shapes=own_shapes)
    print(f"written: {path}")


if __name__ == "__main__":
    sys.exit(main())
