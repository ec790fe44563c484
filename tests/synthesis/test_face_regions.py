"""Regions, forbidden places, head markers and words, on the avatar and real rigs."""

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.synthesis import Rig, read_rig
from mimique.synthesis import avatar as avatar_module
from mimique.synthesis.avatar import build_avatar
from mimique.synthesis.face_regions import REGIONS, face_regions, forbidden_vertices
from mimique.synthesis.head_markers import head_markers
from mimique.synthesis.landmarks import FaceLandmarks
from mimique.synthesis.place_words import describe_place, describe_places


@pytest.fixture(scope="module")
def found():
    return FaceLandmarks(build_avatar())


@pytest.fixture(scope="module")
def real(shared_data):
    folder = shared_data
    return [
        FaceLandmarks(read_rig(folder / "ict_facekit" / "rig.npz", unit="cm")),
        FaceLandmarks(read_rig(folder / "makehuman" / "rig.npz", unit="dm")),
    ]


def check_partition(found):
    parts = face_regions(found.rig, landmarks=found)
    assert tuple(parts) == REGIONS
    together = np.concatenate(list(parts.values()))
    moved = np.linalg.norm(found.rig.deltas, axis=2).max(axis=0) > 0.5
    np.testing.assert_array_equal(np.sort(together), np.flatnonzero(found.surface.skin & moved))
    assert min(len(v) for v in parts.values()) > 0.02 * len(together)
    return parts


def test_regions_part_the_moving_skin(found):
    parts = check_partition(found)
    region = {int(v): name for name, numbers in parts.items() for v in numbers}
    expected = {
        "brow_inner_left": "brows", "brow_outer_right": "brows", "lid_upper_left": "lids", "lid_lower_right": "lids",
        "nose_ala_left": "nose", "cheek_mid_right": "cheeks", "cheek_upper_left": "cheeks",
        "mouth_corner_left": "lips", "lip_upper_border": "lips", "lip_lower_border": "lips", "chin": "chin",
    }  # fmt: skip
    own = avatar_module.landmarks()
    assert {name: region[own[name]] for name in expected} == expected


def test_shapes_move_the_regions_that_they_are_named_for(found, real):
    for face in (found, *real):
        parts = check_partition(face)
        for move, region in (("eyeBlink", "lids"), ("browOuterUp", "brows"), ("jawOpen", "chin")):
            far = face.moves.distance(move)
            mean = {name: far[numbers].mean() for name, numbers in parts.items()}
            assert max(mean, key=mean.get) == region, (move, mean)


def test_forbidden_are_lids_inner_lips_and_what_is_hidden(found, real):
    for face in (found, *real):
        bad = forbidden_vertices(face.rig, landmarks=face)
        every = np.unique(np.concatenate(list(bad.values())))
        for side in ("left", "right"):
            assert np.isin(face.vertex(f"lid_upper_{side}"), bad["lids"])
            assert np.isin(face.vertex(f"lid_lower_{side}"), bad["lids"])
            for free in ("mouth_corner", "brow_mid", "cheek", "nose_ala"):
                assert not np.isin(face.vertex(f"{free}_{side}"), every), free
        assert np.isin([face.vertex("lip_upper"), face.vertex("lip_lower")], bad["inner_lips"]).all()
        free = ["nose_tip", "chin", "glabella", "lip_upper_border"]
        assert not np.isin([face.vertex(name) for name in free], every).any()
        assert not np.isin(np.flatnonzero(~face.surface.skin), bad["hidden"], invert=True).any()


@pytest.mark.parametrize("count", [4, 5, 6])
def test_head_markers_hold_still_and_are_spread(found, real, count):
    for face in (found, *real):
        chosen = head_markers(face.rig, count, landmarks=face)
        vertices = list(chosen.values())
        assert len(set(vertices)) == count
        assert np.linalg.norm(face.rig.deltas[:, vertices], axis=2).max() <= 0.25
        assert face.outside[vertices].all()
        points = face.rig.neutral[vertices]
        apart = np.linalg.norm(points[:, None] - points, axis=2) + 1e9 * np.eye(count)
        assert apart.min() > 15
        # As long across its narrow side as a head is rigid: a turn about the long side is seen.
        assert np.linalg.svd(points - points.mean(0), compute_uv=False)[1] > 20
        assert points[:, 1].min() > face.position("eye_outer_left")[1]
        for name in chosen:
            if name.endswith("_left"):
                partner = face.rig.neutral[chosen[name.replace("left", "right")]]
                np.testing.assert_allclose(partner, face.rig.neutral[chosen[name]] * [-1, 1, 1], atol=0.2)


def test_a_head_that_moves_as_a_whole_has_no_head_markers(found):
    rig = found.rig
    deltas = rig.deltas + [0.0, 0.5, 0.0]
    moving = FaceLandmarks(Rig(rig.neutral, rig.triangles, deltas, rig.shapes))
    with pytest.raises(InputError, match=r"no skin above the eyes holds still to 0\.25 mm"):
        head_markers(moving.rig, landmarks=moving)
    with pytest.raises(InputError, match="expected 4, 5 or 6 head markers, but got 3"):
        head_markers(rig, 3, landmarks=found)


def test_places_are_told_by_the_nearest_landmark(found):
    rig = found.rig
    corner = found.vertex("mouth_corner_left")
    assert describe_place(rig, corner, landmarks=found) == "at the left mouth corner"
    assert describe_place(rig, found.vertex("nose_tip"), landmarks=found) == "at the tip of the nose"
    # A vertex that stands a known way from the corner: the words must give that way back.
    numbers = np.flatnonzero(found.outside)
    for up, out in ((12.0, 4.0), (-8.0, 9.0), (5.0, -6.0)):
        wanted = rig.neutral[corner] + [out, up, 0]
        vertex = int(numbers[np.argmin(np.linalg.norm(rig.neutral[numbers, :2] - wanted[:2], axis=1))])
        words = describe_place(rig, vertex, landmarks=found)
        if "left mouth corner" in words:
            way = rig.neutral[vertex] - rig.neutral[corner]
            assert f"{abs(way[1]):.0f} mm {'above' if up > 0 else 'below'}" in words
            assert f"{np.hypot(way[0], way[2]):.0f} mm {'outside' if out > 0 else 'inside'} the left" in words
    assert "left mouth corner" in words


def test_words_of_the_two_sides_mirror_each_other(found):
    left = np.flatnonzero(found.outside & (found.rig.neutral[:, 0] > 3))[::40]
    right = found.surface.mirror[left]
    here = describe_places(found.rig, left, landmarks=found)
    there = describe_places(found.rig, right, landmarks=found)
    swap = [w.replace("left", "#").replace("right", "left").replace("#", "right") for w in there]
    # Half millimetres may round either way.
    assert np.mean([a == b for a, b in zip(here, swap, strict=True)]) > 0.98
    assert not any("left" in w for w in there)


def test_no_such_vertex(found):
    with pytest.raises(InputError):
        describe_place(found.rig, found.rig.n_vertices, landmarks=found)
