"""Labels for segments from a fitted classifier (Reverdy 2019, 4.4.3)."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ..features.descriptors import mean_weights
from .affect_classifiers import AffectModel

__all__ = ["label_segments"]


def label_segments(model: AffectModel, weights: ArrayLike, segments: pd.DataFrame) -> pd.DataFrame:
    """Label each segment by its mean weights (4.6).

    A segment whose ``kind`` is ``"transition"`` also gets ``from_label`` and ``to_label``, those of the stable segments
    that touch it, if the two are there and differ; both are empty elsewhere. Its own label is the classifier's answer
    for its mean, like any other's: what stands between two labels belongs to neither, and the thesis leaves open what
    to do with it (7.2).

    Parameters
    ----------
    model
        Fitted classifier.
    weights
        ``(n_frames, n_shapes)``, NaN in gaps.
    segments
        Table with ``onset`` and ``offset`` and, where known, ``kind``.

    Returns
    -------
    The table in order of time with ``label``, ``confidence`` (the score of the label, 0 to 1, see
    :meth:`AffectModel.predict_proba`), ``from_label`` and ``to_label``. A segment that is all gaps has the label ""
    and the confidence NaN.
    """
    table = segments.sort_values("onset", kind="stable").reset_index(drop=True)
    means = mean_weights(weights, table)
    present = np.isfinite(means).all(axis=1)
    scores = model.predict_proba(means[present])
    labels = np.full(len(table), "", dtype=object)
    confidence = np.full(len(table), np.nan)
    labels[present] = np.array(model.classes, dtype=object)[scores.argmax(axis=1)]
    confidence[present] = scores.max(axis=1)

    before = np.full(len(table), "", dtype=object)
    after = np.full(len(table), "", dtype=object)
    if "kind" in table.columns:
        moving = (table["kind"] == "transition").to_numpy()
        onsets, offsets = table["onset"].to_numpy(), table["offset"].to_numpy()
        for row in np.flatnonzero(moving[1:-1]) + 1:
            touching = offsets[row - 1] == onsets[row] and offsets[row] == onsets[row + 1]
            pair = labels[row - 1], labels[row + 1]
            if touching and not moving[row - 1] and not moving[row + 1] and all(pair) and pair[0] != pair[1]:
                before[row], after[row] = pair
    return table.assign(
        label=pd.Series(labels, dtype=str),
        confidence=confidence,
        from_label=pd.Series(before, dtype=str),
        to_label=pd.Series(after, dtype=str),
    )
