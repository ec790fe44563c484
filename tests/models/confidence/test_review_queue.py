import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.confidence.review_queue import (
    compare_review_orders,
    expected_gains,
    looks_to_reach,
    order_for_review,
    probability_columns,
    replay_review,
)
from sklearn.metrics import f1_score

CLASSES = ("a", "b", "c")


def slow_replay(truth: np.ndarray, given_: np.ndarray, order: np.ndarray, weights: np.ndarray | None) -> list[float]:
    now = given_.copy()
    options = {"average": "macro", "labels": sorted(set(truth)), "zero_division": 0, "sample_weight": weights}
    curve = [f1_score(truth, now, **options)]
    for place in order:
        now[place] = truth[place]
        curve.append(f1_score(truth, now, **options))
    return curve


@given(st.integers(0, 10_000), st.booleans())
def test_replay_is_scikit_learns_macro_f1_look_by_look(seed: int, weighted: bool) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 25))
    truth, labels = rng.choice(["a", "b"], n), rng.choice(["a", "b", "c"], n)
    weights = rng.uniform(0.1, 3, n) if weighted else None
    order = rng.permutation(n)
    found = replay_review(truth, labels, order, weights=weights)
    assert np.allclose(found, slow_replay(truth, labels, order, weights))
    assert found[-1] == pytest.approx(1)


@given(st.integers(0, 10_000))
def test_order_is_a_permutation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 40))
    table = probability_columns(rng.dirichlet(np.ones(3), n), CLASSES).assign(seconds=rng.uniform(0.1, 2, n))
    table.iloc[:: int(rng.integers(2, 9)), :3] = np.nan
    for options in ({}, {"weighted": True}, {"seconds_per_look": 1.0}):
        order = order_for_review(table, **options)
        assert sorted(order) == list(range(n))
        unknown = int(table["p_a"].isna().sum())
        assert table["p_a"].to_numpy()[order[:unknown]].tolist() == pytest.approx([np.nan] * unknown, nan_ok=True)


def slow_gain(p: np.ndarray, i: int) -> float:
    """Over what segment i may be: macro F1 by soft counts after the look, less before."""

    def macro(q: np.ndarray, hot: np.ndarray) -> float:
        right, total = (q * hot).sum(axis=0), q.sum(axis=0) + hot.sum(axis=0)
        return float((2 * right / total).mean())

    hot = np.eye(3)[p.argmax(axis=1)]
    gain = 0.0
    for j in range(3):
        q, after = p.copy(), hot.copy()
        q[i] = after[i] = np.eye(3)[j]
        gain += p[i, j] * (macro(q, after) - macro(q, hot))
    return gain


def test_expected_gain_is_the_enumerated_one(rng: np.random.Generator) -> None:
    p = rng.dirichlet(np.ones(3), 12)
    expected = [slow_gain(p, i) for i in range(len(p))]
    assert np.allclose(expected_gains(p, CLASSES), expected)
    assert min(expected) >= 0


def test_unsure_and_rare_come_first() -> None:
    sure, unsure = [0.98, 0.01, 0.01], [0.55, 0.44, 0.01]
    order = order_for_review(probability_columns([sure] * 5 + [unsure], CLASSES))
    assert order[0] == 5
    # Equally unsure: between two common classes, or between a common and a rare one.
    rows = [[0.99, 0.01, 0.0]] * 50 + [[0.01, 0.99, 0.0]] * 50 + [[0.0, 0.02, 0.98]] * 2
    rows += [[0.6, 0.4, 0.0], [0.6, 0.0, 0.4]]
    order = order_for_review(probability_columns(rows, CLASSES)).tolist()
    assert order.index(103) < order.index(102)


def test_long_segments_come_first_where_time_counts_and_last_where_it_costs() -> None:
    table = probability_columns([[0.6, 0.4]] * 3, ("a", "b")).assign(seconds=[0.5, 4.0, 1.0], label="a")
    assert order_for_review(table, weighted=True)[0] == 1
    assert order_for_review(table, seconds_per_look=5.0).tolist() == [0, 2, 1]


def test_a_perfect_oracle_saves_and_the_worst_order_does_not(rng: np.random.Generator) -> None:
    truth = rng.choice(CLASSES, 200)
    labels = truth.copy()
    labels[:20] = np.where(truth[:20] == "a", "b", "a")
    best = compare_review_orders(truth, labels, np.arange(200), rng=rng, targets=(1.0,), n_orders=5)
    assert best.table["queue"].iloc[0] == 20
    assert best.table["saved"].iloc[0] > 0.85
    worst = compare_review_orders(truth, labels, np.arange(200)[::-1], rng=rng, targets=(1.0,), n_orders=5)
    assert worst.table["queue"].iloc[0] == 200
    assert best.random_curves.shape == (5, 201)


def test_looks_to_reach_counts_from_the_first() -> None:
    assert looks_to_reach([0.5, 0.8, 0.9, 1.0], 0.9) == 2
    assert looks_to_reach([0.95, 1.0], 0.9) == 0
    with pytest.raises(InputError, match="above 0"):
        looks_to_reach([1.0], 0.0)
    with pytest.raises(InputError, match="reaches"):
        looks_to_reach([0.5, 0.6], 0.9)


def test_bad_input_is_refused() -> None:
    with pytest.raises(InputError, match="once"):
        replay_review(["a", "b"], ["a", "a"], [0, 0])
    with pytest.raises(InputError, match="at least two classes"):
        order_for_review(pd.DataFrame({"label": ["a"]}))
    with pytest.raises(InputError, match="seconds"):
        order_for_review(probability_columns([[0.5, 0.5]], ("a", "b")), weighted=True)
    with pytest.raises(InputError, match="expected one of a, b"):
        expected_gains([[0.5, 0.5]], ("a", "b"), labels=["x"])
