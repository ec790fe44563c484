"""Time from a frame to its weights, one frame at a time: ``WeightSolver.stream``.

Run ``python benchmarks/bench_stream.py --data DIR``; DIR holds ``ict_facekit`` and ``arkit_recordings``. The setting is
that of ``bench_weights.py``; set OMP_NUM_THREADS=1. Beside the time on the clock stands the processor's own, which is
what a machine without other work to do would take.
"""

from __future__ import annotations

import argparse
import gc
import time
from pathlib import Path

import numpy as np
from bench_weights import ROOT, performance, spread
from mimique.synthesis import WeightPrior, WeightSolver, read_rig


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--markers", type=int, default=40)
    parser.add_argument("--noise", type=float, default=0.2, help="mm")
    parser.add_argument("--frames", type=int, default=4000)
    arguments = parser.parse_args()
    rig = read_rig(arguments.data / "ict_facekit" / "rig.npz", unit="cm")
    weights = performance(arguments.data / "arkit_recordings" / "livelinkface" / "alex_rom_3.csv", rig)
    weights = weights[: arguments.frames]
    vertices = spread(rig, arguments.markers)
    rng = np.random.default_rng(0)
    seen = rig.pose(weights, vertices) + rng.normal(0, arguments.noise, (len(weights), len(vertices), 3))
    print(f"{len(seen)} frames, {len(vertices)} markers, {rig.n_shapes} shapes; µs a frame")
    for name, prior in (("lsts", None), ("bounded", None), ("map", WeightPrior.fit(weights))):
        solver = WeightSolver(rig, vertices, name, prior=prior)
        whole = solver.solve(seen)
        stream = solver.stream()
        times, worst = np.empty((len(seen), 2)), 0.0
        gc.disable()
        for f, frame in enumerate(seen):
            start, own = time.perf_counter(), time.thread_time()
            found = stream.push(frame)
            times[f] = time.perf_counter() - start, time.thread_time() - own
            worst = max(worst, float(np.abs(found - whole[f]).max()))
        gc.enable()
        for clock, values in zip(("clock", "processor"), 1e6 * times.T, strict=True):
            median, high = np.percentile(values, [50, 99])
            print(f"{name:10}{clock:10}median {median:6.0f}  p99 {high:6.0f}  max {values.max():6.0f}")
        print(f"{name:10}differs from solve by at most {worst:.1e}")


if __name__ == "__main__":
    main()
