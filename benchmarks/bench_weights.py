"""Frames a second of every method beside SciPy's NNLS, in one run.

Run ``python benchmarks/bench_weights.py --data DIR``; DIR holds ``ict_facekit`` and ``arkit_recordings``. A real
performance (Live Link Face) moves the ICT rig; 40 markers spread over the face are seen with 0.2 mm noise. Only the
ratios mean anything on a machine that does other things; set OMP_NUM_THREADS=1 to compare one core with one core.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np
from mimique.synthesis import Rig, WeightPrior, WeightSolver, arkit_name, read_rig
from scipy.optimize import nnls

ROOT = Path(__file__).resolve().parents[1]
FACE = 9409  # The first vertices of the rig: face without scalp and neck.


def performance(path: Path, rig: Rig) -> np.ndarray:
    """Weights (F, n_shapes) of a Live Link Face recording; rows in which the face was lost are left out."""
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    columns = [arkit_name(name) for name in head]
    values = np.array([[float(v) for v in row[2:54]] for row in rows if len(row) > 53])
    names = columns[2:54]
    return np.clip(np.stack([values[:, names.index(arkit_name(s))] for s in rig.shapes], axis=1), 0, 1)


def spread(rig: Rig, count: int) -> np.ndarray:
    """Vertices of the moving face, each as far as can be from those chosen before."""
    moving = np.flatnonzero(np.linalg.norm(rig.deltas[:, :FACE], axis=2).max(0) > 1.0)
    points = rig.neutral[moving]
    chosen, distance = [0], np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < count:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return moving[chosen]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--markers", type=int, default=40)
    parser.add_argument("--noise", type=float, default=0.2, help="mm")
    arguments = parser.parse_args()
    rig = read_rig(arguments.data / "ict_facekit" / "rig.npz", unit="cm")
    weights = performance(arguments.data / "arkit_recordings" / "livelinkface" / "alex_rom_3.csv", rig)
    vertices = spread(rig, arguments.markers)
    rng = np.random.default_rng(0)
    seen = rig.pose(weights, vertices) + rng.normal(0, arguments.noise, (len(weights), len(vertices), 3))
    basis = rig.deltas[:, vertices].reshape(rig.n_shapes, -1).T
    moved = (seen - rig.neutral[vertices]).reshape(len(seen), -1)

    few = moved[:: max(1, len(moved) // 400)]
    start = time.perf_counter()
    for d in few:
        nnls(basis, d)
    base = len(few) / (time.perf_counter() - start)
    print(f"{len(seen)} frames, {len(vertices)} markers, {rig.n_shapes} shapes")
    print(f"{'scipy nnls':16}{base:>10.0f} frames/s")
    gaps = seen.copy()
    gaps[rng.uniform(size=seen.shape[:2]) < 0.01] = np.nan
    prior = WeightPrior.fit(weights)
    for name, options in (
        ("lsts", {"alpha": 0.3}),
        ("bounded", {}),
        ("map", {"prior": prior}),
        ("least-squares", {}),
    ):
        solver = WeightSolver(rig, vertices, name, **options)  # type: ignore[arg-type]
        solver.solve(seen[:200])
        rates = []
        for positions in (seen, gaps):
            start = time.perf_counter()
            solver.solve(positions)
            rates.append(len(positions) / (time.perf_counter() - start))
        print(
            f"{name:16}{rates[0]:>10.0f} frames/s{rates[0] / base:>8.1f} × nnls;"
            f" with 1 % of the markers missing {rates[1]:>8.0f} frames/s{rates[1] / base:>8.1f} ×",
            flush=True,
        )


if __name__ == "__main__":
    main()
