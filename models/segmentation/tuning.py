"""Parameters of the segmentation, chosen by cross-validation across signers.

Every combination of a grid is tried on every take, and its borders (or segments) are compared with a person's. Since
nothing else is learned, a signer's counts do not depend on the others': the combination that is best on some signers
is known for every choice of them, and leaving one signer out costs nothing. The score of a combination is F1 over all
of the signers' borders together; of equals the one that comes first, which is nearest to the default, is taken.

The grid is in physical terms: seconds, shares, and multiples of how restless the signer's face is at rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import product
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ...features.segmentation import (
    Motion,
    SegmentationSettings,
    find_candidates,
    join_candidates,
    measure_motion,
    measure_restlessness,
    tile_run,
)
from ..labelled_take import LabelledTake
from ..scores.segmentation_scores import (
    ReferenceCut,
    clip_segments,
    count_matched_borders,
    count_matched_segments,
    find_borders,
    prepare_reference,
)

__all__ = ["GRID", "TARGETS", "SegmentationTuning", "tune_segmentation"]

GRID: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        "window": (0.15, 0.25, 0.35, 0.5),
        "tau": (0.02, 0.05),
        "threshold": (7.0, 10.0, 14.0, 20.0, 28.0, 40.0),
        "directness": (0.15, 0.3, 0.45),
        "flank": (0.4, 0.5, 0.6, 0.8),
    }
)
"""Values tried: window and tau in seconds, threshold in units of the restlessness, directness and flank as shares."""
TARGETS = ("borders", "segments")
"""What the choice is made by: F1 of borders within a tolerance in seconds, or F1@50 of segments of any label."""


@dataclass(frozen=True)
class SegmentationTuning:
    """What a grid of settings gives on each take; see :func:`tune_segmentation`.

    Parameters
    ----------
    settings
        Combinations, the nearest to the default first: :class:`~mimique.features.segmentation.SegmentationSettings`, or
        other frozen settings.
    takes
        ``take, signer`` of each.
    counts
        ``(n_settings, n_takes, 3)``: right ones, those found, those of the reference.
    target, tolerance
        What is counted; seconds.
    """

    settings: tuple[Any, ...]
    takes: pd.DataFrame
    counts: NDArray[np.int64]
    target: str
    tolerance: float

    def score(self, settings: Any, signers: Sequence[str] | None = None) -> float:
        """F1 of a combination over all takes, or over the takes of some signers."""
        if settings not in self.settings:
            raise InputError(f"settings: expected a combination of the grid, but got {settings}")
        return float(_f1(self._pool(signers)[self.settings.index(settings)]))

    def choose(self, signers: Sequence[str] | None = None) -> Any:
        """Return the best combination on all takes, or on the takes of some signers.

        Raises
        ------
        InputError
            If none of the takes is of these signers, or their references have no borders.
        """
        pooled = self._pool(signers)
        if not pooled[0, 2]:
            raise InputError(f"segmentation: expected a reference with {self.target} to choose by, but there is none")
        return self.settings[int(np.argmax(_f1(pooled)))]

    def leave_one_out(self) -> pd.DataFrame:
        """Score each signer with what is best on all others.

        Returns
        -------
        One row a signer: ``signer, n_takes, default, tuned`` (F1 with the default settings, and with those chosen
        without this signer), the chosen settings, and ``matched, found, reference`` of ``tuned`` to pool. Where there
        is one signer only, one row a take, chosen on the other takes.
        """
        by = "signer" if self.takes["signer"].nunique() > 1 else "take"
        rows = []
        for name in self.takes[by].unique():
            own = (self.takes[by] == name).to_numpy()
            if own.all():
                raise InputError("segmentation: expected at least two annotated takes to choose by, but got one")
            best = int(np.argmax(_f1(self.counts[:, ~own].sum(axis=1))))
            tested = self.counts[:, own].sum(axis=1)
            matched, found, reference = tested[best].tolist()
            rows.append(
                {
                    by: name,
                    "n_takes": int(own.sum()),
                    "default": float(_f1(tested[0])),
                    "tuned": float(_f1(tested[best])),
                    **{key: value for key, value in asdict(self.settings[best]).items() if key in self.varying},
                    "matched": matched,
                    "found": found,
                    "reference": reference,
                }
            )
        return pd.DataFrame(rows)

    @property
    def varying(self) -> list[str]:
        """Names of the parameters in which the combinations differ."""
        tried = pd.DataFrame([asdict(one) for one in self.settings])
        return [str(name) for name in tried.columns if tried[name].nunique() > 1]

    def _pool(self, signers: Sequence[str] | None) -> NDArray[np.int64]:
        own = np.ones(len(self.takes), dtype=bool) if signers is None else self.takes["signer"].isin(list(signers))
        if not np.any(own):
            raise InputError(f"signers: expected some of those that were tried, but got {', '.join(signers or [])}")
        return self.counts[:, np.asarray(own)].sum(axis=1)


def tune_segmentation(
    takes: Sequence[LabelledTake],
    *,
    grid: Mapping[str, Sequence[float]] = GRID,
    default: SegmentationSettings | None = None,
    target: str = "borders",
    tolerance: float = 0.1,
    finished: Callable[[str], object] | None = None,
) -> SegmentationTuning:
    """Try all combinations of a grid on labelled takes.

    Parameters
    ----------
    takes
        With weights. How restless a signer is at rest is measured over all of the signer's takes here.
    grid
        Values of ``window, tau, threshold, directness, flank``; what is left out stays at the default.
    default
        What the other parameters are, and what the outcome is compared with.
    target
        See :data:`TARGETS`.
    tolerance
        Of borders, in seconds, above 0.
    finished
        Called with each take's name.

    Raises
    ------
    InputError
        Without takes, for takes without weights, or values out of range.
    """
    _check(takes, target, tolerance)
    default = default or SegmentationSettings()
    settings = list_settings(grid, default)
    counts = np.zeros((len(settings), len(takes), 3), dtype=np.int64)
    place = {one: index for index, one in enumerate(settings)}
    for signer in dict.fromkeys(take.signer for take in takes):
        own = [index for index, take in enumerate(takes) if take.signer == signer]
        references = {index: prepare_reference(takes[index]) for index in own}
        for window, tau in dict.fromkeys((one.window, one.tau) for one in settings):
            some = [one for one in settings if (one.window, one.tau) == (window, tau)]
            motions = [measure_motion(takes[i].weights, takes[i].rate, tau=tau, window=window) for i in own]  # type: ignore[arg-type]
            restlessness = measure_restlessness(np.concatenate([motion.level for motion in motions]))
            for index, motion in zip(own, motions, strict=True):
                for one, table in cut_in_all_ways(motion, some, restlessness):
                    counts[place[one], index] = count_cut(table, references[index], target, tolerance * motion.rate)
        for index in own:
            if finished is not None:
                finished(takes[index].name)
    table = pd.DataFrame({"take": [take.name for take in takes], "signer": [take.signer for take in takes]})
    return SegmentationTuning(tuple(settings), table, counts, target, float(tolerance))


def _check(takes: Sequence[LabelledTake], target: str, tolerance: float) -> None:
    if not takes:
        raise InputError("segmentation: expected at least one annotated take to choose by, but got none")
    bare = [take.name for take in takes if take.weights is None]
    if bare:
        raise InputError(f"segmentation: expected weights, but {', '.join(bare[:5])} has none; solve first")
    if target not in TARGETS:
        raise InputError(f"target: expected {' or '.join(TARGETS)}, but got {target!r}")
    if not 0 < tolerance < np.inf:
        raise InputError(f"tolerance: expected seconds above 0, but got {tolerance}")


def list_settings(grid: Mapping[str, Sequence[float]], default: SegmentationSettings) -> list[SegmentationSettings]:
    """List the combinations of a grid, those that change fewest parameters of the default, and least, first."""
    known = {field.name for field in fields(SegmentationSettings)}
    unknown = sorted(set(grid) - known)
    if unknown:
        raise InputError(f"grid: expected some of {', '.join(sorted(known))}, but got {', '.join(unknown)}")
    empty = [name for name, values in grid.items() if not len(values)]
    if empty:
        raise InputError(f"grid: expected at least one value, but {empty[0]} has none")
    tried = set()
    for values in product(*grid.values()):
        changes: dict[str, Any] = dict(zip(grid, values, strict=True))
        tried.add(replace(default, **changes))

    def away(one: SegmentationSettings) -> tuple:
        steps = [abs(getattr(one, name) - getattr(default, name)) / (max(grid[name]) or 1.0) for name in grid]
        return (sum(step > 0 for step in steps), sum(steps), *asdict(one).values())

    return sorted(tried | {default}, key=away)


def cut_in_all_ways(
    motion: Motion, settings: Sequence[SegmentationSettings], restlessness: float
) -> list[tuple[SegmentationSettings, list[tuple[int, int, str]]]]:
    """Cut a take with many settings of one window and τ; what they share is computed once."""
    rows: dict[SegmentationSettings, list[tuple[int, int, str]]] = {one: [] for one in settings}
    by_flank: dict[float, dict[tuple[float, float], list[SegmentationSettings]]] = {}
    for one in settings:
        by_flank.setdefault(one.flank, {}).setdefault((one.threshold, one.min_duration), []).append(one)
    for run in motion.runs:
        for flank, by_threshold in by_flank.items():
            lowest = min(threshold for threshold, _ in by_threshold) * restlessness
            candidates = find_candidates(motion, run, flank, max(lowest, motion.round_off))
            for (threshold, min_duration), some in by_threshold.items():
                least = max(threshold * restlessness, motion.round_off)
                movements, directness = join_candidates(motion, run, candidates, least, min_duration)
                for one in some:
                    rows[one] += tile_run(motion, run, movements[directness >= one.directness], one.borders)
    return list(rows.items())


def count_cut(
    rows: Sequence[tuple[Any, ...]], reference: ReferenceCut, target: str, tolerance: float
) -> tuple[int, int, int]:
    """Count what is right, found and asked for; rows begin with onset and offset, the tolerance is in frames."""
    onsets = np.array([row[0] for row in rows], dtype=np.int64)
    offsets = np.array([row[1] for row in rows], dtype=np.int64)
    if target == "borders":
        found = find_borders(onsets, offsets, reference.annotated)
        return count_matched_borders(found, reference.borders, tolerance), len(found), len(reference.borders)
    pieces = clip_segments(onsets, offsets, reference.annotated)
    return count_matched_segments(*pieces, reference, 0.5), len(pieces[0]), len(reference.onsets)


def _f1(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """F1 of counts ``(…, 3)``; 0 where nothing is found nor to be found."""
    total = counts[..., 1] + counts[..., 2]
    return np.divide(2.0 * counts[..., 0], total, out=np.zeros(total.shape), where=total > 0)
