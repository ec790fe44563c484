"""Curves, skin, head and camera of the simulated signers."""

from itertools import pairwise

import numpy as np
import pytest
from mimique.synthesis.rig import Rig
from mimique.synthesis.simulation import load_parameters
from mimique.synthesis.simulation.camera import add_noise, lose_markers
from mimique.synthesis.simulation.confounders import Confounders, add_confounders, signed_stretches
from mimique.synthesis.simulation.head_motion import move_head
from mimique.synthesis.simulation.noise import plateau, rise, saturate, smooth_noise
from mimique.synthesis.simulation.performance import perform_steps
from mimique.synthesis.simulation.poses import draw_style, pose_vector, shape_regions
from mimique.synthesis.simulation.protocols import Instance, Script, Step
from mimique.synthesis.simulation.skin import Skin, smooth_fields, vertex_normals


@pytest.fixture(scope="module")
def parameters():
    return load_parameters()


@pytest.fixture(scope="module")
def shapes():
    from mimique.synthesis.avatar import SHAPES

    return SHAPES


@pytest.fixture
def style(parameters, shapes, rng):
    return draw_style(parameters, shapes, rng=rng)


def test_smooth_noise_has_unit_deviation_and_the_stated_time(rng):
    curves = smooth_noise(100_000, 200.0, 0.5, 4, rng=rng)
    np.testing.assert_allclose(curves.mean(axis=0), 0.0, atol=0.1)
    np.testing.assert_allclose(curves.std(axis=0), 0.9, atol=0.15)

    def correlation(lag):
        return np.mean(curves[lag:] * curves[:-lag]) / np.mean(curves**2)

    assert correlation(10) > 0.95  # a tenth of the time
    assert abs(correlation(200)) < 0.15  # twice the time


def test_rise_goes_from_0_to_1_with_level_ends():
    u = np.linspace(-0.5, 1.5, 2001)
    curve = rise(u, 1.7, 2.6)
    assert curve[0] == 0.0 and curve[-1] == 1.0
    assert (np.diff(curve) >= 0).all()
    slope = np.gradient(curve, u)
    assert slope[np.searchsorted(u, 0.001)] < 0.1 and slope[np.searchsorted(u, 0.999)] < 0.1
    assert rise(np.array([0.5]), 2.0, 3.0) == pytest.approx(1 - 0.75**3)


def test_plateau_and_saturation():
    curve = plateau(100, 20.0, 80.0, 10.0)
    assert (curve[:21] == 0).all() and (curve[30:71] == 1).all() and (curve[80:] == 0).all()
    assert curve[25] == pytest.approx(0.5)
    x = np.linspace(-1.0, 3.0, 1000)
    bent = saturate(x)
    np.testing.assert_array_equal(bent[(x >= 0) & (x <= 0.75)], x[(x >= 0) & (x <= 0.75)])
    assert bent.min() == 0.0 and bent.max() <= 1.0
    assert (np.diff(bent) >= 0).all()


def test_pose_vector_names_both_sides():
    shapes = ["jawOpen", "mouthSmileLeft", "mouthSmileRight"]
    np.testing.assert_array_equal(pose_vector({"mouthSmile": 0.5, "jawOpen": 0.2}, shapes), [0.2, 0.5, 0.5])
    np.testing.assert_array_equal(pose_vector({"mouthSmileLeft": 0.5}, shapes), [0.0, 0.5, 0.0])
    assert shape_regions(["browDownLeft", "noseSneerLeft", "jawOpen"], ["brows", "cheeks", "jaw"]).tolist() == [0, 1, 2]


def test_performance_holds_between_transitions_and_is_neutral_outside(parameters, style, shapes, rng):
    bounds = np.array([0, 400, 500, 900, 1000, 1600])
    regions = shape_regions(shapes, parameters.regions)
    steps = [Instance("neutral"), Instance("joy", 1.0, "surprise", 0.0), Instance("neutral")]
    weights, activation = perform_steps(steps, bounds, "IE", style, regions, parameters, "easy", rng=rng)
    smile = weights[:, shapes.index("mouthSmileLeft")]
    assert smile[:350].max() < 0.1
    assert smile[550:880].min() > 0.8 * smile.max()
    assert smile[400:500].max() - smile[400:500].min() > 0.7 * smile.max()
    assert smile[1300:].max() < 0.1
    joy = parameters.affects.index("joy")
    assert activation[600, joy] > 0.8
    assert (np.delete(activation, joy, axis=1) == 0).all()


def test_a_blend_moves_towards_the_neighbour(parameters, style, shapes, rng):
    bounds = np.array([0, 20, 60, 200, 240, 300])
    regions = shape_regions(shapes, parameters.regions)

    def held(blend):
        steps = [Instance("neutral"), Instance("anger", 1.0, "disgust", blend), Instance("neutral")]
        seed = np.random.default_rng(3)
        return perform_steps(steps, bounds, "IE", style, regions, parameters, "easy", rng=seed)[0][100:180].mean(axis=0)

    disgust = style.poses[parameters.affects.index("disgust"), 0]
    distance = [np.linalg.norm(held(blend) - disgust) for blend in (0.0, 0.5, 1.0)]
    assert distance[0] > distance[1] > distance[2]


def test_confounders_belong_to_sentences(parameters, style, shapes, rng):
    steps = (Step("neutral"), Step("joy"), Step("neutral"))
    bounds = np.array([0, 600, 660, 1400, 1460, 2400])
    isolated = Script("IE_joy", "IE", "joy", steps, "")
    sentence = Script("EU_joy_1", "EU", "joy", steps, "", ((0, 2),), "polar", 1)
    plain = add_confounders(isolated, bounds, style, shapes, parameters, "medium", rng=rng)
    assert {kind for *_, kind in plain.events} <= {"blink", "gaze"}
    assert plain.mouth_busy.max() == 0.0
    signed = add_confounders(sentence, bounds, style, shapes, parameters, "medium", rng=rng)
    assert {"mouthing", "grammar", "cheeks"} <= {kind for *_, kind in signed.events}
    (onset, offset) = signed_stretches(sentence, bounds)[0]
    assert 0 < onset < 600 and 1460 < offset < 2400
    mouth = [i for i, s in enumerate(shapes) if s.startswith(("mouth", "jaw", "cheekPuff"))]
    assert signed.weights[: onset - 40, mouth].max() == 0.0
    assert signed.weights[onset:offset, mouth].max() > 0.2
    assert signed.weights[:, shapes.index("browOuterUpLeft")].max() > 0.3  # a polar question
    for kind in ("blink", "gaze", "mouthing", "grammar", "cheeks"):
        times = [(a, b) for a, b, _, k in signed.events if k == kind]
        assert all(a < b for a, b in times) and all(x[1] <= y[0] for x, y in pairwise(times))


def test_skin_is_the_sum_of_shapes_pairs_and_slides_late_by_the_lag():
    rng = np.random.default_rng(5)
    skin = Skin(
        neutral=rng.normal(size=(3, 3)),
        deltas=rng.normal(size=(4, 3, 3)),
        pairs=np.array([[0, 2], [1, 1]]),
        correctives=rng.normal(size=(2, 3, 3)),
        drive=rng.normal(size=(2, 4)),
        slides=rng.normal(size=(2, 3, 3)),
        lag=np.array([0.01, 0.02, 0.04]),
        drift=0.0,
    )
    weights = np.vstack([np.zeros(4), np.tile(rng.uniform(size=4), (400, 1))])
    moved = skin.move_markers(weights, 200.0, rng=rng)
    w = weights[-1]
    goal = skin.neutral.copy()
    for i in range(4):
        goal += w[i] * skin.deltas[i]
    goal += w[0] * w[2] * skin.correctives[0] + w[1] ** 2 * skin.correctives[1]
    for k in range(2):
        goal += np.tanh(np.sum(skin.drive[k] * w**2)) * skin.slides[k]
    np.testing.assert_allclose(moved[0], skin.neutral, atol=1e-12)
    np.testing.assert_allclose(moved[-1], goal, atol=1e-4)
    # A step answered with a first-order lag: 1 − exp(−t / τ).
    for marker, lag in enumerate(skin.lag):
        share = (moved[1:40, marker] - skin.neutral[marker]) / (goal - skin.neutral)[marker]
        np.testing.assert_allclose(share[:, 0], 1 - np.exp(-np.arange(1, 40) / 200.0 / lag), atol=1e-9)


def test_fields_are_smooth_and_normals_point_outwards(rng):
    points = rng.uniform(-60, 60, (50, 3))
    field = smooth_fields(points, points, 45.0, 2, rng=rng)
    np.testing.assert_allclose(field.std(axis=0), 1.0)
    near = smooth_fields(np.vstack([points[:1], points[:1] + 1.0]), points, 45.0, 200, rng=np.random.default_rng(1))
    assert np.abs(near[0] - near[1]).mean() < 0.1
    corners = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], dtype=float)
    tetrahedron = Rig(corners, [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], np.zeros((1, 4, 3)), ["none"])
    outwards = corners - corners.mean(axis=0)
    assert (np.sum(vertex_normals(tetrahedron) * outwards, axis=1) > 0).all()


def test_head_sways_by_degrees_and_centimetres_more_in_sentences(parameters, rng):
    n = 20_000
    still = Confounders(np.zeros((n, 1)), *(np.zeros(n) for _ in range(4)), events=[])
    turns = {}
    for protocol in ("IE", "EU"):
        motion = move_head(np.zeros((n, 6)), still, protocol, 20.0, parameters, rng=rng)
        np.testing.assert_allclose(
            motion.rotation @ motion.rotation.transpose(0, 2, 1), np.tile(np.eye(3), (n, 1, 1)), atol=1e-9
        )
        np.testing.assert_allclose(np.linalg.det(motion.rotation), 1.0)
        relative = motion.rotation[0].T @ motion.rotation
        turns[protocol] = np.degrees(np.arccos(np.clip((np.trace(relative, axis1=1, axis2=2) - 1) / 2, -1, 1)))
        assert 5.0 < np.ptp(motion.translation, axis=0).max() < 200.0
        up = motion.rotation @ [0.0, 1.0, 0.0]
        assert up[:, 2].min() > 0.8  # the room's z is up
        points = rng.normal(size=(n, 2, 3)) * 50
        np.testing.assert_allclose(
            np.linalg.norm(np.diff(motion.move(points), axis=1), axis=2),
            np.linalg.norm(np.diff(points, axis=1), axis=2),
        )
    assert 1.0 < turns["IE"].max() < 20.0
    assert turns["EU"].mean() > 1.5 * turns["IE"].mean()


def test_noise_is_between_a_tenth_and_a_fifth_of_a_millimetre(parameters, rng):
    noise = add_noise(np.zeros((20_000, 46, 3)), parameters, rng=rng)
    deviation = noise.std(axis=0)
    assert deviation.min() > 0.095 and deviation.max() < 0.205
    assert np.ptp(deviation.mean(axis=1)) > 0.05  # markers differ
    assert np.abs(np.mean(noise[1:] * noise[:-1])) < 1e-4  # white


def test_gaps_are_short_and_lids_and_lips_have_more(parameters, rng):
    kinds = ["head"] * 5 + ["face"] * 5 + ["lips"] * 5 + ["lids"] * 5
    neutral = rng.uniform(-60, 60, (20, 3))
    missing = lose_markers(neutral, kinds, 200 * 60 * 30, "IE", parameters, rng=rng)
    edges = np.diff(missing.astype(int), axis=0)
    counts = (edges == 1).sum(axis=0).reshape(4, 5).mean(axis=1) / 30.0
    expected = [parameters.camera["gaps_per_minute"][kind] for kind in ("head", "face", "lips", "lids")]
    np.testing.assert_allclose(counts, expected, rtol=0.35)
    assert not missing[0].any() and not missing[-1].any()
    lengths = (
        np.concatenate([np.flatnonzero(edges[:, m] == -1) - np.flatnonzero(edges[:, m] == 1) for m in range(20)])
        / 200.0
    )
    assert 0.03 < np.median(lengths) < 0.15
    assert lengths.max() <= 2 * parameters.camera["gap"]["longest"]
    signed = lose_markers(neutral, kinds, 200 * 60 * 10, "EU", parameters, rng=rng)
    assert not lose_markers(neutral, ["head"] * 20, 3, "EU", parameters, rng=rng).any()  # too short for any
    assert (signed.sum(axis=1) >= 3).any()  # a hand hides neighbours together
