"""Head motion out, and the neutral face found, for all takes of a signer together (Reverdy 2019, 5.2.1).

All takes that share signer, markers and head markers are aligned to one reference of the head, so that one neutral
serves them all. It is searched in all of them: a take of a held expression alone shows too little neutral to find it.
The outcome depends on what the corpus holds, not on the order in which it came.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError
from ...features import Stabilised, find_neutral, fit_head_reference, median_pose, stabilise

REPAIRED = "repaired"
"""The processing step whose markers, where there are any, stand for the recorded ones."""

SAMPLES_PER_TAKE = 400
"""Frames of a take, spread evenly, that the signer's reference and typical pose are computed from."""


@dataclass(frozen=True)
class Session:
    """What the takes of one signer with one marker set share.

    Parameters
    ----------
    takes
        Their names.
    markers, head_markers
        Names of the tracked markers, and of those on the skull.
    reference
        (n_head, 3) mm: where the head markers are once stabilised.
    neutral
        (n_markers, 3) mm: the neutral face, stabilised; NaN for a marker that is never seen.
    neutral_take, neutral_onset, neutral_offset
        Where the neutral was found.
    """

    takes: tuple[str, ...]
    markers: tuple[str, ...]
    head_markers: tuple[str, ...]
    reference: NDArray[np.float64]
    neutral: NDArray[np.float64]
    neutral_take: str
    neutral_onset: int
    neutral_offset: int


@dataclass(frozen=True)
class TrackedTake:
    """The tracked markers of a take, without what a model computed."""

    position: NDArray[np.float64]
    markers: tuple[str, ...]
    head_markers: tuple[str, ...]
    rate: float
    neutral_frame: int | None

    @property
    def head(self) -> list[int]:
        """Places of the head markers among the markers."""
        return [self.markers.index(name) for name in self.head_markers]


def read_tracked(corpus: CorpusView, take: str, head_markers: Sequence[str] | None = None) -> TrackedTake:
    """Read the tracked markers of a take, repaired where they were; ``head_markers`` overrides those named at ingest.

    Raises
    ------
    InputError
        If there are fewer than three head markers, or one is not there.
    """
    dataset = corpus.take(take)
    tracked = _select_tracked(dataset)
    markers = tuple(str(name) for name in tracked["marker"].values)
    head = tuple(head_markers or dataset.attrs.get("head_markers") or ())
    if len(head) < 3:
        raise InputError(
            f"take {take!r}: expected at least three head markers to take out head motion, but got {len(head)}; "
            "name them with --head-markers"
        )
    unknown = [name for name in head if name not in markers]
    if unknown:
        raise InputError(f"take {take!r}: no head marker {', '.join(unknown)}; the markers are {', '.join(markers)}")
    frame = dataset.attrs.get("neutral_frame")
    source = corpus.processed(take, REPAIRED) if REPAIRED in corpus.steps(take) else tracked
    position = np.asarray(source["position"].values, dtype=np.float64)
    return TrackedTake(position, markers, head, float(dataset.attrs["rate"]), None if frame is None else int(frame))


def fingerprint_tracked(corpus: CorpusView, take: str) -> str:
    """Return the fingerprint of what :func:`read_tracked` reads: of the repaired markers where there are any."""
    if REPAIRED in corpus.steps(take):
        return corpus.fingerprint(take, "processed", REPAIRED)
    return corpus.fingerprint(take)


def _select_tracked(dataset: xr.Dataset) -> xr.Dataset:
    if "kind" not in dataset.coords:
        return dataset
    return dataset.isel(marker=np.flatnonzero(dataset["kind"].values == "marker"))


def group_sessions(corpus: CorpusView, head_markers: Sequence[str] | None = None) -> list[list[str]]:
    """Return the names of the takes that belong together: same signer, markers and head markers.

    A take without a signer stands alone; one without markers is in no group.
    """
    groups: dict[tuple[object, ...], list[str]] = {}
    for row in corpus.takes().itertuples():
        name = str(row.take)
        if not row.markers:
            continue
        head = tuple(head_markers or corpus.take_attributes(name).get("head_markers") or ())
        alone = name if row.signer is None else None
        key = (row.signer, alone, tuple(corpus.take_markers(name, kind="marker")), head)
        groups.setdefault(key, []).append(name)
    return list(groups.values())


def prepare_session(
    corpus: CorpusView,
    takes: Sequence[str],
    head_markers: Sequence[str] | None = None,
    on_take: Callable[[str], None] = lambda name: None,
) -> Session:
    """Find the reference of the head and the neutral face that some takes share.

    Each take is read twice and thinned, so that memory holds one take at a time.

    Raises
    ------
    InputError
        If the head markers cannot fix a pose, or no marker is seen in any frame.
    """
    seen: list[NDArray] = []
    markers: tuple[str, ...] = ()
    head: tuple[str, ...] = ()
    for name in takes:
        tracked = read_tracked(corpus, name, head_markers)
        markers, head = tracked.markers, tracked.head_markers
        seen.append(_thin(tracked.position[:, tracked.head]))
    try:
        reference = fit_head_reference(np.concatenate(seen))
    except InputError as error:
        raise InputError(f"take {takes[0]!r}: {error}") from error

    poses = []
    for name in takes:
        tracked = read_tracked(corpus, name, head_markers)
        poses.append(stabilise_take(tracked, reference, name, sample=True).positions)
    typical = median_pose(np.concatenate(poses))
    best: tuple[float, Session] | None = None
    for name in takes:
        tracked = read_tracked(corpus, name, head_markers)
        calm = stabilise_take(tracked, reference, name).positions
        neutral = find_neutral(calm, tracked.rate, typical=typical)
        away = float(np.nanmean(np.sum((neutral.positions - typical) ** 2, axis=1)))
        if best is None or away < best[0]:
            best = (
                away,
                Session(tuple(takes), markers, head, reference, neutral.positions, name, neutral.onset, neutral.offset),
            )
        on_take(name)
    assert best is not None
    return best[1]


def stabilise_take(
    tracked: TrackedTake, reference: NDArray[np.float64], name: str, *, sample: bool = False
) -> Stabilised:
    """Take head motion out of a take, or out of an even sample of its frames."""
    position = _thin(tracked.position) if sample else tracked.position
    try:
        return stabilise(position, tracked.head, reference, names=tracked.markers)
    except InputError as error:
        raise InputError(f"take {name!r}: {error}") from error


def choose_neutral(tracked: TrackedTake, calm: Stabilised, session: Session, name: str) -> tuple[NDArray, str]:
    """Return a take's neutral markers (n_markers, 3) and where they come from: its given frame, else the signer's."""
    if tracked.neutral_frame is None:
        source = f"{session.neutral_take}[{session.neutral_onset}:{session.neutral_offset}]"
        return session.neutral, source
    try:
        own = find_neutral(calm.positions, tracked.rate, frame=tracked.neutral_frame)
    except InputError as error:
        raise InputError(f"take {name!r}: {error}") from error
    positions = np.where(own.missing[:, None], session.neutral, own.positions)
    return positions, f"{name}[{own.onset}:{own.offset}]"


def _thin(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(frames) <= SAMPLES_PER_TAKE:
        return frames
    return frames[np.linspace(0, len(frames) - 1, SAMPLES_PER_TAKE).round().astype(int)]
