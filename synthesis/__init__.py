"""The face: rigs, mesh operators, morph adaptation, weight solving, animation, the avatar and simulated signers."""

from .arkit import ARKIT_NAMES, arkit_name, arkit_table
from .diagnosis import Diagnosis, find_conspicuous_frames
from .marker_map import check_marker_map, read_marker_map, write_marker_map
from .marker_proposal import propose_marker_map
from .maximum_posterior import estimate_noise
from .morph_map import MorphMap
from .rig import Rig
from .rig_files import read_rig
from .shape_mapping import ShapeMapping
from .weight_prior import WeightPrior
from .weight_solver import WeightSolver

__all__ = [
    "ARKIT_NAMES",
    "Diagnosis",
    "MorphMap",
    "Rig",
    "ShapeMapping",
    "WeightPrior",
    "WeightSolver",
    "arkit_name",
    "arkit_table",
    "check_marker_map",
    "estimate_noise",
    "find_conspicuous_frames",
    "propose_marker_map",
    "read_marker_map",
    "read_rig",
    "write_marker_map",
]
