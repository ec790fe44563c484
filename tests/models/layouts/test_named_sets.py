"""Named marker sets: sizes, places and order on three meshes."""

import json

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.layouts.named_sets import NAMED_SETS, SOURCES, place_named_set, place_names
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.avatar import build_avatar
from mimique.synthesis.landmarks import FaceLandmarks

STAR = NAMED_SETS[:4]


@pytest.fixture(scope="module")
def faces(shared_data):
    rigs = [
        build_avatar(),
        read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm"),
        read_rig(shared_data / "makehuman" / "rig.npz", unit="dm"),
    ]
    return [FaceLandmarks(rig) for rig in rigs]


@pytest.fixture(scope="module")
def avatar():
    return FaceLandmarks(build_avatar())


@pytest.mark.parametrize("name", NAMED_SETS)
def test_every_set_has_its_size_on_skin_that_can_be_seen(faces, name):
    assert SOURCES[name]
    for face in faces:
        table = place_named_set(face.rig, name, landmarks=face)
        assert list(table.columns) == ["marker", "vertex", "name", "sure", "listed"]
        assert len(table) == int(name.split()[-1])
        assert not table["marker"].duplicated().any()
        assert not table["vertex"].duplicated().any()
        assert face.outside[table["vertex"]].all()
        assert set(table["sure"]) <= {"high", "fair", "low"}
        assert set(table["listed"]) == {"standard" if name.startswith("MPEG") else "rebuilt"}
        # The inner edges of closed lips touch.
        points = face.rig.neutral[table["vertex"][~table["name"].str.startswith("the inner edge of the")]]
        apart = np.linalg.norm(points[:, None] - points, axis=2) + 1e9 * np.eye(len(points))
        assert apart.min() > 0.5


def test_sides_mirror_each_other(avatar):
    for name in NAMED_SETS:
        table = place_named_set(avatar.rig, name.lower(), landmarks=avatar)
        mirrored = avatar.surface.mirror[table["vertex"]]
        assert set(mirrored) == set(table["vertex"])
        for words, vertex in zip(table["name"], table["vertex"], strict=True):
            x = avatar.rig.neutral[vertex, 0]
            assert x > 0 if words.endswith("left") else x < 0 if words.endswith("right") else abs(x) < 1e-6


def test_man_sets_are_nested_and_drawn_from_the_published(avatar):
    published = {place for name in STAR for place in place_names(name)}
    larger = None
    for name in ("MAN 62", "MAN 46", "MAN 30", "MAN 15"):
        places = set(place_names(name))
        assert places <= published
        markers = set(place_named_set(avatar.rig, name, landmarks=avatar)["marker"])
        if larger is not None:
            assert markers < larger
        larger = markers


def test_mpeg4_numbers_are_the_standards_points_of_the_face():
    # Points of each group of ISO/IEC 14496-2 that are not on the skin of the face, counted by hand: pupils and lids'
    # edges (3), teeth (9); tongue (6), spine (7), ears (10) and hair (11) have none left.
    sizes = {2: 14, 3: 14, 4: 6, 5: 4, 8: 10, 9: 15}
    gone = {(3, n) for n in range(1, 7)} | {(9, n) for n in (8, 9, 10, 11)}
    expected = {f"{g}.{n}" for g, size in sizes.items() for n in range(1, size + 1) if (g, n) not in gone}
    rig = build_avatar()
    assert set(place_named_set(rig, "MPEG-4 53")["marker"]) == expected


def test_mpeg4_points_lie_where_multi_pie_marks_them(shared_data, faces):
    rig = faces[1].rig
    published = json.loads((shared_data / "ict_facekit" / "landmarks.json").read_text())["multipie68"]
    same = {  # feature point: Multi-PIE number
        "2.1": 8, "2.2": 62, "2.3": 66, "2.6": 63, "2.7": 61, "2.8": 65, "2.9": 67, "3.7": 45, "3.8": 39, "3.11": 42,
        "3.12": 36, "8.1": 51, "8.2": 57, "8.3": 54, "8.4": 48, "8.9": 50, "8.10": 52, "8.5": 53, "8.6": 49, "9.3": 30,
        "9.15": 33, "4.3": 24, "4.4": 19, "9.4": 31, "9.5": 35,
    }  # fmt: skip
    table = place_named_set(rig, "MPEG-4 53", landmarks=faces[1]).set_index("marker")["vertex"]
    away = {code: np.linalg.norm(rig.neutral[table[code]] - rig.neutral[published[n]]) for code, n in same.items()}
    assert max(away.values()) < 8.0, away
    assert np.median(list(away.values())) < 4.0


def test_lips_keep_their_markers_when_the_mouth_opens(faces):
    # Markers of the lower lip follow the jaw, those of the upper lip do not.
    for face in faces:
        table = place_named_set(face.rig, "MPEG-4 53", landmarks=face).set_index("marker")["vertex"]
        drop = -face.moves.displacement("jawOpen")[:, 1]
        lower, upper = ["2.3", "2.8", "2.9", "8.2", "8.7", "8.8"], ["2.2", "2.6", "2.7", "8.1", "8.5", "8.6", "8.9"]
        assert drop[table[lower]].min() > 2 * drop[table[upper]].max()


def test_bad_requests_are_refused(avatar):
    with pytest.raises(InputError, match=r"expected one of Face Robot 35, .* but got 'Vicon 40'"):
        place_named_set(avatar.rig, "Vicon 40")
    rig = avatar.rig
    keep = [i for i, shape in enumerate(rig.shapes) if "brow" not in shape]
    browless = Rig(rig.neutral, rig.triangles, rig.deltas[keep], [rig.shapes[i] for i in keep])
    with pytest.raises(InputError, match=r"SignCom 41: the marker \w+ cannot be placed; landmark .*browDown"):
        place_named_set(browless, "SignCom 41")
