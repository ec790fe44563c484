"""Segments of a take by its motion energy: where the face holds, and where it changes (Reverdy 2019, 4.4.2).

The thesis looks for the frames at the border between two segments: local optima of ``E_vel² + E_acc²`` whose local
variation, in a window around them, exceeds a threshold. It prints neither threshold nor window; 7.2 adds that the
segments found are the stretches where the expression is stable and those where it is not. mimique reads it so:

1. The curve is the *level*, the square root of the combined energy of :mod:`mimique.features.energies`: the square
   root leaves the optima where they are, and makes the level proportional to the size of the movement.
2. Its local maxima are candidate movements. Their local variation is their prominence within the window: the height
   above the higher of the two valleys beside them.
3. A maximum counts when its variation exceeds `threshold` times the *restlessness* of the take, that is, the spread of
   the level while the face is quiet. This ratio has no unit; noise, rate and gain of the recording fall out of it.
4. The borders of a movement are where the level has fallen by `flank` of the prominence on each side: there the
   transition begins and ends. Movements that meet, or leave less than `min_duration` between them, are one.
5. A movement that comes back to where it began (a blink, a syllable mouthed) is no border between two expressions. It
   counts by its *directness*, the length of the way from its first to its last frame over the length of path travelled.

The defaults suit weights of `map`, `bounded` and `lsts` alike: on one simulated corpus of ten signers they come within
0.01 of the best of a grid for each (F1 of borders within 0.1 s), and were then checked on another. For other recordings
:mod:`mimique.models.segmentation.tuning` chooses them by what a person annotated.

The outcome depends on the take's own quiet stretches; a take that rests for less than a tenth of its time is cut more
sparingly. Measure one `restlessness` on the joined levels of all takes of a signer to treat them alike (not the mean
or median of the takes' own: those that never rest would blunt it).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.signal import find_peaks

from ..arrays import check_array
from ..errors import InputError
from .derivatives import differentiate, find_runs
from .energies import MotionEnergy, motion_energy

__all__ = [
    "Candidates",
    "Motion",
    "SegmentationSettings",
    "cut_motion",
    "find_candidates",
    "join_candidates",
    "measure_joint_restlessness",
    "measure_motion",
    "measure_restlessness",
    "segment",
    "tile_run",
]

# Quantiles of the level in quiet frames, and how far apart they are in standard deviations of a normal curve.
QUIET_QUANTILES = (0.02, 0.10)
QUIET_DEVIATIONS = 0.7722
# In a take without noise the quiet level has no spread; this part of the level's range takes its place.
LEAST_RESTLESSNESS = 0.01


@dataclass(frozen=True)
class SegmentationSettings:
    """Parameters of :func:`segment`, in physical terms; the same words, meanings and ranges.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    window: float = 0.35
    threshold: float = 14.0
    tau: float = 0.05
    directness: float = 0.3
    flank: float = 0.5
    min_duration: float = 0.1
    borders: str = "flanks"

    def __post_init__(self) -> None:
        for name, low, high in (("window", 0, np.inf), ("threshold", 0, np.inf), ("flank", 0, 1)):
            value = getattr(self, name)
            if not low < value < high:
                raise InputError(f"{name}: expected a number above {low} and below {high}, but got {value}")
        if not 0 <= self.directness <= 1:
            raise InputError(f"directness: expected 0 to 1, but got {self.directness}")
        for name in ("tau", "min_duration"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"{name}: expected seconds, at least 0, but got {getattr(self, name)}")
        if self.borders not in ("flanks", "peaks"):
            raise InputError(f"borders: expected 'flanks' or 'peaks', but got {self.borders!r}")


def segment(
    weights: ArrayLike,
    rate: float,
    *,
    tau: float = 0.05,
    window: float = 0.35,
    threshold: float = 14.0,
    min_duration: float = 0.1,
    borders: str = "flanks",
    flank: float = 0.5,
    directness: float = 0.3,
    restlessness: float | None = None,
) -> pd.DataFrame:
    """Cut a take into stable segments and transitions.

    Parameters
    ----------
    weights
        ``(n_frames, n_shapes)``; a frame with a NaN is a gap, and belongs to no segment.
    rate
        Frames per second, above 0.
    tau, window
        Seconds; see :func:`mimique.features.energies.motion_energy`. The local variation of a maximum is measured
        within one second on either side.
    threshold
        Least local variation of a movement, in units of the restlessness; above 0. Higher finds less. With fewer than
        about five shapes the level of noise alone is far from normal, and reaches the default now and then.
    min_duration
        Shortest segment in seconds, at least 0.
    borders
        ``"flanks"``: both ends of a movement are borders, and it is a transition of its own. ``"peaks"``: its highest
        frame is the one border, and all segments are called stable.
    flank
        Part of its prominence by which the level has fallen at the borders of a movement, above 0 and below 1.
    directness
        Least directness of a transition, 0 to 1; 0 takes every movement for one, as the thesis does.
    restlessness
        Spread of the quiet level in 1/s; by default :func:`measure_restlessness` of this take.

    Returns
    -------
    Table with ``onset``, ``offset`` (int64 frames, half-open) and ``kind`` (``"stable"`` or ``"transition"``), in order
    and without overlap; together the segments cover every frame that is not a gap.
    """
    settings = SegmentationSettings(
        window=window,
        threshold=threshold,
        tau=tau,
        directness=directness,
        flank=flank,
        min_duration=min_duration,
        borders=borders,
    )
    motion = measure_motion(weights, rate, tau=tau, window=window)
    if restlessness is None:
        restlessness = measure_restlessness(motion.level)
    return cut_motion(motion, settings, restlessness)


@dataclass(frozen=True)
class Motion:
    """How a take moves, for one τ and window: what every choice of the other parameters is made from.

    Parameters
    ----------
    rate
        Frames per second.
    level
        ``(n_frames,)`` square root of the combined energy, 1/s; NaN in gaps.
    runs
        Half-open intervals without gaps.
    smooth
        ``(n_frames, n_shapes)`` smoothed weights.
    travelled
        ``(n_frames + 1,)`` length of path before each frame, summed over shapes, without what noise alone adds.
    round_off
        Level below which nothing moves, 1/s.
    """

    rate: float
    level: NDArray[np.float64]
    runs: tuple[tuple[int, int], ...]
    smooth: NDArray[np.float64]
    travelled: NDArray[np.float64]
    round_off: float


@dataclass(frozen=True)
class Candidates:
    """Local maxima of the level of a run: their flanks (half-open, in frames of the run), and their prominence."""

    onset: NDArray[np.int64]
    offset: NDArray[np.int64]
    prominence: NDArray[np.float64]


def measure_motion(weights: ArrayLike, rate: float, *, tau: float, window: float) -> Motion:
    """Level, smoothed weights and path of a take; parameters as in :func:`segment`."""
    values = check_array(weights, name="weights", shape=(None, None))
    energy = motion_energy(values, rate, tau=tau, window=window)
    speed = np.nan_to_num(np.clip(energy.velocity - _quiet_velocity(energy), 0, None))
    return Motion(
        rate=float(rate),
        level=energy.level,
        runs=tuple(find_runs(np.isfinite(values).all(axis=1))),
        smooth=differentiate(values, rate, window=window, max_order=0)[0],
        travelled=np.concatenate(([0.0], np.cumsum(speed) / rate)),
        # Weights that stay the same to nine digits do not move: what their derivatives show is round-off.
        round_off=1e-9 * float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0)) / window,
    )


def cut_motion(motion: Motion, settings: SegmentationSettings, restlessness: float) -> pd.DataFrame:
    """Cut a take whose motion was measured with the τ and window of the settings; returns what :func:`segment` does."""
    if not 0 <= restlessness < np.inf:
        raise InputError(f"restlessness: expected 1/s, at least 0, but got {restlessness}")
    least = max(settings.threshold * restlessness, motion.round_off)
    rows: list[tuple[int, int, str]] = []
    for run in motion.runs:
        candidates = find_candidates(motion, run, settings.flank, least)
        movements, directness = join_candidates(motion, run, candidates, least, settings.min_duration)
        rows += tile_run(motion, run, movements[directness >= settings.directness], settings.borders)
    table = pd.DataFrame(rows, columns=["onset", "offset", "kind"])
    return table.astype({"onset": np.int64, "offset": np.int64, "kind": str})


def measure_restlessness(level: ArrayLike) -> float:
    """Spread of the level while the face is quiet, in the unit of the level (1/s).

    The distance between the 0.02 and 0.10 quantiles of the level, over the 0.77 standard deviations that lie between
    them in a normal distribution: a take must rest for a tenth of its time to be measured well. At least a hundredth of
    the level's range, so that a recording without noise has a measure too.

    Parameters
    ----------
    level
        Any shape, NaN for gaps; one take, or several of one signer joined.
    """
    values = np.asarray(level, dtype=np.float64)
    values = values[np.isfinite(values)]
    if not len(values):
        return 0.0
    low, quiet, high = np.quantile(values, [*QUIET_QUANTILES, 0.99])
    return float(max((quiet - low) / QUIET_DEVIATIONS, LEAST_RESTLESSNESS * (high - low)))


def measure_joint_restlessness(
    takes: Iterable[tuple[ArrayLike, float]], settings: SegmentationSettings | None = None
) -> float:
    """Restlessness of a signer, 1/s, over the joined levels of all takes, each given by its weights and its rate."""
    used = settings or SegmentationSettings()
    levels = [motion_energy(weights, rate, tau=used.tau, window=used.window).level for weights, rate in takes]
    return measure_restlessness(np.concatenate(levels)) if levels else 0.0


def find_candidates(motion: Motion, run: tuple[int, int], flank: float, least: float) -> Candidates:
    """Maxima of a run whose prominence, within a second on either side, is at least so much, with their flanks."""
    # Frames without a level lie at the ends of runs too short to differentiate; zero makes no maximum of them.
    curve = np.nan_to_num(motion.level[slice(*run)], nan=0.0)
    floor = max(least, np.finfo(float).tiny)
    peaks, found = find_peaks(curve, prominence=floor, wlen=round(2 * motion.rate) + 1)
    onsets, offsets = np.empty(len(peaks), dtype=np.int64), np.empty(len(peaks), dtype=np.int64)
    for index, (peak, prominence) in enumerate(zip(peaks, found["prominences"], strict=True)):
        low = curve < curve[peak] - flank * prominence
        before, after = np.flatnonzero(low[:peak]), np.flatnonzero(low[peak:])
        onsets[index] = before[-1] + 1 if len(before) else 0
        offsets[index] = peak + after[0] if len(after) else len(curve)
    return Candidates(onsets, offsets, found["prominences"])


def join_candidates(
    motion: Motion, run: tuple[int, int], candidates: Candidates, least: float, min_duration: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Movements of a run: candidates of at least so much prominence, joined where too little is left between them.

    Returns
    -------
    movements
        ``(n_movements, 2)`` onset and offset in frames of the take; none is shorter than the least duration.
    directness
        Way between the ends of each over the path travelled in it, 0 to 1; both are sums over shapes.
    """
    n_least, n_frames = max(int(np.ceil(min_duration * motion.rate - 1e-9)), 1), run[1] - run[0]
    chosen = candidates.prominence >= least
    joined: list[list[int]] = []
    for onset, offset in sorted(
        zip(candidates.onset[chosen].tolist(), candidates.offset[chosen].tolist(), strict=True)
    ):
        onset = 0 if onset < n_least else onset
        offset = n_frames if n_frames - offset < n_least else offset
        if joined and onset - joined[-1][1] < n_least:
            joined[-1][1] = max(joined[-1][1], offset)
        else:
            joined.append([onset, offset])
    movements = run[0] + np.array([pair for pair in joined if pair[1] - pair[0] >= n_least], dtype=np.int64)
    movements = movements.reshape(-1, 2)
    first, last = movements[:, 0], movements[:, 1]
    way = np.abs(motion.smooth[last - 1] - motion.smooth[first]).sum(axis=1)
    path = motion.travelled[last] - motion.travelled[first]
    return movements, np.divide(way, path, out=np.zeros(len(way)), where=path > 0)


def tile_run(
    motion: Motion, run: tuple[int, int], movements: NDArray[np.int64], borders: str
) -> list[tuple[int, int, str]]:
    """Cover a run with segments: movements are transitions, what lies between them is stable; or cut at the peaks."""
    onset, offset = run
    if borders == "peaks":
        cuts = [onset, *(int(a) + int(np.argmax(motion.level[a:b])) for a, b in movements), offset]
        return [(a, b, "stable") for a, b in pairwise(cuts) if b > a]
    ends = [onset, *movements.ravel().tolist(), offset]
    kinds = ["stable", "transition"]
    return [(a, b, kinds[index % 2]) for index, (a, b) in enumerate(pairwise(ends)) if b > a]


def _quiet_velocity(energy: MotionEnergy) -> float:
    """E_vel of noise alone, which adds to every path."""
    velocity = energy.velocity[np.isfinite(energy.velocity)]
    return float(np.quantile(velocity, QUIET_QUANTILES[1])) if len(velocity) else 0.0
