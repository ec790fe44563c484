"""Landmarks against published vertex numbers, the avatar's own, and meshes that were tampered with."""

import json
import re

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.synthesis import Rig, read_rig
from mimique.synthesis import avatar as avatar_module
from mimique.synthesis.avatar import build_avatar, regions
from mimique.synthesis.landmarks import LANDMARKS, FaceLandmarks, find_landmarks, locate_landmarks

# Multi-PIE numbers of the landmarks that the ICT FaceKit publishes; two numbers: the place between them.
# The wing of the nose is left out: the scheme's 35 is the nostril's lower rim.
MULTI_PIE = {
    "eye_outer_left": (45,), "eye_inner_left": (42,), "lid_upper_left": (43, 44), "lid_lower_left": (46, 47),
    "brow_inner_left": (22, 23), "brow_mid_left": (24,), "brow_outer_left": (25, 26), "mouth_corner_left": (54,),
    "eye_outer_right": (36,), "eye_inner_right": (39,), "mouth_corner_right": (48,), "brow_mid_right": (19,),
    "nasion": (27,), "nose_tip": (30,), "nose_base": (33,), "lip_upper_border": (51,), "lip_upper": (62,),
    "lip_lower": (66,), "lip_lower_border": (57,), "chin_bottom": (8,),
}  # fmt: skip
WITHIN = {"high": 5.0, "fair": 10.0}


@pytest.fixture(scope="module")
def avatar():
    return build_avatar()


@pytest.fixture(scope="module")
def found(avatar):
    return find_landmarks(avatar)


@pytest.mark.parametrize("seed", [None, 0, 1])
def test_ict_identities_have_the_published_landmarks(shared_data, seed):
    rig = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    if seed is not None:
        with np.load(shared_data / "ict_facekit" / "identities.npz") as file:
            modes = file["deltas"].astype(float) * 10.0
        draw = np.random.default_rng(seed).normal(size=len(modes))
        rig = Rig(rig.neutral + np.tensordot(draw, modes, axes=1), rig.triangles, rig.deltas, rig.shapes)
    published = json.loads((shared_data / "ict_facekit" / "landmarks.json").read_text())["multipie68"]
    table = locate_landmarks(rig, MULTI_PIE).set_index("landmark")
    away = {
        name: np.linalg.norm(
            rig.neutral[table.loc[name, "vertex"]] - rig.neutral[[published[n] for n in numbers]].mean(axis=0)
        )
        for name, numbers in MULTI_PIE.items()
    }
    too_far = {name: far for name, far in away.items() if far > WITHIN[table.loc[name, "sure"]]}
    assert not too_far
    assert np.median(list(away.values())) < 3.5


def test_the_avatars_own_landmarks_are_found(avatar, found):
    own = avatar_module.landmarks()
    sure = locate_landmarks(avatar).set_index("landmark")["sure"]
    shared = [name for name in own if name in found and sure[name] != "low"]
    assert len(shared) >= 20
    away = np.array([np.linalg.norm(avatar.neutral[found[n]] - avatar.neutral[own[n]]) for n in shared])
    assert (away <= [WITHIN[sure[n]] for n in shared]).all(), dict(zip(shared, away.round(1), strict=True))


def test_landmarks_sit_on_skin_and_mirror_each_other(avatar, found):
    assert set(found) == set(LANDMARKS)
    assert np.isin(list(found.values()), regions()["skin"]).all()
    for name, vertex in found.items():
        if name.endswith("_left"):
            partner = avatar.neutral[found[name.replace("_left", "_right")]]
            np.testing.assert_allclose(partner, avatar.neutral[vertex] * [-1, 1, 1], atol=1e-6)
        elif not name.endswith("_right"):
            assert abs(avatar.neutral[vertex, 0]) < 1e-6


def test_makehuman_has_all_in_anatomical_order(shared_data):
    rig = read_rig(shared_data / "makehuman" / "rig.npz", unit="dm")
    at = {name: rig.neutral[vertex] for name, vertex in find_landmarks(rig).items()}
    down = ["forehead", "glabella", "nasion", "nose_tip", "nose_base", "lip_upper_border", "lip_upper"]
    down += ["lip_lower", "lip_lower_border", "chin_fold", "chin", "chin_bottom"]
    assert (np.diff([at[name][1] for name in down]) < 0).all()
    out = ["nose_tip", "brow_inner_left", "brow_mid_left", "brow_outer_left", "temple_left", "ear_left"]
    assert (np.diff([at[name][0] for name in out]) > 0).all()
    assert at["lid_lower_left"][1] < at["eye_inner_left"][1] < at["lid_upper_left"][1] < at["brow_mid_left"][1]
    assert at["eye_inner_left"][0] < at["lid_upper_left"][0] < at["eye_outer_left"][0]
    assert max(at, key=lambda name: at[name][2]) == "nose_tip"


def test_order_seams_and_place_of_the_mesh_do_not_matter(avatar, found):
    rng = np.random.default_rng(4)
    shift = np.array([25.0, -300.0, 40.0])
    order = rng.permutation(avatar.n_vertices)
    where = np.argsort(order)
    # Every tenth triangle gets corners of its own, as files with texture seams have them.
    triangles, neutral, deltas = where[avatar.triangles], avatar.neutral[order] + shift, avatar.deltas[:, order]
    torn = np.arange(0, len(triangles), 10)
    extra = triangles[torn].ravel()
    triangles[torn] = len(neutral) + np.arange(len(extra)).reshape(-1, 3)
    rig = Rig(
        np.concatenate([neutral, neutral[extra]]),
        triangles,
        np.concatenate([deltas, deltas[:, extra]], 1),
        avatar.shapes,
    )
    again = find_landmarks(rig)
    away = {n: np.linalg.norm(rig.neutral[again[n]] - shift - avatar.neutral[found[n]]) for n in found}
    # Normals differ a little at the seams.
    assert max(away.values()) < 4.0
    assert np.median(list(away.values())) < 1e-6


def test_shapes_of_other_names_can_be_told(avatar, found):
    names = [f"AU{i}" for i in range(avatar.n_shapes)]
    rig = Rig(avatar.neutral, avatar.triangles, avatar.deltas, names)
    with pytest.raises(InputError, match=r"landmark \w+: it is found by .*shapes=\{'its name'"):
        find_landmarks(rig)
    assert find_landmarks(rig, shapes=dict(zip(names, avatar.shapes, strict=True))) == found
    with pytest.raises(InputError, match="no shape AU99"):
        find_landmarks(rig, shapes={"AU99": "jawOpen"})
    with pytest.raises(InputError, match="names of ARKit's shapes, but got grin"):
        find_landmarks(rig, shapes={"AU1": "grin"})


@pytest.mark.parametrize(
    ("gone", "landmark", "needed"),
    [
        ("mouth(Smile|Stretch|Dimple)", "mouth_corner_left", "mouthSmile"),
        ("jawOpen", "lip_upper", "jawOpen"),
        ("brow", "brow_mid_left", "browDown"),
    ],
)
def test_a_missing_shape_is_named(avatar, gone, landmark, needed):
    keep = [i for i, name in enumerate(avatar.shapes) if not re.match(gone, name)]
    rig = Rig(avatar.neutral, avatar.triangles, avatar.deltas[keep], [avatar.shapes[i] for i in keep])
    with pytest.raises(InputError, match=f"landmark {landmark}: .*{needed}"):
        find_landmarks(rig, [landmark])
    assert find_landmarks(rig, ["eye_inner_left"])  # what does not need it is still found


def test_a_rig_that_stands_otherwise_is_refused(avatar):
    def turned(matrix):
        return Rig(avatar.neutral @ matrix.T, avatar.triangles, avatar.deltas @ matrix.T, avatar.shapes)

    lying = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    with pytest.raises(InputError, match=r"\+Y is up"):
        find_landmarks(turned(lying))
    with pytest.raises(InputError, match=r"\+Y up"):
        find_landmarks(turned(np.diag([-1.0, -1, 1])))
    with pytest.raises(InputError, match=r"eyeBlink moves no skin on the left side .*\+X is the subject's left"):
        find_landmarks(turned(np.diag([-1.0, 1, -1])))


def test_unknown_names_and_empty_rigs_are_refused(avatar):
    with pytest.raises(InputError, match="expected one of forehead"):
        find_landmarks(avatar, ["moustache"])
    with pytest.raises(InputError, match="no triangles"):
        FaceLandmarks(Rig(avatar.neutral, np.empty((0, 3), int), avatar.deltas, avatar.shapes))
    with pytest.raises(InputError, match="no shape moves"):
        FaceLandmarks(Rig(avatar.neutral, avatar.triangles, 0 * avatar.deltas, avatar.shapes))
