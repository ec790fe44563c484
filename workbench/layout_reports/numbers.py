"""What the figures of a layout study show, reduced from its long tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import pandas as pd

from ...models.scores.bootstrap import bootstrap_interval

__all__ = [
    "CHOSEN",
    "LEARNED",
    "SHOWN",
    "LayoutStudyLike",
    "find_table",
    "pick_reconstruction",
    "pool_by_actor",
    "sort_methods",
    "summarise_curves",
]

CHOSEN = "solver"
"""The reconstruction that the main figures show: the default weight solver."""
LEARNED = "sogp"
"""The thesis's own reconstruction, shown in its figures."""

SHOWN = (
    "greedy + swaps",
    "greedy",
    "pivoted QR",
    "k-means median",
    "k-means best inertia",
    "k-means one actor",
    "k-means several actors",
    "STAR",
    "MAN",
)
"""The order of methods in figures and tables."""

PAIR = ["tested_on", "take"]
N_DRAWS = 1000


class LayoutStudyLike(Protocol):
    """What a report needs of a study; see :class:`~mimique.models.layouts.study.LayoutStudy`."""

    @property
    def tables(self) -> Mapping[str, pd.DataFrame]:
        """Long tables by name."""

    @property
    def layouts(self) -> pd.DataFrame:
        """``layout, method, K, marker, vertex``, a row a marker."""

    @property
    def notes(self) -> Any:
        """Sentences that a reader should know."""

    @property
    def parameters(self) -> Mapping[str, Any]:
        """What the study was made with."""

    @property
    def recommended(self) -> str:
        """Name of the layout to use."""


def find_table(study: LayoutStudyLike, name: str, *needed: str) -> pd.DataFrame | None:
    """Return a table that has rows and the needed columns, else None."""
    table = study.tables.get(name)
    if table is None or table.empty or any(column not in table for column in needed):
        return None
    return table


def pick_reconstruction(errors: pd.DataFrame, wanted: str) -> tuple[pd.DataFrame, str]:
    """Return the rows of the wanted reconstruction, or of the first that is there, and its name."""
    there = list(dict.fromkeys(errors["reconstruction"].astype(str)))
    name = wanted if wanted in there else there[0]
    return errors[errors["reconstruction"].astype(str) == name], name


def sort_methods(methods: Any) -> list[str]:
    """Return method names in the order that every figure keeps."""
    names = [str(name) for name in dict.fromkeys(methods)]
    return sorted(names, key=lambda name: (SHOWN.index(name) if name in SHOWN else len(SHOWN), names.index(name)))


def summarise_curves(errors: pd.DataFrame, value: str = "mean_mm", *, bands: bool = True) -> pd.DataFrame:
    """Return mean error by method, set and K over all pairs of a tested actor and a take, with bootstrap bands.

    Several layouts of one method and size (seeds of k-means) count by their median in every pair. Takes of actors are
    drawn again, not frames: neighbouring frames are alike.

    Parameters
    ----------
    errors
        Rows ``layout, method, set, K, tested_on, take`` and the value; of one reconstruction.
    value
        Which column is averaged.
    bands
        Whether 95 % bands are drawn up.

    Returns
    -------
    ``method, set, K, value, low, high, n_pairs, n_layouts``; low and high are NaN with fewer than two pairs.
    """
    rows = errors.assign(set=errors["set"].fillna("").astype(str) if "set" in errors else "")
    out = []
    for (method, name, size), group in rows.groupby(["method", "set", "K"], sort=False):
        pairs = group.groupby(PAIR, sort=True)[value].median().dropna()
        if pairs.empty:
            continue
        if bands:
            middle, low, high = bootstrap_interval(
                list(pairs), lambda values: float(np.mean(values)), np.random.default_rng(0), N_DRAWS
            )
        else:
            middle, low, high = float(pairs.mean()), np.nan, np.nan
        n_layouts = group["layout"].nunique() if "layout" in group else 1
        out.append((str(method), str(name), int(size), middle, low, high, len(pairs), n_layouts))
    table = pd.DataFrame(out, columns=["method", "set", "K", "value", "low", "high", "n_pairs", "n_layouts"])
    order = {name: k for k, name in enumerate(sort_methods(table["method"]))}
    return table.sort_values(["method", "K"], key=lambda c: c.map(order) if c.name == "method" else c).reset_index(
        drop=True
    )


def pool_by_actor(errors: pd.DataFrame, value: str = "rmse_printed") -> pd.DataFrame:
    """Return a root mean square error over all frames of all test takes of each actor, as the thesis has it (3.3.2).

    Of several layouts of one method and size the median is taken.

    Returns
    -------
    ``method, set, K, tested_on, value``.
    """
    rows = errors.assign(
        set=errors["set"].fillna("").astype(str) if "set" in errors else "",
        square=errors["frames"] * errors[value] ** 2,
    )
    keys = ["method", "set", "K", "tested_on"]
    one = rows.groupby([*keys, "layout", "trained_on"], sort=False)[["square", "frames"]].sum().reset_index()
    one["value"] = np.sqrt(one["square"] / one["frames"])
    return one.groupby(keys, sort=False)["value"].median().reset_index()
