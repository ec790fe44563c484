"""Pictures of marked faces: dots at their places, hidden ones left out, numbers that can be read."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from mimique.synthesis.avatar import build_avatar
from mimique.synthesis.head_markers import head_markers
from mimique.synthesis.landmarks import FaceLandmarks
from mimique.workbench.layout_reports.drawings import draw_layout_pictures, draw_region_faces
from mimique.workbench.layout_reports.label_placement import count_overlaps, place_labels
from mimique.workbench.layout_reports.pictures import blank_views, draw_marks, draw_view, number_layout, render_views


@pytest.fixture(scope="module")
def face():
    rig = build_avatar()
    return rig, FaceLandmarks(rig)


@pytest.mark.parametrize("seed", range(4))
def test_labels_of_crowded_points_neither_overlap_nor_cover_points(seed):
    points = np.random.default_rng(seed).uniform(0, 100, (45, 2))
    sizes = np.tile([6.0, 4.0], (45, 1))
    centres = place_labels(points, sizes, 1.0)
    assert count_overlaps(centres, sizes) == 0
    covered = (np.abs(centres[:, None] - points) < sizes[:, None] / 2).all(axis=2)
    assert not covered.any()
    assert np.linalg.norm(centres - points, axis=1).max() < 30


def test_lone_label_stands_beside_its_point_and_none_is_none():
    centre = place_labels([[5.0, 5.0]], [[4.0, 2.0]], 0.5)
    assert 1.0 < np.linalg.norm(centre[0] - 5) < 4.0
    assert place_labels(np.empty((0, 2)), np.empty((0, 2)), 1.0).shape == (0, 2)
    assert count_overlaps([[0, 0], [1, 0], [9, 9]], np.full((3, 2), 2.0)) == 1


def test_vertices_are_drawn_where_the_projection_says(face):
    rig, landmarks = face
    names = ["nose_tip", "mouth_corner_left", "brow_outer_right", "chin"]
    for name in names:
        vertex = landmarks.vertex(name)
        near = np.linalg.norm(rig.neutral - rig.neutral[vertex], axis=1) < 5
        colours = np.where(near[:, None], [1.0, 0.0, 0.0], [0.7, 0.7, 0.7])
        view = render_views(rig, (0.0,), vertices=[landmarks.vertex(n) for n in names], colours=colours, pixels=300)[0]
        red = (view.image[..., 0].astype(int) - view.image[..., 1]) > 60
        rows, columns = np.nonzero(red)
        left, right, bottom, top = view.extent
        found = [
            left + (columns.mean() + 0.5) / red.shape[1] * (right - left),
            top - (rows.mean() + 0.5) / red.shape[0] * (top - bottom),
        ]
        assert np.linalg.norm(found - rig.neutral[vertex] @ view.axes) < 4, name


def test_what_looks_away_or_is_covered_is_not_marked(face):
    rig, landmarks = face
    jaws = [landmarks.vertex(f"jaw_corner_{side}") for side in ("left", "right")]
    tip, back = landmarks.vertex("nose_tip"), int(rig.neutral[:, 2].argmin())
    front, right, left = render_views(rig, (0.0, -62.0, 62.0), vertices=[*jaws, tip], pixels=300)
    assert front.visible[tip] and not front.visible[back]
    assert left.visible[jaws[0]] and not left.visible[jaws[1]]
    assert right.visible[jaws[1]] and not right.visible[jaws[0]]
    skin = landmarks.surface.skin
    assert not front.visible[skin & ~landmarks.surface.visible & (rig.neutral[:, 2] < rig.neutral[tip, 2] - 40)].any()


def test_blank_view_has_the_same_frame(face):
    rig, landmarks = face
    where = [landmarks.vertex(n) for n in ("nose_tip", "mouth_corner_left", "brow_outer_right")]
    drawn = render_views(rig, (0.0,), vertices=where, pixels=120)[0]
    blank = blank_views(rig, (0.0,), vertices=where)[0]
    assert blank.extent == drawn.extent
    assert blank.visible[where].all()
    assert (blank.image == 255).all()


def test_every_marker_of_a_layout_is_in_some_picture(face):
    rig, landmarks = face
    vertices = [landmarks.vertex(n) for n in ("nose_tip", "cheek_left", "cheek_right", "chin", "temple_left")]
    pictures = draw_layout_pictures(rig, vertices, {"crown": landmarks.vertex("forehead")})
    assert pictures.unseen == () and pictures.blank == ""
    hidden = draw_layout_pictures(rig, vertices, head_markers(rig, landmarks=landmarks))
    assert hidden.unseen == ()  # the hair covers some of the head's
    texts = [t.get_text() for axis in pictures.front.axes for t in axis.texts]
    assert {"1", "2", "3", "4", "H1"} <= set(texts)
    width, height = pictures.front.get_size_inches()
    assert width <= 7.01 and height <= 9.31


def test_numbers_of_a_dense_layout_do_not_overlap_in_the_picture(face):
    rig, landmarks = face
    seen = np.flatnonzero(landmarks.outside & (rig.neutral[:, 2] > 40))
    vertices = np.random.default_rng(3).choice(seen, 50, replace=False).tolist()
    view = render_views(rig, (0.0,), vertices=vertices, pixels=120)[0]
    figure = Figure(figsize=(7, 7 * view.aspect))
    axis = figure.add_axes((0, 0, 1, 1))
    draw_view(axis, view)
    drawn = draw_marks(axis, view, rig, number_layout(vertices, {}))
    figure.canvas.draw()
    boxes = [t.get_window_extent() for t in axis.texts]
    assert len(boxes) == len(drawn) > 40
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_regions_are_drawn_for_each_layout(face):
    import pandas as pd

    rig, landmarks = face
    errors = pd.DataFrame({"brows": [0.1, 0.2], "lips": [0.3, np.nan]}, index=["one", "other"])
    figure = draw_region_faces(rig, errors, landmarks=landmarks)
    assert [axis.get_title() for axis in figure.axes][:2] == ["one", "other"]
    assert "0.30" in [t.get_text() for t in figure.axes[0].texts]
    assert len(figure.axes[1].texts) == 1
