"""What a take's markers are worth: how much of each is missing, for how long, and which ones coincide."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ..errors import InputError
from .take import check_take, select_markers

__all__ = ["find_coinciding_markers", "longest_runs", "summarise_markers"]

COINCIDENCE = 5e-4
"""Distance below which two markers cannot be two, as part of the layout's size: 0.1 mm, optical noise, on a head."""


def summarise_markers(take: xr.Dataset) -> pd.DataFrame:
    """Summarise each tracked marker of a take; model outputs are left out.

    Returns
    -------
    pandas.DataFrame
        One row a marker, in the take's order: ``marker``, ``n_missing`` (frames), ``missing`` (share of all frames),
        ``n_gaps``, ``longest_gap`` (frames), ``longest_gap_s``, ``first_seen`` and ``last_seen`` (frames, −1 where
        never), ``coincides_with`` (name of the first marker that it coincides with, else empty).

    Raises
    ------
    InputError
        If the take is not valid.
    """
    check_take(take)
    markers = select_markers(take)
    names = [str(name) for name in markers["marker"].values]
    missing = np.isnan(markers["position"].transpose("time", "marker", "space").values).any(axis=2)
    n_frames = missing.shape[0]
    n_gaps, longest = longest_runs(missing)
    partner: dict[str, str] = {}
    for first, second in find_coinciding_markers(take):
        partner.setdefault(second, first)
        partner.setdefault(first, second)
    seen = ~missing.all(axis=0)
    return pd.DataFrame(
        {
            "marker": pd.Series(names, dtype="str"),
            "n_missing": missing.sum(axis=0),
            "missing": missing.mean(axis=0),
            "n_gaps": n_gaps,
            "longest_gap": longest,
            "longest_gap_s": longest / float(take.attrs["rate"]),
            "first_seen": np.where(seen, np.argmin(missing, axis=0), -1),
            "last_seen": np.where(seen, n_frames - 1 - np.argmin(missing[::-1], axis=0), -1),
            "coincides_with": pd.Series([partner.get(name, "") for name in names], dtype="str"),
        }
    )


def find_coinciding_markers(take: xr.Dataset, *, tolerance: float | None = None) -> list[tuple[str, str]]:
    """Find pairs of tracked markers that are one and the same point.

    A pair coincides if it is within ``tolerance`` (mm) in more than half of the frames that show both. Markers
    that touch for a moment (lips, lids) do not. By default the tolerance goes with the layout's size
    (:data:`COINCIDENCE`), so that a recording in the wrong unit is not taken for one of copies.

    Raises
    ------
    InputError
        If the tolerance is not above 0.
    """
    if tolerance is not None and not tolerance > 0:
        raise InputError(f"tolerance: expected a distance above 0 mm, but got {tolerance!r}")
    markers = select_markers(take)
    names = [str(name) for name in markers["marker"].values]
    position = markers["position"].transpose("marker", "time", "space").values.astype(np.float64)
    if tolerance is None:
        tolerance = COINCIDENCE * _layout_size(position)
    pairs = []
    for first in range(len(names) - 1):
        distance = np.linalg.norm(position[first + 1 :] - position[first], axis=2)
        n_seen = np.isfinite(distance).sum(axis=1)
        close = 2 * (distance <= tolerance).sum(axis=1) > n_seen
        pairs += [(names[first], names[first + 1 + int(other)]) for other in np.flatnonzero(close)]
    return pairs


def _layout_size(position: NDArray[np.float64]) -> float:
    """Return the largest extent of the markers in a typical frame, mm; (n_markers, n_frames, 3), NaN where missing."""
    seen = np.isfinite(position).all(axis=2)
    frames = seen.any(axis=0)
    if not frames.any():
        return 0.0
    extent = np.nanmax(position[:, frames], axis=0) - np.nanmin(position[:, frames], axis=0)
    return float(np.median(extent.max(axis=1)))


def longest_runs(flags: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Count the runs of true values in each column and measure the longest.

    Parameters
    ----------
    flags
        (n_frames, n_markers).

    Returns
    -------
    n_runs, longest
        (n_markers,) each; the length in frames, 0 where there is none.
    """
    n_frames, n_markers = flags.shape
    padded = np.zeros((n_frames + 2, n_markers), dtype=np.int8)
    padded[1:-1] = flags
    steps = np.diff(padded, axis=0).T  # marker by marker, so that starts and ends pair up
    marker, starts = np.nonzero(steps == 1)
    _, ends = np.nonzero(steps == -1)
    longest = np.zeros(n_markers, dtype=np.int64)
    np.maximum.at(longest, marker, ends - starts)
    return np.bincount(marker, minlength=n_markers), longest
