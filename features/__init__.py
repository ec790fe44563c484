"""What is computed from one take: head stabilisation, neutral pose, energies, segments, descriptors."""

from .derivatives import differentiate
from .descriptors import mean_weights, sample_frames
from .energies import MotionEnergy, motion_energy
from .neutral import Neutral, find_neutral, median_pose
from .segmentation import measure_restlessness, segment
from .stabilisation import Stabilised, fit_head_reference, stabilise

__all__ = [
    "MotionEnergy",
    "Neutral",
    "Stabilised",
    "differentiate",
    "find_neutral",
    "fit_head_reference",
    "mean_weights",
    "measure_restlessness",
    "median_pose",
    "motion_energy",
    "sample_frames",
    "segment",
    "stabilise",
]
