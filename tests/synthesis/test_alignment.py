import numpy as np
import pytest
from mimique.errors import InputError, RigError
from mimique.synthesis.alignment import align_points, size_ratio
from scipy.spatial.transform import Rotation


def test_a_turned_neutral_is_brought_back(rng):
    rig = rng.normal(size=(12, 3)) * 50
    turn = Rotation.random(random_state=1).as_matrix()
    take = rng.normal(size=(7, 12, 3)) + rig @ turn.T + [100, 0, -900]
    take[:, 3] = np.nan
    fit = align_points(take[0], rig)
    assert np.nanmax(np.linalg.norm(fit.apply(take) - rig, axis=2)) < 12
    exact = align_points(2.5 * rig @ turn.T, rig, scale=True)
    np.testing.assert_allclose(exact.apply(2.5 * rig @ turn.T), rig, atol=1e-9)


def test_too_few_or_straight_markers_are_refused():
    line = np.outer(np.arange(6.0), [1, 1, 0])
    with pytest.raises(RigError, match="6 of 6 are usable"):
        align_points(line, line)
    few = np.where(np.arange(6)[:, None] < 2, line, np.nan)
    with pytest.raises(RigError, match="2 of 6 are usable"):
        align_points(few, line)
    with pytest.raises(InputError, match="expected shape"):
        align_points(line, line[:4])


def test_size_ratio(rng):
    rest = rng.normal(size=(10, 3))
    frames = np.stack([rest * 0.1 + 3] * 5)
    frames[2, :4] = np.nan
    assert size_ratio(frames, rest) == pytest.approx(0.1)
    assert np.isnan(size_ratio(frames * np.nan, rest))
