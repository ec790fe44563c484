"""What labels lose when only the markers of a layout exist."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...synthesis import Rig, WeightPrior, WeightSolver
from ...synthesis.adaptation import Adaptation
from ..evaluation.labeller_comparison import check_classes, deal_signers, train_labeller
from ..labelled_take import LabelledTake
from ..labellers import stack_takes
from ..scores.frame_metrics import score_frames

__all__ = ["ALL_WEIGHTS", "measure_label_loss"]

ALL_WEIGHTS = "all weights"
LABELLER = "per-frame-linear"
"""Looks at single frames and learns in moments; what is asked is what the weights lose, not how good labels can be."""


def measure_label_loss(
    base: Rig,
    faces: Mapping[str, Rig],
    takes: Sequence[LabelledTake],
    layouts: Mapping[str, ArrayLike],
    *,
    noise: float,
    seed: int,
    n_folds: int = 3,
    finished: Callable[[str], object] | None = None,
) -> pd.DataFrame:
    """Solve labelled takes anew from virtual markers of each layout, and label signers whom nobody learned from.

    Parameters
    ----------
    base
        The rig that the takes' weights move, and on which they are solved anew.
    faces
        Each signer's own face where it is known, of the same mesh; else the base rig.
    takes
        With weights of the base rig, of at least two signers.
    layouts
        Vertices by name.
    noise
        Deviation of each coordinate of a marker, mm.
    seed
        Of noise, folds and labeller.
    n_folds
        Into which signers are dealt; as many as there are signers, if there are fewer.
    finished
        Told each name.

    Returns
    -------
    DataFrame ``layout, K, accuracy, macro_f1`` over frames; the first row, ``all weights`` with K = 0, labels the true
    weights. The weights' prior is learned from all takes' true weights: the same for every layout.

    Raises
    ------
    InputError
        If there are fewer than two signers or labels.
    """
    n_signers = len({take.signer for take in takes})
    folds = deal_signers([t.signer for t in takes], max(2, min(n_folds, n_signers)), np.random.default_rng(seed))
    weights = [_read_weights(base, take) for take in takes]
    whole = np.concatenate([values[np.isfinite(values).all(axis=1)] for values in weights])
    prior = WeightPrior.fit(whole[:: max(1, len(whole) // 4000)])
    rows = [(ALL_WEIGHTS, 0, *_score(takes, folds, seed))]
    for name, vertices in layouts.items():
        numbers = np.asarray(vertices, dtype=np.int64)
        solver = WeightSolver(base, numbers, prior=prior)
        solved = []
        for number, (take, true) in enumerate(zip(takes, weights, strict=True)):
            face = faces.get(take.signer, base)
            adapt = Adaptation.fit(face.neutral[numbers], base.neutral[numbers])
            seen = face.pose(np.nan_to_num(true), numbers)
            seen = seen + np.random.default_rng([seed, number]).normal(0.0, noise, seen.shape)
            seen[~np.isfinite(true).all(axis=1)] = np.nan
            solved.append(replace(take, weights=solver.solve(adapt(seen)).astype(np.float64)))
        rows.append((name, len(numbers), *_score(solved, folds, seed)))
        if finished is not None:
            finished(name)
    return pd.DataFrame(rows, columns=["layout", "K", "accuracy", "macro_f1"])


def _read_weights(base: Rig, take: LabelledTake) -> NDArray[np.float64]:
    if take.weights is None or take.weights.shape[1] != base.n_shapes:
        raise InputError(f"take {take.name}: expected weights of the rig's {base.n_shapes} shapes")
    return take.weights


def _score(takes: Sequence[LabelledTake], folds: Sequence[tuple[str, ...]], seed: int) -> tuple[float, float]:
    frames = stack_takes(takes)
    truth: list[NDArray[Any]] = []
    answers: list[NDArray[Any]] = []
    for fold in folds:
        test = np.isin(frames.signers.astype(str), fold)
        if not any(label is not None for label in frames.y[test]):
            continue
        check_classes(frames, ~test, test, f"signers {', '.join(fold)}")
        _, predict = train_labeller(frames, LABELLER, ~test, seed)
        truth.append(frames.y[test])
        answers.append(predict(test))
    if not truth:
        raise InputError("label loss: expected labelled frames to test on, but there are none")
    scores = score_frames(np.concatenate(truth), np.concatenate(answers))
    return float(scores.accuracy), float(scores.macro_f1)
