"""Markers beside their place: on the skin, as far off as asked."""

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.layouts import Sites, place_beside
from mimique.synthesis import Rig


@pytest.fixture
def plane():
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(21.0) * 3, np.arange(21.0) * 3))
    neutral = np.column_stack([x, y, np.zeros(441)])
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    triangles = np.concatenate(
        [np.column_stack([corner, corner + 1, corner + 22]), np.column_stack([corner, corner + 22, corner + 21])]
    )
    deltas = np.stack([np.column_stack([np.zeros(441), np.zeros(441), x])])
    return Rig(neutral, triangles, deltas, ["lift"])


@pytest.mark.parametrize("off", [0.5, 1.0, 4.0, 5.0])
def test_distance_on_flat_skin_is_exact(plane, off, rng):
    vertices = np.array([220, 150, 260])
    sites = place_beside(plane, vertices, off, rng)
    places = sites.neutral(plane)
    np.testing.assert_allclose(np.linalg.norm(places - plane.neutral[vertices], axis=1), off, atol=1e-6)
    np.testing.assert_allclose(places[:, 2], 0, atol=1e-9)


def test_a_site_moves_with_the_skin_under_it(plane, rng):
    sites = place_beside(plane, [220, 150], 4.0, rng)
    places = sites.neutral(plane)
    moved = sites.on(plane, np.array([[0.0], [0.5]]))
    np.testing.assert_allclose(moved[0], places, atol=1e-12)
    np.testing.assert_allclose(moved[1][:, 2], 0.5 * places[:, 0], atol=1e-9)  # the shape is linear in x


def test_no_distance_is_the_vertex_itself(plane, rng):
    np.testing.assert_array_equal(place_beside(plane, [5, 9], 0.0, rng).neutral(plane), plane.neutral[[5, 9]])
    weights = np.array([[0.3]])
    np.testing.assert_allclose(Sites.at([5, 9]).on(plane, weights), plane.pose(weights, [5, 9]))


def test_the_other_side_of_a_sheet_is_left_alone(plane, rng):
    below = Rig(
        np.concatenate([plane.neutral, plane.neutral - [0, 0, 0.5]]),
        np.concatenate([plane.triangles, plane.triangles[:, ::-1] + 441]),
        np.concatenate([plane.deltas, plane.deltas], axis=1),
        plane.shapes,
    )
    assert (place_beside(below, np.full(20, 220), 3.0, rng).corners < 441).all()


def test_bad_distance(plane, rng):
    with pytest.raises(InputError, match="0 or more"):
        place_beside(plane, [5], -1.0, rng)
