import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.features import fit_head_reference, stabilise
from scipy.spatial.transform import Rotation

HEAD = [0, 1, 2, 3, 4, 5]


def make_take(rng: np.random.Generator, n_frames: int = 300):
    """Six rigid head markers, eight that move, and a head that turns up to 40° and shifts by decimetres."""
    t = np.linspace(0, 6, n_frames)
    face = np.empty((n_frames, 14, 3))
    face[:, :6] = rng.normal(size=(6, 3)) * 80
    face[:, 6:] = rng.normal(size=(8, 3)) * 40 + 6 * np.sin(t[:, None, None] + rng.normal(size=(8, 3)))
    rotation = Rotation.from_rotvec(0.7 * np.column_stack([np.sin(t), np.cos(0.7 * t), np.sin(0.3 * t)])).as_matrix()
    translation = 200 * np.column_stack([np.sin(t), np.cos(t), 0.3 * t]) + 1000
    return face, rotation, translation, np.einsum("fij,fpj->fpi", rotation, face) + translation[:, None]


def distances(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, :, None] - points[:, None], axis=-1)


def test_given_reference_returns_face_and_pose(rng: np.random.Generator) -> None:
    face, rotation, translation, recorded = make_take(rng)
    found = stabilise(recorded, HEAD, reference=face[0, HEAD])
    np.testing.assert_allclose(found.positions, face, atol=1e-9)
    np.testing.assert_allclose(found.rotation, rotation, atol=1e-9)
    np.testing.assert_allclose(found.translation, translation, atol=1e-9)
    np.testing.assert_allclose(found.rmse, 0, atol=1e-9)
    assert found.usable.all()
    assert found.n_unusable == 0


def test_each_frame_agrees_with_scipy(rng: np.random.Generator) -> None:
    """Independent solver: scipy's align_vectors, with noise on the head markers."""
    _, _, _, recorded = make_take(rng, 20)
    recorded += rng.normal(size=recorded.shape)
    reference = fit_head_reference(recorded[:, HEAD])
    found = stabilise(recorded, HEAD, reference=reference)
    for frame in range(20):
        seen = recorded[frame, HEAD]
        turn, rssd = Rotation.align_vectors(seen - seen.mean(axis=0), reference - reference.mean(axis=0))
        np.testing.assert_allclose(found.rotation[frame], turn.as_matrix(), atol=1e-6)
        assert found.rmse[frame] == pytest.approx(rssd / np.sqrt(6))


def test_own_reference_leaves_the_face_up_to_one_pose(rng: np.random.Generator) -> None:
    face, _, _, recorded = make_take(rng)
    found = stabilise(recorded, HEAD)
    np.testing.assert_allclose(found.positions[:, HEAD], np.tile(found.reference, (300, 1, 1)), atol=1e-6)
    np.testing.assert_allclose(distances(found.positions), distances(face), atol=1e-6)
    # One rigid motion leads from the planted face to the stabilised one, the same in all frames.
    turn, _ = Rotation.align_vectors(
        found.positions[0] - found.positions[0].mean(axis=0), face[0] - face[0].mean(axis=0)
    )
    moved = (face - face[0].mean(axis=0)) @ turn.as_matrix().T + found.positions[0].mean(axis=0)
    np.testing.assert_allclose(found.positions, moved, atol=1e-6)


def test_reference_is_the_truth_within_the_noise_despite_gaps_and_a_slipped_marker(rng: np.random.Generator) -> None:
    face, _, _, recorded = make_take(rng, 2500)
    recorded += 0.15 * rng.normal(size=recorded.shape)
    for marker in HEAD:
        recorded[rng.random(2500) < 0.3, marker] = np.nan
    recorded[:, 4][100:300] = np.nan
    recorded[1000:1300, 2] += 25  # a marker that hangs off for 1.5 s
    reference = fit_head_reference(recorded[:, HEAD])
    np.testing.assert_allclose(distances(reference[None]), distances(face[:1, HEAD]), atol=0.1)


def test_reference_of_markers_that_no_frame_shows_together(rng: np.random.Generator) -> None:
    face, _, _, recorded = make_take(rng)
    recorded[::2, 0] = np.nan
    recorded[1::2, 5] = np.nan
    reference = fit_head_reference(recorded[:, HEAD])
    np.testing.assert_allclose(distances(reference[None]), distances(face[:1, HEAD]), atol=1e-5)


def test_hidden_markers_change_nothing_as_long_as_three_remain(rng: np.random.Generator) -> None:
    face, _, _, recorded = make_take(rng)
    recorded[50, [0, 1, 2]] = np.nan
    recorded[60, [0, 1, 2, 3]] = np.nan
    recorded[70, 9] = np.nan
    found = stabilise(recorded, HEAD, reference=face[0, HEAD])
    assert np.flatnonzero(~found.usable).tolist() == [60]
    assert found.n_unusable == 1
    assert np.isnan(found.positions[60]).all()
    assert np.isnan(found.rmse[60])
    expected = np.where(np.isnan(recorded), np.nan, face)
    expected[60] = np.nan
    np.testing.assert_allclose(found.positions, expected, atol=1e-9)


def test_three_visible_on_one_line_are_not_enough(rng: np.random.Generator) -> None:
    face, rotation, translation, _ = make_take(rng, 30)
    face[:, 2] = 0.3 * face[:, 0] + 0.7 * face[:, 1]
    recorded = np.einsum("fij,fpj->fpi", rotation, face) + translation[:, None]
    recorded[10, 3:6] = np.nan
    found = stabilise(recorded, HEAD)
    assert np.flatnonzero(~found.usable).tolist() == [10]


def test_no_reflection_even_where_it_fits_better(rng: np.random.Generator) -> None:
    face, _, _, recorded = make_take(rng, 10)
    found = stabilise(recorded, HEAD, reference=face[0, HEAD] * [-1, 1, 1])
    np.testing.assert_allclose(np.linalg.det(found.rotation), 1, atol=1e-9)
    assert (found.rmse > 10).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.01, 100))
def test_moving_and_scaling_the_scene_moves_and_scales_the_result(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    _, _, _, recorded = make_take(rng, 40)
    recorded += rng.normal(size=recorded.shape)
    turn = Rotation.random(random_state=seed).as_matrix()
    first = stabilise(recorded, HEAD)
    second = stabilise(scale * (recorded @ turn.T + 37), HEAD)
    np.testing.assert_allclose(second.rmse, scale * first.rmse, rtol=1e-4)
    np.testing.assert_allclose(
        second.positions, scale * (first.positions @ turn.T + 37), atol=1e-3 * scale * np.ptp(recorded)
    )


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ([0, 1], "at least three head markers, but got 2"),
        ([0, 1, 1], "each head marker once"),
        ([0, 1, 14], "indices from 0 to 13"),
        ([0, 1, 2, 3], "markers 2 and 3 coincide"),
        ([0, 1, 4], "not on one line"),
        ([0, 1, 6], "at least three visible"),
    ],
)
def test_bad_head_markers(rng: np.random.Generator, head: list, words: str) -> None:
    face, rotation, translation, _ = make_take(rng, 30)
    face[:, 3] = face[:, 2] + 0.1
    face[:, 4] = 0.4 * face[:, 0] + 0.6 * face[:, 1]
    recorded = np.einsum("fij,fpj->fpi", rotation, face) + translation[:, None]
    recorded[:, 6] = np.nan
    with pytest.raises(InputError, match=words):
        stabilise(recorded, head)


def test_real_take_leaves_rigid_distances_alone(shared_data) -> None:
    """On real markers, whatever three of them are called the head, mutual distances in a frame stay as recorded."""
    with np.load(shared_data / "facial_markers" / "animface_eyebrows.npz", allow_pickle=False) as data:
        recorded = next(np.asarray(data[k], float) for k in data.files if data[k].ndim == 3)
    found = stabilise(recorded, [0, 10, 20, 30])
    usable = found.usable
    np.testing.assert_allclose(distances(found.positions[usable]), distances(recorded[usable]), atol=1e-6)
