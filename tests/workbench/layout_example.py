"""A layout study made up by formula, with every table, to write reports from."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from mimique.models.layouts import find_moving_vertices
from mimique.models.layouts.constraints import spread_points
from mimique.synthesis import Rig

SIZES = (10, 15, 20, 30, 40)
LEVELS = {
    "greedy + swaps": 0.11,
    "greedy": 0.112,
    "pivoted QR": 0.118,
    "k-means median": 0.13,
    "k-means best inertia": 0.135,
    "k-means one actor": 0.131,
    "k-means several actors": 0.129,
}
SETS = {
    "STAR": {"Face Robot 35": 35, "SignCom 41": 41, "MPEG-4 53": 53, "Sign3D 60": 60},
    "MAN": {"MAN 15": 15, "MAN 30": 30, "MAN 46": 46, "MAN 62": 62},
}
ACTORS = {"A": True, "B": True, "C": False}  # whether it took part in learning
TAKES = ("facial", "apfel", "S88-001")
REGIONS = {"brows": 0.8, "lids": 1.5, "nose": 0.7, "cheeks": 0.6, "lips": 1.6, "chin": 1.1}
N_VERTICES = 400


@dataclass
class ExampleStudy:
    tables: dict[str, pd.DataFrame]
    layouts: pd.DataFrame
    recommended: str
    notes: list[str] = field(default_factory=lambda: ["Every number here is made up by a formula."])
    parameters: dict[str, Any] = field(default_factory=lambda: {"noise_mm": 0.2, "n_seeds": 20, "sizes": [10, 15]})


def make_study(rig: Rig, sizes: tuple[int, ...] = SIZES) -> ExampleStudy:
    """Errors fall as 1/K towards a floor; every row differs a little, by formula."""
    entries = [(f"{m} {k}", m, "", k, 0.6 * level / 0.11 / k + level) for m, level in LEVELS.items() for k in sizes]
    entries += [(name, m, name, k, 1.1 / k + 0.15) for m, some in SETS.items() for name, k in some.items()]
    errors, regions = [], []
    for number, (layout, method, name, k, base) in enumerate(entries):
        for trained in ("A", "B"):
            for actor, known in ACTORS.items():
                if known and actor != trained:
                    continue
                for how, factor in (("sogp", 1.2), ("solver", 1.0), ("thin shell", 1.7)):
                    for t, take in enumerate(TAKES):
                        wobble = 1 + 0.08 * np.sin(3.1 * number + 1.7 * t + ord(actor))
                        mean = base * factor * wobble * (1.0 if known else 1.15)
                        rmse = 1.3 * mean
                        errors.append(
                            {
                                "layout": layout,
                                "method": method,
                                "set": name,
                                "K": k,
                                "trained_on": trained,
                                "tested_on": actor,
                                "same_actor": known,
                                "reconstruction": how,
                                "take": take,
                                "frames": 100 + 10 * t,
                                "rmse_printed": rmse * np.sqrt(N_VERTICES),
                                "rmse_mm": rmse,
                                "mean_mm": mean,
                                "p95_mm": 2.4 * mean,
                            }
                        )
                        regions += [
                            {**errors[-1], "region": region, "mean_mm": mean * (share + 0.2 * np.sin(number + i))}
                            for i, (region, share) in enumerate(REGIONS.items())
                        ]
    best = f"greedy + swaps {sizes[-2] if len(sizes) > 1 else sizes[0]}"
    few = [e for e in entries if e[3] in sizes[-2:] and e[1] in ("greedy + swaps", "k-means median", "pivoted QR")]
    tables = {
        "errors": pd.DataFrame(errors),
        "regions": pd.DataFrame(regions),
        "noise": pd.DataFrame(
            [
                {"layout": e[0], "K": e[3], "noise_mm": n, "mean_mm": e[4] + 0.1 * n}
                for e in few
                for n in (0.1, 0.5, 1.0)
            ]
        ),
        "misplacement": pd.DataFrame(
            [{"layout": e[0], "K": e[3], "off_mm": n, "mean_mm": e[4] + 0.03 * n} for e in few for n in (1, 2, 3, 5)]
        ),
        "losses": pd.DataFrame(
            [
                {
                    "layout": e[0],
                    "K": e[3],
                    "lost": n,
                    "mean_mm": e[4] * (1 + 0.05 * n),
                    "worst_mm": e[4] * (1 + 0.4 * n),
                    "worst_markers": "M03" if n == 1 else "M03 M07",
                }
                for e in few
                for n in (1, 2)
            ]
        ),
        "stability": pd.DataFrame(
            [
                {"method": m, "K": k, "over": over, "jaccard": 0.1 + 0.1 * i, "jaccard_near": 0.5 + 0.1 * i}
                for i, m in enumerate(("k-means", "greedy + swaps"))
                for k in sizes
                for over in ("seeds", "takes", "actors")
            ]
        ),
        "symmetry": pd.DataFrame(
            [
                {"layout": f"k-means {n}", "K": k, "trained_on_n_actors": n, "asymmetry_mm": 12.0 / n + 40 / k}
                for n in (1, 3)
                for k in sizes
            ]
        ),
        "mismatch": pd.DataFrame(
            [
                {
                    "layout": f"greedy + swaps {k}",
                    "K": k,
                    "error_mm": 0.11 + 0.6 / k,
                    "own_rig_mm": 0.05 + 0.6 / k,
                    "every_vertex_mm": 0.11,
                    "share": 0.06 / (0.11 + 0.6 / k),
                }
                for k in sizes
            ]
        ),
        "labels": pd.DataFrame(
            [{"layout": e[0], "K": e[3], "accuracy": 0.8 - 1 / e[3], "macro_f1": 0.75 - 1 / e[3]} for e in few]
        ),
    }
    moving = find_moving_vertices(rig)
    front = moving[rig.neutral[moving, 2] > np.median(rig.neutral[moving, 2])]
    rows = []
    for layout, method, _, k, _ in entries:
        chosen = front[spread_points(rig.neutral[front], min(k, len(front)))]
        chosen = chosen[np.lexsort((rig.neutral[chosen, 0], -np.round(rig.neutral[chosen, 1] / 8)))]
        rows += [
            {"layout": layout, "method": method, "K": k, "marker": f"M{i:02d}", "vertex": int(v)}
            for i, v in enumerate(chosen, start=1)
        ]
    return ExampleStudy(tables, pd.DataFrame(rows), best)
