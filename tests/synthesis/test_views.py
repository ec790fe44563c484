"""Views of a performance: which markers, which columns, whose camera; and machines that cannot draw."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mimique.errors import InputError, MimiqueError, RigError
from mimique.synthesis.marker_balls import MARKER_COLOURS, find_shown_kinds
from mimique.synthesis.performance import Performance, count_clock_frames
from mimique.synthesis.scene import Scene
from mimique.synthesis.screen_layout import Layout
from mimique.synthesis.timeline import Timeline
from mimique.synthesis.view import View

from .test_scene import N_FRAMES, make_performance, make_rig

SIZE = (480, 270)
ALL = ("raw", "adapted", "fitted", "residuals")
VERTICES = np.array([212, 220, 228, 110])


def marked(**changes) -> Performance:
    """Adapted markers 12 mm above the fitted ones, raw ones 12 mm below."""
    weights = make_performance().weights
    fitted = make_rig().pose(weights, VERTICES)
    given = {
        "markers": fitted + [0, 12, 8],
        "raw_markers": fitted[:, :3] + [0, -12, 8],
        "marker_vertices": VERTICES,
        "title": "ab",
    }
    return make_performance(**(given | changes))


def draw(performance, view, frame=5, size=SIZE, beside=None):
    try:
        with Scene(performance, size, view=view, beside=beside) as scene:
            return scene.image(frame).astype(int)
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")


def columns_of(image, curves=True, n=2):
    layout = Layout(image.shape[1], image.shape[0], n, curves, captions=True)
    boxes = [layout.column(i) for i in range(n)]
    return [image[image.shape[0] - top : image.shape[0] - bottom, left:right] for left, bottom, right, top in boxes]


def is_skin(pixels):
    return pixels[..., 0] > pixels[..., 2] + 25


def count_hue(pixels, kind):
    """Count the pixels of a marker's hue, whatever the light."""
    colour = np.array([int(MARKER_COLOURS[kind][i : i + 2], 16) for i in (1, 3, 5)], dtype=float)
    length = np.linalg.norm(pixels, axis=2)
    cosine = pixels @ colour / np.maximum(length, 1) / np.linalg.norm(colour)
    return int(((cosine > 0.995) & (length > 180)).sum())


def test_each_kind_of_marker_is_shown_when_it_is_asked_for_and_only_then():
    for kind in ("raw", "fitted", "residuals"):
        with_it = columns_of(draw(marked(), View("beside", show=("adapted", kind))))[1]
        without = columns_of(draw(marked(), View("beside", show=tuple(k for k in ALL if k != kind))))[1]
        assert count_hue(with_it, kind) > 12, kind
        assert count_hue(without, kind) < 0.2 * count_hue(with_it, kind), kind


def test_markers_beside_leave_the_skin_alone_and_have_a_column_of_their_own():
    skin, markers = columns_of(draw(marked(), View("beside", show=ALL)))
    assert is_skin(skin).mean() > 0.15 and is_skin(markers).mean() < 0.02
    bare = columns_of(draw(marked(markers=None, marker_vertices=None, raw_markers=None), View("beside", show=ALL)))[0]
    np.testing.assert_array_equal(skin, bare)


def test_what_a_performance_does_not_have_is_not_shown():
    assert find_shown_kinds(marked(), ALL) == ALL
    assert find_shown_kinds(marked(marker_vertices=None), ALL) == ("raw", "adapted")
    assert find_shown_kinds(make_performance(), ALL) == ()
    empty = marked(markers=np.zeros((N_FRAMES, 0, 3)), marker_vertices=np.zeros(0, dtype=int), raw_markers=None)
    assert find_shown_kinds(empty, ALL) == ()
    draw(empty, View("beside", show=ALL, heat="displacement"))


def test_a_face_whose_weights_are_not_known_is_grey_and_colours_come_back():
    weights = make_performance().weights.copy()
    weights[10] = np.nan
    try:
        with Scene(marked(weights=weights), SIZE, view=View(curves=False)) as scene:
            before, lost, after = (scene.image(frame).astype(int) for frame in (9, 10, 11))
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")
    assert is_skin(before).mean() > 0.15 and is_skin(lost).mean() < 0.01
    np.testing.assert_array_equal(before, after)


def test_two_takes_share_the_clock_in_seconds():
    fast, slow = marked(), make_performance(title="slow", rate=10.0, tiers={})
    assert count_clock_frames(fast, slow) == 180 and count_clock_frames(slow, fast) == 60
    image = {frame: draw(fast, View("none"), frame, beside=slow) for frame in (29, 31, 89, 91, 179)}
    one = {frame: columns_of(picture)[0] for frame, picture in image.items()}
    two = {frame: columns_of(picture)[1] for frame, picture in image.items()}
    assert np.abs(one[29] - one[31]).max() > 50 and np.abs(two[29] - two[31]).max() == 0
    assert np.abs(one[89] - one[91]).max() == 0 and np.abs(two[89] - two[91]).max() > 50
    np.testing.assert_allclose(two[91], one[31], atol=2)  # the same face under the same camera; VTK dithers


def test_segments_of_the_take_beside_stand_at_their_seconds():
    slow = make_performance(title="slow", rate=15.0)  # changes its label after two seconds
    timeline = Timeline(marked(), Layout(960, 540), slow)
    assert timeline.n_frames == 120 and timeline.duration == 4
    row = next(row for row in timeline._rows if row.performance is slow)
    assert [(a, b) for a, b, _ in timeline._segments(row)] == [(0, 60), (60, 120)]
    assert timeline.draw_panel(119).shape == (432, 240, 3)


@pytest.mark.parametrize("camera", ["three-quarter", "side"])
def test_the_camera_goes_round_to_the_subjects_left(camera):
    try:
        with Scene(marked(), SIZE, view=View(camera=camera)) as scene:
            position = np.array(scene.plotter.renderers[0].camera.position)
            scene.aim("front")
            front = np.array(scene.plotter.renderers[0].camera.position)
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")
    assert position[0] > front[0] + 100 and position[2] < front[2] - 50


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ({"markers": "under"}, "markers: expected overlay, beside or none"),
        ({"show": ("raw", "cooked")}, "show: expected raw, .*'cooked'"),
        ({"heat": "fever"}, "heat: expected displacement or residual"),
        ({"camera": "back"}, "camera: expected front, three-quarter or side"),
    ],
)
def test_words_that_are_none_are_refused(words, says):
    with pytest.raises(InputError, match=says):
        View(**words)


@pytest.mark.parametrize(
    ("changes", "error", "says"),
    [
        ({"marker_vertices": np.array([0, 1, 2, 441])}, RigError, "expected 0 to 440, but got 441"),
        ({"marker_vertices": np.array([0, 1])}, InputError, "marker vertices"),
        ({"markers": None}, InputError, "expected markers"),
        ({"raw_markers": np.zeros((3, 4, 3))}, InputError, "raw markers"),
    ],
)
def test_markers_that_do_not_fit_are_refused(changes, error, says):
    with pytest.raises(error, match=says):
        marked(**changes)


@pytest.mark.parametrize("size", [(64, 64), (333, 251), (101, 640)])
def test_a_take_of_one_frame_at_odd_sizes(size):
    one = Performance(
        make_rig(), np.full((1, 2), 0.4), 200.0, tiers={"t": pd.DataFrame(columns=["onset", "offset", "label"])}
    )
    for view in (View(), View("beside", show=ALL, heat="displacement"), View(curves=False)):
        assert draw(one, view, 0, size).shape == (size[1], size[0], 3)


CANNOT = """
import sys
from mimique.errors import MimiqueError
from mimique.synthesis import Rig
from mimique.synthesis.contact_sheet import write_sheet
from mimique.synthesis.movie import write_movie
from mimique.synthesis.performance import Performance
from mimique.synthesis.playback import play
rig = Rig([[0, 0, 0], [90, 0, 0], [0, 90, 0]], [[0, 1, 2]], [[[0, 9, 0]] * 3], ("up",))
performance = Performance(rig, [[0.0], [1.0]], 10.0)
ways = [lambda: play(performance), lambda: write_sheet(performance, "x.png"), lambda: write_movie(performance, "x.gif")]
for draw in ways:
    try:
        draw()
        print("drawn")
    except MimiqueError as error:
        print(error)
"""


def run_elsewhere(tmp_path, *before, **changes):
    env = {key: value for key, value in os.environ.items() if not key.startswith(("VTK_", "DISPLAY"))} | changes
    done = subprocess.run(
        [*before, sys.executable, "-c", CANNOT], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="hides Linux's libraries")
def test_where_no_opengl_is_each_way_of_drawing_says_in_one_line_what_to_install(tmp_path):
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    for name in ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so", "libEGL.so.1", "libEGL.so", "libGL.so.1"):
        (hidden / name).touch()  # found before the real one, and no library
    lines = run_elsewhere(tmp_path, LD_LIBRARY_PATH=str(hidden), DISPLAY=":987")
    assert len(lines) == 3
    assert all("libosmesa6" in line and "libegl1" in line for line in lines)
    assert [p.name for p in tmp_path.iterdir()] == ["hidden"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="displays are Linux's")
def test_a_display_that_is_not_there_is_one_line_and_not_a_window_that_nobody_sees(tmp_path):
    window, sheet, film = run_elsewhere(tmp_path, DISPLAY=":987")
    assert "window" in window and "--movie" in window
    if "cannot draw" in sheet:
        pytest.skip("this machine cannot draw off screen")
    assert (sheet, film) == ("drawn", "drawn")


KEYS = """
from synthesis_tests.test_views import ALL, marked
from mimique.synthesis import playback
from mimique.synthesis.player import Player
from mimique.synthesis.scene import Scene
from mimique.synthesis.view import View
performance = marked()
now = [0.0]
with Scene(performance, (480, 270), off_screen=False, view=View("beside", show=ALL)) as scene:
    player = Player(scene.n_frames, performance.rate, lambda: now[0], playback.find_segments(performance))
    window = playback._Window(scene, player)
    keys = iter(["space", "n", "l", "4", "h", "q", "h", "Right", "Home", "Escape"])
    show = window._on_time
    def tick(interactor):
        show(interactor)
        key = next(keys)
        interactor.SetKeySym(key)
        interactor.InvokeEvent("KeyPressEvent")
        print(key, scene.frame, player.playing, player.loop, scene.state, sep="|")
        now[0] += 0.1
        return False
    window._on_time = tick
    window.run()
"""


@pytest.mark.skipif(shutil.which("xvfb-run") is None, reason="no virtual display (xvfb) at hand")
def test_the_window_follows_keys_and_clock(tmp_path):
    (tmp_path / "synthesis_tests").symlink_to(Path(__file__).parent)
    command = ["xvfb-run", "-a", "-s", "-screen 0 800x600x24", sys.executable, "-c", KEYS]
    env = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=100)
    if "cannot open a window" in done.stderr:
        pytest.skip("the virtual display has no OpenGL")
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if "|" in line]
    assert lines == [
        "space|0|True|None|",
        "n|30|True|None|",
        "l|33|True|(30, 60)|loop",
        "4|36|True|(30, 60)|speed 2, loop",
        "h|42|True|(30, 60)|speed 2, loop",
        "q|48|True|(30, 60)|speed 2, loop",
        "h|54|True|(30, 60)|speed 2, loop",
        "Right|31|False|(30, 60)|speed 2, loop",
        "Home|0|False|None|speed 2",
        "Escape|0|False|None|speed 2",
    ]
