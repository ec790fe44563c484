"""Marker layouts learned from a range-of-motion performance (Reverdy 2019, 3.6).

Vertices that move alike need one marker between them. Every vertex that some shape moves is described by its whole
trajectory, normalised per coordinate by its own mean and deviation over time,

    v̄_n^p = (v_n^p − μ^p) / σ^p        (3.6)

and these descriptions are partitioned by k-means (3.7). The vertex nearest each centroid carries the marker: the thesis
speaks of centroids alone, and a centroid of trajectories is no place on the skin.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.cluster import KMeans
from sklearn.metrics import pairwise_distances_argmin

from ...arrays import check_array
from ...errors import InputError
from ...synthesis import Rig

__all__ = ["cluster_trajectories", "find_moving_vertices", "kmeans_layout", "normalise_trajectories"]

STILL = 0.05
"""Deviation in mm below which a coordinate counts as still: dividing by it would make noise as loud as motion."""


def find_moving_vertices(rig: Rig, least: float = 0.5) -> NDArray[np.int64]:
    """Return the numbers of the vertices that at least one shape moves by more than ``least`` mm at weight 1."""
    return np.flatnonzero(np.linalg.norm(rig.deltas, axis=2).max(axis=0) > least)


def normalise_trajectories(positions: ArrayLike) -> NDArray[np.float64]:
    """Return each coordinate of each vertex with mean 0 and deviation 1 over time (3.6).

    Parameters
    ----------
    positions
        (n_frames, n_vertices, 3), mm.

    Returns
    -------
    (n_vertices, 3·n_frames). A coordinate that moves by less than 0.05 mm (deviation) is divided by 0.05 mm instead, so
    that it stays near 0.
    """
    values = check_array(positions, name="positions", shape=(None, None, 3), finite=True)
    centred = values - values.mean(axis=0)
    scaled = centred / np.maximum(values.std(axis=0), STILL)
    return np.ascontiguousarray(scaled.transpose(1, 0, 2)).reshape(values.shape[1], -1)


def kmeans_layout(
    rig: Rig, weights: ArrayLike, n_markers: int, *, rng: np.random.Generator, least: float = 0.5
) -> NDArray[np.int64]:
    """Choose vertices for markers by k-means on normalised trajectories (3.6, 3.7).

    Parameters
    ----------
    rig
        The face.
    weights
        (n_frames, n_shapes) of a range-of-motion performance; a few hundred frames do.
    n_markers
        How many, at least 1.
    rng
        Draws the initial centroids.
    least
        Vertices that no shape moves by more than this, in mm, are left out.

    Returns
    -------
    (n_markers,) vertex numbers, sorted; fewer where two centroids share their nearest vertex.

    Raises
    ------
    InputError
        If fewer vertices move than there are to be markers.
    """
    moving = find_moving_vertices(rig, least)
    if not 1 <= n_markers <= len(moving):
        raise InputError(f"n_markers: expected 1 to {len(moving)}, the vertices that move, but got {n_markers}")
    performed = check_array(weights, name="weights", shape=(None, rig.n_shapes), finite=True)
    places, _ = cluster_trajectories(normalise_trajectories(rig.pose(performed, moving)), n_markers, rng=rng)
    return moving[places]


def cluster_trajectories(
    observations: NDArray[np.floating[Any]], n_markers: int, *, rng: np.random.Generator
) -> tuple[NDArray[np.int64], float]:
    """Partition trajectories by k-means (3.7) and return the one nearest each centroid.

    Parameters
    ----------
    observations
        (n_vertices, n_values), of :func:`normalise_trajectories`; those of several actors side by side.
    n_markers
        How many, from 1 to the number of observations.
    rng
        Draws the initial centroids.

    Returns
    -------
    Rows of the observations, sorted, fewer where two centroids share the nearest; and the inertia, the sum of squared
    distances to the nearest centroid.
    """
    if not 1 <= n_markers <= len(observations):
        raise InputError(f"n_markers: expected 1 to {len(observations)}, the vertices that move, but got {n_markers}")
    clusters = KMeans(n_markers, n_init=1, random_state=int(rng.integers(2**31))).fit(observations)
    nearest = pairwise_distances_argmin(clusters.cluster_centers_, observations)
    return np.unique(nearest).astype(np.int64), float(clusters.inertia_)
