"""How many seconds of each affect a corpus holds: Reverdy 2019, Table B.1."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

from ..errors import InputError
from .labelled_take import LabelledTake, find_transitions

__all__ = ["AFFECT_COLUMNS", "recording_times"]

# Order of the thesis's columns: C D P J T S N.
AFFECT_COLUMNS = ("anger", "disgust", "fear", "joy", "sadness", "surprise", "neutral")
PROTOCOL_ORDER = ("IE", "SE", "IGE", "EU")


def recording_times(takes: Iterable[LabelledTake], affects: Sequence[str] = AFFECT_COLUMNS) -> pd.DataFrame:
    """Seconds per signer and protocol: one column an affect, then what has no label, transitions, and all.

    A held segment of intensity degree 0 (column ``intensity`` of the tier, where it has one) counts as the last of the
    `affects`, neutral, as in the thesis. Frames that no segment covers are ``unlabelled`` (the thesis's NA). Labels
    outside `affects` that are not transitions come in a column ``other``, which is only there if needed.

    Parameters
    ----------
    takes
        Takes with their reference tier; weights are not looked at.
    affects
        Labels of the columns, the neutral one last.

    Returns
    -------
    Table of seconds with the index (signer, protocol), signers as they come, protocols in the thesis's order, and a
    last row ("all", ""). The columns before ``total`` add up to it, but for rounding in the last bit.
    """
    names = list(affects)
    if not names or len(set(names)) != len(names):
        raise InputError(f"affects: expected distinct labels, but got {names}")
    columns = [*names, "other", "unlabelled", "transitions", "total"]
    sums: dict[tuple[str, str], dict[str, float]] = {}
    for take in takes:
        row = sums.setdefault((take.signer, take.protocol), dict.fromkeys(columns, 0.0))
        segments = take.segments
        is_transition = find_transitions(segments)
        has_degree = "intensity" in segments.columns
        n_labelled = 0
        for index, (onset, offset, label) in enumerate(
            zip(segments["onset"], segments["offset"], segments["label"], strict=True)
        ):
            n_frames = int(offset) - int(onset)
            n_labelled += n_frames
            if is_transition[index]:
                column = "transitions"
            elif has_degree and segments["intensity"].iloc[index] == 0:
                column = names[-1]
            else:
                column = str(label) if str(label) in names else "other"
            row[column] += n_frames / take.rate
        row["unlabelled"] += (take.n_frames - n_labelled) / take.rate
        row["total"] += take.n_frames / take.rate

    signers = list(dict.fromkeys(signer for signer, _ in sums))
    groups = sorted(sums, key=lambda key: (signers.index(key[0]), _protocol_rank(key[1])))
    places = pd.MultiIndex.from_tuples([*groups, ("all", "")], names=["signer", "protocol"])
    table = pd.DataFrame([sums[group] for group in groups], columns=columns, dtype=float)
    table = pd.concat([table, table.sum().to_frame().T], ignore_index=True).set_axis(places)
    return table if (table["other"] > 0).any() else table.drop(columns="other")


def _protocol_rank(protocol: str) -> tuple[int, str]:
    known = PROTOCOL_ORDER.index(protocol) if protocol in PROTOCOL_ORDER else len(PROTOCOL_ORDER)
    return known, protocol
