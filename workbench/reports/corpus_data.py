"""What a report is made of: plain tables, whoever computed them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from .corpus_quality import Quality

EVALUATION_COLUMNS = ("signer", "classifier", "segmentation", "n_segments", "accuracy")


@dataclass(frozen=True)
class SegmentationExample:
    """One take's energies and segments, to be drawn as in Reverdy 2019, Figure 4.3.

    Parameters
    ----------
    take
        The take's name.
    rate
        Hz.
    energies
        Curves (n_frames,) by the name that the legend shows, for example ``"E_vel"`` and ``"τ E_acc"``.
    tiers
        Segment tables (``onset``, ``offset`` in frames, ``label``) by tier name, manual before automatic.
    unit
        Unit of the curves.
    start, stop
        The frames to draw, half-open; all by default.
    """

    take: str
    rate: float
    energies: Mapping[str, NDArray[np.float64]]
    tiers: Mapping[str, pd.DataFrame]
    unit: str = "1/s"
    start: int = 0
    stop: int | None = None

    def __post_init__(self) -> None:
        lengths = {len(curve) for curve in self.energies.values()}
        if len(lengths) != 1 or 0 in lengths:
            raise InputError(
                f"report example {self.take!r}: expected energies of one length, but got {sorted(lengths)}"
            )
        if not self.rate > 0:
            raise InputError(f"report example {self.take!r}: expected a positive rate, but got {self.rate}")


@dataclass(frozen=True)
class ReportData:
    """All that a report can show; what is ``None`` or empty is left out, and the report says so.

    Parameters
    ----------
    corpus, snapshot, version, created
        Name of the corpus, the snapshot that the report describes, the mimique version, and the time it was made
        (as text).
    simulated
        Whether the recordings are simulated: every heading and caption then says so.
    takes
        One row a take, any columns; ``signer``, ``protocol``, ``seconds`` and ``n_markers`` are summed up.
    recording_times
        Seconds by row (signer and protocol) and column (labels, gap, transitions), the form of Table B.1. Totals are
        added here and must not be among them.
    residuals
        One row a take: ``take``, ``mean``, ``p95`` and whatever else, marker residuals of the solve in mm.
    example
        A take whose energies and segments are drawn.
    evaluation
        One row per signer, classifier and segmentation: ``signer``, ``classifier``, ``segmentation``, ``n_segments``,
        ``accuracy``, and optionally ``accuracy_duration``, ``majority`` and others.
    people
        Second annotators and classifiers on the same segments: ``signer``, ``segmentation``, ``kind``, ``accuracy`` …
    confusions
        Counts by reference (rows) and prediction (columns), by title.
    quality
        What the check of markers and tiers found.
    quality_notes
        Sentences about the data that a reader should know besides.
    history
        One row a snapshot, any columns.
    parameters
        What the results were computed with, name to value.
    portrait
        A picture of the face, PNG bytes, for the top of the report.
    """

    corpus: str
    snapshot: str
    version: str
    created: str
    simulated: bool = False
    takes: pd.DataFrame | None = None
    recording_times: pd.DataFrame | None = None
    residuals: pd.DataFrame | None = None
    example: SegmentationExample | None = None
    evaluation: pd.DataFrame | None = None
    people: pd.DataFrame | None = None
    confusions: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    quality: Quality | None = None
    quality_notes: Sequence[str] = ()
    history: pd.DataFrame | None = None
    parameters: Mapping[str, object] = field(default_factory=dict)
    portrait: bytes | None = None

    def __post_init__(self) -> None:
        for name, table, columns in (
            ("evaluation", self.evaluation, EVALUATION_COLUMNS),
            ("residuals", self.residuals, ("take", "mean", "p95")),
        ):
            missing = [c for c in columns if table is not None and c not in table.columns]
            if missing:
                raise InputError(f"report: expected columns {', '.join(columns)} in {name}, but got no {missing}")
