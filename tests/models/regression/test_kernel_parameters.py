import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.regression.kernel_parameters import fit_kernel_parameters, log_marginal_likelihood
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern, WhiteKernel


@pytest.fixture
def examples(rng):
    X = rng.normal(size=(60, 2))
    Y = np.sin(X @ rng.normal(size=(2, 3))) + 0.1 * rng.normal(size=(60, 3))
    return X, Y


@pytest.mark.parametrize(("kernel", "oracle"), [("rbf", RBF(0.8)), ("matern52", Matern(0.8, nu=2.5))], ids=str)
def test_the_likelihood_is_scikit_learns(examples, kernel, oracle):
    X, Y = examples
    gp = GaussianProcessRegressor(ConstantKernel(1.7) * oracle + WhiteKernel(0.05), optimizer=None, alpha=0)
    expected = sum(gp.fit(X, y).log_marginal_likelihood() for y in Y.T)
    assert log_marginal_likelihood(X, Y, 0.8, 1.7, 0.05, kernel) == pytest.approx(expected, abs=1e-6)


def test_the_parameters_are_at_least_as_likely_as_scikit_learns(examples):
    X, Y = examples
    found = fit_kernel_parameters(X, Y)
    gp = GaussianProcessRegressor(ConstantKernel(1.0) * RBF(1.0) + WhiteKernel(0.1), alpha=0, random_state=0)
    gp.fit(X, Y)  # Outputs share the parameters, as here.
    assert found.log_likelihood > gp.log_marginal_likelihood_value_ - 0.01
    assert found.length_scale == pytest.approx(gp.kernel_.k1.k2.length_scale, rel=0.05)
    assert found.noise == pytest.approx(gp.kernel_.k2.noise_level, rel=0.05)
    again = log_marginal_likelihood(X, Y, found.length_scale, found.amplitude, found.noise)
    assert again == pytest.approx(found.log_likelihood, abs=1e-6)


def test_parameters_scale_with_inputs_and_outputs(examples):
    X, Y = examples
    one, other = fit_kernel_parameters(X, Y), fit_kernel_parameters(10 * X, 3 * Y)
    assert other.length_scale == pytest.approx(10 * one.length_scale, rel=1e-6)
    assert (other.amplitude, other.noise) == pytest.approx((9 * one.amplitude, 9 * one.noise), rel=1e-6)


def test_few_evenly_spaced_examples_are_used(examples):
    X, Y = examples
    chosen = np.linspace(0, 59, 20).round().astype(int)
    assert fit_kernel_parameters(X, Y, n_examples=20) == fit_kernel_parameters(X[chosen], Y[chosen])


def test_impossible_examples_are_refused(examples):
    X, Y = examples
    with pytest.raises(InputError, match="at least two examples"):
        fit_kernel_parameters(X[:1], Y[:1])
    with pytest.raises(InputError, match="examples that differ"):
        fit_kernel_parameters(np.ones_like(X), Y)
    with pytest.raises(InputError, match="not all 0"):
        fit_kernel_parameters(X, np.zeros_like(Y))
    with pytest.raises(InputError, match="expected one of rbf"):
        fit_kernel_parameters(X, Y, kernel="cosine")
