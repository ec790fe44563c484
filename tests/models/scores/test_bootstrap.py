from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.scores.bootstrap import Interval, bootstrap_interval
from mimique.models.scores.segment_metrics import pool_f1, segmental_f1
from scipy import stats


def test_quantiles_are_those_of_all_resamples() -> None:
    # Three takes can be drawn in 27 ways, so the true distribution of the mean is known.
    takes = [1.0, 4.0, 10.0]
    means = [np.mean(draw) for draw in product(takes, repeat=3)]
    found = bootstrap_interval(takes, np.mean, np.random.default_rng(0), n=20_000, level=0.6)
    assert found.value == 5
    assert found.low == pytest.approx(np.quantile(means, 0.2, method="inverted_cdf"))
    assert found.high == pytest.approx(np.quantile(means, 0.8, method="inverted_cdf"))


def test_as_scipys_percentile_bootstrap(rng: np.random.Generator) -> None:
    takes = rng.gamma(2.0, size=40)
    found = bootstrap_interval(takes, np.median, np.random.default_rng(1), n=4000)  # type: ignore[arg-type]
    other = stats.bootstrap(
        (takes,), np.median, n_resamples=4000, method="percentile", rng=np.random.default_rng(2)
    ).confidence_interval
    assert found.low == pytest.approx(other.low, abs=0.06)
    assert found.high == pytest.approx(other.high, abs=0.06)


def test_the_interval_holds_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(4)
    held = 0
    for _ in range(150):
        _, low, high = bootstrap_interval(rng.normal(size=25), np.mean, rng, n=200, level=0.9)  # type: ignore[arg-type]
        held += low <= 0 <= high
    assert 0.78 < held / 150 < 0.97


def test_takes_are_drawn_and_not_their_frames() -> None:
    # Each take is all right or all wrong: the interval is as wide as 8 coins, not as narrow as 800 frames.
    takes = [np.full(100, i % 2) for i in range(8)]
    found = bootstrap_interval(takes, lambda some: np.concatenate(some).mean(), np.random.default_rng(6))
    assert found.value == 0.5
    assert found.high - found.low > 0.5


@settings(max_examples=25)
@given(st.lists(st.floats(-5, 5), min_size=2, max_size=8), st.floats(-3, 3))
def test_invariants(takes: list, shift: float) -> None:
    value, low, high = bootstrap_interval(takes, np.mean, np.random.default_rng(2), n=50)
    assert min(takes) - 1e-12 <= low <= high <= max(takes) + 1e-12
    moved = bootstrap_interval([x + shift for x in takes], np.mean, np.random.default_rng(2), n=50)
    np.testing.assert_allclose(moved, np.add([value, low, high], shift), atol=1e-9)


def test_scores_and_differences_of_takes() -> None:
    reference = list("NNNNAAAA")
    takes = [
        (segmental_f1(reference, list(p), 0.5), segmental_f1(reference, list(q), 0.5))
        for p, q in [("NNNNAAAA", "NANAAAAA"), ("NNNNNAAA", "NNNNNNNN"), ("NNNNAAAA", "NNNNANAA")]
    ]

    def gain(some: list) -> float:
        return pool_f1(pair[0] for pair in some).f1 - pool_f1(pair[1] for pair in some).f1

    found = bootstrap_interval(takes, gain, np.random.default_rng(0), n=200)
    assert 0 < found.low <= found.value <= found.high <= 1


def test_too_little_to_say() -> None:
    one = bootstrap_interval([3.0], np.mean, np.random.default_rng(0))
    assert one.value == 3
    assert np.isnan([one.low, one.high]).all()
    nothing = bootstrap_interval([np.nan, np.nan], np.mean, np.random.default_rng(0), n=10)
    assert np.isnan(nothing).all()
    # A score that most draws do not have.
    rare = bootstrap_interval(
        [0, 0, 1, 2], lambda some: np.mean(some) if {1, 2} <= set(some) else np.nan, np.random.default_rng(0), n=100
    )
    assert rare.value == 0.75
    assert np.isnan([rare.low, rare.high]).all()


def test_the_same_generator_gives_the_same_interval() -> None:
    takes = [1.0, 2.0, 5.0, 7.0]
    first, second = (bootstrap_interval(takes, np.mean, np.random.default_rng(9), n=50) for _ in range(2))
    assert first == second
    assert str(Interval(0.5, 0.25, 0.75)) == "0.500 [0.250, 0.750]"


def test_bad_input(rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="at least one take"):
        bootstrap_interval([], np.mean, rng)
    with pytest.raises(InputError, match="1 draw"):
        bootstrap_interval([1, 2], np.mean, rng, n=0)
    for level in (0, 1, 95):
        with pytest.raises(InputError, match="level"):
            bootstrap_interval([1, 2], np.mean, rng, level=level)
