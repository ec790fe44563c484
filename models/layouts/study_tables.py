"""The tables of a study, from the numbers of its pieces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...synthesis import Rig
from ..scores.bootstrap import bootstrap_interval
from .kmeans import find_moving_vertices
from .stability import compare_layouts
from .study_choices import Candidate
from .study_trials import SCORES, Trials
from .symmetry import measure_asymmetry

Array = NDArray[np.floating[Any]]

__all__ = ["tabulate_bands", "tabulate_errors", "tabulate_robustness", "tabulate_stability", "tabulate_symmetry"]

ERROR_COLUMNS = ["layout", "method", "set", "K", "trained_on", "tested_on", "same_actor", "reconstruction", "take"]


def tabulate_errors(
    trials: Trials, candidates: Sequence[Candidate], scores: Mapping[tuple[str, str], Array]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return ``errors`` and ``regions``; ``scores`` by layout and reconstruction."""
    rows, parts = [], []
    for candidate in candidates:
        for reconstruction in trials.plan.reconstructions:
            for case, values in zip(trials.cases, scores[candidate.name, reconstruction], strict=True):
                tested, teacher = trials.actors[case.actor].name, trials.actors[trials.teacher(case.actor)].name
                which = (candidate.name, candidate.method, candidate.set_name, candidate.size)
                key = (*which, teacher, tested, teacher == tested, reconstruction, case.take)
                rows.append((*key, len(case.weights), *values[: len(SCORES)]))
                parts += [
                    (*key, region, value)
                    for region, value in zip(trials.regions, values[len(SCORES) :], strict=True)
                    if np.isfinite(value)
                ]
    return (
        pd.DataFrame(rows, columns=[*ERROR_COLUMNS, "frames", *SCORES]),
        pd.DataFrame(parts, columns=[*ERROR_COLUMNS, "region", "mean_mm"]),
    )


def tabulate_bands(errors: pd.DataFrame, seed: int, n_draws: int = 500) -> pd.DataFrame:
    """Return the mean error of each layout with its 95 % interval over pairs of actor and take."""
    rows = []
    keys = ["layout", "method", "set", "K", "reconstruction", "same_actor"]
    for key, some in errors.groupby(keys, sort=False):
        # The same pairs are drawn for every layout.
        rng = np.random.default_rng([seed, 6])
        band = bootstrap_interval(some["mean_mm"].tolist(), np.mean, rng, n=n_draws)
        tested = "training" if key[-1] else "unseen"
        rows.append((*key[:-1], tested, len(some), band.value, band.low, band.high))
    return pd.DataFrame(rows, columns=[*keys[:-1], "tested", "n_pairs", "mean_mm", "low", "high"])


def tabulate_robustness(
    trials: Trials, candidates: Sequence[Candidate], found: Mapping[str, Mapping[str, Array]], every: float
) -> dict[str, pd.DataFrame]:
    """Return ``noise``, ``misplacement``, ``losses`` and ``mismatch``; ``every`` is the error with markers all over."""
    noise, off, lost, other = [], [], [], []
    for c in candidates:
        kept = found[c.name]
        noise += [(c.name, c.size, mm, e) for mm, e in zip(trials.plan.noises, kept["noise"].tolist(), strict=True)]
        off += [(c.name, c.size, mm, e) for mm, e in zip(trials.plan.offs, kept["off"].tolist(), strict=True)]
        one, two, pairs = kept["one"], kept["two"], kept["pairs"]
        worst = int(np.argmax(one))
        lost.append((c.name, c.size, 1, float(one.mean()), float(one[worst]), c.markers[worst]))
        if len(two) and np.isfinite(two).any():
            most = int(np.nanargmax(two))
            drawn = two[int(kept["n_worst"]) :] if len(two) > int(kept["n_worst"]) else two
            names = ", ".join(c.markers[j] for j in pairs[most])
            lost.append((c.name, c.size, 2, float(drawn.mean()), float(two[most]), names))
        error, own = float(kept["error"]), float(kept["own_rig"])
        other.append((c.name, c.size, error, own, every, 1.0 - own / error if error > 0 else np.nan))
    return {
        "noise": pd.DataFrame(noise, columns=["layout", "K", "noise_mm", "mean_mm"]),
        "misplacement": pd.DataFrame(off, columns=["layout", "K", "off_mm", "mean_mm"]),
        "losses": pd.DataFrame(lost, columns=["layout", "K", "lost", "mean_mm", "worst_mm", "worst_markers"]),
        "mismatch": pd.DataFrame(
            other, columns=["layout", "K", "error_mm", "own_rig_mm", "every_vertex_mm", "share_of_mismatch"]
        ),
    }


def tabulate_stability(
    rig: Rig, alternatives: Mapping[tuple[str, int, str], Sequence[NDArray[np.int64]]]
) -> pd.DataFrame:
    """Return how alike layouts are, by method, size and what they differ in; one layout alone makes no row."""
    rows = [
        (method, size, over, *compare_layouts(layouts, rig.neutral))
        for (method, size, over), layouts in alternatives.items()
        if len(layouts) > 1
    ]
    return pd.DataFrame(rows, columns=["method", "K", "over", "jaccard", "jaccard_near"])


def tabulate_symmetry(rig: Rig, candidates: Sequence[Candidate], middle: float | None) -> pd.DataFrame:
    """Return how far each layout is from its mirror image; the mean over draws where there are several."""
    if middle is None:
        x = rig.neutral[find_moving_vertices(rig), 0]
        middle = 0.5 * float(x.min() + x.max())
    rows = []
    for c in candidates:
        layouts = c.draws or (c.vertices,)
        asymmetry = float(np.mean([measure_asymmetry(rig.neutral[v], middle) for v in layouts]))
        rows.append((c.name, c.method, c.size, c.n_actors, asymmetry))
    return pd.DataFrame(rows, columns=["layout", "method", "K", "trained_on_n_actors", "asymmetry_mm"])
