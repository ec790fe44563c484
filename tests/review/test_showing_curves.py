"""Curves computed in blocks, stretches of residual, and the files in which what was computed is kept."""

import itertools
import threading
import time

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import CorpusError
from mimique.features import motion_energy
from mimique.workbench.review.showing.curves import ENERGIES, compute_energies
from mimique.workbench.review.showing.made_files import MadeFiles, make_key
from mimique.workbench.review.showing.residual import LEAST_RESIDUAL, LONGEST_PAUSE, find_stretches, find_threshold
from mimique.workbench.review.showing.shown_weights import ShownWeights
from mimique.workbench.review.showing.strongest_shapes import find_strongest, measure_spread


def make_shown(values, rate):
    stored = xr.Dataset({"weights": (("time", "shape"), values)})
    shapes = tuple(f"s{n}" for n in range(values.shape[1]))
    return ShownWeights(
        take="t", solve="s", rig="r", shapes=shapes, rate=rate, n_frames=len(values), key="0", stored=stored,
        kept=np.arange(values.shape[1]), mapping=None,
    )  # fmt: skip


@settings(max_examples=25)
@given(
    seed=st.integers(0, 2**32 - 1),
    rate=st.sampled_from([24.0, 60.0, 200.0]),
    n_frames=st.integers(1, 400),
    size=st.integers(1, 150),
    gaps=st.lists(st.tuples(st.integers(0, 399), st.integers(1, 60)), max_size=5),
)
def test_blocks_give_what_the_whole_take_gives(seed, rate, n_frames, size, gaps):
    values = np.random.default_rng(seed).normal(size=(n_frames, 3)).cumsum(axis=0)
    for onset, length in gaps:
        values[onset : onset + length] = np.nan
    whole = motion_energy(values, rate)
    found = compute_energies(make_shown(values, rate), size=size)
    for row, name in zip(found, ENERGIES, strict=True):
        np.testing.assert_allclose(row, getattr(whole, name), rtol=1e-5, atol=1e-4)


def test_the_spread_is_the_standard_deviation_of_known_frames(tmp_path, rng):
    values = rng.normal(size=(40_000, 4)) * (0.1, 0.0, 3.0, 1.0) + (5, 1, 0, 0)
    values[100:9000] = np.nan
    shown = make_shown(values, 200.0)
    np.testing.assert_allclose(measure_spread(shown), np.nanstd(values, axis=0), rtol=1e-5, atol=1e-6)
    assert find_strongest(MadeFiles(tmp_path), shown) == ["s2", "s3", "s0"]
    nothing = make_shown(np.full((10, 2), np.nan), 200.0)
    assert find_strongest(MadeFiles(tmp_path / "other"), nothing) == []


def test_a_planted_slip_is_marked_and_a_clean_take_is_not(rng):
    residual = rng.gamma(8.0, 0.05, 4000)
    residual[50:60] = np.nan
    threshold = find_threshold(residual)
    assert find_stretches(residual, threshold, 200.0) == []
    residual[1000:1030] += 5
    residual[1035:1040] += 5  # 25 ms later
    residual[1060:1061] += 5  # 100 ms later
    assert find_stretches(residual, find_threshold(residual), 200.0) == [(1000, 1040), (1060, 1061)]


def test_what_nobody_sees_is_not_marked():
    residual = np.full(500, 0.02)
    residual[100:110] = 0.5  # 25 times the rest, and half a millimetre
    assert find_threshold(residual) == LEAST_RESIDUAL
    assert find_stretches(residual, LEAST_RESIDUAL, 200.0) == []


def test_a_take_that_is_bad_throughout_marks_what_is_worse(rng):
    residual = rng.normal(8.0, 0.5, 2000)
    residual[500:600] = 20.0
    threshold = find_threshold(residual)
    assert 9.0 < threshold < 13.0 and find_stretches(residual, threshold, 100.0) == [(500, 600)]


@pytest.mark.parametrize("residual", [[], [np.nan] * 5])
def test_an_unknown_residual_marks_nothing(residual):
    assert find_threshold(residual) is None and find_stretches(residual, None, 200.0) == []


@given(st.lists(st.booleans(), max_size=60), st.sampled_from([20.0, 100.0, 200.0]))
def test_joined_stretches_by_a_slow_second_way(flags, rate):
    residual = np.where(flags, 2.0, 0.0)
    covered = list(flags)
    marked = [frame for frame, flag in enumerate(flags) if flag]
    for first, second in itertools.pairwise(marked):
        if (second - first - 1) / rate < LONGEST_PAUSE - 1e-12:
            covered[first:second] = [True] * (second - first)
    found = find_stretches(residual, 1.0, rate)
    again = [False] * len(flags)
    for onset, offset in found:
        again[onset:offset] = [True] * (offset - onset)
    assert again == covered
    assert all(a[1] < b[0] for a, b in itertools.pairwise(found))


def test_an_array_is_computed_once_and_again_when_cut_off(tmp_path):
    files, made = MadeFiles(tmp_path / "deep" / "folder"), []

    def make():
        made.append(1)
        time.sleep(0.05)
        return np.arange(1000, dtype=np.float32)

    threads = [threading.Thread(target=files.find_array, args=("key", make)) for _ in range(5)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(made) == 1
    path = next(files.folder.iterdir())
    path.write_bytes(path.read_bytes()[:300])
    np.testing.assert_array_equal(files.find_array("key", make), np.arange(1000))
    assert len(made) == 2
    path.write_bytes(b"")
    files.find_array("key", make)
    assert len(made) == 3 and [p.name for p in files.folder.iterdir()] == ["key.npy"]


def test_a_file_that_fails_leaves_nothing_behind(tmp_path):
    files = MadeFiles(tmp_path)

    def fail(path):
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    with pytest.raises(CorpusError, match="No space left on device"):
        files.find("key", ".glb", fail)
    assert list(tmp_path.iterdir()) == []
    assert files.find("key", ".glb", lambda path: path.write_bytes(b"all")).read_bytes() == b"all"


def test_keys_differ_with_what_they_are_made_of():
    assert make_key(a=1, b="x") == make_key(b="x", a=1) != make_key(a=2, b="x")
