"""Stretches of a take in which the face does not follow the markers: where a reviewer should not trust it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....features.derivatives import find_runs
from ....synthesis.diagnosis import find_residual_threshold

__all__ = ["LEAST_RESIDUAL", "LONGEST_PAUSE", "find_stretches", "find_threshold"]

LEAST_RESIDUAL = 1.0
"""mm. In a clean take frames stand out by a tenth of a millimetre, which nobody sees: a face of 200 mm that is drawn
400 pixels tall moves by two of them for 1 mm."""

LONGEST_PAUSE = 0.05
"""s. Two stretches that are no farther apart are one to the eye; a marker that flickers would else make dozens."""


def find_threshold(residual: ArrayLike) -> float | None:
    """Return the residual above which a frame is marked, mm; None where no residual is known.

    The take's own measure of what stands out (:func:`mimique.synthesis.diagnosis.find_residual_threshold`, which
    ``mimique solve`` counts by too), but no less than :data:`LEAST_RESIDUAL`.

    Parameters
    ----------
    residual
        (n_frames,) mm, NaN where unknown.
    """
    own = find_residual_threshold(residual)
    return max(own, LEAST_RESIDUAL) if np.isfinite(own) else None


def find_stretches(residual: ArrayLike, threshold: float | None, rate: float) -> list[tuple[int, int]]:
    """Return the stretches [onset, offset) whose residual exceeds the threshold, near ones joined.

    Parameters
    ----------
    residual
        (n_frames,) mm; NaN never exceeds anything.
    threshold
        mm; None gives none.
    rate
        Hz.
    """
    if threshold is None:
        return []
    values: NDArray[np.float64] = np.asarray(residual, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        runs = find_runs(values > threshold)
    pause = LONGEST_PAUSE * rate
    joined: list[tuple[int, int]] = []
    for onset, offset in runs:
        if joined and onset - joined[-1][1] < pause:
            joined[-1] = (joined[-1][0], offset)
        else:
            joined.append((onset, offset))
    return joined
