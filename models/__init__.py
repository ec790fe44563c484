"""What is learned or chosen from many takes: affect classifiers, their evaluation, metrics, recording times."""

from . import layouts, metrics
from .affect_classifiers import CLASSIFIERS, AffectModel, fit_affect_classifier
from .evaluation.annotator_comparison import compare_annotators
from .evaluation.protocols import Evaluation, collect_training_samples, evaluate_across_signers, evaluate_reverdy2019
from .labelled_take import LabelledTake
from .labelling import label_segments
from .recording_times import recording_times

__all__ = [
    "CLASSIFIERS",
    "AffectModel",
    "Evaluation",
    "LabelledTake",
    "collect_training_samples",
    "compare_annotators",
    "evaluate_across_signers",
    "evaluate_reverdy2019",
    "fit_affect_classifier",
    "label_segments",
    "layouts",
    "metrics",
    "recording_times",
]
