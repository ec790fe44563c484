"""Borders by general change point detection, to compare the segmentation by energies with (needs ``ruptures``).

Three searches (Truong, Oudre, Vayatis 2020), each asking for the cuts that lower a cost by more than a penalty a cut:

- ``pelt``: exact least squares, constant pieces (Killick, Fearnhead, Eckley 2012);
- ``kernel``: the same with a Gaussian kernel, which sees changes of distribution and not of the mean only;
- ``window``: where the two halves of a sliding window differ most, by least squares.

They run on the smoothed weights, scaled to a total variance of 1 over all of a signer's takes, or on the logarithm of
the level of :mod:`mimique.features.segmentation` over its restlessness. The penalty is per second: the same motion is
cut alike at every rate. Segments have no kind: these methods do not know a transition from a held expression.

References
----------
C. Truong, L. Oudre, N. Vayatis, "Selective review of offline change point detection methods", Signal Processing 167
(2020). R. Killick, P. Fearnhead, I. A. Eckley, "Optimal detection of changepoints with a linear computational cost",
Journal of the American Statistical Association 107 (2012).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise, product
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ...features.segmentation import Motion, measure_motion, measure_restlessness
from ..labelled_take import LabelledTake
from ..scores.segmentation_scores import prepare_reference
from .tuning import SegmentationTuning, count_cut

__all__ = [
    "METHODS",
    "ChangePointSettings",
    "cut_by_change_points",
    "has_ruptures",
    "prepare_signals",
    "tune_change_points",
]

METHODS = ("pelt", "kernel", "window")
SIGNALS = ("weights", "level")
PENALTIES = (0.0003, 0.001, 0.003, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6)
WORK_RATE = 50.0
"""Hz at which cuts are looked for: 20 ms is finer than people agree on borders."""
WINDOW = 0.4
"""Seconds, both halves of the sliding window."""


@dataclass(frozen=True)
class ChangePointSettings:
    """One way to cut: a method, the signal that it sees, the penalty of a cut in s (times the signal's variance)."""

    method: str
    signal: str
    penalty: float
    min_duration: float = 0.1

    def __post_init__(self) -> None:
        for name, known in (("method", METHODS), ("signal", SIGNALS)):
            if getattr(self, name) not in known:
                raise InputError(f"{name}: expected one of {', '.join(known)}, but got {getattr(self, name)!r}")
        for name in ("penalty", "min_duration"):
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(f"{name}: expected seconds above 0, but got {getattr(self, name)}")


def has_ruptures() -> bool:
    """Return whether the package is installed."""
    return find_spec("ruptures") is not None


def prepare_signals(takes: Sequence[LabelledTake]) -> dict[str, dict[str, list[tuple[int, int, NDArray[np.float64]]]]]:
    """Return the signals of one signer's takes at the working rate.

    Parameters
    ----------
    takes
        With weights, of one signer: scale and restlessness are measured over all of them.

    Returns
    -------
    For each signal and take: onset and offset of each run without gaps, and ``(n_samples, n_curves)``.
    """
    motions = {take.name: measure_motion(take.weights, take.rate, tau=0.05, window=0.25) for take in takes}  # type: ignore[arg-type]
    level = np.concatenate([motion.level for motion in motions.values()])
    quiet = measure_restlessness(level) or 1.0
    smooth = np.concatenate([motion.smooth for motion in motions.values()])
    present = smooth[np.isfinite(smooth).all(axis=1)]
    scale = float(np.sqrt(present.var(axis=0).sum())) if len(present) else 0.0
    of_level = np.log1p(level / quiet)
    spread = float(np.nanstd(of_level)) if np.isfinite(of_level).any() else 0.0
    found: dict[str, dict[str, list[tuple[int, int, NDArray[np.float64]]]]] = {name: {} for name in SIGNALS}
    for name, motion in motions.items():
        curves = {"weights": motion.smooth / (scale or 1.0), "level": np.log1p(motion.level / quiet)[:, None]}
        curves["level"] = curves["level"] / (spread or 1.0)
        for signal in SIGNALS:
            found[signal][name] = [_sample(motion, run, curves[signal]) for run in motion.runs]
    return found


def cut_by_change_points(
    runs: Sequence[tuple[int, int, NDArray[np.float64]]], rate: float, settings: ChangePointSettings
) -> pd.DataFrame:
    """Cut a take; see :func:`prepare_signals` for the runs.

    Returns
    -------
    Table with ``onset``, ``offset`` (int64 frames, half-open); the segments cover every frame that is not a gap.

    Raises
    ------
    InputError
        Without the package ``ruptures``.
    """
    rows: list[tuple[int, int]] = []
    for onset, offset, samples in runs:
        cuts = _search(samples, settings.method, settings.min_duration)([settings.penalty])[0]
        rows += _tile(onset, offset, cuts, rate)
    return pd.DataFrame(rows, columns=["onset", "offset"]).astype(np.int64)


def tune_change_points(
    takes: Sequence[LabelledTake],
    method: str,
    *,
    signals: Sequence[str] = SIGNALS,
    penalties: Sequence[float] = PENALTIES,
    tolerance: float = 0.1,
    target: str = "borders",
    finished: Callable[[str], object] | None = None,
) -> SegmentationTuning:
    """Try a method's signals and penalties on labelled takes, as :func:`.segmentation_tuning.tune_segmentation`."""
    settings = [ChangePointSettings(method, signal, penalty) for signal, penalty in product(signals, penalties)]
    counts = np.zeros((len(settings), len(takes), 3), dtype=np.int64)
    place = {take.name: index for index, take in enumerate(takes)}
    for signer in dict.fromkeys(take.signer for take in takes):
        own = [take for take in takes if take.signer == signer]
        prepared = prepare_signals(own)
        for take in own:
            reference = prepare_reference(take)
            for number, signal in enumerate(signals):
                rows: list[list[tuple[int, int]]] = [[] for _ in penalties]
                for onset, offset, samples in prepared[signal][take.name]:
                    found = _search(samples, method, settings[0].min_duration)(penalties)
                    for some, cuts in zip(rows, found, strict=True):
                        some += _tile(onset, offset, cuts, take.rate)
                for index, some in enumerate(rows, start=number * len(penalties)):
                    counts[index, place[take.name]] = count_cut(some, reference, target, tolerance * take.rate)
            if finished is not None:
                finished(take.name)
    table = pd.DataFrame({"take": [take.name for take in takes], "signer": [take.signer for take in takes]})
    return SegmentationTuning(tuple(settings), table, counts, target, float(tolerance))


def _sample(motion: Motion, run: tuple[int, int], curves: NDArray) -> tuple[int, int, NDArray[np.float64]]:
    """Bring a run to the working rate; samples lie in the middle of their time."""
    onset, offset = run
    values = np.nan_to_num(curves[onset:offset])
    n_samples = int((offset - onset) / motion.rate * WORK_RATE)
    at = (np.arange(n_samples) + 0.5) / WORK_RATE * motion.rate - 0.5
    frames = np.arange(offset - onset)
    sampled = [np.interp(at, frames, curve) for curve in values.T]
    return onset, offset, np.column_stack(sampled) if n_samples else np.zeros((0, values.shape[1]))


def _search(
    samples: NDArray[np.float64], method: str, min_duration: float
) -> Callable[[Sequence[float]], list[list[int]]]:
    """Return a function from penalties to the samples at which new pieces begin."""
    if not has_ruptures():
        raise InputError("change points: the package ruptures is not installed; install mimique[compare]")
    import ruptures

    least = max(1, round(min_duration * WORK_RATE))
    width = 2 * round(WINDOW / 2 * WORK_RATE)
    # A run without two pieces, or without any motion, has no change.
    if len(samples) < max(2 * least, width + 1) or np.ptp(samples, axis=0).max() <= 0:
        return lambda penalties: [[] for _ in penalties]
    search: Any
    if method == "window":
        search = ruptures.Window(width=width, model="l2", min_size=least, jump=1)
    else:
        search = ruptures.KernelCPD(kernel="linear" if method == "pelt" else "rbf", min_size=least)
    search.fit(samples)
    return lambda penalties: [search.predict(pen=penalty * WORK_RATE)[:-1] for penalty in penalties]


def _tile(onset: int, offset: int, cuts: Sequence[int], rate: float) -> list[tuple[int, int]]:
    frames = [onset, *(onset + round(cut * rate / WORK_RATE) for cut in cuts), offset]
    return [(a, b) for a, b in pairwise(frames) if b > a]
