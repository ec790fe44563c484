"""Marker layouts: how many markers a face needs, and where (Reverdy 2019, ch. 3)."""

from .choice import Layout, choose_layout
from .constraints import mirror_by_position
from .errors import VertexErrors, measure_vertex_errors, measure_weight_errors
from .kmeans import cluster_trajectories, find_moving_vertices, kmeans_layout, normalise_trajectories
from .misplacement import Sites, place_beside
from .named_sets import NAMED_SETS, SOURCES, place_named_set
from .stability import compare_layouts, compute_jaccard
from .study import run_study
from .study_plan import METHODS, RECONSTRUCTIONS, Actor, LayoutStudy, StudyPlan
from .symmetry import measure_asymmetry

__all__ = [
    "METHODS",
    "NAMED_SETS",
    "RECONSTRUCTIONS",
    "SOURCES",
    "Actor",
    "Layout",
    "LayoutStudy",
    "Sites",
    "StudyPlan",
    "VertexErrors",
    "choose_layout",
    "cluster_trajectories",
    "compare_layouts",
    "compute_jaccard",
    "find_moving_vertices",
    "kmeans_layout",
    "measure_asymmetry",
    "measure_vertex_errors",
    "measure_weight_errors",
    "mirror_by_position",
    "normalise_trajectories",
    "place_beside",
    "place_named_set",
    "run_study",
]
