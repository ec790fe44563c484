"""How useful it is to look at each segment of a tier next.

All segments of a tier count together in one macro F1 (:mod:`mimique.models.confidence.review_queue`): those that a
person has reviewed are certain, so that nothing is gained by looking again, and each class is as rare as it is by now.
A proposal counts by the probabilities of the model that made it; where there are none, its confidence stands for its
label, and the rest is shared evenly by the other labels.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....models.confidence.review_queue import expected_gains

__all__ = ["Judgement", "expect_gains"]

Judgement = tuple[NDArray[np.float64], tuple[str, ...]]
"""Probabilities ``(n_classes,)`` of a segment, and the labels that they are of."""


def expect_gains(
    labels: Sequence[str], confidences: ArrayLike, reviewed: ArrayLike, judgements: Sequence[Judgement | None]
) -> tuple[NDArray[np.float64], list[str]]:
    """Return what looking at each segment gains, and what it most likely is otherwise.

    Parameters
    ----------
    labels
        ``(n_segments,)`` of one tier, over all takes.
    confidences
        ``(n_segments,)`` from 0 to 1, NaN where unknown.
    reviewed
        ``(n_segments,)`` whether a person has said so already.
    judgements
        ``(n_segments,)`` what a model holds of each; None where none does.

    Returns
    -------
    gains
        ``(n_segments,)`` in units of macro F1, at least 0; 0 where reviewed, NaN where nothing is known.
    seconds
        The likeliest other label of each, "" where no model says.
    """
    names = [str(label) for label in labels]
    certain = np.asarray(reviewed, dtype=bool)
    sure = np.asarray(confidences, dtype=np.float64)
    by_classes: dict[tuple[str, ...], list[int]] = {}
    for number, judgement in enumerate(judgements):
        if judgement is not None and not certain[number] and names[number] in judgement[1]:
            by_classes.setdefault(judgement[1], []).append(number)
    classes = sorted({*names, *(name for some in by_classes for name in some)})
    if len(classes) < 2:
        classes = [*classes, "other" if classes != ["other"] else "another"]
    place = {name: column for column, name in enumerate(classes)}
    own = np.array([place[name] for name in names], dtype=np.int64)
    rows = np.arange(len(names))
    p = np.repeat(((1.0 - sure) / (len(classes) - 1))[:, None], len(classes), axis=1)
    p[rows, own] = sure
    seconds = [""] * len(names)
    for some, numbers in by_classes.items():
        columns = np.array([place[name] for name in some])
        given = np.array([judgements[number][0] for number in numbers])  # type: ignore[index]
        spread = np.zeros((len(numbers), len(classes)))
        spread[:, columns] = given
        p[numbers] = spread
        others = given.copy()
        others[np.arange(len(numbers)), [some.index(names[number]) for number in numbers]] = -1.0
        if len(some) > 1:
            for number, best in zip(numbers, others.argmax(axis=1), strict=True):
                seconds[number] = some[int(best)]
    p[certain] = 0.0
    p[certain, own[certain]] = 1.0
    return expected_gains(p, classes, labels=names), seconds
