"""How far a layout is from being its own mirror image."""

from __future__ import annotations

from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ...arrays import check_array
from ...errors import InputError

__all__ = ["measure_asymmetry"]


def measure_asymmetry(points: ArrayLike, middle: float = 0.0) -> float:
    """Return the mean distance, mm, from the mirror image of each marker to the nearest marker.

    0 for a layout whose markers are mirrored in pairs or lie on the midline. Only layouts of the same number of markers
    compare: with more markers some marker is always near.

    Parameters
    ----------
    points
        (n_markers, 3) places on a neutral face, mm; X is the side.
    middle
        X of the mirror plane, mm.
    """
    places = check_array(points, name="points", shape=(None, 3), finite=True)
    if not len(places):
        raise InputError("points: expected at least one marker, but got none")
    images = places * [-1.0, 1.0, 1.0] + [2.0 * middle, 0.0, 0.0]
    return float(cKDTree(places).query(images)[0].mean())
