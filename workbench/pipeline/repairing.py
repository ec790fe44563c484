"""Repairs of a take's markers: gaps filled and labels swapped back, explicit, recorded and undone at will.

The recording never changes. The processing step ``repaired`` holds ``position (time, marker, space)`` and the masks
``filled`` and ``swapped (time, marker)``; its provenance lists the operations in order. Each repair replays the whole
list from the recording, so that the result is what the list says and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ...corpus import Corpus
from ...corpus.checks.quality import longest_runs
from ...corpus.store.provenance import describe_step
from ...corpus.store.view import CorpusView
from ...corpus.take import select_markers
from ...errors import InputError, NotFoundError
from ...features.gap_filling import fill_gaps
from ...features.swaps import exchange_markers
from ..progress import Reporter
from .stabilising import REPAIRED
from .take_blocks import open_take
from .take_scan import scan_take
from .take_survey import survey_take

__all__ = ["DEFAULT_BELOW", "RepairedMarkers", "apply_operations", "fill", "swap", "swap_found", "undo"]

DEFAULT_BELOW = 0.25
"""s; gaps of twice that cost about a millimetre on a moving face (``benchmarks/bench_quality.py``)."""

Operation = dict[str, Any]


@dataclass(frozen=True)
class RepairedMarkers:
    """Markers after some operations.

    Parameters
    ----------
    position
        (n_frames, n_markers, 3) mm, NaN where missing still.
    filled, swapped
        (n_frames, n_markers) bool: the value was computed; the value was recorded under another label.
    """

    position: NDArray[np.float64]
    filled: NDArray[np.bool_]
    swapped: NDArray[np.bool_]


def apply_operations(
    position: NDArray[np.float64], markers: Sequence[str], rate: float, operations: Sequence[Operation]
) -> RepairedMarkers:
    """Apply operations to recorded markers, in order.

    Parameters
    ----------
    position
        (n_frames, n_markers, 3) mm as recorded, NaN where missing.
    markers, rate
        Their names; Hz.
    operations
        ``{"operation": "fill", "below": seconds, "method": …}`` or ``{"operation": "swap", "markers": [a, b],
        "onset": frame, "offset": frame}``.

    Raises
    ------
    InputError
        If a marker is not there, frames are outside the take, or an operation is unknown.
    """
    names = list(markers)
    values = np.array(position, dtype=np.float64)
    filled, swapped = np.zeros((2, *values.shape[:2]), dtype=bool)
    for operation in operations:
        if operation["operation"] == "fill":
            recorded = np.where(filled[..., None], np.nan, values)
            values, gaps = fill_gaps(recorded, rate, float(operation["below"]), method=operation["method"])
            filled[:] = False
            for gap in gaps:
                filled[gap.onset : gap.offset, gap.marker] = True
        elif operation["operation"] == "swap":
            first, second = (_index(names, name) for name in operation["markers"])
            onset, offset = int(operation["onset"]), int(operation["offset"])
            values = exchange_markers(values, first, second, onset, offset)
            part = slice(onset, offset)
            for mask in (filled, swapped):
                mask[part, [first, second]] = mask[part, [second, first]]
            swapped[part, [first, second]] ^= True
        else:
            raise InputError(f"repair: expected the operation fill or swap, but got {operation['operation']!r}")
    return RepairedMarkers(values, filled, swapped & np.isfinite(values[..., 0]) & ~filled)


def fill(
    corpus: Corpus,
    takes: Sequence[str],
    *,
    below: float = DEFAULT_BELOW,
    method: str = "auto",
    author: str | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Fill the short gaps of takes, in one commit.

    Parameters
    ----------
    takes
        Names.
    below
        Seconds; gaps of up to this length are filled.
    method
        See :func:`mimique.features.gap_filling.fill_gaps`.

    Returns
    -------
    pandas.DataFrame
        ``take, gaps`` (filled), ``frames`` (of markers, filled), ``left`` (gaps that stay), ``longest_left_s``.

    Raises
    ------
    MimiqueError
        If a take is not there or an option is wrong; nothing is changed then.
    """
    if not takes:
        raise InputError("repair fill: expected the names of takes")
    names = list(dict.fromkeys(takes))
    bare = [name for name in names if not corpus.take_markers(name)]
    if bare:
        raise InputError(f"take {bare[0]!r}: it has no markers to repair, only weights that came from elsewhere")
    operation = {"operation": "fill", "below": float(below), "method": method}
    planned = {name: [*_without_fills(read_operations(corpus, name)), operation] for name in names}
    results = _commit(corpus, planned, "repair fill", _say("Fill gaps of", names), author, reporter)
    rows = []
    for name, (repaired, rate) in results.items():
        gaps, _ = _count_gaps(repaired.filled)
        left, longest = _count_gaps(np.isnan(repaired.position[..., 0]))
        rows.append((name, gaps, int(repaired.filled.sum()), left, longest / rate))
    return pd.DataFrame(rows, columns=["take", "gaps", "frames", "left", "longest_left_s"])


def swap(
    corpus: Corpus,
    take: str,
    first: str,
    second: str,
    *,
    onset: int,
    offset: int | None = None,
    author: str | None = None,
) -> str:
    """Give two markers of a take each other's label in the frames ``[onset, offset)``, in one commit.

    Returns
    -------
    A line that says what was done.
    """
    n_frames = open_take(corpus, take, recorded=True).n_frames
    stop = n_frames if offset is None else offset
    operation = {"operation": "swap", "markers": [first, second], "onset": int(onset), "offset": int(stop)}
    planned = {take: _insert_swaps(read_operations(corpus, take), [operation])}
    _commit(corpus, planned, "repair swap", f"Swap {first} and {second} of {take}", author, None)
    return f"{take}: {first} and {second} exchanged in frames [{onset}, {stop})"


def find_swaps(corpus: CorpusView, take: str) -> list[Operation]:
    """Return the swaps that a check finds in a take, as it is repaired so far, as operations."""
    reader = open_take(corpus, take)
    found = scan_take(reader, survey_take(reader)).swaps
    return [
        {
            "operation": "swap",
            "markers": [reader.markers[s.first], reader.markers[s.second]],
            "onset": s.onset,
            "offset": s.offset,
        }
        for s in found
    ]


def swap_found(corpus: Corpus, take: str, operations: Sequence[Operation], *, author: str | None = None) -> str:
    """Swap back what :func:`find_swaps` found, in one commit."""
    if not operations:
        return f"{take}: no swaps found"
    planned = {take: _insert_swaps(read_operations(corpus, take), operations)}
    _commit(corpus, planned, "repair swap", f"Swap back {len(operations)} found in {take}", author, None)
    return f"{take}: {len(operations)} swapped back"


def undo(corpus: Corpus, take: str, *, author: str | None = None) -> str:
    """Take back all repairs of a take: the recording counts again. The repaired markers stay in the history.

    Raises
    ------
    NotFoundError
        If the take has no repairs.
    """
    operations = read_operations(corpus, take)
    if not operations and REPAIRED not in corpus.steps(take):
        raise NotFoundError(f"take {take!r}: it has no repairs to undo")
    parameters = {"take": take}
    with corpus.transaction(
        f"Undo the repairs of {take}", command="repair undo", parameters=parameters, author=author
    ) as edit:
        edit.delete_processed(take, REPAIRED)
    return f"{take}: {len(operations)} repairs undone; solve it again to use the recorded markers"


def read_operations(corpus: CorpusView, take: str) -> list[Operation]:
    """Return the operations that a take was repaired by, in order; none where it was not."""
    if REPAIRED not in corpus.steps(take):
        return []
    parameters = corpus.provenance(take, "processed", REPAIRED).get("parameters", {})
    return [dict(operation) for operation in parameters.get("operations", [])]


def _insert_swaps(operations: list[Operation], swaps: Sequence[Operation]) -> list[Operation]:
    """Put swaps before the filling: gaps must be filled under the right label."""
    fills = [o for o in operations if o["operation"] == "fill"]
    return [*_without_fills(operations), *swaps, *fills]


def _without_fills(operations: Sequence[Operation]) -> list[Operation]:
    """Leave out earlier fills; a new one takes their place."""
    return [operation for operation in operations if operation["operation"] != "fill"]


def _commit(
    corpus: Corpus,
    planned: dict[str, list[Operation]],
    command: str,
    message: str,
    author: str | None,
    reporter: Reporter | None,
) -> dict[str, tuple[RepairedMarkers, float]]:
    """Replay the operations of each take from its recording and store what comes of it."""
    results = {}
    parameters = {"operations": planned}
    with (reporter or Reporter()).stage("Repairing", len(planned)) as finished:
        with corpus.transaction(message, command=command, parameters=parameters, author=author) as edit:
            for take, operations in planned.items():
                recorded = select_markers(corpus.take(take))
                rate = float(recorded.attrs["rate"])
                markers = [str(name) for name in recorded["marker"].values]
                position = recorded["position"].transpose("time", "marker", "space").values
                try:
                    repaired = apply_operations(position, markers, rate, operations)
                except InputError as error:
                    raise InputError(f"take {take!r}: {error}") from error
                provenance = describe_step(
                    "repair",
                    inputs={"take": corpus.fingerprint(take)},
                    parameters={"operations": operations},
                )
                edit.put_processed(take, REPAIRED, _to_dataset(repaired, markers, rate), provenance=provenance)
                results[take] = (repaired, rate)
                finished(take)
    return results


def _to_dataset(repaired: RepairedMarkers, markers: list[str], rate: float) -> xr.Dataset:
    return xr.Dataset(
        {
            "position": (("time", "marker", "space"), repaired.position),
            "filled": (("time", "marker"), repaired.filled),
            "swapped": (("time", "marker"), repaired.swapped),
        },
        {"marker": markers, "space": ["x", "y", "z"]},
        {"rate": rate},
    )


def _count_gaps(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """Return how many runs of true values there are, and the longest one's frames."""
    n_runs, longest = longest_runs(flags)
    return int(n_runs.sum()), int(longest.max(initial=0))


def _index(names: list[str], name: str) -> int:
    if name not in names:
        raise InputError(f"no marker {name!r}; the markers are {', '.join(names)}")
    return names.index(name)


def _say(what: str, names: list[str]) -> str:
    return f"{what} {names[0]}" if len(names) == 1 else f"{what} {len(names)} takes"
