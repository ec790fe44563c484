import numpy as np
from mimique.models.layouts.choice import choose_layout
from mimique.models.layouts.constraints import find_places, mirror_by_position, spread_points
from mimique.synthesis import Rig
from mimique.synthesis.avatar import build_avatar


def strip(shift=0.0):
    neutral = np.array([[x + shift, y, 0.0] for y in range(3) for x in (-20.0, -10.0, 0.0, 10.0, 20.0)])
    deltas = np.random.default_rng(0).normal(0, 3, (2, 15, 3))
    return Rig(neutral, [[0, 1, 5], [1, 2, 6]], deltas, ["a", "b"])


def test_twins_of_a_symmetric_strip_wherever_it_stands():
    for shift in (0.0, 7.0, -300.0):
        expected = (np.arange(15).reshape(3, 5)[:, ::-1]).ravel()
        np.testing.assert_array_equal(mirror_by_position(strip(shift), 0.1), expected)


def test_a_vertex_without_a_mirror_image_has_no_twin():
    rig = strip()
    neutral = rig.neutral.copy()
    neutral[4] += [6.0, 3.0, 0.0]
    twins = mirror_by_position(Rig(neutral, rig.triangles, rig.deltas, rig.shapes), 0.5)
    assert twins[4] == -1 and twins[0] == -1 and twins[1] == 3
    own = np.flatnonzero(twins >= 0)
    np.testing.assert_array_equal(twins[twins[own]], own)


def test_the_avatar_mirrors_almost_whole():
    rig = build_avatar()
    twins = mirror_by_position(rig)
    assert (twins >= 0).mean() > 0.9
    own = np.flatnonzero(twins >= 0)
    away = rig.neutral[twins[own]] - rig.neutral[own] * [-1, 1, 1]
    assert np.linalg.norm(away, axis=1).max() < 3.0


def test_allowed_units_by_hand():
    places = find_places(strip(), 4, min_distance=1.5, n_candidates=100)
    at = {int(v): k for k, v in enumerate(places.vertices)}
    left = places.vertices[places.allowed(places.singles, [at[7]])[:, 0]]  # Vertex 7 has 2 and 12 within 1 mm.
    assert set(left) == set(range(15)) - {2, 7, 12}


def test_an_odd_number_of_mirrored_markers_has_one_on_the_midline():
    rig = strip()
    weights = np.random.default_rng(1).uniform(size=(20, 2))
    for n_markers in range(1, 12):
        made = choose_layout(rig, weights, n_markers, mirror=True, min_distance=0.5)
        assert len(made.vertices) == n_markers
        assert (rig.neutral[made.vertices, 0] == 0).sum() % 2 == n_markers % 2


def test_spread_points_are_far_apart():
    points = np.random.default_rng(2).uniform(size=(400, 3))
    chosen = points[spread_points(points, 30)]
    nearest = (np.linalg.norm(chosen[:, None] - chosen, axis=2) + np.eye(30) * 9).min()
    cover = np.linalg.norm(points[:, None] - chosen, axis=2).min(1).max()
    assert nearest >= cover  # What defines a farthest-point sample.
    assert len(spread_points(points[:5], 30)) == 5


def test_pairs_of_a_given_mirror_map_never_share_a_vertex():
    """On a mesh that is not quite symmetric two vertices may have the same nearest image."""
    twins = (np.arange(15).reshape(3, 5)[:, ::-1]).ravel()
    twins[3] = 0
    places = find_places(strip(), 4, mirror=twins, n_candidates=100)
    used = places.vertices[np.concatenate([places.singles.ravel(), places.pairs.ravel()])]
    assert len(np.unique(used)) == len(used) and 3 not in used
