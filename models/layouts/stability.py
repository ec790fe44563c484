"""How alike layouts are that were chosen by other seeds, from other takes, on other actors."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching
from scipy.spatial import cKDTree

from ...arrays import check_array
from ...errors import InputError

__all__ = ["NEAR", "compare_layouts", "compute_jaccard"]

NEAR = 10.0
"""Distance in mm up to which two markers count as the same place: about what a marker and its base take up."""


def compute_jaccard(first: ArrayLike, second: ArrayLike, points: ArrayLike | None = None, near: float = NEAR) -> float:
    """Return the Jaccard index ``m / (|A| + |B| − m)`` of two layouts.

    Parameters
    ----------
    first, second
        Vertex numbers, each once.
    points
        (n_vertices, 3) places of all vertices, mm. With them ``m`` is the greatest number of pairs, one marker of each,
        that are at most ``near`` apart, no marker in two pairs; without, the number of vertices that both have.
    near
        mm.
    """
    a, b = (check_array(x, name="layout", shape=(None,), dtype=np.int64) for x in (first, second))
    for layout in (a, b):
        if not len(layout) or len(np.unique(layout)) != len(layout):
            raise InputError("layout: expected vertex numbers, each once")
    if points is None:
        shared = len(np.intersect1d(a, b))
    else:
        places = check_array(points, name="points", shape=(None, 3), finite=True)
        close = cKDTree(places[a]).query_ball_point(places[b], near)
        rows = np.repeat(np.arange(len(b)), [len(found) for found in close])
        columns = np.array([i for found in close for i in found], dtype=np.int64)
        links = csr_array((np.ones(len(rows)), (rows, columns)), shape=(len(b), len(a)))
        shared = int((maximum_bipartite_matching(links, perm_type="column") >= 0).sum())
    return shared / (len(a) + len(b) - shared)


def compare_layouts(layouts: Sequence[ArrayLike], points: ArrayLike, near: float = NEAR) -> tuple[float, float]:
    """Return the mean Jaccard index over all pairs of layouts, by vertex and by place; NaN with fewer than two."""
    pairs = list(combinations(layouts, 2))
    if not pairs:
        return float("nan"), float("nan")
    return (
        float(np.mean([compute_jaccard(a, b) for a, b in pairs])),
        float(np.mean([compute_jaccard(a, b, points, near) for a, b in pairs])),
    )
