import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.regression.linear_trend import RIDGES, fit_linear_trend
from sklearn.linear_model import Ridge, RidgeCV
from sklearn.model_selection import KFold


def test_it_is_scikit_learns_ridge_tried_on_stretches(rng):
    t = np.arange(203) / 30
    X = np.sin(t[:, None] * rng.uniform(0.2, 2, 9)) + 0.3 * rng.normal(size=(203, 9))
    Y = X @ rng.normal(size=(9, 4)) + 3 * rng.normal(size=(203, 4))
    found, ridge = fit_linear_trend(X, Y)
    # Scikit-learn's penalty is not divided by the number of frames, which differs from fold to fold.
    errors = np.zeros(len(RIDGES))
    for train, test in KFold(5).split(X):
        for i, each in enumerate(RIDGES):
            model = Ridge(each * len(train), fit_intercept=False).fit(X[train], Y[train])
            errors[i] += ((model.predict(X[test]) - Y[test]) ** 2).sum()
    assert ridge == RIDGES[errors.argmin()]
    assert RIDGES[0] < ridge < RIDGES[-1]
    np.testing.assert_allclose(found, Ridge(ridge * 203, fit_intercept=False).fit(X, Y).coef_.T, atol=1e-9)


def test_repeated_frames_do_not_hide_the_noise(rng):
    """Every frame ten times: single frames left out would be found in the others, and any overfit would look good."""
    X, Y = np.repeat(rng.normal(size=(30, 25)), 10, axis=0), np.repeat(rng.normal(size=(30, 2)), 10, axis=0)
    single = RidgeCV(RIDGES * 300, fit_intercept=False).fit(X, Y)
    assert fit_linear_trend(X, Y)[1] > 10 * single.alpha_ / 300


def test_too_few_frames_are_refused(rng):
    with pytest.raises(InputError, match="2 to 3 stretches"):
        fit_linear_trend(rng.normal(size=(3, 2)), rng.normal(size=(3, 2)))
