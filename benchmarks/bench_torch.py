"""Frames a second of the torch backend beside the NumPy solver, in one run, and how far their weights differ.

Run ``python benchmarks/bench_torch.py --data DIR``; DIR holds ``ict_facekit`` and ``arkit_recordings``. The data are
those of ``bench_weights.py``: a real performance moves the ICT rig, 40 markers are seen with 0.2 mm noise. On a
graphics processor the take is repeated to ``--frames`` frames; times include the copies to and from the device.
"""

from __future__ import annotations

import argparse
import importlib
import time
from pathlib import Path

import numpy as np
from bench_weights import performance, spread
from mimique.synthesis import WeightPrior, read_rig
from mimique.synthesis.torch_backend import choose_device, describe_device, has_torch, on_torch
from mimique.synthesis.weight_methods import Method, make_method
from mimique.synthesis.weight_solver import WeightSolver

ROOT = Path(__file__).resolve().parents[1]
REPEATS = 3


def rate(method: Method, basis: np.ndarray, displacements: np.ndarray) -> tuple[float, np.ndarray]:
    """Frames a second, the best of a few runs, and the weights."""
    solve = method.prepare(basis)
    solve(displacements[:256])
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        weights = solve(displacements)
        times.append(time.perf_counter() - start)
    return len(displacements) / min(times), weights


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--device", help="a PyTorch device; by default cuda where there is one, else cpu")
    parser.add_argument("--frames", type=int, default=500_000, help="on a graphics processor; the take itself on a CPU")
    parser.add_argument("--markers", type=int, default=40)
    arguments = parser.parse_args()
    if not has_torch():
        print("PyTorch is not installed: nothing to measure (pip install 'mimique[gpu]')")
        return
    device = choose_device(arguments.device)
    on_gpu = device.startswith("cuda")
    rig = read_rig(arguments.data / "ict_facekit" / "rig.npz", unit="cm")
    truth = performance(arguments.data / "arkit_recordings" / "livelinkface" / "alex_rom_3.csv", rig)
    vertices = spread(rig, arguments.markers)
    moved = np.einsum("fn,npd->fpd", truth, rig.deltas[:, vertices])
    moved += np.random.default_rng(0).normal(0, 0.2, moved.shape)
    print(f"{len(moved)} frames, {len(vertices)} markers, {rig.n_shapes} shapes; device: {describe_device(device)}")
    if not on_gpu:
        importlib.import_module("torch").set_num_threads(1)  # More wait for each other where cores are busy.
        print("no graphics processor here: PyTorch runs on one core of the CPU; speed on a GPU is not measured")
    prior = WeightPrior.fit(truth)
    for name in ("lsts", "bounded", "map", "nnls", "least-squares"):
        options = WeightSolver(rig, vertices, name, prior=prior if name == "map" else None).options
        method, unit = make_method(options, rig, vertices)
        basis = np.ascontiguousarray(rig.deltas[:, vertices].transpose(1, 2, 0).reshape(-1, rig.n_shapes) / unit)
        seen = moved.reshape(len(moved), -1) / unit
        few = seen[:: max(1, len(seen) // 400)] if name == "nnls" else seen
        base, expected = rate(method, basis, few)
        accelerated = on_torch(method, device)
        _, found = rate(accelerated, basis, few)
        many = np.resize(seen, (arguments.frames, seen.shape[1])) if on_gpu else seen
        speed, _ = rate(accelerated, basis, many)
        print(
            f"{name:14} NumPy{base:>9.0f}, torch{speed:>10.0f} frames/s ({speed / base:.1f} ×);"
            f" weights differ by at most {np.abs(found - expected).max():.1e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
