import numpy as np
import pytest
from mimique import InputError
from mimique.features import find_neutral, median_pose

RATE = 100.0


def make_take(rng: np.random.Generator, noise: float = 0.0):
    """Twelve seconds: begins in mid-motion, holds an expression, rests from 2.5 to 8.5 s, and moves again."""
    neutral = rng.normal(size=(10, 3)) * 40
    smile = 8 * rng.normal(size=(10, 3))
    t = np.arange(1200) / RATE
    amount = np.interp(t, [0, 0.5, 1.5, 2.5, 8.5, 9.2, 10.2, 11, 12], [0.5, 1, 1, 0, 0, 1, 1, 0, 0.3])
    return neutral, neutral + amount[:, None, None] * smile + noise * rng.normal(size=(1200, 10, 3)), t


def test_finds_the_rest_and_not_the_first_frame(rng: np.random.Generator) -> None:
    truth, take, _ = make_take(rng, noise=0.15)
    found = find_neutral(take, RATE)
    assert found.offset - found.onset == 50
    assert found.onset >= 245
    assert found.offset <= 855
    assert np.abs(found.positions - truth).max() < 0.15
    assert np.abs(take[0] - truth).max() > 2
    assert not found.filled.any()
    assert not found.missing.any()


def test_against_a_slow_search(rng: np.random.Generator) -> None:
    _, take, _ = make_take(rng, noise=0.3)
    take[rng.random((1200, 10)) < 0.1] = np.nan
    target = np.nanmedian(take, axis=0)
    motion, distance = [], []
    for onset in range(1200 - 50 + 1):
        window = take[onset : onset + 50]
        motion.append(np.sqrt(np.mean(np.nanvar(window, axis=0).sum(axis=1))))
        distance.append(np.sqrt(np.mean(((np.nanmean(window, axis=0) - target) ** 2).sum(axis=1))))
    still = np.flatnonzero(motion <= np.quantile(motion, 0.25))
    expected = still[np.argmin(np.array(distance)[still])]
    found = find_neutral(take, RATE)
    assert found.onset == expected
    np.testing.assert_allclose(found.positions, np.nanmedian(take[expected : expected + 50], axis=0))


def test_a_typical_pose_leads_out_of_a_held_expression(rng: np.random.Generator) -> None:
    truth, take, t = make_take(rng, noise=0.1)
    held = take[(t < 2.2) | ((t > 4) & (t < 5)) | ((t > 8.9) & (t < 10.8))]
    assert np.abs(find_neutral(held, RATE).positions - truth).max() > 3
    assert np.abs(find_neutral(held, RATE, typical=truth).positions - truth).max() < 0.5


def test_given_frame(rng: np.random.Generator) -> None:
    _, take, _ = make_take(rng)
    found = find_neutral(take, RATE, frame=123)
    assert (found.onset, found.offset) == (123, 124)
    np.testing.assert_array_equal(found.positions, take[123])


def test_a_marker_hidden_at_rest_comes_from_similar_frames(rng: np.random.Generator) -> None:
    truth, take, _ = make_take(rng, noise=0.1)
    take[200:890, 4] = np.nan  # hidden in the long rest, visible when the face passes neutral at 11 s
    take[:, 7] = np.nan
    found = find_neutral(take, RATE)
    assert found.filled.tolist() == [m == 4 for m in range(10)]
    assert found.missing.tolist() == [m == 7 for m in range(10)]
    assert np.abs(found.positions[4] - truth[4]).max() < 1.0
    assert np.abs(np.nanmedian(take[:, 4], axis=0) - truth[4]).max() > 1.0, "the plain median would not do"


def test_windows_that_are_mostly_gaps_are_not_taken(rng: np.random.Generator) -> None:
    truth, take, _ = make_take(rng, noise=0.1)
    take[270:830, 1:] = np.nan
    take[270:830, 0] = truth[0]  # one marker, perfectly still, is no face at rest
    found = find_neutral(take, RATE)
    assert found.offset <= 270 + 26 or found.onset >= 830 - 26


def test_short_take_is_one_window(rng: np.random.Generator) -> None:
    _, take, _ = make_take(rng)
    found = find_neutral(take[400:420], RATE)
    assert (found.onset, found.offset) == (0, 20)


def test_order_of_time_and_rigid_shift_do_not_matter(rng: np.random.Generator) -> None:
    _, take, _ = make_take(rng, noise=0.2)
    first = find_neutral(take, RATE)
    second = find_neutral(take[::-1] + 500, RATE)
    assert (second.onset, second.offset) == (1200 - first.offset, 1200 - first.onset)
    np.testing.assert_allclose(second.positions, first.positions + 500)


def test_bad_input(rng: np.random.Generator) -> None:
    _, take, _ = make_take(rng)
    with pytest.raises(InputError, match="all 1200 frames are gaps"):
        find_neutral(np.full_like(take, np.nan), RATE)
    with pytest.raises(InputError, match="from 0 to 1199, but got 1200"):
        find_neutral(take, RATE, frame=1200)
    take[5] = np.nan
    with pytest.raises(InputError, match="frame 5 is a gap"):
        find_neutral(take, RATE, frame=5)
    with pytest.raises(InputError, match="typical"):
        find_neutral(take, RATE, typical=np.full((10, 3), np.nan))


def test_median_pose_of_a_hidden_marker_is_missing(rng: np.random.Generator) -> None:
    take = rng.normal(size=(20, 3, 3))
    take[:, 1] = np.nan
    found = median_pose(take)
    np.testing.assert_allclose(found[[0, 2]], np.median(take[:, [0, 2]], axis=0))
    assert np.isnan(found[1]).all()
