import numpy as np
import pytest
from mimique.errors import InputError
from mimique.synthesis.rbf_regression import RBFRegression
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF


def smooth(rng, n=60):
    """Markers that move on a plane of poses, and two weights that depend on the pose without being linear in it."""
    pose = rng.uniform(-1, 1, (n, 2))
    positions = (pose @ rng.normal(0, 5, (2, 12))).reshape(n, 4, 3)
    return positions, np.stack([np.sin(2 * pose[:, 0]), pose[:, 0] * pose[:, 1]], 1)


def test_without_ridge_it_passes_through_the_examples(rng):
    positions, weights = smooth(rng, 20)
    fit = RBFRegression.fit(positions, weights, ridge=0.0, widths=4.0)
    np.testing.assert_allclose(fit.predict(positions), weights, atol=1e-6)


def test_coefficients_are_the_minimum_of_2_14(rng):
    positions, weights = smooth(rng, 25)
    widths = rng.uniform(3, 8, 25)
    fit = RBFRegression.fit(positions, weights, ridge=0.3, widths=widths)
    flat = positions.reshape(25, -1)
    phi = np.array(
        [[np.exp(-((a - b) ** 2).sum() / (2 * w**2)) for b, w in zip(flat, widths, strict=True)] for a in flat]
    )

    def cost(c):
        return ((weights - phi @ c) ** 2).sum() + 0.3 * (c**2).sum()

    best = cost(fit.coefficients)
    assert all(best < cost(fit.coefficients + 1e-3 * rng.normal(size=fit.coefficients.shape)) for _ in range(50))
    normal = np.linalg.solve(phi.T @ phi + 0.3 * np.eye(25), phi.T @ weights)
    np.testing.assert_allclose(fit.coefficients, normal, atol=1e-8)


def test_between_examples_it_agrees_with_sklearn_where_both_interpolate(rng):
    positions, weights = smooth(rng, 30)
    new, _ = smooth(rng, 10)
    fit = RBFRegression.fit(positions, weights, ridge=0.0, widths=4.0)
    other = GaussianProcessRegressor(RBF(4.0, "fixed"), alpha=1e-12, optimizer=None)
    other.fit(positions.reshape(30, -1), weights)
    np.testing.assert_allclose(fit.predict(new), other.predict(new.reshape(10, -1)), atol=1e-4)


def test_it_learns_what_a_linear_map_cannot(rng):
    positions, weights = smooth(rng, 400)
    fit = RBFRegression.fit(positions[:300], weights[:300])
    error = np.abs(fit.predict(positions[300:]) - weights[300:]).mean()
    flat = np.c_[positions.reshape(400, -1), np.ones(400)]
    linear = flat[300:] @ np.linalg.lstsq(flat[:300], weights[:300], rcond=None)[0]
    assert error < 0.02 < 0.08 < np.abs(linear - weights[300:]).mean()


def test_units_do_not_matter_gaps_give_nan_and_the_far_is_zero(rng):
    positions, weights = smooth(rng)
    fit, metres = RBFRegression.fit(positions, weights), RBFRegression.fit(positions / 1000, weights)
    np.testing.assert_allclose(fit.predict(positions), metres.predict(positions / 1000), atol=1e-7)
    gaps = positions.copy()
    gaps[3, 1, 0] = np.nan
    found = fit.predict(gaps)
    assert np.isnan(found[3]).all() and np.isfinite(np.delete(found, 3, 0)).all()
    np.testing.assert_array_equal(fit.predict(positions + 1e4), 0)
    np.testing.assert_array_equal(RBFRegression.fit(gaps, weights).centres, np.delete(gaps, 3, 0).reshape(59, -1))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.full((60, 4, 3), np.nan)}, "without NaN"),
        ({"positions": np.ones((60, 4, 3))}, "alike"),
        ({"ridge": -1.0}, "ridge"),
        ({"widths": 0.0}, "widths"),
        ({"weights": np.zeros((59, 2))}, "weights"),
    ],
)
def test_bad_input_is_refused(rng, change, message):
    positions, weights = smooth(rng)
    with pytest.raises(InputError, match=message):
        RBFRegression.fit(**({"positions": positions, "weights": weights} | change))
