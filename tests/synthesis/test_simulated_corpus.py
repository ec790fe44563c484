"""Whole simulated recordings: markers, tiers and truth together."""

from itertools import islice

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.synthesis.avatar import build_avatar, default_markers
from mimique.synthesis.simulation import simulate_corpus
from mimique.synthesis.simulation.parameters import load_parameters, random_stream
from mimique.synthesis.simulation.signers import create_signer


@pytest.fixture(scope="module")
def recordings():
    return list(simulate_corpus(2, "medium", 60.0, seed=4))


@pytest.fixture(scope="module")
def rig():
    return build_avatar()


def test_recordings_say_what_they_are(recordings):
    assert len({r.name for r in recordings}) == len(recordings)
    for r in recordings:
        assert r.name.startswith(f"{r.signer}_{r.protocol}_{r.affect}")
        assert r.rate == 200
        assert len(r.marker_names) == 46 and len(set(r.marker_names)) == 46
        assert len(r.head_markers) == 6 and set(r.head_markers) < set(r.marker_names)
        assert r.positions.shape == (len(r.truth.weights), 46, 3)
        assert r.attributes["simulated"] == "yes"
        assert r.instruction


def test_tiers_are_half_open_inside_the_take_and_do_not_overlap(recordings):
    for r in recordings:
        n_frames = len(r.positions)
        assert {"affect@A1", "affect@A2", "instruction"} <= set(r.tiers)
        assert ("intensity_asked" in r.tiers) == (r.protocol == "IGE")
        for name, tier in [*r.tiers.items(), *r.truth.tiers.items()]:
            onset, offset = tier["onset"].to_numpy(), tier["offset"].to_numpy()
            assert onset.dtype == np.int64 and (onset >= 0).all() and (offset <= n_frames).all(), (r.name, name)
            assert (offset > onset).all() and (onset[1:] >= offset[:-1]).all(), (r.name, name)
        assert r.tiers["affect@A2"].attrs == {"author": "A2", "participant": r.signer}
        truth = r.truth.tiers["affect"]
        assert truth["onset"].iloc[0] == 0 and truth["offset"].iloc[-1] == n_frames


def per_frame(tier, n_frames):
    labels = np.full(n_frames, "", dtype=object)
    for onset, offset, label in zip(tier["onset"], tier["offset"], tier["label"], strict=True):
        labels[onset:offset] = label
    return labels


def test_annotators_agree_mostly_with_the_truth_and_never_fully(recordings):
    for author in ("affect@A1", "affect@A2"):
        agreement = np.concatenate(
            [
                per_frame(r.tiers[author], len(r.positions)) == per_frame(r.truth.tiers["affect"], len(r.positions))
                for r in recordings
            ]
        ).mean()
        assert 0.70 < agreement < 0.98


def test_weights_follow_the_true_tiers(recordings):
    for r in recordings:
        assert r.truth.weights.min() >= 0.0 and r.truth.weights.max() <= 1.0
        if r.protocol != "IE":
            continue
        effort = r.truth.weights[:, [i for i, s in enumerate(r.truth.face.shapes) if "eye" not in s]].sum(axis=1)
        tier = r.truth.tiers["affect"]
        held = [effort[a:b].mean() for a, b in zip(tier["onset"], tier["offset"], strict=True)]
        labels = tier["label"].tolist()
        expressive = [x for x, label in zip(held, labels, strict=True) if label == r.affect]
        neutral = [x for x, label in zip(held, labels, strict=True) if label == "neutral"]
        assert min(expressive) > 2 * max(neutral)


def test_the_neutral_frame_is_whole_and_neutral(recordings):
    for r in recordings:
        assert np.isfinite(r.positions[r.neutral_frame]).all()
        moved = np.linalg.norm(r.truth.markers[r.neutral_frame] - r.truth.markers[r.neutral_frame].mean(axis=0), axis=1)
        assert moved.max() < 200.0
        weights = r.truth.weights
        assert weights[r.neutral_frame].sum() <= np.quantile(weights.sum(axis=1), 0.2)


def test_recorded_markers_are_the_moved_truth_with_noise_and_gaps(recordings):
    deviation, missing = [], []
    for r in recordings:
        clean = r.truth.head.move(r.truth.markers)
        deviation.append(np.nanstd(r.positions - clean, axis=(0, 2)))
        missing.append(np.isnan(r.positions[..., 0]).mean())
        assert (np.isnan(r.positions).any(axis=2) == np.isnan(r.positions).all(axis=2)).all()
        assert np.isfinite(r.positions[[0, -1]]).all()
    assert np.min(deviation) > 0.09 and np.max(deviation) < 0.22
    assert 0.0 < np.mean(missing) < 0.02


def test_signers_have_different_faces_and_ways(recordings):
    first = next(r for r in recordings if r.signer == "s1")
    second = next(r for r in recordings if r.signer == "s2")
    a, b = (r.truth.face.neutral[r.truth.marker_vertices] for r in (first, second))
    # What is left after the best similarity: other proportions, not only another size.
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    u, s, vt = np.linalg.svd(a.T @ b)
    left = b - (s.sum() / np.sum(a**2)) * a @ (u @ vt)
    assert np.sqrt(np.mean(np.sum(left**2, axis=1))) > 1.0
    assert first.truth.face.triangles.shape == second.truth.face.triangles.shape
    holds = []
    for signer in ("s1", "s2"):
        r = next(r for r in recordings if r.signer == signer and r.protocol == "IE" and r.affect == "anger")
        holds.append(r.truth.weights[np.argmax(r.truth.activation.sum(axis=1))])
    assert np.linalg.norm(holds[0] - holds[1]) > 0.2 * np.linalg.norm(holds[0])


def test_no_inverse_crime(recordings, rig):
    """Even unbounded, noise-free and perfectly stabilised, the rig's shapes leave a residual far above the noise."""
    vertices = np.array([default_markers()[name] for name in recordings[0].marker_names])
    residuals, moved = [], []
    for r in recordings:
        face = np.array([name not in r.head_markers for name in r.marker_names])
        displacement = (r.truth.markers - r.truth.markers[r.neutral_frame])[::20][:, face].reshape(-1, 3 * face.sum())
        shapes = rig.deltas[:, vertices[face]].reshape(rig.n_shapes, -1)
        left = displacement - displacement @ np.linalg.pinv(shapes) @ shapes
        residuals.append(np.sqrt(np.mean(np.sum(left.reshape(len(left), -1, 3) ** 2, axis=2))))
        moved.append(np.sqrt(np.mean(np.sum(displacement.reshape(len(left), -1, 3) ** 2, axis=2))))
    noise = 0.15 * np.sqrt(3)
    assert np.mean(residuals) > 1.5 * noise
    assert 0.15 < np.mean(residuals) / np.mean(moved) < 0.6  # … and still the shapes explain most of it


def test_a_seed_fixes_every_number_and_another_changes_them():
    for a, b in zip(
        islice(simulate_corpus(1, "hard", 60.0, seed=7), 2),
        islice(simulate_corpus(1, "hard", 60.0, seed=7), 2),
        strict=True,
    ):
        np.testing.assert_array_equal(a.positions, b.positions)
        np.testing.assert_array_equal(a.truth.weights, b.truth.weights)
        assert all(a.tiers[name].equals(b.tiers[name]) for name in a.tiers)
    other = next(simulate_corpus(1, "hard", 60.0, seed=8))
    assert other.positions.shape != a.positions.shape or not np.array_equal(other.positions, a.positions)


def test_a_signer_does_not_depend_on_the_others():
    parameters = load_parameters()
    alone = next(simulate_corpus(1, "medium", seed=7))
    among = next(simulate_corpus(3, "medium", seed=7))
    np.testing.assert_array_equal(alone.positions, among.positions)
    assert create_signer(2, parameters, seed=7).code == "s3"
    draws = {float(random_stream(7, stream, n).random()) for stream in ("motion", "camera") for n in range(3)}
    assert len(draws) == 6


def test_wrong_arguments_get_one_line():
    with pytest.raises(InputError, match="signers: expected at least 1, but got 0"):
        next(simulate_corpus(0))
    with pytest.raises(InputError, match="expected one of easy, medium, hard"):
        next(simulate_corpus(1, "brutal"))
    with pytest.raises(InputError, match="seed: expected a whole number from 0, but got -1"):
        next(simulate_corpus(1, seed=-1))
