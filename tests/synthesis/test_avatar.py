"""The embedded avatar: a clean, symmetric mesh whose parts stay where they belong, markers, affects and people."""

from itertools import pairwise

import numpy as np
import pytest
from mimique.errors import InputError, NotFoundError
from mimique.synthesis.avatar import (
    AFFECTS,
    SHAPES,
    Morphology,
    Part,
    affect_pose,
    build_avatar,
    default_markers,
    landmarks,
    mirror_pairs,
    random_morphology,
    regions,
    vertex_colours,
)
from mimique.synthesis.avatar.head import base_head
from mimique.synthesis.avatar.morphology import eye_geometry
from mimique.synthesis.avatar.muscles import crease
from mimique.synthesis.avatar.sculpture import EYE_CENTRE, EYE_RADIUS, head_distance
from mimique.synthesis.avatar.template import EYE, MOUTH
from scipy.spatial import cKDTree

LEFT, UP, FRONT = np.eye(3)
DOWN = -UP


@pytest.fixture(scope="module")
def rig():
    return build_avatar()


@pytest.fixture(scope="module")
def places():
    return landmarks()


def moves(rig, shape, vertex):
    return rig.deltas[rig.index(shape), vertex]


def test_the_face_is_exactly_symmetric(rig):
    pair = mirror_pairs()
    assert np.array_equal(pair[pair], np.arange(rig.n_vertices))
    assert np.array_equal(rig.neutral[pair] * [-1, 1, 1], rig.neutral)
    faces = {tuple(np.sort(t)) for t in rig.triangles}
    assert {tuple(np.sort(t)) for t in pair[rig.triangles]} == faces


def test_sizes_are_an_adults(rig, places):
    at = {name: rig.neutral[vertex] for name, vertex in places.items()}
    assert 10_000 <= rig.n_vertices <= 12_000
    assert 86 <= np.ptp([at["eye_outer_left"][0], at["eye_outer_right"][0]]) <= 96
    assert 45 <= np.ptp([at["mouth_corner_left"][0], at["mouth_corner_right"][0]]) <= 60
    assert 58 <= np.ptp([at["pupil_left"][0], at["pupil_right"][0]]) <= 68
    assert 95 <= at["nasion"][1] - at["chin"][1] <= 125
    assert at["nose_tip"][2] > at["chin"][2] > at["eye_outer_left"][2]


def skin_triangles(rig):
    return rig.triangles[(base_head().part[rig.triangles] == Part.SKIN).all(1)]


def smallest_angles(vertices, triangles):
    corners = vertices[triangles]
    angles = []
    for k in range(3):
        u, w = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        angles.append(np.arctan2(np.linalg.norm(np.cross(u, w), axis=1), (u * w).sum(1)))
    return np.degrees(np.min(angles, axis=0))


def boundary_loops(triangles):
    """Follow the edges that have one triangle only; a manifold's boundary is a set of closed loops."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    directed = {(int(a), int(b)) for a, b in edges}
    assert len(directed) == len(edges)  # consistent orientation: no directed edge twice
    after = {a: b for a, b in directed if (b, a) not in directed}
    loops = []
    while after:
        start, at = after.popitem()
        count = 1
        while at != start:
            at, count = after.pop(at), count + 1
        loops.append(count)
    return sorted(loops)


def test_the_skin_is_one_clean_manifold_with_openings_for_eyes_mouth_and_neck(rig):
    skin = skin_triangles(rig)
    loops = boundary_loops(skin)
    assert len(loops) == 4
    used = np.unique(skin)
    edges = np.unique(np.sort(skin[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    # a sphere with four holes: V − E + F = 2 − 4; were it several pieces or had it handles, this would differ
    assert len(used) - len(edges) + len(skin) == -2
    angles = smallest_angles(rig.neutral, skin)
    assert angles.min() > 8.0
    assert np.percentile(angles, 1) > 15.0
    assert np.percentile(angles, 5) > 25.0


def test_no_triangle_anywhere_is_degenerate(rig):
    assert smallest_angles(rig.neutral, rig.triangles).min() > 1.0


def test_every_piece_faces_outwards(rig):
    """Closed or nearly closed pieces enclose a positive volume; the dark bag of the mouth is seen from inside."""
    head = base_head()
    outside = set(Part) - {Part.MOUTH_INSIDE}
    for part in outside:
        for sign in (1, -1):
            own = rig.triangles[(head.part[rig.triangles] == part).all(1)]
            own = own[sign * rig.neutral[own][..., 0].mean(1) > 0]
            corners = rig.neutral[own] - rig.neutral[np.unique(own)].mean(0)
            assert np.linalg.det(corners).sum() > 0, part


def test_loops_run_round_lids_and_lips(rig):
    head = base_head()
    edges = {(int(a), int(b)) for t in rig.triangles for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))}
    for zone, rings in ((EYE, (1.0, 2.0, 4.0)), (MOUTH, (3.0, 4.0, 5.0))):
        for ring in rings:
            loop = np.flatnonzero((head.zone == zone) & (head.ring == ring) & (head.vertices[:, 0] >= 0))
            loop = loop[np.argsort(head.turn[loop])]
            assert all((a, b) in edges or (b, a) in edges for a, b in pairwise(loop.tolist()))


def lid_gap(rig, weights):
    head = base_head()
    posed = rig.pose(weights)
    margin = (head.zone == EYE) & (head.ring == 1.0) & (head.vertices[:, 0] > 0)
    at = {float(head.turn[v]): posed[v] for v in np.flatnonzero(margin)}
    return np.array([np.linalg.norm(at[t] - at[24.0 - t]) for t in np.arange(1.0, 11.5, 0.5)])


def weights_of(rig, **amounts):
    weights = np.zeros(rig.n_shapes)
    for name, amount in amounts.items():
        weights[rig.index(name)] = amount
    return weights


def test_a_blink_closes_the_lids(rig):
    open_, closed = lid_gap(rig, weights_of(rig)), lid_gap(rig, weights_of(rig, eyeBlinkLeft=1.0))
    assert open_.max() > 9.0
    assert (closed / open_).max() < 0.10
    assert lid_gap(rig, weights_of(rig, eyeBlinkLeft=0.5)).max() > 0.3 * open_.max()


@pytest.mark.parametrize(
    "morphology", [Morphology(), Morphology(eye_size=1.0, eye_spacing=-1.0), Morphology(eye_size=-1.0)]
)
@pytest.mark.parametrize("shape", ["eyeBlinkLeft", "eyeSquintLeft", "eyeWideLeft", "eyeLookDownLeft", "eyeLookUpLeft"])
@pytest.mark.parametrize("weight", [0.0, 0.25, 0.5, 0.75, 1.0])
def test_lids_stay_outside_the_eyeball(morphology, shape, weight):
    person = build_avatar(morphology)
    head = base_head()
    centre, size = eye_geometry(morphology)
    lid = np.flatnonzero((head.zone == EYE) & (head.vertices[:, 0] > 0))
    posed = person.neutral[lid] + weight * person.deltas[person.index(shape), lid]
    assert np.linalg.norm(posed - centre, axis=1).min() > EYE_RADIUS * size


def test_the_eyeball_turns_without_leaving_its_place(rig):
    head = base_head()
    eye = np.flatnonzero((head.part == Part.EYEBALL) & (head.vertices[:, 0] > 0))
    for shape in ("eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft"):
        before = np.linalg.norm(rig.neutral[eye] - EYE_CENTRE, axis=1)
        after = np.linalg.norm(rig.neutral[eye] + rig.deltas[rig.index(shape), eye] - EYE_CENTRE, axis=1)
        assert np.allclose(before, after)


def test_the_mouth_opens_and_mouth_close_closes_it(rig, places):
    upper, lower = places["lip_upper"], places["lip_lower"]

    def gap(**amounts):
        posed = rig.pose(weights_of(rig, **amounts), [upper, lower])
        return np.linalg.norm(posed[0] - posed[1])

    assert gap() < 0.5
    assert gap(jawOpen=1.0) > 25.0
    assert gap(jawOpen=1.0, mouthClose=1.0) < 2.0
    assert gap(jawOpen=0.5, mouthClose=0.5) < 1.5
    chin = places["chin"]
    dropped = rig.pose(weights_of(rig, jawOpen=1.0, mouthClose=1.0), [chin])[0] - rig.neutral[chin]
    assert dropped[1] < -12.0  # the jaw itself stays open


def test_lower_teeth_follow_the_jaw_and_upper_teeth_do_not(rig):
    part, jaw = base_head().part, rig.deltas[rig.index("jawOpen")]
    assert np.abs(jaw[part == Part.UPPER_TEETH]).max() == 0.0
    assert jaw[part == Part.LOWER_TEETH, 1].max() < -8.0


def poking_out(rig, weights):
    """Count vertices of teeth, tongue and mouth bag that lie outside the skin nearest to them."""
    head, posed = base_head(), rig.pose(weights)
    skin = skin_triangles(rig)
    corners = posed[skin]
    normals = np.zeros_like(posed)
    np.add.at(
        normals, skin.ravel(), np.repeat(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), 3, 0)
    )
    outer = (head.part == Part.SKIN) & ((head.zone != MOUTH) | (head.ring >= 5))
    outer = np.flatnonzero(outer & ((head.zone != EYE) | (head.ring >= 3)))
    inner = np.isin(head.part, [Part.MOUTH_INSIDE, Part.UPPER_TEETH, Part.LOWER_TEETH, Part.TONGUE])
    away, nearest = cKDTree(posed[outer]).query(posed[inner])
    above = ((posed[inner] - posed[outer[nearest]]) * normals[outer[nearest]]).sum(1)
    return int(((above > 0) & (away < 15)).sum())


def test_the_mouths_inside_stays_inside(rig):
    for shape in SHAPES:
        if shape.startswith(("mouth", "jaw", "cheek", "nose")):
            assert poking_out(rig, weights_of(rig, **{shape: 1.0})) == 0, shape
    for affect in AFFECTS:
        assert poking_out(rig, affect_pose(affect)) == 0, affect
    assert poking_out(rig, weights_of(rig, jawOpen=1.0, mouthClose=1.0)) == 0
    assert poking_out(rig, weights_of(rig, jawOpen=0.4, mouthPucker=1.0)) == 0


def test_brows_move_with_the_skin_under_them(rig):
    part = base_head().part
    brow = np.flatnonzero((part == Part.BROW) & (base_head().vertices[:, 0] > 0))
    skin = np.flatnonzero(part == Part.SKIN)
    for shape in ("browDownLeft", "browInnerUp", "browOuterUpLeft"):
        moved = rig.deltas[rig.index(shape)]
        for v in brow[::17]:
            nearest = skin[np.argmin(((rig.neutral[skin] - rig.neutral[v]) ** 2).sum(1))]
            assert np.linalg.norm(moved[v] - moved[nearest]) < 1.2


def test_hair_lies_close_to_the_skin_and_is_tucked_under_it_at_the_hairline(rig):
    at = rig.neutral[base_head().part == Part.HAIR]
    out = head_distance(at)
    assert out.max() < 12.0
    line = at[out < 0]  # the first row is under the skin all along the hairline
    azimuth = np.degrees(np.arctan2(np.abs(line[:, 0]), line[:, 2] + 6.0))
    assert azimuth.min() < 2 and azimuth.max() > 178 and np.diff(np.sort(azimuth)).max() < 10
    away = cKDTree(line).query(at)[0]
    assert out[away < 4.0].max() < 3.0  # a thin rim
    assert out[away > 60.0].min() > 5.0
    # no bare skin over the ear: hair is next to its top
    ear = rig.neutral[base_head().part == Part.EAR]
    top = ear[np.argmax(ear[:, 1])]
    assert cKDTree(at[out > 0]).query(top)[0] < 10.0


def test_a_smile_and_a_sneer_fold_the_skin_beside_the_nose(rig):
    """The cheek comes forward of the lip's side; without the crease by 2.7 mm in a smile, by nothing in a sneer."""
    skin = np.flatnonzero((base_head().part == Part.SKIN) & (rig.neutral[:, 2] > 50))
    cheek, lip = (skin[np.argmin(((rig.neutral[skin, :2] - xy) ** 2).sum(1))] for xy in ((33.0, -51.0), (24.5, -57.0)))
    for shape, least in (("mouthSmileLeft", 3.5), ("noseSneerLeft", 1.0)):
        assert moves(rig, shape, cheek)[2] - moves(rig, shape, lip)[2] > least, shape


def test_a_crease_stands_up_to_its_left_and_falls_to_its_right():
    path = np.array([[0.0, 0.0], [0.0, 10.0], [0.0, 20.0]])
    height = crease(np.array([[-2.0, 10, 0], [2.0, 10, 5], [0.0, 10, 0], [-7.0, 10, 0], [-2.0, 0, 0]]), path, 2.0)
    assert height == pytest.approx([1.0, -1.0, 0.0, 0.0, 0.0], abs=0.01)


def test_46_markers_of_which_six_on_the_head_never_move(rig):
    markers = default_markers()
    assert len(markers) == len(set(markers.values())) == 46
    head = [v for name, v in markers.items() if name.startswith("head_")]
    assert len(head) == 6
    assert np.abs(rig.deltas[:, head]).max() == 0.0
    face = [v for name, v in markers.items() if not name.startswith("head_")]
    assert (np.linalg.norm(rig.deltas[:, face], axis=2).max(0) > 1.0).all()
    centred = rig.neutral[head] - rig.neutral[head].mean(0)
    assert np.linalg.svd(centred, compute_uv=False)[1] > 20.0  # far from collinear
    for name, vertex in markers.items():
        if name.endswith("_left"):
            assert mirror_pairs()[vertex] == markers[name.replace("_left", "_right")]
            assert rig.neutral[vertex, 0] > 0
    on = {name: base_head().part[vertex] for name, vertex in markers.items()}
    assert {name for name in on if on[name] != Part.SKIN} == {"head_band_left", "head_band_right"}
    assert min(np.linalg.norm(rig.neutral[a] - rig.neutral[b]) for a in face for b in face if a != b) > 6.0


def test_every_shape_but_gaze_is_seen_by_the_markers(rig):
    at = list(default_markers().values())
    for shape in SHAPES:
        if not shape.startswith("eyeLook"):
            assert np.linalg.norm(rig.deltas[rig.index(shape), at], axis=1).max() > 0.5, shape


def test_affects_are_what_people_would_call_them(rig, places):
    def moved(affect, place, way):
        return (rig.pose(affect_pose(affect), [places[place]])[0] - rig.neutral[places[place]]) @ way

    def mouth_open(affect):
        return moved(affect, "lip_upper", UP) - moved(affect, "lip_lower", UP)

    assert set(AFFECTS) == {"anger", "disgust", "fear", "joy", "neutral", "sadness", "surprise"}
    assert not affect_pose("neutral").any()
    for affect in AFFECTS:
        weights = affect_pose(affect)
        assert weights.shape == (51,) and weights.min() >= 0 and weights.max() <= 1
    assert moved("joy", "mouth_corner_left", UP) > 6 and moved("joy", "cheek_upper_left", UP) > 3
    assert moved("sadness", "mouth_corner_left", DOWN) > 4 and moved("sadness", "brow_inner_left", UP) > 2.5
    assert moved("anger", "brow_inner_left", DOWN) > 4 and abs(mouth_open("anger")) < 3
    assert moved("disgust", "nose_ala_left", UP) > 4 and moved("disgust", "lip_upper", UP) > 3
    assert moved("fear", "brow_inner_left", UP) > 2.5 and moved("fear", "mouth_corner_left", LEFT) > 3
    assert moved("surprise", "brow_outer_left", UP) > 5 and mouth_open("surprise") > 12
    with pytest.raises(NotFoundError, match="pride"):
        affect_pose("pride")


def test_people_share_numbers_and_differ_in_place(rig, rng):
    people = [build_avatar(random_morphology(rng)) for _ in range(4)]
    for person in people:
        assert np.array_equal(person.triangles, rig.triangles)
        assert np.array_equal(person.neutral[mirror_pairs()] * [-1, 1, 1], person.neutral)
        assert smallest_angles(person.neutral, skin_triangles(person)).min() > 1.5
        assert 0.8 < np.linalg.norm(person.neutral - rig.neutral, axis=1).mean() < 12.0
    assert np.abs(people[0].neutral - people[1].neutral).max() > 3.0
    assert np.abs(people[0].deltas - people[1].deltas).max() > 0.3  # shapes follow the person


@pytest.mark.parametrize(
    ("parameter", "place", "way"),
    [
        ("jaw_width", "jaw_line_left", LEFT),
        ("chin_length", "chin", DOWN),
        ("chin_forward", "chin", FRONT),
        ("nose_length", "nose_tip", DOWN),
        ("nose_width", "nose_ala_left", LEFT),
        ("brow_ridge", "brow_mid_left", FRONT),
        ("brow_height", "brow_mid_left", UP),
        ("eye_spacing", "pupil_left", LEFT),
        ("lip_fullness", "lip_lower_border", FRONT),
        ("mouth_width", "mouth_corner_left", LEFT),
        ("cheek_fullness", "cheek_mid_left", LEFT),
        ("face_width", "jaw_line_left", LEFT),
        ("face_height", "forehead", UP),
        ("forehead", "forehead", FRONT),
    ],
)
def test_a_proportion_moves_what_it_names(rig, places, parameter, place, way):
    for amount in (-1.0, 1.0):
        person = build_avatar(Morphology(**{parameter: amount}))
        assert amount * ((person.neutral[places[place]] - rig.neutral[places[place]]) @ way) > 1.0


def test_proportions_out_of_range_are_refused():
    with pytest.raises(InputError, match=r"jaw_width = 1\.5"):
        Morphology(jaw_width=1.5)
    with pytest.raises(InputError, match="chin_length"):
        Morphology(chin_length=float("nan"))


def test_colours_and_regions_cover_every_vertex(rig):
    colours = vertex_colours()
    assert colours.shape == (rig.n_vertices, 3) and colours.min() >= 0 and colours.max() <= 1
    assert np.array_equal(np.sort(np.concatenate(list(regions().values()))), np.arange(rig.n_vertices))
    at = landmarks()
    assert colours[at["pupil_left"]].max() < 0.1
    assert np.ptp(colours[at["lip_lower_border"]]) > np.ptp(colours[at["forehead"]])
