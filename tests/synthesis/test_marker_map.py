from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mimique.errors import FileFormatError, InputError, RigError
from mimique.synthesis import Rig, check_marker_map, propose_marker_map, read_marker_map, read_rig, write_marker_map
from mimique.synthesis.marker_proposal import closest_on_triangles
from scipy.spatial.transform import Rotation

# Vertices of the ICT rig near which the AnimFace actor's markers sit: around, not on, lids and lips.
LANDMARKS = {
    **{"Leye_Outside": 3341, "Reye_Outside": 1121, "Leye_Inside": 4484, "Reye_Inside": 4483},
    **{"Leye_Up": 4121, "Reye_Up": 1921, "Leye_Down": 4338, "Reye_Down": 2145},
    **{"Mouth_Lend": 2759, "Mouth_Rend": 518, "Mouth_Up": 3, "Mouth_Down": 5528, "Chin": 966},
    **{
        "NoseTop": 1307,
        "NoseHead": 4857,
        "NoseHead_L": 5227,
        "NoseHead_R": 4762,
        "Leyebrow_M": 4114,
        "Reyebrow_M": 1914,
    },
}


def dome(n=30):
    """Half an egg of 75 by 100 by 80 mm, one shape."""
    x, y = np.meshgrid(np.linspace(-0.9, 0.9, n), np.linspace(-0.9, 0.9, n), indexing="ij")
    z = np.sqrt(np.maximum(2.0 - x**2 - y**2, 0)) + 0.1 * np.sin(5 * x + 1) * np.cos(4 * y)
    v = np.stack([75 * x, 100 * y, 80 * z], -1).reshape(-1, 3)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    f = np.concatenate([np.stack([i, i + n, i + n + 1], 1), np.stack([i, i + n + 1, i + 1], 1)])
    return Rig(v, f, np.ones((1, len(v), 3)), ["a"])


def test_round_trip(tmp_path):
    table = pd.DataFrame({"marker": ["Chin", "Nez, haut"], "vertex": [3, 1], "distance": [0.1, 0.2]})
    write_marker_map(tmp_path / "map.csv", table)
    again = read_marker_map(tmp_path / "map.csv")
    pd.testing.assert_frame_equal(again, table[["marker", "vertex"]], check_dtype=False)
    assert again["vertex"].dtype == np.int64


def test_blanks_a_byte_order_mark_and_more_columns_are_fine(tmp_path):
    (tmp_path / "map.csv").write_text("\ufeffvertex , side, marker\r\n 7, L, NA\r\n", encoding="utf-8")
    table = read_marker_map(tmp_path / "map.csv")
    assert table["marker"].tolist() == ["NA"] and table["vertex"].tolist() == [7]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("marker;vertex\nA;1\n", "line 1: expected the columns marker,vertex, but got marker;vertex"),
        ("", "not a marker map"),
        ("marker,vertex\n", "no rows"),
        ("marker,vertex\nA,1\nB,two\n", "line 3: expected a whole vertex number for B, but got 'two'"),
        ("marker,vertex\nA,1.5\n", "line 2"),
        ("marker,vertex\n,1\n", "line 2: the marker has no name"),
        ("marker,vertex\nA,1\nA,2\n", r"marker A is listed 2 times \(lines 2, 3\)"),
        ("marker,vertex\nA,1\nB,2\nC,1\n", r"vertex 1 is listed 2 times \(lines 2, 4\)"),
    ],
)
def test_files_that_are_no_marker_map(tmp_path, text, words):
    (tmp_path / "map.csv").write_text(text)
    with pytest.raises((FileFormatError, RigError), match=r"map\.csv.*" + words):
        read_marker_map(tmp_path / "map.csv")


def test_an_absent_file(tmp_path):
    with pytest.raises(InputError, match="no such marker map"):
        read_marker_map(tmp_path / "map.csv")


def test_a_map_is_checked_against_rig_and_take():
    rig = dome()
    table = pd.DataFrame({"marker": ["A", "B"], "vertex": [5, 899]})
    np.testing.assert_array_equal(check_marker_map(rig, table, ["B", "A", "C"]), [5, 899])
    with pytest.raises(RigError, match="the take has no marker B; it has A, C"):
        check_marker_map(rig, table, ["A", "C"])
    for vertex in (900, -1):
        with pytest.raises(RigError, match=f"vertex {vertex} of marker B does not exist.*0 to 899"):
            check_marker_map(rig, table.assign(vertex=[5, vertex]))
    with pytest.raises(RigError, match="vertex 5 is listed 2 times"):
        check_marker_map(rig, table.assign(vertex=5))
    with pytest.raises(RigError, match="vertex is missing"):
        check_marker_map(rig, table[["marker"]])


def test_a_proposal_finds_the_planted_vertices(rng):
    rig = dome()
    vertices = rng.choice(rig.n_vertices, 20, replace=False)
    turned = rig.neutral[vertices] @ Rotation.random(random_state=3).as_matrix().T * 0.1 + [5, 6, 7]
    names = [f"m{i}" for i in range(20)]
    turned[11] = np.nan
    table = propose_marker_map(rig, turned, names, dict(zip(names[:6], vertices[:6], strict=True)))
    assert table["marker"].tolist() == names[:11] + names[12:]
    np.testing.assert_array_equal(table["vertex"], np.delete(vertices, 11))
    assert table["distance"].max() < 1e-6


def test_distances_say_how_far_a_marker_is_from_the_skin():
    rig = dome()
    vertices = np.arange(3, 900, 45)
    markers = rig.neutral[vertices].copy()
    out = rig.neutral[vertices[9]] - rig.neutral.mean(0)
    markers[9] += 12 * out / np.linalg.norm(out)
    names = [f"m{i}" for i in range(20)]
    table = propose_marker_map(rig, markers, names, dict(zip(names[:8], vertices[:8], strict=True)))
    assert 6 < table["distance"][9] <= 12.01
    assert table["distance"].drop(9).max() < 1e-6


def test_two_markers_never_share_a_vertex():
    rig = dome(8)
    markers = np.vstack([rig.neutral[[0, 7, 56, 63, 27]], rig.neutral[27] + [0.1, 0.1, 0]])
    table = propose_marker_map(rig, markers, list("abcdef"), {"a": 0, "b": 7, "c": 56, "d": 63, "e": 27}, rounds=0)
    assert table["vertex"].is_unique


@pytest.mark.parametrize(
    ("landmarks", "words"),
    [
        ({"x": 1, "b": 2, "c": 3, "d": 4}, "there is no marker x"),
        ({"a": 1, "b": 2, "c": 3, "e": 4}, "e is missing in the neutral"),
        ({"a": 1, "b": 2, "c": 3000}, "vertex 3000 of marker c does not exist"),
        ({"a": 1, "b": 2}, "at least three markers"),
    ],
)
def test_landmarks_that_cannot_be_used(landmarks, words):
    rig = dome()
    markers = np.vstack([rig.neutral[[1, 200, 650, 899]], np.full(3, np.nan)])
    with pytest.raises(RigError, match=words):
        propose_marker_map(rig, markers, list("abcde"), landmarks)


def test_nearest_points_of_triangles_agree_with_a_fine_search(rng):
    corners = rng.normal(size=(40, 3, 3))
    points = rng.normal(size=(40, 3)) * 2
    s, t = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    inside = s + t <= 1 + 1e-12
    s, t = s[inside], t[inside]
    samples = corners[:, :1] + s[None, :, None] * (corners[:, 1:2] - corners[:, :1])
    samples = samples + t[None, :, None] * (corners[:, 2:] - corners[:, :1])
    slow = np.linalg.norm(samples - points[:, None], axis=2).min(1)
    fast = np.linalg.norm(closest_on_triangles(points, corners) - points, axis=1)
    assert (fast <= slow + 1e-12).all()
    np.testing.assert_allclose(fast, slow, atol=0.03)


def test_the_kept_map_of_real_markers_is_what_the_proposal_gives(shared_data):
    """The 41 AnimFace markers on the ICT rig, proposed from 19 landmarks and looked at in a picture."""
    rig = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    with np.load(shared_data / "facial_markers" / "animface_eyebrows.npz") as take:
        names, first = [str(n) for n in take["names"]], np.median(take["positions"][6:16], 0) * 10.0
    kept = read_marker_map(Path(__file__).resolve().parents[1] / "data" / "animface_ict_markers.csv")
    check_marker_map(rig, kept, names)
    assert kept["marker"].tolist() == names
    proposed = propose_marker_map(rig, first, names, LANDMARKS, rounds=4)
    np.testing.assert_array_equal(proposed["vertex"], kept["vertex"])
    assert proposed["distance"].max() < 12
    sides = rig.neutral[kept["vertex"], 0]
    left = kept["marker"].str.contains("^L|_L|UpL|DownL")
    right = kept["marker"].str.contains("^R|_R|UpR|DownR")
    assert (sides[left] > 0).all() and (sides[right] < 0).all()
