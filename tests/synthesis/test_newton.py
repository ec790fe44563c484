import numpy as np
import pytest
from mimique.synthesis import newton
from mimique.synthesis.lsts import SoftBounds
from scipy.optimize import minimize


def problem(n=20, f=300, seed=0, spread=1.0):
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(n + 10, n)) * rng.uniform(0.1, 2, n)
    return 2 * B.T @ B, 2 * (rng.normal(0.3, spread, (f, n)) @ B.T) @ B


@pytest.mark.parametrize("weight", [1e-3, 0.01, 10.0])
@pytest.mark.parametrize("spread", [0.3, 3.0])
def test_the_gradient_vanishes(weight, spread):
    H, g = problem(spread=spread)
    phi = SoftBounds(weight, 0.1, -0.1, 1.1)
    c = newton.minimise(H, g, np.clip(np.linalg.solve(H, g.T).T, -0.1, 1.1), phi)
    slope, curve = phi.derivatives(c)
    assert (np.abs(c @ H - g + slope) / (np.diag(H) + curve)).max() < 1e-8


def test_agrees_with_scipy():
    H, g = problem(6, 5)
    phi = SoftBounds(0.02, 0.1, -0.1, 1.1)
    for c, x in zip(newton.minimise(H, g, np.zeros_like(g), phi), g, strict=True):
        best = minimize(lambda w, x=x: 0.5 * w @ H @ w - x @ w + phi.value(w).sum(), np.zeros(6), tol=1e-12)
        np.testing.assert_allclose(c, best.x, atol=1e-5)


def test_both_stages_reach_the_same_minimum():
    H, g = problem()
    phi = SoftBounds(0.007, 0.1, -0.1, 1.1)
    start = np.zeros_like(g)
    np.testing.assert_allclose(newton._newton(H, g, start, phi), newton.minimise(H, g, start, phi), atol=1e-8)


def test_a_far_start_does_not_matter():
    H, g = problem(f=20)
    phi = SoftBounds(0.007, 0.1, -0.1, 1.1)
    near = newton.minimise(H, g, np.zeros_like(g), phi)
    np.testing.assert_allclose(newton.minimise(H, g, np.full_like(g, -6.0), phi), near, atol=1e-8)


def test_derivatives_of_the_bounds():
    phi = SoftBounds(0.5, 0.1, -0.1, 1.1)
    c, h = np.linspace(-0.5, 1.5, 41), 1e-5
    expected = 0.5 * (np.exp((-0.1 - c) / 0.1) + np.exp((c - 1.1) / 0.1))
    np.testing.assert_allclose(phi.value(c), expected)
    slope, curve = phi.derivatives(c)
    np.testing.assert_allclose(slope, (phi.value(c + h) - phi.value(c - h)) / (2 * h), rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(curve, expected / 0.01)
