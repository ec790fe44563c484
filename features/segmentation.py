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

The outcome depends on the take's own quiet stretches; a take that rests for less than a tenth of its time is cut more
sparingly. Measure one `restlessness` on the joined levels of all takes of a signer to treat them alike (not the mean
or median of the takes' own: those that never rest would blunt it).
"""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.signal import find_peaks

from ..arrays import check_array
from ..errors import InputError
from .derivatives import differentiate, find_runs
from .energies import MotionEnergy, motion_energy

__all__ = ["measure_restlessness", "segment"]

# Quantiles of the level in quiet frames, and how far apart they are in standard deviations of a normal curve.
QUIET_QUANTILES = (0.02, 0.10)
QUIET_DEVIATIONS = 0.7722
# In a take without noise the quiet level has no spread; this part of the level's range takes its place.
LEAST_RESTLESSNESS = 0.01


def segment(
    weights: ArrayLike,
    rate: float,
    *,
    tau: float = 0.05,
    window: float = 0.25,
    threshold: float = 10.0,
    min_duration: float = 0.1,
    borders: Literal["flanks", "peaks"] = "flanks",
    flank: float = 0.8,
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
    values = check_array(weights, name="weights", shape=(None, None))
    for name, value, low, high in (
        ("threshold", threshold, 0, np.inf),
        ("flank", flank, 0, 1),
    ):
        if not low < value < high:
            raise InputError(f"{name}: expected a number above {low} and below {high}, but got {value}")
    if not 0 <= directness <= 1:
        raise InputError(f"directness: expected 0 to 1, but got {directness}")
    if not 0 <= min_duration < np.inf:
        raise InputError(f"min_duration: expected seconds, at least 0, but got {min_duration}")
    if borders not in ("flanks", "peaks"):
        raise InputError(f"borders: expected 'flanks' or 'peaks', but got {borders!r}")
    energy = motion_energy(values, rate, tau=tau, window=window)
    smooth = differentiate(values, rate, window=window, max_order=0)[0]
    if restlessness is None:
        restlessness = measure_restlessness(energy.level)
    elif not 0 <= restlessness < np.inf:
        raise InputError(f"restlessness: expected 1/s, at least 0, but got {restlessness}")
    # Weights that stay the same to nine digits do not move: what their derivatives show is round-off.
    round_off = 1e-9 * float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0)) / window
    least = max(threshold * restlessness, round_off)
    n_least = max(int(np.ceil(min_duration * rate - 1e-9)), 1)
    level = energy.level
    speed = energy.velocity - _quiet_velocity(energy)
    rows: list[tuple[int, int, str]] = []
    for onset, offset in find_runs(np.isfinite(values).all(axis=1)):
        run = slice(onset, offset)
        movements = _find_movements(level[run], round(2 * rate) + 1, least, flank)
        movements = _join_and_drop(movements, n_least, offset - onset)
        movements = [(a, b) for a, b in movements if _directness(smooth[run], speed[run], a, b, rate) >= directness]
        if borders == "peaks":
            cuts = [onset, *(onset + a + int(np.argmax(level[run][a:b])) for a, b in movements), offset]
            rows += [(a, b, "stable") for a, b in pairwise(cuts) if b > a]
        else:
            rows += _tile(movements, onset, offset)
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


def _find_movements(level: NDArray, n_window: int, least: float, flank: float) -> list[tuple[int, int]]:
    """Half-open extents of the maxima whose prominence within the window exceeds the least, joined where they meet."""
    # Frames without a level lie at the ends of runs too short to differentiate; zero makes no maximum of them.
    curve = np.nan_to_num(level, nan=0.0)
    peaks, found = find_peaks(curve, prominence=max(least, np.finfo(float).tiny), wlen=n_window)
    movements: list[tuple[int, int]] = []
    for peak, prominence in zip(peaks, found["prominences"], strict=True):
        low = curve < curve[peak] - flank * prominence
        before = np.flatnonzero(low[:peak])
        after = np.flatnonzero(low[peak:])
        onset = int(before[-1]) + 1 if len(before) else 0
        offset = int(peak + after[0]) if len(after) else len(curve)
        movements.append((onset, offset))
    return movements


def _join_and_drop(movements: list[tuple[int, int]], n_least: int, n_frames: int) -> list[tuple[int, int]]:
    """Join movements that leave fewer than the least frames between them, then drop those shorter than that."""
    joined: list[tuple[int, int]] = []
    for onset, offset in sorted(movements):
        onset = 0 if onset < n_least else onset
        offset = n_frames if n_frames - offset < n_least else offset
        if joined and onset - joined[-1][1] < n_least:
            joined[-1] = (joined[-1][0], max(joined[-1][1], offset))
        else:
            joined.append((onset, offset))
    return [(a, b) for a, b in joined if b - a >= n_least]


def _directness(smooth: NDArray, speed: NDArray, onset: int, offset: int, rate: float) -> float:
    """Way between the ends of a movement over the path travelled in it; both are sums over shapes."""
    way = np.abs(smooth[offset - 1] - smooth[onset]).sum()
    path = np.clip(speed[onset:offset], 0, None).sum() / rate
    return float(way / path) if path > 0 else 0.0


def _quiet_velocity(energy: MotionEnergy) -> float:
    """E_vel of noise alone, which adds to every path."""
    velocity = energy.velocity[np.isfinite(energy.velocity)]
    return float(np.quantile(velocity, QUIET_QUANTILES[1])) if len(velocity) else 0.0


def _tile(movements: list[tuple[int, int]], onset: int, offset: int) -> list[tuple[int, int, str]]:
    """Movements as transitions and what lies between them as stable segments, from onset to offset."""
    rows: list[tuple[int, int, str]] = []
    position = onset
    for a, b in movements:
        if onset + a > position:
            rows.append((position, onset + a, "stable"))
        rows.append((onset + a, onset + b, "transition"))
        position = onset + b
    if position < offset:
        rows.append((position, offset, "stable"))
    return rows
