import json

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.regression.kernel_parameters import KernelParameters
from mimique.models.regression.marker_regression import MarkerRegression, MarkerScale
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

PARAMETERS = KernelParameters(6.0, 0.05, 1e-4, 0.0)


class Actor:
    """Eight markers that three shapes move, on a face of some size and place."""

    def __init__(self, rng, size=1.0):
        self.rest = rng.normal(0, 30, (8, 3)) * size
        self.shapes = np.random.default_rng(1).normal(0, 4, (3, 8, 3)) * size

    def __call__(self, weights):
        return self.rest + np.tensordot(weights, self.shapes, axes=1)


def motion(rng, n_frames):
    t = np.arange(n_frames) / 30
    return 0.5 + 0.5 * np.sin(t[:, None] * rng.uniform(0.5, 3, 3) + rng.uniform(0, 6, 3))


@pytest.fixture
def learned(rng):
    actor = Actor(rng)
    weights = motion(rng, 240)
    return actor, weights, MarkerRegression.fit(actor(weights), weights, parameters=PARAMETERS, novelty=0, budget=None)


def test_it_is_gaussian_process_regression_on_standardised_markers(rng, learned):
    actor, weights, model = learned
    flat = actor(weights).reshape(240, -1)
    centre, scale = flat.mean(0), flat.std(0)
    assert scale.min() > 0.05
    exact = GaussianProcessRegressor(ConstantKernel(0.05, "fixed") * RBF(6.0, "fixed"), alpha=1e-4, optimizer=None)
    exact.fit((flat - centre) / scale, weights - weights.mean(0))
    test = actor(motion(rng, 50))
    mean, std = exact.predict((test.reshape(50, -1) - centre) / scale, return_std=True)
    ours, spread = model.predict(test, return_std=True)
    np.testing.assert_allclose(ours, mean + weights.mean(0), atol=1e-6)
    np.testing.assert_allclose(spread, std, atol=1e-6)


def test_another_actor_is_scaled_by_their_own_range_of_motion(rng, learned):
    """An actor of twice the size elsewhere in space, who makes the same motion, gets the same weights; else not."""
    _, weights, model = learned
    giant = Actor(rng, size=2.0)
    test = motion(rng, 60)
    own = model.predict(giant(test), actor_rom=giant(weights))
    np.testing.assert_allclose(own, test, atol=0.06)
    scale = MarkerScale.fit(giant(weights))
    np.testing.assert_array_equal(model.predict(giant(test), actor_rom=scale), own)
    assert np.abs(model.predict(giant(test)) - test).mean() > 0.2


def test_known_weights_are_found_with_parameters_of_its_own_and_a_budget(rng):
    actor, weights = Actor(rng), motion(rng, 600)
    seen = actor(weights) + rng.normal(0, 0.1, (600, 8, 3))
    model = MarkerRegression.fit(seen, weights, budget=60)
    assert len(model.process.basis_) <= 60
    test = motion(rng, 100)
    found, std = model.predict(actor(test), return_std=True)
    assert np.sqrt(((found - test) ** 2).mean()) < 0.02
    assert (np.abs(found - test) < 4 * np.sqrt(std**2 + model.process.noise)).mean() > 0.95


def test_a_still_coordinate_stays_near_zero():
    positions = np.zeros((4, 1, 3))
    positions[:, 0, 0] = [0, 2, 0, 2]
    positions[:, 0, 1] = [0, 0.01, 0, 0.01]
    scaled = MarkerScale.fit(positions)(positions)
    np.testing.assert_allclose(scaled[:, 0, 0], [-1, 1, -1, 1])
    np.testing.assert_allclose(scaled[:, 0, 1], [-0.1, 0.1, -0.1, 0.1])  # 0.005 mm over 0.05 mm
    np.testing.assert_allclose(scaled[:, 0, 2], 0)


def test_missing_markers_in_the_range_of_motion_teach_nothing(rng, learned):
    actor, weights, model = learned
    positions = np.concatenate([actor(weights), actor(weights[:20] + 5)])
    positions[240:] = np.nan
    again = MarkerRegression.fit(
        positions, np.concatenate([weights, weights[:20]]), parameters=PARAMETERS, novelty=0, budget=None
    )
    np.testing.assert_allclose(again.predict(actor(weights)), model.predict(actor(weights)), atol=1e-9)


def test_missing_markers_are_inferred_or_give_nan(rng, learned):
    actor, _, model = learned
    test = motion(rng, 40)
    gaps = actor(test)
    gaps[3, 2, 1] = np.nan  # One coordinate: the marker counts as missing.
    gaps[10:20, :2] = np.nan
    gaps[30, :5] = np.nan
    found = model.predict(gaps)
    assert np.isnan(found[30]).all()  # Three visible markers are too few.
    assert np.isfinite(np.delete(found, 30, axis=0)).all()
    np.testing.assert_allclose(found[10:20], test[10:20], atol=0.1)
    whole = model.predict(actor(test))
    np.testing.assert_array_equal(found[:3], whole[:3])
    strict = model.predict(gaps, missing="nan")
    assert set(np.flatnonzero(np.isnan(strict).all(axis=1))) == {3, *range(10, 20), 30}
    at_mean = np.where(np.isnan(gaps), model.scale.centre, gaps)
    assert np.abs(found[10:20] - test[10:20]).mean() < 0.5 * np.abs(model.predict(at_mean) - test)[10:20].mean()


def test_inferred_markers_are_the_conditional_mean(rng, learned):
    """By regression on the range of motion itself: ridge with the stated noise."""
    actor, weights, model = learned
    inputs = model.scale(actor(weights)).reshape(240, -1)
    seen, gone = np.arange(3, 24), np.arange(3)
    A, b = inputs[:, seen], inputs[:, gone]
    ridge = np.linalg.solve(A.T @ A / 240 + 0.05 * np.eye(21), A.T @ b / 240)
    frame = model.scale(actor(motion(rng, 1)))
    expected = frame.reshape(-1)[seen] @ ridge
    frame[0, 0] = np.nan
    np.testing.assert_allclose(model._infer(frame)[0, 0], expected, atol=1e-9)


def test_a_stored_model_predicts_the_same(rng, learned):
    actor, _, model = learned
    arrays, metadata = model.to_arrays()
    again = MarkerRegression.from_arrays(arrays, json.loads(json.dumps(metadata)))
    test = actor(motion(rng, 30))
    test[4, 2] = np.nan
    np.testing.assert_array_equal(again.predict(test), model.predict(test))
    with pytest.raises(InputError, match="expected likeness"):
        MarkerRegression.from_arrays({k: v for k, v in arrays.items() if k != "likeness"}, metadata)
    with pytest.raises(InputError, match="expected format 1"):
        MarkerRegression.from_arrays(arrays, metadata | {"format": 2})


def test_what_cannot_be_learned_from_is_refused(rng):
    actor, weights = Actor(rng), motion(rng, 30)
    seen = actor(weights)
    with pytest.raises(InputError, match="hardly moves"):
        MarkerRegression.fit(actor.rest + rng.normal(0, 0.001, seen.shape), weights)
    with pytest.raises(InputError, match="constant"):
        MarkerRegression.fit(seen, np.ones_like(weights))
    lost = seen.copy()
    lost[1:, 3] = np.nan
    with pytest.raises(InputError, match=r"marker 3 \(from 0\) is seen in 1 frames"):
        MarkerRegression.fit(lost, weights)
    alternating = seen.copy()
    alternating[::2, 0] = alternating[1::2, 1] = np.nan
    with pytest.raises(InputError, match="two frames or more without NaN"):
        MarkerRegression.fit(alternating, weights)
    with pytest.raises(InputError, match="range-of-motion weights"):
        MarkerRegression.fit(seen, weights[:-1])
    model = MarkerRegression.fit(seen, weights, parameters=PARAMETERS)
    with pytest.raises(InputError, match=r"\(any, 8, 3\)"):
        model.predict(seen[:, :7])
    with pytest.raises(InputError, match=r"range-of-motion positions: expected shape \(any, 8, 3\)"):
        model.predict(seen, actor_rom=seen[:, :7])
    with pytest.raises(InputError, match="infer or nan"):
        model.predict(seen, missing="zero")


def test_a_linear_trend_takes_what_is_linear(rng):
    actor, weights = Actor(rng), motion(rng, 300)
    seen = actor(weights) + rng.normal(0, 0.05, (300, 8, 3))
    few = 4 * motion(rng, 40)  # Far outside what was learned from: only a trend goes on there.
    plain, linear = (MarkerRegression.fit(seen, weights, budget=30, trend=trend) for trend in ("none", "linear"))
    errors = [np.abs(model.predict(actor(few)) - few).mean() for model in (plain, linear)]
    assert errors[1] < 0.1 * errors[0]
    again = MarkerRegression.from_arrays(*linear.to_arrays())
    np.testing.assert_array_equal(again.predict(actor(few)), linear.predict(actor(few)))
    assert np.abs(linear.trend).max() > 0
    assert not plain.trend.any()
    with pytest.raises(InputError, match="none or linear"):
        MarkerRegression.fit(seen, weights, trend="quadratic")
