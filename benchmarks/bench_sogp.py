"""Sparse online Gaussian processes beside scikit-learn's exact ones and the default weight solver, in one run.

Run ``python benchmarks/bench_sogp.py --data DIR``; DIR holds ``ict_facekit`` and ``arkit_recordings``. Two parts:

- speed and agreement: 2 minutes at 30 Hz of a real range-of-motion performance, 40 markers with 0.2 mm noise on one
  ICT identity, 51 shapes; equal hyperparameters;
- error: learned on one identity's range of motion, predicted for other performances of that identity and of others,
  each scaled by their own range of motion (Reverdy 2019, 3.4.3); against the default solver (``map``), whose prior and
  noise are learned from the tested identity's own first solve of its range of motion. The regression has seen true
  weights of the range of motion, the solver none.

Only ratios mean anything on a machine that does other things. ``--threads`` limits the linear algebra of the others;
the sparse process learns in one thread.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def bench_speed(scene, rng) -> None:
    import numpy as np
    from mimique.models.regression.kernel_parameters import fit_kernel_parameters
    from mimique.models.regression.marker_regression import MarkerScale
    from mimique.models.regression.sparse_gaussian_process import SparseGaussianProcess
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel
    from study_data import NOISE

    def see(weights):
        positions = scene.actors[0].pose(weights, scene.vertices)
        return positions + rng.normal(0, NOISE, positions.shape)

    rom, test = scene.range_of_motion[:3600], scene.tests["facial"]
    seen = see(rom)
    scale = MarkerScale.fit(seen)
    X, Y = scale(seen).reshape(len(rom), -1), (rom - rom.mean(axis=0))[:, :51]
    Z, truth = scale(see(test)).reshape(len(test), -1), (test - rom.mean(axis=0))[:, :51]
    start = time.perf_counter()
    chosen = fit_kernel_parameters(X, Y)
    print(f"{len(X)} frames × {X.shape[1]} inputs × {Y.shape[1]} outputs; {chosen}")
    print(f"hyperparameters on 300 frames: {time.perf_counter() - start:.2f} s")
    alike = {"amplitude": chosen.amplitude, "noise": chosen.noise}

    few = slice(None, 600)
    kernel = ConstantKernel(chosen.amplitude, "fixed") * RBF(chosen.length_scale, "fixed")
    exact = GaussianProcessRegressor(kernel, alpha=chosen.noise, optimizer=None).fit(X[few], Y[few])
    ours = SparseGaussianProcess(chosen.length_scale, **alike, novelty=0).fit(X[few], Y[few])
    (mean, std), (other, spread) = ours.predict(Z, return_std=True), exact.predict(Z, return_std=True)
    print(
        "threshold 0, no budget, 600 frames: greatest difference from scikit-learn "
        f"{np.abs(mean - other).max():.1e} in the mean, {np.abs(std - spread).max():.1e} in the deviation"
    )

    print(f"{'':32}{'training':>10}{'× exact':>10}{'prediction':>18}{'× exact':>10}{'weight RMSE':>14}")
    base = None
    for name, process in (
        ("scikit-learn, exact, all frames", GaussianProcessRegressor(kernel, alpha=chosen.noise, optimizer=None)),
        *(
            (f"SOGP, budget {budget}", SparseGaussianProcess(chosen.length_scale, **alike, budget=budget))
            for budget in (100, 200, 300, 400)
        ),
    ):
        start = time.perf_counter()
        process.fit(X, Y)
        taken = time.perf_counter() - start
        start = time.perf_counter()
        error = float(np.sqrt(((process.predict(Z) - truth) ** 2).mean()))
        rate = len(Z) / (time.perf_counter() - start)
        base = base or (taken, rate)
        print(
            f"{name:32}{taken:>8.2f} s{taken / base[0]:>10.2f}{rate:>10.0f} frames/s{rate / base[1]:>10.2f}"
            f"{error:>14.4f}",
            flush=True,
        )


def bench_error(scene, counts: list[int], rng) -> None:
    import numpy as np
    from mimique.models.layouts.errors import measure_weight_errors
    from mimique.models.regression.marker_regression import MarkerRegression, MarkerScale
    from mimique.synthesis import WeightPrior, WeightSolver, estimate_noise
    from mimique.synthesis.adaptation import Adaptation
    from study_data import NOISE, lose

    rig, rom = scene.rig, scene.range_of_motion[::2]
    print("\nmean vertex error, mm, over the vertices that move; mean over performances")
    print(f"{'':22}{'':40}{'8 % of the markers missing':>30}")
    names = f"{'SOGP':>8}{'linear + SOGP':>16}{'map':>8}"
    print(f"{'markers':10}{'identity':12}{names}{'σ':>8}  {names}")
    for count in counts:
        marked = scene.with_markers(count).vertices

        def see(actor, weights, marked=marked):
            positions = actor.pose(weights, marked)
            return positions + rng.normal(0, NOISE, positions.shape)

        first_seen = see(scene.actors[0], rom)
        models = [MarkerRegression.fit(first_seen, rom, trend=trend) for trend in ("none", "linear")]
        for number, actor in enumerate(scene.actors):
            own = see(actor, rom)
            scale = MarkerScale.fit(own)
            adapt = Adaptation.fit(actor.neutral[marked], rig.neutral[marked])
            first = WeightSolver(rig, marked, method="bounded")
            adapted = adapt(own)
            solved = first.solve(adapted)
            noise = estimate_noise(first.residuals(adapted, solved), rig.n_shapes)
            solver = WeightSolver(rig, marked, method="map", prior=WeightPrior.fit(solved), noise=noise)
            errors = []
            for truth in scene.tests.values():
                true = truth[::4]
                seen = see(actor, true)
                gaps = lose(seen, rng)
                made = []
                for positions in (seen, gaps):
                    made += [model.predict(positions, actor_rom=scale) for model in models]
                    made.append(solver.solve(adapt(positions)))
                found, std = models[0].predict(seen, actor_rom=scale, return_std=True)
                row = [measure_weight_errors(actor, true, m, vertices=scene.checked)["all"].mean_mm for m in made]
                errors.append([*row, float(np.sqrt((std**2).mean()) / np.sqrt(((found - true) ** 2).mean()))])
            *whole, plain_gaps, linear_gaps, default_gaps, sure = np.mean(errors, axis=0)
            who = "trained on" if number == 0 else f"another {number}"
            print(
                f"{count:<10}{who:12}{whole[0]:>8.3f}{whole[1]:>16.3f}{whole[2]:>8.3f}{sure:>8.2f}  "
                f"{plain_gaps:>8.3f}{linear_gaps:>16.3f}{default_gaps:>8.3f}",
                flush=True,
            )
    print("σ: deviation that SOGP predicts for the weights over their true error (root mean squares); 1 is honest")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--identities", type=int, default=3)
    parser.add_argument("--markers", type=int, nargs="*", default=[10, 20, 40])
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = str(arguments.threads)
    import numpy as np  # Only now: threads are counted when it is loaded.
    from study_data import ict_scene

    scene = ict_scene(arguments.data, arguments.identities)
    bench_speed(scene, np.random.default_rng(0))
    bench_error(scene, arguments.markers, np.random.default_rng(1))


if __name__ == "__main__":
    main()
