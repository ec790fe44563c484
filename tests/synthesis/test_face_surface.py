"""The skin of a rig: what belongs to it, what hides it, how it mirrors and where planes cut it."""

import numpy as np
import pytest
from mimique.errors import RigError
from mimique.synthesis import Rig
from mimique.synthesis.avatar import Part, base_head, build_avatar, mirror_pairs
from mimique.synthesis.face_sections import cut_skin, farthest_from_chord
from mimique.synthesis.face_surface import find_face_surface, mirror_vertices, unroll


@pytest.fixture(scope="module")
def avatar():
    return build_avatar()


def sphere(n: int = 24, radius: float = 80.0, centre=(0.0, 0.0, 0.0)):
    """Vertices and outward triangles of a sphere, the poles up and down."""
    up = np.linspace(0, np.pi, n)
    round_ = np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)
    u, r = np.meshgrid(up, round_, indexing="ij")
    points = np.stack([np.sin(u) * np.sin(r), np.cos(u), np.sin(u) * np.cos(r)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(2 * n), indexing="ij")
    a, b = (i * 2 * n + j).ravel(), (i * 2 * n + (j + 1) % (2 * n)).ravel()
    triangles = np.concatenate([np.stack([a, a + 2 * n, b], 1), np.stack([b, a + 2 * n, b + 2 * n], 1)])
    return points * radius + centre, triangles


def rig_of(*pieces, moved=0):
    """A rig of several pieces; three shapes move the piece of that number, one shape every other piece."""
    points, triangles, deltas, start = [], [], [], 0
    for number, (p, t) in enumerate(pieces):
        points.append(p)
        triangles.append(t + start)
        start += len(p)
        move = np.zeros((4, len(p), 3))
        move[: 3 if number == moved else 0, :, 1] = 1.0
        move[3, :, 2] = 0.0 if number == moved else 1.0
        deltas.append(move)
    return Rig(np.concatenate(points), np.concatenate(triangles), np.concatenate(deltas, 1), ["a", "b", "c", "d"])


def test_the_avatars_parts_are_told_apart(avatar):
    surface = find_face_surface(avatar)
    np.testing.assert_array_equal(surface.skin, base_head().part == Part.SKIN)
    assert surface.symmetric
    assert abs(surface.middle) < 1e-9


def test_mirror_vertices_are_the_avatars_own(avatar):
    np.testing.assert_array_equal(mirror_vertices(avatar), mirror_pairs())
    moved = Rig(avatar.neutral + [31.0, 5.0, -2.0], avatar.triangles, avatar.deltas, avatar.shapes)
    np.testing.assert_array_equal(mirror_vertices(moved), mirror_pairs())


def test_a_vertex_without_partner_has_none(avatar):
    neutral = avatar.neutral.copy()
    tip = int(np.argmax(neutral[:, 2]))
    neutral[tip] += [0.0, 0.0, 30.0]
    far = int(np.argmax(np.where(mirror_pairs() != np.arange(len(neutral)), neutral[:, 2], -np.inf)))
    neutral[far] += [0.0, 0.0, 40.0]
    mirror = mirror_vertices(Rig(neutral, avatar.triangles, avatar.deltas, avatar.shapes), tolerance=5.0)
    assert mirror[tip] == tip
    assert mirror[far] == -1
    assert (mirror >= 0).mean() > 0.99


def test_what_is_inside_or_covered_is_not_visible():
    skin, inner = sphere(), sphere(radius=60.0)
    # A cap before the forehead: 15 mm off the skin, so it covers; a brow 2 mm off does not.
    rig = rig_of(skin, inner)
    surface = find_face_surface(rig)
    front = surface.skin & (rig.neutral[:, 2] > 20)
    back = rig.neutral[:, 2] < -79  # a look from the side sees a little of it
    assert surface.skin.sum() == len(skin[0])
    assert surface.visible[front].all()
    assert not surface.visible[back].any()
    assert not surface.visible[len(skin[0]) :].any()
    for gap, covered in ((15.0, True), (2.0, False)):
        points, triangles = sphere(radius=80.0 + gap)
        high = triangles[(points[triangles, 1] > 40).all(axis=1)]
        surface = find_face_surface(rig_of(skin, (points, high)))
        under = (skin[0][:, 1] > 60) & (skin[0][:, 2] > 10)
        assert surface.visible[: len(skin[0])][under].any() != covered


def test_plane_sections_of_a_sphere_are_circles():
    rig = rig_of(sphere(60))
    surface = find_face_surface(rig)
    for axis in (0, 1):
        along, forward = cut_skin(rig, surface, axis, 10.0, step=1.0)
        near = np.abs(along) < 50
        expected = np.sqrt(80.0**2 - 10.0**2 - along[near] ** 2)
        np.testing.assert_allclose(forward[near], expected, atol=0.3)
    assert all(len(part) == 0 for part in cut_skin(rig, surface, 1, 500.0))


def test_the_farthest_point_from_a_chord():
    s = np.linspace(0, 10, 201)
    assert farthest_from_chord(s, (s - 4) ** 2, 0, 8, -1.0) == pytest.approx(4.0)
    assert farthest_from_chord(s, 5 * s - (s - 3) ** 2, 6, 0, 1.0) == pytest.approx(3.0)
    assert np.isnan(farthest_from_chord(s, s, 3.01, 3.02, 1.0))


def test_unrolling_a_cylinder_keeps_lengths():
    angle = np.linspace(-2, 2, 9)
    points = np.stack([5 + 90 * np.sin(angle), np.arange(9.0), -7 + 90 * np.cos(angle)], axis=1)
    flat = unroll(points, (5.0, -7.0), 90.0)
    np.testing.assert_allclose(flat, np.stack([90 * angle, np.arange(9.0)], axis=1), atol=1e-9)


def test_rigs_without_skin_are_refused(avatar):
    bare = Rig(avatar.neutral, np.empty((0, 3), int), avatar.deltas, avatar.shapes)
    for call in (find_face_surface, mirror_vertices):
        with pytest.raises(RigError, match="no triangles"):
            call(bare)
