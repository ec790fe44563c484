import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.errors import InputError, RigError
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.animation import (
    SPARSE_BELOW,
    SPARSE_FRAMES,
    Animation,
    ResampledWeights,
    check_weights,
    find_missing,
    weight_blocks,
)
from mimique.synthesis.avatar import build_avatar
from mimique.synthesis.rig_parts import split_parts


def make_rig(rng, density=0.3):
    deltas = rng.normal(size=(4, 50, 3)) * (rng.random((4, 50, 1)) < density)
    return Rig(rng.normal(size=(50, 3)) * 50, rng.integers(0, 50, (30, 3)), deltas, list("abcd"))


@pytest.mark.parametrize("dense", [True, False, None])
def test_blocks_are_the_poses_of_the_rig(rng, dense):
    rig = make_rig(rng)
    weights = rng.normal(size=(23, 4))
    found = list(Animation(rig, dense=dense).blocks(weights, frames=5))
    assert [first for first, _ in found] == [0, 5, 10, 15, 20]
    meshes = np.concatenate([block for _, block in found])
    assert meshes.dtype == np.float32
    by_hand = np.array([rig.neutral + sum(w * d for w, d in zip(row, rig.deltas, strict=True)) for row in weights])
    np.testing.assert_allclose(meshes, by_hand, atol=1e-4)


def test_a_frame_without_weights_has_no_mesh(rng):
    rig = make_rig(rng)
    weights = np.zeros((3, 4))
    weights[1, 2] = np.nan
    meshes = Animation(rig).positions(weights)
    assert np.isnan(meshes[1]).all()
    np.testing.assert_allclose(meshes[[0, 2]], np.stack([rig.neutral] * 2), rtol=1e-6)
    with pytest.raises(RigError, match="expected 4 columns"):
        Animation(rig).positions(np.zeros((3, 5)))


def test_ten_minutes_need_no_more_memory_than_a_block(rng):
    rig = make_rig(rng)

    class Long:
        shape = (120_000, 4)

        def __len__(self):
            return 120_000

        def __getitem__(self, part):
            return np.zeros((len(range(*part.indices(120_000))), 4))

    largest = max(block.nbytes for _, block in Animation(rig).blocks(Long()))
    assert largest <= 4 * 2**20 < 120_000 * rig.n_vertices * 12 / 10


def test_real_rigs_by_either_product(shared_data):
    ict = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    makehuman = read_rig(shared_data / "makehuman" / "rig.npz", unit="dm")
    for rig, few in ((ict, False), (makehuman, True), (build_avatar(), True)):
        animation = Animation(rig)
        assert (animation.density <= SPARSE_BELOW) == few
        weights = np.random.default_rng(3).random((SPARSE_FRAMES + 2, rig.n_shapes))
        for n_frames in (1, SPARSE_FRAMES, SPARSE_FRAMES + 2):
            np.testing.assert_allclose(animation.positions(weights[:n_frames]), rig.pose(weights[:n_frames]), atol=1e-3)


def test_missing_frames_as_intervals():
    weights = np.zeros((10, 3))
    weights[:, 1] = np.nan
    weights[[2, 3, 9], 0] = np.nan
    lost, never = find_missing(weights)
    assert lost.tolist() == [[2, 4], [9, 10]] and never.tolist() == [False, True, False]
    lost, never = find_missing(np.full((5, 2), np.nan))
    assert lost.tolist() == [[0, 5]] and never.all()
    assert find_missing(np.zeros((5, 2)))[0].shape == (0, 2)


@given(
    n_frames=st.integers(1, 40),
    rate=st.sampled_from([24.0, 25.0, 30.0, 60.0, 59.94, 200.0]),
    new_rate=st.sampled_from([12.0, 24.0, 25.0, 60.0, 120.0, 200.0]),
    seed=st.integers(0, 1000),
)
def test_other_rates_lie_on_the_lines_between_frames(n_frames, rate, new_rate, seed):
    weights = np.random.default_rng(seed).random((n_frames, 2))
    resampled = ResampledWeights(weights, rate, new_rate)
    old, new = np.arange(n_frames) / rate, np.arange(len(resampled)) / new_rate
    assert new[-1] <= old[-1] + 1e-9 < new[-1] + 1 / new_rate + 2e-9
    expected = np.stack([np.interp(new, old, column) for column in weights.T], axis=1)
    np.testing.assert_allclose(np.concatenate([b for _, b in weight_blocks(resampled, 7)]), expected, atol=1e-6)


def test_a_missing_frame_spreads_only_to_what_needs_it():
    weights = np.arange(6.0)[:, None].copy()
    weights[3] = np.nan
    np.testing.assert_array_equal(ResampledWeights(weights, 10.0, 5.0)[0:9], [[0], [2], [4]])
    halves = ResampledWeights(weights, 10.0, 20.0)[0:99][:, 0]
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(halves)), [5, 6, 7])
    with pytest.raises(InputError, match="rate: expected a positive"):
        ResampledWeights(weights, 10.0, 0.0)


def test_weights_are_checked_with_their_frame(rng):
    rig = make_rig(rng)
    weights = np.zeros((5000, 4))
    check_weights(rig, weights, 10.0)
    weights[4500, 2] = -np.inf
    with pytest.raises(InputError, match=r"frame 4500, shape 'c'"):
        check_weights(rig, weights, 10.0)


def test_parts_together_are_the_rig():
    deltas = np.zeros((3, 7, 3))
    deltas[0, 0], deltas[1, 5] = 1, 1
    rig = Rig(np.eye(7)[:, :3], [[0, 1, 2], [3, 4, 5], [2, 4, 5]], deltas, list("abc"), [("x", 1), ("y", 2), ("z", 0)])
    first, second = split_parts(rig)
    assert (first.name, first.vertices.tolist(), first.shapes.tolist()) == ("x", [0, 1, 2, 6], [0, 2])
    assert (second.name, second.vertices.tolist(), second.shapes.tolist()) == ("y", [2, 3, 4, 5], [1])
    for part, triangles in ((first, rig.triangles[:1]), (second, rig.triangles[1:])):
        np.testing.assert_array_equal(part.vertices[part.triangles], triangles)
    again = Rig.from_dataset(rig.to_dataset())
    assert again.parts == rig.parts == (("x", 1), ("y", 2), ("z", 0))
    plain = Rig(rig.neutral, rig.triangles, deltas, list("abc"))
    assert plain.parts == () and "parts" not in plain.to_dataset().attrs
    assert [part.name for part in split_parts(plain)] == ["face"]
    for parts in ([("x", 1)], [("x", 4), ("y", -1)]):
        with pytest.raises(RigError, match="expected parts of 3 triangles together"):
            Rig(rig.neutral, rig.triangles, deltas, list("abc"), parts)
