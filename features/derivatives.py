"""Derivatives of sampled curves in seconds: a tapered Savitzky-Golay filter whose width does not depend on the rate.

Two hundred frames a second make raw differences useless: 0.01 of noise in a weight becomes 2.8 per second in its
first difference and 980 per second squared in its second. Each frame is therefore given the polynomial that fits its
neighbours best (Savitzky and Golay 1964), and the derivatives are the polynomial's.

The fit is weighted by ``(1 - (2 t / window)²)²`` [1]_. A plain Savitzky-Golay filter has a box for a window, which
holds a whole number of frames: 0.12 s are 7 frames at 60 Hz but 25 at 200 Hz, and the same motion gets another
curve. The tapered weight falls to zero at both ends of the *stated* window, so that it is the same function of time at
every rate; it also damps the noise above the pass band much better.

Convention: derivatives are per second, not per frame.

References
----------
.. [1] M. Schmid, D. Rath, U. Diebold, "Why and How Savitzky-Golay Filters Should Be Replaced", ACS Measurement
   Science Au 2 (2022), 185-196.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import correlate1d

from ..arrays import check_array
from ..errors import InputError

__all__ = ["check_rate", "differentiate", "find_runs", "fit_polynomial_kernels"]


def differentiate(
    values: ArrayLike, rate: float, *, window: float = 0.25, degree: int = 2, max_order: int = 2
) -> NDArray:
    """Smooth curves and their derivatives in time.

    Parameters
    ----------
    values
        Curves, shape ``(n_frames, n_curves)``. A frame with a NaN in any curve is missing, and every run of frames
        between missing ones is treated by itself.
    rate
        Frames per second, above 0.
    window
        Full width of the fit in seconds. What is much faster is smoothed away.
    degree
        Degree of the polynomial; curves of that degree are reproduced exactly, up to the ends of a run.
    max_order
        Highest derivative wanted, at most `degree`.

    Returns
    -------
    Array of shape ``(max_order + 1, n_frames, n_curves)``: the smoothed curves, their first derivative (1/s), their
    second (1/s²), … NaN at missing frames, and in runs of no more than `degree` frames.

    Raises
    ------
    InputError
        If the window holds too few frames at this rate to fit the polynomial.

    Notes
    -----
    Within half a window of the end of a run the window reaches as far inwards as it lacks outwards, as in LOESS; the
    derivatives there are noisier, the first about four times.
    """
    curves = check_array(values, name="values", shape=(None, None))
    rate = check_rate(rate)
    if not 0 <= max_order <= degree:
        raise InputError(f"max_order: expected 0 to the degree {degree}, but got {max_order}")
    reach = _frames_each_side(window, rate, degree)
    result = np.full((max_order + 1, *curves.shape), np.nan)
    orders = range(max_order + 1)
    centre = fit_polynomial_kernels(np.arange(-reach, reach + 1) / rate, window / 2, degree)
    for onset, offset in find_runs(np.isfinite(curves).all(axis=1)):
        run = curves[onset:offset]
        n_frames = offset - onset
        if n_frames <= degree:
            continue
        for order in orders:
            # The filter's own treatment of the ends is replaced below.
            result[order, onset:offset] = correlate1d(run, centre[order], axis=0, mode="nearest")
        n_span = min(2 * reach + 1, n_frames)
        for frame in _frames_near_ends(n_frames, reach):
            first = 0 if frame < n_frames / 2 else n_frames - n_span
            times = (np.arange(first, first + n_span) - frame) / rate
            inside = min(frame, n_frames - 1 - frame) / rate
            span = min(window, (n_frames + 1) / rate)
            kernels = fit_polynomial_kernels(times, max(span - inside, span / 2), degree)
            result[:, onset + frame] = kernels[: max_order + 1] @ run[first : first + n_span]
    return result


def fit_polynomial_kernels(times: NDArray, half_width: float, degree: int) -> NDArray:
    """Fit the filters that give a curve's derivatives at time 0 from its samples, by weighted least squares.

    Parameters
    ----------
    times
        Sample times in seconds, shape ``(n_samples,)``.
    half_width
        Seconds at which the weight ``(1 - (t / half_width)²)²`` reaches zero; infinite for equal weights.
    degree
        Degree of the polynomial.

    Returns
    -------
    Shape ``(degree + 1, n_samples)``: row k, times the samples, is the k-th derivative.
    """
    unit = np.abs(times).max() or 1.0
    powers = np.vander(times / unit, degree + 1, increasing=True)
    root_weight = np.clip(1 - (times / half_width) ** 2, 0, None)
    coefficients = np.linalg.pinv(root_weight[:, None] * powers) * root_weight
    factorials = np.cumprod([1.0, *range(1, degree + 1)])
    return coefficients * (factorials / unit ** np.arange(degree + 1))[:, None]


def find_runs(present: ArrayLike) -> list[tuple[int, int]]:
    """Half-open intervals of consecutive true frames, in order.

    >>> find_runs([False, True, True, False, True])
    [(1, 3), (4, 5)]
    """
    flags = np.concatenate(([False], np.asarray(present, dtype=bool), [False]))
    changes = np.flatnonzero(flags[1:] != flags[:-1])
    return [(int(a), int(b)) for a, b in pairwise(changes)][::2]


def check_rate(rate: float) -> float:
    """Return the frame rate in Hz, or say what is wrong with it."""
    if not np.isfinite(rate) or rate <= 0:
        raise InputError(f"rate: expected a frame rate in Hz above 0, but got {rate}")
    return float(rate)


def _frames_each_side(window: float, rate: float, degree: int) -> int:
    """Frames on each side of a frame that have a weight above zero."""
    if not np.isfinite(window) or window <= 0:
        raise InputError(f"window: expected seconds above 0, but got {window}")
    # A frame exactly at the end of the window has no weight; the margin keeps round-off from counting it.
    reach = int(np.ceil(window * rate / 2 - 1e-9)) - 1
    if 2 * reach + 1 <= degree:
        needed = 2 * (degree // 2 + 1) / rate
        raise InputError(
            f"window: expected more than {needed:.3g} s at {rate:g} Hz (degree {degree} needs {degree + 1} frames), "
            f"but got {window:g} s"
        )
    return reach


def _frames_near_ends(n_frames: int, reach: int) -> list[int]:
    """Frames of a run whose window would stick out of it."""
    if n_frames <= 2 * reach:
        return list(range(n_frames))
    return [*range(reach), *range(n_frames - reach, n_frames)]
