import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.features import mean_weights, sample_frames


def table(*bounds: tuple[int, int]) -> pd.DataFrame:
    return pd.DataFrame(bounds, columns=["onset", "offset"])


def test_mean_leaves_gaps_out(rng: np.random.Generator) -> None:
    weights = rng.normal(size=(20, 3))
    weights[5, 2] = np.nan
    weights[10:15] = np.nan
    found = mean_weights(weights, table((0, 4), (4, 7), (10, 15)))
    np.testing.assert_allclose(found[0], weights[:4].mean(axis=0))
    np.testing.assert_allclose(found[1], weights[[4, 6]].mean(axis=0))
    assert np.isnan(found[2]).all()


def test_samples_are_spread_evenly_and_never_gaps() -> None:
    weights = np.arange(400.0)[:, None]
    weights[100:120] = np.nan
    samples, rows = sample_frames(weights, table((0, 200), (200, 205), (105, 110)), 200.0, per_second=10)
    assert rows.tolist() == [0] * 9 + [1]  # 180 frames that are not gaps are 0.9 s; a short one gives one sample
    assert samples[:, 0].tolist() == [10, 30, 50, 70, 90, 130, 150, 170, 190, 202]


def test_every_frame_on_request() -> None:
    samples, rows = sample_frames(np.arange(30.0)[:, None], table((3, 8), (8, 10)), 200.0, per_second=None)
    assert samples[:, 0].tolist() == [3, 4, 5, 6, 7, 8, 9]
    assert rows.tolist() == [0, 0, 0, 0, 0, 1, 1]


def test_more_samples_than_frames_are_the_frames() -> None:
    samples, _ = sample_frames(np.arange(30.0)[:, None], table((3, 8)), 60.0, per_second=1000)
    assert samples[:, 0].tolist() == [3, 4, 5, 6, 7]


def test_no_segments() -> None:
    samples, rows = sample_frames(np.zeros((5, 2)), table(), 60.0)
    assert samples.shape == (0, 2)
    assert rows.shape == (0,)
    assert mean_weights(np.zeros((5, 2)), table()).shape == (0, 2)


@pytest.mark.parametrize("bounds", [(-1, 4), (4, 4), (3, 11)])
def test_bounds_outside_the_take(bounds: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="row 0 has onset"):
        mean_weights(np.zeros((10, 2)), table(bounds))


def test_bad_arguments() -> None:
    with pytest.raises(InputError, match="onset and offset, but offset is missing"):
        mean_weights(np.zeros((10, 2)), pd.DataFrame({"onset": [1]}))
    with pytest.raises(InputError, match="per_second"):
        sample_frames(np.zeros((10, 2)), table((0, 4)), 10.0, per_second=0)
