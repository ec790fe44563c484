"""The avatar does what its shapes are called: everything is measured at landmarks, in mm."""

import numpy as np
import pytest
from mimique.synthesis.avatar import (
    SHAPES,
    build_avatar,
    landmarks,
    mirror_pairs,
)
from mimique.synthesis.avatar.head import base_head

X, Y, Z = np.eye(3)
LEFT, RIGHT, UP, DOWN, FRONT, BACK = X, -X, Y, -Y, Z, -Z

# Apple's order (ARFaceAnchor.BlendShapeLocation), written out so that a slip in the code's own list shows
APPLE = [
    "eyeBlinkLeft",
    "eyeLookDownLeft",
    "eyeLookInLeft",
    "eyeLookOutLeft",
    "eyeLookUpLeft",
    "eyeSquintLeft",
    "eyeWideLeft",
    "eyeBlinkRight",
    "eyeLookDownRight",
    "eyeLookInRight",
    "eyeLookOutRight",
    "eyeLookUpRight",
    "eyeSquintRight",
    "eyeWideRight",
    "jawForward",
    "jawLeft",
    "jawRight",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthLeft",
    "mouthRight",
    "mouthSmileLeft",
    "mouthSmileRight",
    "mouthFrownLeft",
    "mouthFrownRight",
    "mouthDimpleLeft",
    "mouthDimpleRight",
    "mouthStretchLeft",
    "mouthStretchRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "mouthPressLeft",
    "mouthPressRight",
    "mouthLowerDownLeft",
    "mouthLowerDownRight",
    "mouthUpperUpLeft",
    "mouthUpperUpRight",
    "browDownLeft",
    "browDownRight",
    "browInnerUp",
    "browOuterUpLeft",
    "browOuterUpRight",
    "cheekPuff",
    "cheekSquintLeft",
    "cheekSquintRight",
    "noseSneerLeft",
    "noseSneerRight",
]

BROWS = ("brow_inner_left", "brow_mid_left", "brow_outer_left")
LIPS = ("mouth_corner_left", "lip_upper", "lip_lower", "lip_upper_border", "lip_lower_border")
LIDS = ("lid_upper_left", "lid_lower_left", "pupil_left")
CHIN = ("chin", "jaw_line_left")
SKULL = ("forehead", "nasion")

# shape (its left or only form): moves (landmark, direction, at least mm), and what keeps still
DOES: dict[str, tuple[list[tuple[str, np.ndarray, float]], tuple[str, ...]]] = {
    "eyeBlinkLeft": ([("lid_upper_left", DOWN, 9.0)], (*BROWS, *LIPS, *CHIN, *SKULL, "pupil_left")),
    "eyeLookDownLeft": ([("pupil_left", DOWN, 5.5), ("lid_upper_left", DOWN, 2.5)], (*BROWS, *LIPS, *CHIN, *SKULL)),
    "eyeLookInLeft": ([("pupil_left", RIGHT, 6.0)], (*BROWS, *LIPS, *CHIN, *SKULL, "lid_upper_left")),
    "eyeLookOutLeft": ([("pupil_left", LEFT, 6.0)], (*BROWS, *LIPS, *CHIN, *SKULL, "lid_upper_left")),
    "eyeLookUpLeft": ([("pupil_left", UP, 5.0), ("lid_upper_left", UP, 1.0)], (*BROWS, *LIPS, *CHIN, *SKULL)),
    "eyeSquintLeft": ([("lid_lower_left", UP, 2.0), ("lid_upper_left", DOWN, 1.0)], (*BROWS, *LIPS, *CHIN, *SKULL)),
    "eyeWideLeft": ([("lid_upper_left", UP, 2.0), ("lid_lower_left", DOWN, 0.5)], (*LIPS, *CHIN, *SKULL)),
    "jawForward": ([("chin", FRONT, 5.0), ("lip_lower", FRONT, 4.0)], (*BROWS, *LIDS, *SKULL, "nose_tip")),
    "jawLeft": ([("chin", LEFT, 6.0), ("lip_lower", LEFT, 5.0)], (*BROWS, *LIDS, *SKULL, "nose_tip")),
    "jawRight": ([("chin", RIGHT, 6.0), ("lip_lower", RIGHT, 5.0)], (*BROWS, *LIDS, *SKULL, "nose_tip")),
    "jawOpen": ([("lip_lower", DOWN, 22.0), ("chin", DOWN, 18.0)], (*BROWS, *LIDS, *SKULL, "nose_tip")),
    "mouthClose": ([("lip_lower", UP, 12.0), ("lip_upper", DOWN, 6.0)], (*BROWS, *LIDS, *SKULL, "nose_tip")),
    "mouthFunnel": (
        [
            ("lip_upper", UP, 3.0),
            ("lip_lower", DOWN, 3.0),
            ("mouth_corner_left", RIGHT, 3.0),
            ("lip_upper", FRONT, 4.0),
        ],
        (*BROWS, *LIDS, *SKULL),
    ),
    "mouthPucker": ([("mouth_corner_left", RIGHT, 7.0), ("lip_lower", FRONT, 5.0)], (*BROWS, *LIDS, *SKULL)),
    "mouthLeft": ([("mouth_corner_left", LEFT, 4.0), ("lip_upper", LEFT, 4.0)], (*BROWS, *LIDS, *SKULL)),
    "mouthRight": ([("mouth_corner_left", RIGHT, 4.0), ("lip_upper", RIGHT, 4.0)], (*BROWS, *LIDS, *SKULL)),
    "mouthSmileLeft": (
        [("mouth_corner_left", UP, 7.0), ("mouth_corner_left", LEFT, 5.0), ("mouth_corner_left", BACK, 2.0)],
        (*BROWS, *LIDS, *SKULL, "chin"),
    ),
    "mouthFrownLeft": ([("mouth_corner_left", DOWN, 6.0)], (*BROWS, *LIDS, *SKULL, "nose_tip")),
    "mouthDimpleLeft": ([("mouth_corner_left", LEFT, 3.5), ("mouth_corner_left", BACK, 3.5)], (*BROWS, *LIDS, *CHIN)),
    "mouthStretchLeft": ([("mouth_corner_left", LEFT, 6.0), ("mouth_corner_left", DOWN, 2.5)], (*BROWS, *LIDS, *SKULL)),
    "mouthRollLower": (
        [("lip_lower_border", UP, 3.0), ("lip_lower_border", BACK, 2.0)],
        (*BROWS, *LIDS, *SKULL, "lip_upper"),
    ),
    "mouthRollUpper": (
        [("lip_upper_border", DOWN, 3.0), ("lip_upper_border", BACK, 2.0)],
        (*BROWS, *LIDS, *CHIN, "lip_lower"),
    ),
    "mouthShrugLower": ([("lip_lower", UP, 3.5), ("chin", UP, 3.0)], (*BROWS, *LIDS, *SKULL, "nose_tip")),
    "mouthShrugUpper": ([("lip_upper", UP, 3.0)], (*BROWS, *LIDS, *CHIN, "lip_lower")),
    "mouthPressLeft": (
        [("lip_lower_border", UP, 0.5), ("lip_upper_border", DOWN, 0.3), ("lip_lower_side_left", BACK, 0.8)],
        (*BROWS, *LIDS, *SKULL),
    ),
    "mouthLowerDownLeft": (
        [("lip_lower_side_left", DOWN, 6.0)],
        (*BROWS, *LIDS, *SKULL, "lip_upper_side_left", "nose_tip"),
    ),
    "mouthUpperUpLeft": ([("lip_upper_side_left", UP, 5.0)], (*BROWS, *LIDS, *CHIN, "lip_lower_side_left")),
    "browDownLeft": (
        [("brow_inner_left", DOWN, 5.0), ("brow_mid_left", DOWN, 4.0), ("brow_inner_left", RIGHT, 1.5)],
        (*LIPS, *CHIN),
    ),
    "browInnerUp": (
        [("brow_inner_left", UP, 5.0), ("brow_inner_right", UP, 5.0)],
        (*LIPS, *CHIN, "brow_outer_left", *LIDS),
    ),
    "browOuterUpLeft": ([("brow_outer_left", UP, 6.0)], (*LIPS, *CHIN, *LIDS, "brow_inner_left")),
    "cheekPuff": ([("cheek_mid_left", LEFT, 4.0), ("cheek_mid_left", FRONT, 2.5)], (*BROWS, *LIDS, *SKULL, "chin")),
    "cheekSquintLeft": (
        [("cheek_upper_left", UP, 4.0), ("cheek_upper_left", FRONT, 2.0)],
        (*BROWS, *LIPS, *CHIN, "pupil_left"),
    ),
    "noseSneerLeft": ([("nose_ala_left", UP, 3.5)], (*CHIN, "lip_lower", "brow_outer_left", "pupil_left")),
}


@pytest.fixture(scope="module")
def rig():
    return build_avatar()


@pytest.fixture(scope="module")
def places():
    return landmarks()


def moves(rig, shape, vertex):
    return rig.deltas[rig.index(shape), vertex]


def as_right(name):
    return name.replace("_left", "_RIGHT").replace("_right", "_left").replace("_RIGHT", "_right")


def right_form():
    for shape, (does, still) in DOES.items():
        if shape.endswith("Left") and not shape.startswith(("jaw", "mouthLeft")):
            mirrored = [(as_right(place), way * [-1, 1, 1], least) for place, way, least in does]
            yield shape[:-4] + "Right", (mirrored, tuple(as_right(place) for place in still))


EVERY = {**DOES, **dict(right_form())}


def test_the_shapes_are_apples_in_apples_order(rig):
    assert list(rig.shapes) == APPLE == list(SHAPES)
    assert set(EVERY) == set(APPLE)  # no shape goes unmeasured


@pytest.mark.parametrize("shape", APPLE)
def test_a_shape_does_what_its_name_says(rig, places, shape):
    does, still = EVERY[shape]
    for place, way, least in does:
        assert moves(rig, shape, places[place]) @ way >= least, (place, moves(rig, shape, places[place]))
    for place in still:
        assert np.linalg.norm(moves(rig, shape, places[place])) < 0.35, (place, moves(rig, shape, places[place]))


@pytest.mark.parametrize("shape", [s for s in APPLE if s.endswith("Left") and s not in ("jawLeft", "mouthLeft")])
def test_a_left_shape_moves_nothing_on_the_right(rig, shape):
    right = base_head().vertices[:, 0] < -6.0
    assert np.abs(rig.deltas[rig.index(shape), right]).max() == 0.0


@pytest.mark.parametrize("shape", [s for s in APPLE if s.endswith("Left")])
def test_right_is_the_mirror_image_of_left(rig, shape):
    mirrored = rig.deltas[rig.index(shape)][mirror_pairs()] * [-1, 1, 1]
    assert np.array_equal(mirrored, rig.deltas[rig.index(shape[:-4] + "Right")])


def test_shapes_of_both_sides_are_symmetric(rig):
    both = [s for s in APPLE if not s.endswith(("Left", "Right"))]
    for shape in both:
        moved = rig.deltas[rig.index(shape)]
        assert np.abs(moved[mirror_pairs()] * [-1, 1, 1] - moved).max() < 1e-9, shape


def test_shapes_are_linearly_independent(rig):
    flat = rig.deltas.reshape(rig.n_shapes, -1)
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.linalg.svd(flat, compute_uv=False).min() > 0.03
