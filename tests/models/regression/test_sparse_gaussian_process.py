import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.models.regression.sparse_gaussian_process import SparseGaussianProcess
from mimique.models.regression.sparse_posterior import SparsePosterior
from scipy.spatial.distance import cdist
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Matern


def rbf(a, b, length=1.0):
    return np.exp(-0.5 * cdist(a, b, "sqeuclidean") / length**2)


def wavy(rng, n_examples, n_inputs=3, n_outputs=4, noise=0.05):
    X = rng.normal(size=(n_examples, n_inputs))
    Y = np.sin(X @ rng.normal(size=(n_inputs, n_outputs))) + noise * rng.normal(size=(n_examples, n_outputs))
    return X, Y


@pytest.mark.parametrize(
    ("kernel", "oracle"), [("rbf", RBF(1.3, "fixed")), ("matern52", Matern(1.3, "fixed", nu=2.5))], ids=str
)
def test_without_threshold_and_budget_it_is_exact_regression(rng, kernel, oracle):
    X, Y = wavy(rng, 150)
    Z = rng.normal(size=(40, 3))
    exact = GaussianProcessRegressor(ConstantKernel(2.0, "fixed") * oracle, alpha=1e-3, optimizer=None).fit(X, Y)
    mean, std = exact.predict(Z, return_std=True)
    process = SparseGaussianProcess(1.3, amplitude=2.0, noise=1e-3, novelty=0, kernel=kernel).fit(X, Y)
    ours, spread = process.predict(Z, return_std=True)
    assert len(process.basis_) == 150
    np.testing.assert_allclose(ours, mean, atol=1e-9)
    np.testing.assert_allclose(spread, std, atol=1e-9)


@pytest.mark.parametrize(("length", "noise"), [(1.0, 1e-4), (5.0, 1e-6), (5.0, 1e-2)])
def test_it_is_exact_on_a_kernel_matrix_that_cannot_be_inverted(length, noise):
    """Frames of a slow motion: neighbours all but coincide, and every fifth is held still, so that frames repeat."""
    t = np.linspace(0, 20, 300)
    t[::5] = t[1::5]
    X = np.column_stack([t, np.sin(t)])
    Y = np.column_stack([np.sin(t), np.cos(2 * t)])
    Z = X[::7] + 0.01
    assert np.linalg.cond(rbf(X, X, length)) > 1e15
    exact = GaussianProcessRegressor(RBF(length, "fixed"), alpha=noise, optimizer=None).fit(X, Y)
    mean, std = exact.predict(Z, return_std=True)
    ours, spread = SparseGaussianProcess(length, noise=noise, novelty=0).fit(X, Y).predict(Z, return_std=True)
    np.testing.assert_allclose(ours, mean, atol=1e-6)
    np.testing.assert_allclose(spread, std, atol=1e-6)


def test_with_a_given_basis_it_is_fitc(rng):
    """Frames that are not novel are projected; that is FITC (Quiñonero-Candela and Rasmussen 2005, 24) in one sweep."""
    X, Y = wavy(rng, 120, n_inputs=2)
    B = X[:12]
    noise = 0.01
    process = SparseGaussianProcess(0.8, noise=noise, novelty=0).fit(B, Y[:12])
    process.set_params(novelty=1.0).partial_fit(X[12:], Y[12:])
    Z = rng.normal(size=(30, 2))
    K, KZ, KX = rbf(B, B, 0.8), rbf(Z, B, 0.8), rbf(X, B, 0.8)
    diagonal = 1 - np.einsum("ij,ji->i", KX, np.linalg.solve(K, KX.T)) + noise
    A = K + (KX.T / diagonal) @ KX
    mean = KZ @ np.linalg.solve(A, (KX.T / diagonal) @ Y)
    variance = 1 - np.einsum("ij,ji->i", KZ, np.linalg.solve(K, KZ.T) - np.linalg.solve(A, KZ.T))
    ours, std = process.predict(Z, return_std=True)
    np.testing.assert_array_equal(process.basis_.round(12), B.round(12))
    np.testing.assert_allclose(ours, mean, atol=1e-5)
    np.testing.assert_allclose(std[:, 0], np.sqrt(variance), atol=1e-5)


class PaperProcess:
    """Slow second version, in the parameters α, C and Q of Csató and Opper's paper."""

    def __init__(self, length, noise, novelty, budget):
        self.length, self.noise, self.novelty, self.budget = length, noise, novelty, budget
        self.B = None

    def take_in(self, x, y):
        if self.B is None:
            self.B, self.alpha = np.empty((0, len(x))), np.empty((0, len(y)))
            self.C, self.Q = np.empty((0, 0)), np.empty((0, 0))
        k = rbf(self.B, x[None], self.length)[:, 0]
        e = self.Q @ k
        gamma = 1 - k @ e
        scale = self.noise + 1 + k @ self.C @ k
        q, r = (y - k @ self.alpha) / scale, -1 / scale
        s = self.C @ k + e
        if len(self.B) and gamma <= self.novelty:
            self.alpha = self.alpha + np.outer(s, q)
            self.C = self.C + r * np.outer(s, s)
            return
        grown = np.append(self.C @ k, 1.0)
        self.B = np.vstack([self.B, x])
        self.alpha = np.vstack([self.alpha, 0 * y]) + np.outer(grown, q)
        self.C = np.pad(self.C, (0, 1)) + r * np.outer(grown, grown)
        self.Q = np.pad(self.Q, (0, 1)) + np.outer(np.append(e, -1), np.append(e, -1)) / gamma
        if len(self.B) > self.budget:
            self.remove(int((np.linalg.norm(self.alpha, axis=1) / np.diag(self.Q)).argmin()))

    def remove(self, i):
        keep = np.delete(np.arange(len(self.B)), i)
        a, c, q = self.alpha[i], self.C[i, i], self.Q[i, i]
        C, Q = self.C[keep, i], self.Q[keep, i]
        self.B = self.B[keep]
        self.alpha = self.alpha[keep] - np.outer(Q, a) / q
        self.C = self.C[np.ix_(keep, keep)] + c / q**2 * np.outer(Q, Q) - (np.outer(Q, C) + np.outer(C, Q)) / q
        self.Q = self.Q[np.ix_(keep, keep)] - np.outer(Q, Q) / q


@pytest.mark.parametrize(("novelty", "budget"), [(0.05, 1000), (0.3, 10), (0.001, 15)])
def test_it_follows_the_papers_own_recursions(rng, novelty, budget):
    X, Y = wavy(rng, 200, n_inputs=2)
    process = SparseGaussianProcess(1.0, noise=0.02, novelty=novelty, budget=budget)
    slow = PaperProcess(1.0, 0.02, novelty, budget)
    for x, y in zip(X, Y, strict=True):
        process.partial_fit(x[None], y[None])
        slow.take_in(x, y)
    np.testing.assert_allclose(process.basis_, slow.B, atol=1e-9)
    k = rbf(X, slow.B)
    mean, std = process.predict(X, return_std=True)
    np.testing.assert_allclose(mean, k @ slow.alpha, atol=1e-5)
    np.testing.assert_allclose(std[:, 0] ** 2, 1 + np.einsum("ij,jk,ik->i", k, slow.C, k), atol=1e-5)
    assert (process.n_removed_ > 0) == (budget < 1000)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.data())
def test_removal_keeps_the_moments_of_what_stays(seed, size, data):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(size, 2)) * 0.3  # Near neighbours: an ill-conditioned kernel matrix.
    K = rbf(X, X)
    posterior = SparsePosterior(2, noise=0.1)
    for n in range(size):
        posterior.add(*posterior.project(K[n, :n]), rng.normal(size=2))
    L = posterior.factor.copy()
    mean, covariance = L @ posterior.mean, L @ posterior.covariance @ L.T
    gone = data.draw(st.integers(0, size - 1))
    posterior.remove(gone)
    stay = np.delete(np.arange(size), gone)
    L = posterior.factor
    np.testing.assert_allclose(L @ L.T, K[np.ix_(stay, stay)] + 1e-8 * np.eye(size - 1), atol=1e-14)
    np.testing.assert_allclose(L @ posterior.mean, mean[stay], atol=1e-12)
    np.testing.assert_allclose(L @ posterior.covariance @ L.T, covariance[np.ix_(stay, stay)], atol=1e-12)
    scores = posterior.scores()
    posterior._refresh()
    np.testing.assert_allclose(scores, posterior.scores(), rtol=1e-4)


def test_the_score_is_what_the_mean_loses(rng):
    X, Y = wavy(rng, 12, n_inputs=2, n_outputs=1)
    process = SparseGaussianProcess(1.0, noise=0.02, novelty=0).fit(X, Y)
    scores = process._posterior.scores()
    before = process.predict(X)
    process._remove(5)
    assert abs(before[5, 0] - process.predict(X)[5, 0]) == pytest.approx(scores[5], rel=1e-5)


def test_a_budget_is_kept_and_costs_little_on_a_low_dimensional_motion(rng):
    t = np.arange(900) / 30
    latent = np.column_stack([np.sin(t), np.cos(0.7 * t)])
    X = np.tanh(latent @ rng.normal(size=(2, 30)))
    Y = np.sin(latent @ rng.normal(size=(2, 5)))
    process = SparseGaussianProcess(5.0, noise=1e-4, novelty=1e-5, budget=40).fit(X[::2], Y[::2])
    assert len(process.basis_) <= 40
    assert process.n_removed_ > 20
    assert np.abs(process.predict(X[1::2]) - Y[1::2]).mean() < 0.005
    assert process.n_seen_ == 450


def test_far_from_all_examples_it_returns_to_the_prior(rng):
    X, Y = wavy(rng, 30)
    mean, std = SparseGaussianProcess(1.0, amplitude=4.0).fit(X, Y).predict(X + 100, return_std=True)
    np.testing.assert_allclose(mean, 0, atol=1e-12)
    np.testing.assert_allclose(std, 2.0)


def test_parts_teach_the_same_as_the_whole_and_fit_forgets(rng):
    X, Y = wavy(rng, 80)
    whole = SparseGaussianProcess(1.0, budget=20).fit(X, Y)
    parts = SparseGaussianProcess(1.0, budget=20).fit(X[::-1], Y[::-1]).fit(X[:33], Y[:33]).partial_fit(X[33:], Y[33:])
    np.testing.assert_array_equal(whole.predict(X), parts.predict(X))


def test_length_scales_of_their_own_weigh_the_inputs(rng):
    X, Y = wavy(rng, 50)
    scaled = SparseGaussianProcess(1.0).fit(X / [1, 2, 3], Y)
    np.testing.assert_allclose(
        SparseGaussianProcess([1, 2, 3]).fit(X, Y).predict(X), scaled.predict(X / [1, 2, 3]), atol=1e-9
    )


def test_scikit_learns_conventions(rng):
    X, Y = wavy(rng, 40)
    process = SparseGaussianProcess(0.7, budget=9)
    assert clone(process).get_params() == process.get_params()
    with pytest.raises(NotFittedError):
        process.predict(X)
    with pytest.raises(NotFittedError):
        process.to_arrays()
    process.fit(X, Y[:, 0])
    mean, std = process.predict(X, return_std=True)
    assert mean.shape == std.shape == (40,)
    assert process.score(X, Y[:, 0]) > 0.5


def test_a_stored_process_predicts_the_same_and_learns_on(rng):
    X, Y = wavy(rng, 60)
    process = SparseGaussianProcess(0.7, budget=15, novelty=0.01).fit(X[:40], Y[:40])
    again = SparseGaussianProcess.from_arrays(*process.to_arrays())
    np.testing.assert_array_equal(again.predict(X), process.predict(X))
    assert (again.n_seen_, again.n_removed_) == (40, process.n_removed_)
    np.testing.assert_allclose(
        again.partial_fit(X[40:], Y[40:]).predict(X), process.partial_fit(X[40:], Y[40:]).predict(X), atol=1e-9
    )
    arrays, metadata = process.to_arrays()
    with pytest.raises(InputError, match="expected factor"):
        SparseGaussianProcess.from_arrays({k: v for k, v in arrays.items() if k != "factor"}, metadata)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"length_scale": 0.0}, "length_scale"),
        ({"length_scale": [1.0, 1.0]}, "length_scale"),
        ({"noise": 0.0}, "noise"),
        ({"amplitude": np.nan}, "amplitude"),
        ({"novelty": -0.1}, "novelty"),
        ({"budget": 0}, "budget"),
        ({"budget": 1.5}, "budget"),
        ({"kernel": "linear"}, "rbf, matern52"),
    ],
)
def test_impossible_parameters_are_refused(rng, parameters, message):
    with pytest.raises(InputError, match=message):
        SparseGaussianProcess(**parameters).fit(*wavy(rng, 5))


def test_impossible_examples_are_refused(rng):
    X, Y = wavy(rng, 10)
    process = SparseGaussianProcess()
    with pytest.raises(InputError, match="one row for each of the 10"):
        process.fit(X, Y[:9])
    with pytest.raises(InputError, match="at least one example"):
        process.fit(X[:0], Y[:0])
    with pytest.raises(InputError, match="finite"):
        process.fit(np.full_like(X, np.nan), Y)
    process.fit(X, Y)
    with pytest.raises(InputError, match="4 outputs as before"):
        process.partial_fit(X, Y[:, :2])
    with pytest.raises(InputError, match="3 inputs as before"):
        process.partial_fit(X[:, :2], Y)
    with pytest.raises(InputError, match="fit again"):
        process.set_params(length_scale=2.0).partial_fit(X, Y)


def test_by_default_what_is_less_than_the_noise_is_not_novel(rng):
    X, Y = wavy(rng, 200)
    default = SparseGaussianProcess(2.0, amplitude=4.0, noise=0.4).fit(X, Y)
    np.testing.assert_array_equal(
        default.basis_, SparseGaussianProcess(2.0, amplitude=4.0, noise=0.4, novelty=0.1).fit(X, Y).basis_
    )
    assert 1 < len(default.basis_) < 200


def test_a_budget_made_smaller_is_kept(rng):
    X, Y = wavy(rng, 60)
    process = SparseGaussianProcess(1.0, budget=30, novelty=0).fit(X[:50], Y[:50])
    assert len(process.basis_) == 30
    process.set_params(budget=12).partial_fit(X[50:], Y[50:])
    assert len(process.basis_) == 12
