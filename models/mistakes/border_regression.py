"""Where each border of a tier belongs, learned from the borders of other takes.

People put the border between a held expression and a transition where the face begins or ends to move from the one
expression to the other. What that looks like is learned: a border is moved away at random, the curves around the wrong
place are shown to boosted trees, and they learn how far back it was. The curves are

* the course c(t) = ⟨w(t) − b, a − b⟩ / ‖a − b‖² from the expression before, b, to that after, a (their median weights):
  0 before the transition, 1 after it;
* the probability of moving, the logarithm of the motion energy (4.4 in Reverdy 2019), and how much more the face shows
  the class after than the one before, from :mod:`.label_evidence`;
* where there is one, a temporal labeller's probabilities of transition and of both classes.

People scatter about such places; the trees, which minimise the mean absolute error, learn the middle. A second model
learns how far a border usually is from where it fits, given what is known about it: a weak expression in signed
discourse has no sharp edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingRegressor

from ...errors import InputError

__all__ = ["BORDER_COLUMNS", "Border", "describe_borders", "place_borders"]

BORDER_COLUMNS = ["onset", "before", "after", "kind", "fitted", "expected"]
LAGS = np.concatenate((np.arange(-0.8, -0.39, 0.08), np.arange(-0.36, 0.37, 0.04), np.arange(0.4, 0.81, 0.08)))
"""s around a place at which curves are looked at."""
MOVED = 0.6
"""s, greatest distance that borders are moved away to learn from."""
N_MOVED = 8
LOOKS = np.array([-0.2, -0.1, 0.0, 0.1, 0.2])
"""s around the last estimate from which the next is made; the median of them counts."""
N_STEPS = 3
LEAST_BORDERS = 40
"""Fewer teach nothing."""
SMALLEST = 0.01
"""s added to a distance before its logarithm is taken: two frames at 200 Hz."""


@dataclass(frozen=True)
class Border:
    """A border between two touching segments, and the curves that tell where it belongs.

    Parameters
    ----------
    onset
        Frame at which the segment after it begins.
    before, after
        Labels of the two segments.
    kind
        0: from a held expression to a transition; 1: the other way; 2: between two of a kind.
    curves
        ``(n_frames, n_curves)``, NaN where unknown.
    size
        Distance between the two expressions, in weights; NaN where one of them is not known.
    """

    onset: int
    before: str
    after: str
    kind: int
    curves: NDArray[np.float64] = field(repr=False)
    size: float


def describe_borders(
    segments: pd.DataFrame,
    moves: NDArray[np.bool_],
    smooth: NDArray[np.float64],
    curves: NDArray[np.float64],
    log_probabilities: NDArray[np.float64],
    classes: Sequence[str],
) -> list[Border]:
    """Return the borders of a tier with what is known around them.

    Parameters
    ----------
    segments, moves
        ``onset, offset, label`` in order of time, without overlap, and which of them are transitions.
    smooth
        ``(n_frames, n_shapes)`` weights, smoothed; NaN in gaps.
    curves
        ``(n_frames, n)`` what is looked at as it is.
    log_probabilities, classes
        ``(n_frames, k · n_classes)``: k sets of log probabilities of the classes; those of the classes before and after
        are looked at, and their difference.
    """
    onsets, offsets = segments["onset"].to_numpy(), segments["offset"].to_numpy()
    labels = segments["label"].astype(str).to_numpy()
    middles = [_middle(smooth, int(a), int(b)) for a, b in zip(onsets, offsets, strict=True)]
    column = {name: k for k, name in enumerate(classes)}
    n_sets = log_probabilities.shape[1] // max(len(classes), 1)
    nothing = np.full(len(smooth), np.nan)
    found = []
    for i in range(len(segments) - 1):
        if offsets[i] != onsets[i + 1]:
            continue
        kind = 0 if not moves[i] and moves[i + 1] else 1 if moves[i] and not moves[i + 1] else 2
        before, after = _held(i, -1, moves, onsets, offsets), _held(i + 1, 1, moves, onsets, offsets)
        course, size = nothing, np.nan
        shown = [nothing] * (3 * n_sets)
        if before is not None and after is not None:
            start, end = middles[before], middles[after]
            if start is not None and end is not None:
                way = end - start
                size = float(np.sqrt((way**2).sum()))
                course = np.clip((smooth - start) @ way / max(size**2, 1e-9), -1.0, 2.0)
            pair = [column[labels[place]] for place in (before, after) if labels[place] in column]
            if len(pair) == 2:
                shown = []
                for k in range(n_sets):
                    one, other = (log_probabilities[:, k * len(classes) + place] for place in pair)
                    shown += [one, other, other - one]
        found.append(
            Border(
                int(offsets[i]),
                str(labels[i]),
                str(labels[i + 1]),
                kind,
                np.column_stack((course, curves, *shown)),
                size,
            )
        )
    return found


def place_borders(
    borders: Sequence[Sequence[Border]],
    kinds: Sequence[str],
    rates: Sequence[float],
    folds: NDArray[np.int64],
    *,
    rng: np.random.Generator,
) -> list[pd.DataFrame]:
    """Find where each border fits, by models of the takes of other folds.

    Parameters
    ----------
    borders
        Those of each take.
    kinds
        Of each take: its protocol. Borders of one kind of take are compared with each other.
    rates
        Hz, of each take.
    folds
        ``(n_takes,)`` fold of each take.
    rng
        Moves the borders that are learned from.

    Returns
    -------
    One table a take: ``onset, before, after, kind``, ``fitted`` (frame, not rounded), and ``expected``, the usual
    distance of such borders from where they fit, in seconds. Both are NaN where there are too few borders to learn
    from.
    """
    if not len(borders) == len(kinds) == len(rates) == len(folds):
        raise InputError("borders: expected one list, kind, rate and fold per take")
    tables = [
        pd.DataFrame(
            [(b.onset, b.before, b.after, b.kind, np.nan, np.nan) for b in own], columns=BORDER_COLUMNS
        ).astype({"fitted": float, "expected": float})
        for own in borders
    ]
    seed = int(rng.integers(2**31))
    agreement: dict[int, NDArray] = {}
    for fold in sorted(set(folds.tolist())):
        inside = [i for i in range(len(borders)) if folds[i] != fold]
        if sum(len(borders[i]) for i in inside) < LEAST_BORDERS:
            continue
        model = _learn([borders[i] for i in inside], [rates[i] for i in inside], rng, seed)
        for i in np.flatnonzero(folds == fold).tolist():
            if borders[i]:
                tables[i]["fitted"], agreement[i] = _place(model, borders[i], rates[i])
    _expect(tables, borders, kinds, rates, folds, agreement, seed)
    return tables


def _held(i: int, step: int, moves: NDArray, onsets: NDArray, offsets: NDArray) -> int | None:
    """Find the held expression at a place, or, from a transition there, the one that touches its far side."""
    if not moves[i]:
        return i
    other = i + step
    if not 0 <= other < len(moves) or moves[other]:
        return None
    first, second = min(i, other), max(i, other)
    return other if offsets[first] == onsets[second] else None


def _middle(smooth: NDArray, onset: int, offset: int) -> NDArray[np.float64] | None:
    """Median weights of the middle half, which a wrong border seldom reaches."""
    quarter = (offset - onset) // 4
    rows = smooth[onset + quarter : offset - quarter]
    rows = rows[np.isfinite(rows).all(axis=1)]
    return np.median(rows, axis=0) if len(rows) else None


def _look(border: Border, places: NDArray[np.int64], rate: float) -> NDArray[np.float64]:
    """Curves around places; NaN outside the take, which trees can read."""
    frames = places[:, None] + np.round(LAGS * rate).astype(np.int64)
    values = border.curves[np.clip(frames, 0, len(border.curves) - 1)]
    values[(frames < 0) | (frames >= len(border.curves))] = np.nan
    context = np.broadcast_to([border.kind, border.size], (len(places), 2))
    return np.column_stack((values.reshape(len(places), -1), context))


def _learn(
    borders: Sequence[Sequence[Border]], rates: Sequence[float], rng: np.random.Generator, seed: int
) -> HistGradientBoostingRegressor:
    X, y = [], []
    for own, rate in zip(borders, rates, strict=True):
        for border in own:
            places = np.round(border.onset + rng.uniform(-MOVED, MOVED, N_MOVED) * rate).astype(np.int64)
            X.append(_look(border, places, rate))
            y.append((border.onset - places) / rate)
    model = HistGradientBoostingRegressor(
        loss="absolute_error", max_iter=120, max_leaf_nodes=15, min_samples_leaf=30, max_bins=63, max_features=0.3,
        early_stopping=False, random_state=seed,
    )  # fmt: skip
    return model.fit(np.concatenate(X), np.concatenate(y))


def _place(
    model: HistGradientBoostingRegressor, borders: Sequence[Border], rate: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where borders fit, and how far the looks at each differ, in seconds."""
    places = np.array([float(border.onset) for border in borders])
    spread = np.zeros(len(borders))
    for _ in range(N_STEPS):
        looks = np.round(places[:, None] + LOOKS * rate).astype(np.int64)
        rows = np.concatenate([_look(border, own, rate) for border, own in zip(borders, looks, strict=True)])
        given = looks + model.predict(rows).reshape(looks.shape) * rate
        places, spread = np.median(given, axis=1), given.std(axis=1) / rate
    return places, spread


def _expect(
    tables: Sequence[pd.DataFrame],
    borders: Sequence[Sequence[Border]],
    kinds: Sequence[str],
    rates: Sequence[float],
    folds: NDArray[np.int64],
    agreement: dict[int, NDArray],
    seed: int,
) -> None:
    """Fill in the usual distance: exp of the expected logarithm, from takes of other folds.

    Durations are left out of it: a shifted border makes odd durations, and would excuse itself by them.
    """
    codes = {kind: k for k, kind in enumerate(sorted(set(kinds)))}
    X, y = {}, {}
    for i, spread in agreement.items():
        own = borders[i]
        X[i] = np.array([(codes[kinds[i]], b.kind, b.size, s) for b, s in zip(own, spread, strict=True)])
        away = (tables[i]["onset"] - tables[i]["fitted"]).abs().to_numpy() / rates[i]
        y[i] = np.log(away + SMALLEST)
    for fold in sorted(set(folds.tolist())):
        inside = [i for i in X if folds[i] != fold]
        outside = [i for i in X if folds[i] == fold]
        if not outside or not inside:
            continue
        model = HistGradientBoostingRegressor(
            loss="absolute_error", max_iter=60, learning_rate=0.06, max_leaf_nodes=6, min_samples_leaf=40,
            early_stopping=False, random_state=seed,
        )  # fmt: skip
        model.fit(np.concatenate([X[i] for i in inside]), np.concatenate([y[i] for i in inside]))
        for i in outside:
            tables[i]["expected"] = np.exp(model.predict(X[i]))
