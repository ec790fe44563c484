"""Pictures of the avatar: like the stored ones, unlike those of other faces, and changing where a shape should.

To draw the stored pictures anew after the face or its light was changed on purpose, and to look at them::

    MIMIQUE_DRAW_PICTURES=1 python -m pytest tests/synthesis/test_pictures.py
"""

import os
from pathlib import Path

import numpy as np
import pytest
from mimique.errors import MimiqueError
from mimique.synthesis.avatar import build_avatar, default_markers, landmarks, vertex_colours
from mimique.synthesis.performance import Performance
from mimique.synthesis.scene import Scene
from mimique.synthesis.view import View
from PIL import Image
from scipy.ndimage import binary_dilation

from .structural_similarity import structural_similarity

STORED = Path(__file__).resolve().parents[1] / "data" / "pictures"
SIZE = (160, 160)
FACES = {
    "neutral": {},
    "joy": {"mouthSmileLeft": 0.9, "mouthSmileRight": 0.9, "cheekSquintLeft": 0.7, "cheekSquintRight": 0.7},
    "surprise": {"jawOpen": 0.5, "browInnerUp": 1, "browOuterUpLeft": 1, "browOuterUpRight": 1, "eyeWideLeft": 1},
    "half": {"mouthSmileLeft": 0.9},
}
VIEWS = {
    "joy": View(markers="none", curves=False),
    "surprise": View(markers="none", curves=False, camera="three-quarter", heat="displacement"),
    "half": View(show=("adapted", "fitted", "residuals"), curves=False, heat="residual"),
}
MOUTH = slice(80, 140), slice(40, 120)


@pytest.fixture(scope="module")
def rig():
    return build_avatar()


def draw(rig, view, faces):
    """Draw faces under a view, the scales of heat being those of all faces."""
    weights = np.zeros((len(FACES), rig.n_shapes))
    for row, shapes in zip(weights, FACES.values(), strict=True):
        row[[rig.index(shape) for shape in shapes]] = list(shapes.values())
    vertices = np.array(list(default_markers().values()))
    markers = rig.pose(weights, vertices) + 3 * np.sin(np.arange(len(vertices)))[:, None]
    performance = Performance(
        rig, weights, 1.0, markers=markers, marker_vertices=vertices, vertex_colours=vertex_colours()
    )
    try:
        with Scene(performance, SIZE, view=view) as scene:
            return {face: scene.image(list(FACES).index(face)) for face in faces}
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")


@pytest.mark.parametrize("name", list(VIEWS))
def test_a_picture_is_like_the_stored_one_and_another_expression_is_not(rig, name):
    pictures = draw(rig, VIEWS[name], FACES)
    path = STORED / f"{name}.png"
    if os.environ.get("MIMIQUE_DRAW_PICTURES"):
        STORED.mkdir(exist_ok=True)
        Image.fromarray(pictures[name]).save(path, optimize=True)
    assert path.stat().st_size <= 30_000
    stored = np.asarray(Image.open(path))
    alike = {face: structural_similarity(pictures[face], stored, MOUTH) for face in FACES}
    print(name, alike)
    assert alike[name] > 0.97
    assert max(alike[face] for face in FACES if face != name) < 0.95


def test_the_index_is_one_for_the_same_falls_with_noise_and_follows_the_formula(rng):
    picture = rng.integers(0, 256, (32, 40, 3)).astype(np.uint8)
    assert structural_similarity(picture, picture) == pytest.approx(1)
    noisy = [np.clip(picture + rng.normal(0, s, picture.shape), 0, 255) for s in (5, 20, 60)]
    found = [structural_similarity(picture, n) for n in noisy]
    assert 1 > found[0] > found[1] > found[2] > 0
    flat = [np.full((32, 40, 3), grey) for grey in (100, 150)]  # only the means count: (2ab + c) / (a² + b² + c)
    c = (0.01 * 255) ** 2
    assert structural_similarity(*flat) == pytest.approx((2 * 100 * 150 + c) / (100**2 + 150**2 + c))


@pytest.fixture(scope="module")
def changes(rig):
    """For every shape which pixels change, and which pixels its moved vertices fall on."""
    weights = np.concatenate([np.zeros((1, rig.n_shapes)), np.eye(rig.n_shapes)])
    performance = Performance(rig, weights, 1.0, vertex_colours=vertex_colours())
    try:
        with Scene(performance, SIZE, view=View(curves=False)) as scene:
            camera = scene.plotter.renderers[0].camera
            eye, aim, angle = np.array(camera.position), np.array(camera.focal_point), camera.view_angle
            pictures = [scene.image(frame).astype(int) for frame in range(len(weights))]
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")

    def project(points):
        """A pinhole camera, upright: column and row of points (n, 3)."""
        ahead = (aim - eye) / np.linalg.norm(aim - eye)
        right = np.cross(ahead, [0, 1, 0]) / np.linalg.norm(np.cross(ahead, [0, 1, 0]))
        depth = (points - eye) @ ahead
        scale = SIZE[1] / 2 / np.tan(np.radians(angle / 2)) / depth
        return (
            SIZE[0] / 2 + scale * ((points - eye) @ right),
            SIZE[1] / 2 - scale * ((points - eye) @ np.cross(right, ahead)),
        )

    found = {}
    for number, shape in enumerate(rig.shapes):
        changed = np.abs(pictures[number + 1] - pictures[0]).max(axis=2) > 12
        moved = np.linalg.norm(rig.deltas[number], axis=1) > 0.02
        expected = np.zeros(changed.shape, dtype=bool)
        for points in (rig.neutral[moved], rig.pose(weights[number + 1])[moved]):
            column, row = (np.clip(np.floor(v).astype(int), 0, SIZE[0] - 1) for v in project(points))
            expected[row, column] = True
        found[shape] = changed, binary_dilation(expected, iterations=4)
    places = {name: [float(v[0]) for v in project(rig.neutral[[vertex]])] for name, vertex in landmarks().items()}
    return found, places


def test_every_shape_changes_the_picture_and_only_where_its_vertices_are(rig, changes):
    found, _ = changes
    assert len(found) == 51
    for shape, (changed, expected) in found.items():
        assert changed.sum() >= 12, shape
        assert (changed & ~expected).sum() <= 0.02 * changed.sum() + 1, shape
        assert expected.mean() < 0.5, shape  # else the test could not fail


def test_every_shape_changes_the_part_of_the_face_that_it_is_named_after(rig, changes):
    found, _ = changes
    middle = SIZE[0] / 2
    for shape, (changed, _) in found.items():
        rows, columns = np.nonzero(changed)
        upper = shape.startswith(("eye", "brow"))
        assert (rows.mean() < 0.54 * SIZE[1]) == upper or shape.startswith(("cheek", "nose")), shape
        side = 1 if shape.endswith("Left") else -1 if shape.endswith("Right") else 0
        if shape in ("jawLeft", "jawRight", "mouthLeft", "mouthRight"):
            side = 0
        if side:  # the subject's left is at the right of the picture
            assert side * (columns.mean() - middle) > 4, shape
        else:
            assert abs(columns.mean() - middle) < 8, shape
    jaw = np.nonzero(found["jawOpen"][0])[0]
    assert jaw.min() > 0.5 * SIZE[1]
    blink = found["eyeBlinkLeft"][0]
    rows, columns = np.nonzero(blink)
    assert columns.min() > middle and np.ptp(columns) < 40 and np.ptp(rows) < 30
