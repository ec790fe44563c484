"""The picture of a performance: what is where, and that it follows the frame."""

import io

import numpy as np
import pandas as pd
import pytest
from mimique.errors import InputError, MimiqueError, RigError
from mimique.synthesis import drawing
from mimique.synthesis.affect_colours import AFFECT_COLOURS
from mimique.synthesis.moving_mesh import find_normals
from mimique.synthesis.performance import Performance
from mimique.synthesis.rig import Rig
from mimique.synthesis.scene import Scene, find_face_box
from mimique.synthesis.screen_layout import Layout
from mimique.synthesis.timeline import Timeline, choose_tick
from PIL import Image

SIZE = (480, 270)
N_FRAMES = 60


def make_rig() -> Rig:
    """A bulging square patch, 120 mm wide: one shape pulls its lower edge down, the other moves nothing else."""
    side = 21
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-60, 60, side), np.linspace(-60, 60, side)))
    neutral = np.stack([x, y, 30 - (x**2 + y**2) / 200], axis=1)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + side + 1], axis=1)
    upper = np.stack([corner, corner + side + 1, corner + side], axis=1)
    deltas = np.zeros((2, len(neutral), 3))
    deltas[0, :, 1] = np.where(y < -20, -40.0, 0.0)
    deltas[1, :, 2] = np.where(x > 10, 30.0, 0.0)
    return Rig(neutral, np.concatenate([lower, upper]), deltas, ("pull", "lift"))


def make_performance(**changes) -> Performance:
    """Neutral in the first half, pulled in the second; manual and automatic tiers that change with it."""
    rig, half = make_rig(), N_FRAMES // 2
    weights = np.zeros((N_FRAMES, 2))
    weights[half:, 0] = 1.0
    tiers = {
        "manual": pd.DataFrame({"onset": [0, half], "offset": [half, N_FRAMES], "label": ["neutral", "joy"]}),
        "automatic": pd.DataFrame({"onset": [half], "offset": [N_FRAMES], "label": ["NA"]}),
    }
    given = {"rig": rig, "weights": weights, "rate": 30.0, "title": "ab_IE_joy", "note": "simulated", "tiers": tiers}
    return Performance(**(given | changes))


@pytest.fixture(scope="module")
def pictures():
    """Pictures of some frames, drawn once."""
    rig = make_rig()
    weights = make_performance().weights
    markers = rig.pose(weights, [212, 220, 228])
    markers[: N_FRAMES // 2, 1] = np.nan
    try:
        with Scene(make_performance(), SIZE) as plain, Scene(make_performance(markers=markers), SIZE) as marked:
            return {
                "plain": {f: plain.image(f) for f in (0, 10, 40)},
                "again": plain.image(10),
                "file": plain.png(10),
                "marked": {f: marked.image(f) for f in (0, 40)},
            }
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")


def face_of(image: np.ndarray) -> np.ndarray:
    layout = Layout(*SIZE)
    return image[: SIZE[1] - layout.strip_height, layout.panel_width :].astype(int)


def is_skin(pixels: np.ndarray) -> np.ndarray:
    return pixels[..., 0] > pixels[..., 2] + 25


def test_the_face_fills_its_part_of_the_picture(pictures):
    image = pictures["plain"][0]
    assert image.shape == (SIZE[1], SIZE[0], 3) and image.dtype == np.uint8
    rows, columns = np.nonzero(is_skin(face_of(image)))
    height, width, _ = face_of(image).shape
    assert 0.7 * height < np.ptp(rows) < height - 4
    assert abs(columns.mean() - width / 2) < 0.03 * width


def test_the_mesh_moves_as_the_weights_say(pictures):
    still = np.abs(face_of(pictures["plain"][0]) - face_of(pictures["plain"][10])).max()
    assert still == 0
    before, after = (is_skin(face_of(pictures["plain"][f])) for f in (0, 40))
    grown = after & ~before
    assert grown.sum() > 500  # the lower edge went down
    assert np.nonzero(grown)[0].min() > 0.5 * len(before)
    np.testing.assert_array_equal(pictures["again"], pictures["plain"][10])
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(pictures["file"]))), pictures["again"])


def test_a_marker_is_shown_where_it_is_and_only_while_it_is_seen(pictures):
    for frame, seen in ((0, 2), (40, 3)):
        change = np.abs(face_of(pictures["marked"][frame]) - face_of(pictures["plain"][frame])).max(axis=2) > 40
        rows, columns = np.nonzero(change)
        height, width = change.shape
        middle = (abs(columns - width / 2) < 0.1 * width) & (rows < 0.8 * height) & (rows > 0.2 * height)
        assert bool(middle.any()) is (seen == 3)
        assert (columns < 0.4 * width).any() and (columns > 0.6 * width).any()


def test_normals_are_those_of_the_sphere_and_of_a_slow_second_version(rng):
    import pyvista as pv

    ball = pv.Icosphere(radius=50.0, nsub=3)
    rig = Rig(ball.points, ball.regular_faces, np.zeros((1, ball.n_points, 3)), ("still",))
    normals = find_normals(rig.neutral, rig.triangles)
    assert np.abs(normals - rig.neutral / 50).max() < 0.01
    bumpy = rig.neutral + rng.normal(0, 1, rig.neutral.shape)
    slow = np.zeros_like(bumpy)
    for i, j, k in rig.triangles:
        slow[[i, j, k]] += np.cross(bumpy[j] - bumpy[i], bumpy[k] - bumpy[i])
    slow /= np.linalg.norm(slow, axis=1, keepdims=True)
    np.testing.assert_allclose(find_normals(bumpy, rig.triangles), slow, atol=1e-4)


def test_the_camera_looks_at_what_moves():
    rig = make_rig()
    np.testing.assert_allclose(find_face_box(rig)[1][:2], [60, 60])
    lower = Rig(rig.neutral, rig.triangles, rig.deltas[:1], ("pull",))
    assert find_face_box(lower)[1][1] < -20
    still = Rig(rig.neutral, rig.triangles, np.zeros_like(rig.deltas), rig.shapes)
    np.testing.assert_allclose(find_face_box(still)[0][:2], [-60, -60])


def rgb(affect: str) -> list[int]:
    return [int(AFFECT_COLOURS[affect][i : i + 2], 16) for i in (1, 3, 5)]


def count(image: np.ndarray, affect: str) -> int:
    return int((np.abs(image.astype(int) - rgb(affect)).max(axis=-1) <= 2).sum())


def test_the_panel_shows_the_labels_of_its_frame():
    timeline = Timeline(make_performance(), Layout(960, 540))
    first, last = timeline.draw_panel(0), timeline.draw_panel(59)
    assert first.shape == (432, 240, 3)
    assert count(first, "neutral") > 3000 and count(first, "joy") == 0 and count(first, "anger") == 0
    assert count(last, "joy") > 3000 and count(last, "anger") > 300  # neutral → anger shows both colours


def test_the_timeline_shows_segments_in_place_and_the_cursor_moves():
    timeline = Timeline(make_performance(energy=np.linspace(0, 5, N_FRAMES)), Layout(960, 540))
    strips = {f: timeline.draw_timeline(f).astype(int) for f in (0, 29, 59)}
    joy = np.nonzero((np.abs(strips[0] - rgb("joy")).max(axis=2) <= 2).any(axis=0))[0]
    assert abs(joy.min() - timeline.position_of(30)) <= 2 and abs(joy.max() - timeline.position_of(60)) <= 2
    for frame, strip in strips.items():
        columns = np.nonzero((strip == 255).all(axis=2).sum(axis=0) > 20)[0]
        assert abs(columns.mean() - timeline.position_of(frame + 0.5)) < 2


def test_a_pixel_of_the_timeline_and_its_frame_are_each_others_inverse():
    timeline = Timeline(make_performance(), Layout(960, 540))
    assert [timeline.frame_at(timeline.position_of(f + 0.5)) for f in range(N_FRAMES)] == list(range(N_FRAMES))
    assert timeline.frame_at(-50) == 0 and timeline.frame_at(5000) == N_FRAMES - 1


def test_labels_are_those_of_half_open_intervals():
    tier = pd.DataFrame({"onset": [10, 20, 22], "offset": [20, 40, 30], "label": ["a", "b", "c"]})
    p = make_performance(tiers={"t": tier})
    assert [p.label_at("t", f) for f in (9, 10, 19, 20, 22, 29, 30, 40)] == ["", "a", "a", "b", "c", "c", "b", ""]


@pytest.mark.parametrize(
    ("duration", "n_ticks", "step"), [(10, 16, 1), (10, 9, 2), (1, 16, 0.1), (60, 16, 5), (1000, 16, 100)]
)
def test_ticks(duration, n_ticks, step):
    assert choose_tick(duration, n_ticks) == pytest.approx(step)


def test_lost_frames_say_so():
    weights = make_performance().weights.copy()
    weights[3] = np.nan
    timeline = Timeline(make_performance(weights=weights), Layout(960, 540))
    lost, fine = timeline.draw_panel(3).astype(int), timeline.draw_panel(4).astype(int)
    warm = (lost[..., 0] > 200) & (lost[..., 2] < 130) & (lost[..., 0] > lost[..., 1] + 60)
    assert warm.sum() > 50
    assert not ((fine[..., 0] > 200) & (fine[..., 2] < 130) & (fine[..., 0] > fine[..., 1] + 60)).any()


@pytest.mark.parametrize(
    ("changes", "error", "says"),
    [
        ({"weights": np.zeros((5, 3))}, RigError, "expected 2 columns"),
        ({"weights": np.zeros((0, 2))}, InputError, "nothing to show"),
        ({"rate": 0.0}, InputError, "rate"),
        ({"markers": np.zeros((3, 4, 3))}, InputError, "markers"),
        ({"energy": np.zeros(7)}, InputError, "energy"),
        ({"vertex_colours": np.full((441, 3), 255.0)}, InputError, "0 to 1"),
        ({"tiers": {"affect": pd.DataFrame({"onset": [0]})}}, InputError, "'affect'.*label"),
    ],
)
def test_what_does_not_fit_together_is_refused(changes, error, says):
    with pytest.raises(error, match=says):
        make_performance(**changes)


def test_no_display_and_no_opengl_are_one_clear_line(monkeypatch):
    monkeypatch.setattr(drawing.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(MimiqueError, match=r"no display.*--movie"):
        Scene(make_performance(), SIZE, off_screen=False)


def test_a_machine_without_opengl_is_told_what_to_install(monkeypatch):
    import pyvista as pv

    class Window:
        def GetClassName(self):
            return "vtkOSOpenGLRenderWindow"

    class Plotter:
        render_window = Window()

        def __init__(self, **_):
            pass

        def close(self):
            pass

    monkeypatch.setattr(pv, "Plotter", Plotter)
    monkeypatch.setattr(drawing, "_has_library", lambda *_: False)
    with pytest.raises(MimiqueError, match="libosmesa6"):
        Scene(make_performance(), SIZE)


@pytest.mark.parametrize("size", [(960, 540), (320, 180), (200, 700), (1920, 1080)])
def test_any_take_has_a_timeline_and_a_panel_of_the_right_size(size):
    rig = make_rig()
    long = {name: pd.DataFrame({"onset": [0], "offset": [1], "label": ["a very long label " * 9]}) for name in "abcd"}
    empty = {"nothing": pd.DataFrame({"onset": [], "offset": [], "label": []})}
    for changes in ({}, {"tiers": long}, {"tiers": empty}, {"energy": [np.nan]}, {"energy": [0.0], "title": "t" * 200}):
        layout = Layout(*size)
        timeline = Timeline(Performance(rig, np.zeros((1, 2)), 200.0, **changes), layout)
        assert timeline.draw_timeline(0).shape == (layout.strip_height, size[0], 3)
        assert timeline.draw_panel(0).shape == (size[1] - layout.strip_height, layout.panel_width, 3)
