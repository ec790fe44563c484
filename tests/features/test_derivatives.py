import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.features.derivatives import differentiate, find_runs, fit_polynomial_kernels
from scipy.signal import savgol_coeffs


def test_equal_weights_give_scipys_savitzky_golay() -> None:
    rate = 200.0
    times = np.arange(-7, 8) / rate
    kernels = fit_polynomial_kernels(times, np.inf, 3)
    for order in range(4):
        expected = savgol_coeffs(15, 3, deriv=order, delta=1 / rate, use="dot")
        np.testing.assert_allclose(kernels[order], expected, atol=1e-9 * np.abs(expected).max())


def test_each_frame_is_the_weighted_least_squares_fit(rng: np.random.Generator) -> None:
    """Slow second version: numpy's polyfit at every frame that has a whole window."""
    rate, window = 120.0, 0.15
    values = rng.normal(size=(60, 1))
    found = differentiate(values, rate, window=window)
    times = np.arange(60) / rate
    for frame in range(10, 50):
        away = times - times[frame]
        near = np.abs(away) < window / 2 - 1e-9
        root_weight = 1 - (2 * away[near] / window) ** 2
        c2, c1, c0 = np.polyfit(away[near], values[near, 0], 2, w=root_weight)
        np.testing.assert_allclose(found[:, frame, 0], [c0, c1, 2 * c2], rtol=1e-9, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(3, 80),
    st.floats(30, 500),
    st.floats(0.1, 0.6),
    st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3)),
)
def test_quadratics_are_exact_to_the_ends(n_frames: int, rate: float, window: float, c: tuple) -> None:
    t = np.arange(n_frames) / rate
    found = differentiate((c[0] + c[1] * t + c[2] * t**2)[:, None], rate, window=window)[..., 0]
    # Round-off of the samples grows with the rate in each order.
    np.testing.assert_allclose(found[0], c[0] + c[1] * t + c[2] * t**2, atol=1e-9)
    np.testing.assert_allclose(found[1], c[1] + 2 * c[2] * t, atol=1e-7)
    np.testing.assert_allclose(found[2], np.full(n_frames, 2 * c[2]), atol=1e-5 * rate)


def test_sine_against_closed_form() -> None:
    rate = 200.0
    t = np.arange(600) / rate
    found = differentiate(np.sin(2 * np.pi * t)[:, None], rate, window=0.1)[:, 50:-50, 0]
    t = t[50:-50]
    np.testing.assert_allclose(found[1], 2 * np.pi * np.cos(2 * np.pi * t), atol=0.02 * 2 * np.pi)
    np.testing.assert_allclose(found[2], -((2 * np.pi) ** 2) * np.sin(2 * np.pi * t), atol=0.02 * (2 * np.pi) ** 2)


def test_gaps_are_kept_and_separate_the_runs(rng: np.random.Generator) -> None:
    values = rng.normal(size=(100, 3))
    values[40, 1] = np.nan
    values[43] = np.nan
    found = differentiate(values, 100.0, window=0.1)
    assert np.isnan(found[:, [40, 43]]).all()
    assert np.isnan(found[:, 41:43]).all(), "two frames do not make a parabola"
    np.testing.assert_array_equal(found[:, :40], differentiate(values[:40], 100.0, window=0.1))
    np.testing.assert_array_equal(found[:, 44:], differentiate(values[44:], 100.0, window=0.1))


def test_reversed_time_turns_the_odd_derivative(rng: np.random.Generator) -> None:
    values = rng.normal(size=(70, 2))
    found = differentiate(values, 60.0)
    back = differentiate(values[::-1], 60.0)[:, ::-1]
    np.testing.assert_allclose(found, back * np.array([1, -1, 1])[:, None, None], atol=1e-9)


def test_runs() -> None:
    assert find_runs([True, True, False, True]) == [(0, 2), (3, 4)]
    assert find_runs([]) == []
    assert find_runs([False]) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"rate": 0.0}, "rate: expected"),
        ({"rate": np.nan}, "rate: expected"),
        ({"rate": 10.0, "window": 0.1}, "window: expected more than"),
        ({"rate": 10.0, "window": -1.0}, "window: expected seconds"),
        ({"rate": 10.0, "window": 1.0, "max_order": 3}, "max_order: expected"),
    ],
)
def test_bad_arguments(arguments: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        differentiate(np.zeros((20, 1)), **arguments)


def test_the_least_window_named_in_the_message_works() -> None:
    differentiate(np.zeros((20, 1)), 10.0, window=0.4 * (1 + 1e-3))
    with pytest.raises(InputError, match=r"more than 0\.4 s"):
        differentiate(np.zeros((20, 1)), 10.0, window=0.2, degree=3)
