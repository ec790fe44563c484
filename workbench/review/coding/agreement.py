"""How much pairs of people agree, over all takes that both read on their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ....corpus.versions.segment_rows import Row
from ....models.scores.agreement import cohen_kappa, krippendorff_alpha
from ....models.scores.segment_metrics import pool_f1, segmental_f1
from ..queueing.corpus_facts import get_facts
from .readings import Reading, make_canonical

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["PairAgreement", "measure_agreement", "score_pair"]

_MOST_KEPT = 1000


@dataclass(frozen=True)
class PairAgreement:
    """Two people on one tier.

    Parameters
    ----------
    takes, seconds
        How much both read: takes, and the time in them that at least one of both labelled.
    kappa, alpha
        Cohen's κ and Krippendorff's α of the frames that both labelled; None where they are not defined.
    agreement
        Part of ``seconds`` on which both say the same; a label against none is not the same.
    f1_50
        Segmental F1 at an overlap of one half, either taken for the reference in turn.
    """

    tier: str
    first: str
    second: str
    takes: int
    seconds: float
    kappa: float | None
    alpha: float | None
    agreement: float | None
    f1_50: float | None


def measure_agreement(review: Review, readings: Mapping[tuple[str, str], Mapping[str, Reading]]) -> list[PairAgreement]:
    """Return the agreement of each pair on each tier, of readings without proposals alone.

    People who corrected the same proposals have seen the same answer; how much they agree says little.
    """
    facts = get_facts(review)
    shared: dict[tuple[str, str, str], list[tuple[str, Reading, Reading]]] = {}
    for (take, tier), some in readings.items():
        own = {author: one for author, one in some.items() if one.from_scratch}
        for first, second in combinations(sorted(own), 2):
            shared.setdefault((tier, first, second), []).append((take, own[first], own[second]))
    kept: dict[tuple, tuple[list[Reading], PairAgreement]] = review.part("agreement", dict)
    found = []
    for (tier, first, second), pairs in sorted(shared.items()):
        rows = tuple((take, id(a.rows), id(b.rows)) for take, a, b in pairs)
        key = (tier, first, second, rows, facts.vocabulary(tier))
        if key not in kept:
            scored = score_pair(
                [(a.rows, b.rows, facts.takes[take].rate) for take, a, b in pairs], make_canonical(facts, tier)
            )
            if len(kept) >= _MOST_KEPT:
                kept.clear()
            # The readings are kept along, so that no other rows can come to have the same identities.
            held = [reading for _, a, b in pairs for reading in (a, b)]
            kept[key] = (held, PairAgreement(tier, first, second, len(pairs), *scored))
        found.append(kept[key][1])
    return found


def score_pair(
    pairs: Sequence[tuple[Sequence[Row], Sequence[Row], float]], canonical: Callable[[str], str] = str
) -> tuple[float, float | None, float | None, float | None, float | None]:
    """Return ``seconds, kappa, alpha, agreement, f1_50`` of two people over takes.

    Parameters
    ----------
    pairs
        Of each take the first person's segments, the second's, and the rate in Hz.
    canonical
        Which label a spelling stands for.
    """
    codes: dict[str, int] = {}
    firsts, seconds, scores = [], [], []
    time = same_time = 0.0
    for one, other, rate in pairs:
        n_frames = max((int(row["offset"]) for rows in (one, other) for row in rows), default=0)
        a, b = (_paint(rows, n_frames, codes, canonical) for rows in (one, other))
        time += float((~np.isnan(a) | ~np.isnan(b)).sum()) / rate
        same_time += float((a == b).sum()) / rate
        scores += [segmental_f1(a, b, 0.5), segmental_f1(b, a, 0.5)]
        firsts.append(a)
        seconds.append(b)
    if not time:
        return 0.0, None, None, None, None
    first, second = np.concatenate(firsts), np.concatenate(seconds)
    kappa, alpha = cohen_kappa(first, second), krippendorff_alpha(np.column_stack([first, second]))
    return time, _or_none(kappa), _or_none(alpha), same_time / time, _or_none(pool_f1(scores).f1)


def _paint(
    rows: Sequence[Row], n_frames: int, codes: dict[str, int], canonical: Callable[[str], str]
) -> NDArray[np.float64]:
    """Return a number for the label of each frame, NaN for none; new labels get new numbers."""
    painted = np.full(n_frames, np.nan)
    for row in rows:
        painted[row["onset"] : row["offset"]] = codes.setdefault(canonical(str(row["label"])), len(codes))
    return painted


def _or_none(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
