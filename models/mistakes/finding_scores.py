"""How many planted mistakes are found, how many findings are planted, and how well anybody could do.

A finding counts as right when it is of the fault's kind and overlaps it; each counts once. Everything else that is
found counts as false, the annotator's own mistakes included, since nobody knows of them. Simulated signers have true
borders, though: an oracle that knows them says how far shifted borders can be told from an annotator's scatter at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from .label_checks import PROBLEMS

__all__ = ["count_findings", "match_findings", "score_border_oracle", "score_counts"]


def match_findings(faults: pd.DataFrame, findings: pd.DataFrame) -> NDArray[np.bool_]:
    """Return which faults are found.

    Parameters
    ----------
    faults
        ``take, problem, onset, offset`` of :func:`mimique.models.mistakes.planted_faults.plant_faults`.
    findings
        Of :func:`mimique.models.mistakes.label_checks.find_label_mistakes`.

    Returns
    -------
    ``(n_faults,)``.
    """
    used: set[int] = set()
    found = np.zeros(len(faults), dtype=bool)
    for row, fault in enumerate(faults.itertuples()):
        near = findings[
            (findings["take"] == fault.take)
            & (findings["problem"] == fault.problem)
            & (findings["onset"] < fault.offset)
            & (fault.onset < findings["offset"])
        ]
        free = [index for index in near.index if index not in used]
        found[row] = bool(free)
        used |= set(free[:1])
    return found


def count_findings(faults: pd.DataFrame, findings: pd.DataFrame, by: Sequence[str] = ("problem",)) -> pd.DataFrame:
    """Count faults and findings by problem and, if wanted, by what else both tables tell, such as the protocol.

    Returns
    -------
    One row a combination: ``planted``, ``found`` (findings) and ``right``.
    """
    hits = faults.assign(right=match_findings(faults, findings))
    keys = list(by)
    planted = hits.groupby(keys, sort=True)["right"].agg(planted="size", right="sum")
    found = findings.groupby(keys, sort=True).size().rename("found")
    counts = planted.join(found, how="outer").fillna(0).astype("int64").reset_index()
    order = {name: place for place, name in enumerate(PROBLEMS)}
    counts = counts.sort_values(keys, key=lambda c: c.map(lambda x: order.get(x, x)) if c.name == "problem" else c)
    return counts[[*keys, "planted", "found", "right"]].reset_index(drop=True)


def score_counts(counts: pd.DataFrame) -> pd.DataFrame:
    """Add ``precision, recall, f1`` to counts; NaN where nothing was found or planted."""
    planted, found, right = (counts[name].to_numpy(dtype=float) for name in ("planted", "found", "right"))
    with np.errstate(invalid="ignore", divide="ignore"):
        return counts.assign(precision=right / found, recall=right / planted, f1=2 * right / (found + planted))


def score_border_oracle(
    tiers: Mapping[str, pd.DataFrame],
    faults: pd.DataFrame,
    truth: Mapping[str, pd.DataFrame],
    rate: float,
) -> pd.DataFrame:
    """Score a detector that knows the true borders and, in hindsight, the best distance to flag them from.

    Nothing that sees only faces and tiers can be expected to do better for shifted borders: what it misses are shifts
    that the annotator's own scatter hides.

    Parameters
    ----------
    tiers
        With faults, by the take's name.
    faults
        ``take, problem, onset, true_onset``.
    truth
        True segments, by the take's name; only simulated signers have such.
    rate
        Hz.

    Returns
    -------
    One row: ``threshold`` (s), ``planted, found, right, precision, recall, f1``, and ``own_slips``, the borders that
    nobody moved and that are at least 0.1 s from the truth all the same.
    """
    moved = faults[faults["problem"] == "shifted boundary"]
    was = {(row.take, int(row.onset)): int(row.true_onset) for row in moved.itertuples()}
    # Near other faults there is no border that could be true.
    others = faults[faults["problem"] != "shifted boundary"]
    away: list[float] = []
    planted: list[bool] = []
    for name, tier in tiers.items():
        if name not in truth:
            raise InputError(f"truth: expected the true segments of take {name}, but there are none")
        true = np.unique(np.concatenate((truth[name]["onset"], truth[name]["offset"])))
        spoilt = others[others["take"] == name]
        table = tier.sort_values("onset", kind="stable")
        onsets, offsets = table["onset"].to_numpy(), table["offset"].to_numpy()
        for at in onsets[1:][offsets[:-1] == onsets[1:]].tolist():
            if ((spoilt["onset"] <= at) & (at <= spoilt["offset"])).any():
                continue
            before = was.get((name, at), at)
            away.append(abs(at - int(true[np.abs(true - before).argmin()])) / rate)
            planted.append((name, at) in was)
    distance, is_planted = np.array(away), np.array(planted, dtype=bool)
    best = (np.nan, 0, 0, -1.0)
    for threshold in np.unique(np.round(distance, 3)) if len(distance) else []:
        flagged = distance >= threshold
        right = int((flagged & is_planted).sum())
        f1 = 2 * right / max(int(flagged.sum()) + int(is_planted.sum()), 1)
        if f1 > best[3]:
            best = (float(threshold), int(flagged.sum()), right, f1)
    row = {"threshold": best[0], "planted": int(is_planted.sum()), "found": best[1], "right": best[2]}
    slips = int(((distance >= 0.1) & ~is_planted).sum())
    return score_counts(pd.DataFrame([row])).assign(own_slips=slips)
