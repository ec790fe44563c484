import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.features import motion_energy


def sines(t: np.ndarray) -> np.ndarray:
    return np.column_stack([0.5 + 0.3 * np.sin(3 * t), 0.4 * np.cos(2 * t), np.full_like(t, 0.2)])


def test_against_closed_form() -> None:
    t = np.arange(400) / 200
    energy = motion_energy(sines(t), 200.0, tau=0.07, window=0.06)
    velocity = np.abs(0.9 * np.cos(3 * t)) + np.abs(0.8 * np.sin(2 * t))
    acceleration = np.abs(2.7 * np.sin(3 * t)) + np.abs(1.6 * np.cos(2 * t))
    inner = slice(10, -10)
    np.testing.assert_allclose(energy.velocity[inner], velocity[inner], atol=0.01)
    np.testing.assert_allclose(energy.acceleration[inner], acceleration[inner], atol=0.03)
    expected = velocity**2 + (0.07 * acceleration) ** 2
    np.testing.assert_allclose(energy.combined[inner], expected[inner], atol=0.03)
    np.testing.assert_allclose(energy.level**2, energy.combined)


@pytest.mark.parametrize("window", [0.11, 0.25])
def test_same_motion_at_any_rate_gives_the_same_curves(window: float) -> None:
    """A quick change of expression, 0.3 s, compared at the instants that all rates share."""

    def record(rate: int) -> np.ndarray:
        s = np.clip((np.arange(3 * rate) / rate - 1) / 0.3, 0, 1)
        weights = np.outer(s**3 * (10 - 15 * s + 6 * s**2), [0.7, -0.4, 0.2])
        energy = motion_energy(weights, rate, window=window)
        return np.array([energy.velocity, energy.acceleration, energy.combined])[:, :: rate // 20]

    reference = record(200)
    for rate in (60, 120):
        assert (np.abs(record(rate) - reference).max(axis=1) < 0.01 * reference.max(axis=1)).all(), rate


@settings(max_examples=30, deadline=None)
@given(st.floats(-4, 4), st.permutations(range(5)), st.floats(-2, 2))
def test_gain_order_and_offset(gain: float, order: list, offset: float) -> None:
    weights = np.random.default_rng(1).normal(size=(80, 5))
    energy = motion_energy(weights, 100.0)
    other = motion_energy(gain * weights[:, order] + offset, 100.0)
    np.testing.assert_allclose(other.velocity, abs(gain) * energy.velocity, atol=1e-8)
    np.testing.assert_allclose(other.level, abs(gain) * energy.level, atol=1e-6)


def test_rest_has_no_energy_and_gaps_have_none_at_all() -> None:
    weights = np.full((100, 4), 0.3)
    weights[50] = np.nan
    energy = motion_energy(weights, 100.0)
    np.testing.assert_allclose(np.delete(energy.level, 50), 0, atol=1e-9)
    assert np.isnan([energy.velocity[50], energy.acceleration[50], energy.combined[50]]).all()


def test_bad_arguments() -> None:
    with pytest.raises(InputError, match="tau: expected seconds"):
        motion_energy(np.zeros((50, 2)), 100.0, tau=-1)
    with pytest.raises(InputError, match="weights: expected shape"):
        motion_energy(np.zeros(50), 100.0)
