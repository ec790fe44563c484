"""Models that label takes, with calibrated confidence, in the form in which a corpus keeps them: arrays and JSON.

Two kinds, one face. A :class:`SegmentModel` holds one of the classifiers of Reverdy 2019, 4.4.3, and names segments
that were cut before. A :class:`TakeModel` holds a labeller of frames in time and finds segments and transitions itself.
Calibration changes how sure an answer is, never the answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..features.descriptors import mean_weights
from .affect_classifiers import AffectModel
from .confidence.calibration import Calibrator, segment_probabilities
from .labellers.base import FrameLabeller
from .labellers.frames import TRANSITION, fill_gaps
from .labellers.storage import labeller_from_arrays, labeller_to_arrays
from .labellers.take_tiers import find_take_segments
from .labelling import label_segments

__all__ = ["SegmentModel", "StoredModel", "TakeModel", "model_from_arrays"]

CALIBRATOR = "calibrator."
"""What the names of a calibrator's arrays begin with."""


@dataclass(frozen=True)
class SegmentModel:
    """A classifier of segments by their mean weights.

    Parameters
    ----------
    classifier
        Fitted.
    calibrator
        Of its answers for segments; ``None``: they are given as they are.
    """

    classifier: AffectModel
    calibrator: Calibrator | None = None
    needs_segments = True

    @property
    def name(self) -> str:
        """Name of the method."""
        return self.classifier.name

    @property
    def classes(self) -> tuple[str, ...]:
        """Labels that it can give."""
        return self.classifier.classes

    @property
    def shapes(self) -> tuple[str, ...]:
        """Names of the weights."""
        return self.classifier.shapes

    def check_fit(self, shapes: Sequence[str], rate: float) -> None:
        """Refuse weights of other shapes, or in another order, than it was trained on; any rate will do."""
        self.classifier.check_shapes(shapes)

    def predict_proba(self, weights: ArrayLike) -> NDArray[np.float64]:
        """Return calibrated probabilities ``(n_rows, n_classes)`` of mean weights ``(n_rows, n_shapes)``."""
        scores = self.classifier.predict_proba(weights)
        return scores if self.calibrator is None else self.calibrator.apply(scores)

    def predict(self, weights: ArrayLike) -> NDArray[np.str_]:
        """Label of every row: the classifier's own answer."""
        return self.classifier.predict(weights)

    def segment_probabilities(self, weights: ArrayLike, segments: pd.DataFrame) -> NDArray[np.float64]:
        """Return calibrated probabilities ``(n_segments, n_classes)``; NaN for a segment that is all gaps."""
        means = mean_weights(weights, segments)
        present = np.isfinite(means).all(axis=1)
        result = np.full((len(segments), len(self.classes)), np.nan)
        result[present] = self.predict_proba(means[present])
        return result

    def label(self, weights: ArrayLike, segments: pd.DataFrame | None = None) -> pd.DataFrame:
        """Label segments, see :func:`~mimique.models.label_segments`; confidences are calibrated."""
        if segments is None:
            raise InputError("segments: expected those to label, but got none")
        table = label_segments(self.classifier, weights, segments)
        if self.calibrator is None:
            return table
        given = (table["label"] != "").to_numpy()
        columns = pd.Index(self.classes).get_indexer(table["label"][given])
        confidence = np.full(len(table), np.nan)
        confidence[given] = self.segment_probabilities(weights, table[given])[np.arange(len(columns)), columns]
        return table.assign(confidence=confidence)

    def to_arrays(self) -> tuple[dict[str, NDArray], dict[str, Any]]:
        """Return all that makes the model: arrays, and metadata that JSON can hold."""
        arrays, metadata = self.classifier.to_arrays()
        return _add_calibrator(arrays, metadata, self.calibrator)


@dataclass(frozen=True)
class TakeModel:
    """A labeller of frames in time.

    Parameters
    ----------
    name
        Of the method, one of :data:`mimique.models.labellers.LABELLERS`.
    labeller
        Fitted, with text for labels.
    shapes
        Names of the weights.
    calibrator
        Of the probabilities of the segments that it finds; ``None``: they are given as they are.
    """

    name: str
    labeller: FrameLabeller
    shapes: tuple[str, ...] = ()
    calibrator: Calibrator | None = None
    needs_segments = False

    @property
    def classes(self) -> tuple[str, ...]:
        """Labels of frames that it can give, among them ``"transition"``."""
        return tuple(str(name) for name in self.labeller.classes_)

    def check_fit(self, shapes: Sequence[str], rate: float) -> None:
        """Refuse weights of other shapes, or in another order, or at another rate than it was trained on."""
        if self.shapes and tuple(shapes) != self.shapes:
            other = sorted(set(shapes) ^ set(self.shapes))
            what = f"they differ in {', '.join(other[:5])}" if other else "their order differs"
            raise InputError(f"model {self.name}: expected weights of the shapes it was trained on, but {what}")
        if not np.isclose(rate, self.labeller.rate, rtol=1e-6, atol=0.0):
            raise InputError(
                f"model {self.name}: expected {self.labeller.rate:g} frames per second as it was trained on, "
                f"but got {rate:g}"
            )

    def frame_probabilities(self, weights: ArrayLike) -> NDArray[np.float64]:
        """Probabilities ``(n_frames, n_classes)`` of a take's frames, not calibrated; NaN in gaps."""
        values, missing = fill_gaps(weights)
        scores = self.labeller.predict_proba(values)
        scores[missing] = np.nan
        return scores

    def segment_probabilities(self, weights: ArrayLike, segments: pd.DataFrame) -> NDArray[np.float64]:
        """Return calibrated probabilities ``(n_segments, n_classes)`` of segments of a take, whoever cut them."""
        pooled = segment_probabilities(self.frame_probabilities(weights), segments)
        return pooled if self.calibrator is None else self.calibrator.apply(pooled)

    def label(self, weights: ArrayLike, segments: pd.DataFrame | None = None) -> pd.DataFrame:
        """Find and label the segments of a take, see :func:`~.labellers.take_tiers.find_take_segments`."""
        return find_take_segments(self.labeller, weights, self.calibrator)[0]

    def to_arrays(self) -> tuple[dict[str, NDArray], dict[str, Any]]:
        """Return all that makes the model: arrays, and metadata that JSON can hold."""
        arrays, labeller = labeller_to_arrays(self.labeller)
        metadata = {
            "classifier": self.name,
            "labeller": labeller,
            "classes": [name for name in self.classes if name != TRANSITION],
            "transitions": TRANSITION in self.classes,
            "shapes": list(self.shapes),
            "rate": float(self.labeller.rate),
        }
        return _add_calibrator(arrays, metadata, self.calibrator)


StoredModel = SegmentModel | TakeModel


def model_from_arrays(arrays: Mapping[str, ArrayLike], metadata: Mapping[str, Any]) -> StoredModel:
    """Return the model that ``to_arrays`` of either kind described.

    Raises
    ------
    InputError
        If something is missing, damaged, or was written by a newer version.
    """
    calibrator = None
    if metadata.get("calibrator"):
        own = {k.removeprefix(CALIBRATOR): v for k, v in arrays.items() if k.startswith(CALIBRATOR)}
        calibrator = Calibrator.from_arrays(own, metadata["calibrator"])
    rest = {name: values for name, values in arrays.items() if not name.startswith(CALIBRATOR)}
    if "labeller" not in metadata:
        return SegmentModel(AffectModel.from_arrays(rest, metadata), calibrator)
    return TakeModel(
        str(metadata.get("classifier", "")),
        labeller_from_arrays(rest, metadata["labeller"]),
        tuple(str(shape) for shape in metadata.get("shapes", ())),
        calibrator,
    )


def _add_calibrator(
    arrays: dict[str, NDArray], metadata: dict[str, Any], calibrator: Calibrator | None
) -> tuple[dict[str, NDArray], dict[str, Any]]:
    if calibrator is None:
        return arrays, {**metadata, "calibrator": None}
    own, facts = calibrator.to_arrays()
    return {**arrays, **{f"{CALIBRATOR}{name}": values for name, values in own.items()}}, {
        **metadata,
        "calibrator": facts,
    }
