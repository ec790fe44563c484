"""The order of the queue: the gain of each look, told by the definition of macro F1."""

import numpy as np
import pytest
from mimique.workbench.review.queueing.usefulness import expect_gains

CLASSES = ("A", "J", "N")


def expected_macro_f1(p, labels):
    """Macro F1 from soft counts; slow, one segment at a time."""
    total, n = 0.0, 0
    for k in range(p.shape[1]):
        right = sum(p[i, k] for i in range(len(labels)) if labels[i] == k)
        labelled = sum(label == k for label in labels)
        real = p[:, k].sum()
        if labelled + real > 0:
            total, n = total + 2 * right / (labelled + real), n + 1
    return total / n


def slow_gain(p, labels, i):
    """What looking at segment i gains: over what it may really be, the F1 with the right label less that without."""
    gain = 0.0
    for k in range(p.shape[1]):
        sure = p.copy()
        sure[i] = np.eye(p.shape[1])[k]
        righted = [*labels[:i], k, *labels[i + 1 :]]
        gain += p[i, k] * (expected_macro_f1(sure, righted) - expected_macro_f1(sure, list(labels)))
    return gain


def test_gains_are_those_of_the_definition_and_reviewed_segments_are_certain(rng):
    n = 12
    p = rng.dirichlet(np.ones(3), n)
    labels = [CLASSES[k] for k in p.argmax(axis=1)]
    reviewed = np.arange(n) % 4 == 0
    gains, seconds = expect_gains(labels, np.full(n, np.nan), reviewed, [(row, CLASSES) for row in p])
    certain = p.copy()
    numbers = [CLASSES.index(label) for label in labels]
    certain[reviewed] = np.eye(3)[numbers][reviewed]
    expected = [slow_gain(certain, numbers, i) for i in range(n)]
    # The mean goes over the classes that occur; all three do.
    assert gains == pytest.approx(expected, abs=1e-12)
    assert (gains[reviewed] == 0).all() and (gains[~reviewed] > 0).all()
    runner_up = [CLASSES[np.argsort(row)[-2]] for row in p]
    assert seconds == ["" if done else name for done, name in zip(reviewed, runner_up, strict=True)]


def test_without_a_model_the_confidence_stands_for_the_label_and_nothing_known_is_nan():
    labels = ["A", "J", "N", "N"]
    gains, seconds = expect_gains(labels, [0.9, 0.5, np.nan, 0.9], [False] * 4, [None] * 4)
    assert np.isnan(gains[2]) and seconds == [""] * 4
    assert gains[1] > gains[0] > 0
    spread = np.array([[0.9, 0.05, 0.05], [0.25, 0.5, 0.25], [0.05, 0.05, 0.9]])
    known, _ = expect_gains(["A", "J", "N"], [np.nan] * 3, [False] * 3, [(row, CLASSES) for row in spread])
    assert gains[[0, 1, 3]] == pytest.approx(known, abs=1e-12)


def test_a_label_that_the_model_does_not_know_goes_by_its_confidence():
    p = np.array([0.2, 0.8])
    gains, seconds = expect_gains(["X", "A"], [0.6, 0.1], [False, False], [(p, ("A", "J")), (p, ("A", "J"))])
    assert np.isfinite(gains).all() and seconds == ["", "J"]


def test_one_label_alone_and_none_at_all():
    assert np.isfinite(expect_gains(["A"], [0.5], [False], [None])[0]).all()
    gains, seconds = expect_gains([], [], [], [])
    assert len(gains) == 0 and seconds == []
