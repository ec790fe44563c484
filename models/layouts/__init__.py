"""Marker layouts: how many markers a face needs, and where (Reverdy 2019, ch. 3)."""

from .kmeans import find_moving_vertices, kmeans_layout, normalise_trajectories

__all__ = ["find_moving_vertices", "kmeans_layout", "normalise_trajectories"]
