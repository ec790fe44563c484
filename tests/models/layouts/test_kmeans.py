import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models import layouts
from mimique.synthesis import Rig


@pytest.fixture
def patches(rng):
    """Four patches of a strip, each moved by a shape of its own, and a fifth that never moves."""
    x = np.repeat(np.arange(5) * 50.0, 12) + np.tile(np.arange(12), 5)
    neutral = np.column_stack([x, rng.normal(0, 2, 60), np.zeros(60)])
    deltas = np.zeros((4, 60, 3))
    for shape in range(4):
        deltas[shape, shape * 12 : shape * 12 + 12] = rng.normal(0, 4, 3)
    return Rig(neutral, [[0, 1, 2]], deltas, list("abcd"))


def test_one_marker_for_each_patch_that_moves_as_one(patches, rng):
    weights = rng.uniform(size=(80, 4))
    chosen = layouts.kmeans_layout(patches, weights, 4, rng=rng)
    assert sorted(chosen // 12) == [0, 1, 2, 3]


def test_normalised_trajectories_by_hand():
    positions = np.zeros((4, 1, 3))
    positions[:, 0, 0] = [0, 2, 0, 2]
    positions[:, 0, 1] = [0, 0.01, 0, 0.01]
    row = layouts.normalise_trajectories(positions).reshape(4, 3)
    np.testing.assert_allclose(row[:, 0], [-1, 1, -1, 1])
    np.testing.assert_allclose(row[:, 1], [-0.1, 0.1, -0.1, 0.1])  # 0.005 mm over 0.05 mm, not over its own deviation
    np.testing.assert_allclose(row[:, 2], 0)


def test_each_marker_is_the_vertex_nearest_its_cluster_mean(patches, rng):
    """A slow second version: given the clusters that the chosen vertices span, no other vertex is nearer the mean."""
    weights = rng.uniform(size=(60, 4))
    deltas = patches.deltas * rng.uniform(0.5, 1.5, (1, 60, 1)) + rng.normal(0, 0.3, patches.deltas.shape)
    rig = Rig(patches.neutral, patches.triangles, deltas, patches.shapes)
    moving = layouts.find_moving_vertices(rig)
    rows = layouts.normalise_trajectories(rig.pose(weights, moving))
    chosen = [int(np.flatnonzero(moving == v)[0]) for v in layouts.kmeans_layout(rig, weights, 4, rng=rng)]
    owner = np.array([min(chosen, key=lambda c: np.linalg.norm(rows[c] - row)) for row in rows])
    for c in chosen:
        mean = rows[owner == c].mean(axis=0)
        distances = [np.linalg.norm(row - mean) for row in rows[owner == c]]
        assert np.linalg.norm(rows[c] - mean) <= np.quantile(distances, 0.2)


def test_impossible_numbers_are_refused(patches, rng):
    with pytest.raises(InputError, match="expected 1 to 48"):
        layouts.kmeans_layout(patches, np.ones((3, 4)), 49, rng=rng)
