"""Films: decoded again and looked at."""

import base64
import re
import subprocess

import numpy as np
import pandas as pd
import pytest
from mimique.errors import InputError, MimiqueError
from mimique.synthesis import movie
from mimique.synthesis.gif_writing import GifWriter
from mimique.synthesis.movie import choose_movie_frames, find_ffmpeg, write_movie
from mimique.synthesis.performance import Performance
from mimique.synthesis.playback import show
from mimique.synthesis.rig import Rig
from mimique.synthesis.scene import Scene
from mimique.synthesis.screen_layout import Layout
from mimique.synthesis.view import View
from PIL import Image

SIZE = (320, 180)


@pytest.fixture(scope="module")
def performance():
    """A pyramid whose tip goes down in the second half of two seconds at 120 Hz, labelled accordingly."""
    neutral = [[-50, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0], [0, 0, 60]]
    triangles = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    deltas = np.zeros((1, 5, 3))
    deltas[0, :, 1] = [-10, -10, 0, 0, -60]
    weights = np.repeat([0.0, 1.0], 120)[:, None]
    tiers = {"affect": pd.DataFrame({"onset": [0, 120], "offset": [120, 240], "label": ["neutral", "joy"]})}
    return Performance(Rig(neutral, triangles, deltas, ("down",)), weights, 120.0, title="tip", tiers=tiers)


@pytest.fixture(scope="module")
def ffmpeg():
    try:
        return find_ffmpeg()
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def film(performance, ffmpeg, tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "tip.mp4"
    try:
        return write_movie(performance, path, fps=25, size=SIZE)
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")


def decode(ffmpeg, path, size=SIZE):
    command = [ffmpeg, "-loglevel", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, check=True, capture_output=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, size[1], size[0], 3).astype(int)


def test_the_film_is_as_long_and_large_as_asked(film, ffmpeg):
    pictures = decode(ffmpeg, film)
    assert pictures.shape == (50, 180, 320, 3)
    about = subprocess.run([ffmpeg, "-hide_banner", "-i", str(film)], capture_output=True, text=True).stderr
    assert re.search(r"Duration: 00:00:02\.00", about)
    assert re.search(r"h264.*yuv420p\(tv, bt709.*320x180.*25 fps", about)
    assert [p.name for p in film.parent.iterdir()] == ["tip.mp4"]


def test_face_and_labels_change_when_they_should_and_not_before(film, ffmpeg):
    pictures = decode(ffmpeg, film)
    layout = Layout(*SIZE)
    face = pictures[:, : 180 - layout.strip_height, layout.panel_width :]
    panel = pictures[:, 20 : 180 - layout.strip_height - 30, : layout.panel_width]
    strip = pictures[:, 180 - layout.strip_height :]
    for part in (face, panel):
        jumps = np.abs(np.diff(part, axis=0)).mean(axis=(1, 2, 3))
        assert jumps.argmax() == 24  # frame 120 at 120 Hz is picture 25
        assert jumps[24] > 10 * np.delete(jumps, 24).max()
    assert np.abs(strip[-1] - strip[0]).max() > 100  # the cursor


def test_the_film_shows_what_the_scene_draws(film, ffmpeg, performance):
    pictures = decode(ffmpeg, film)
    with Scene(performance, SIZE) as scene:
        for picture, frame in ((10, 48), (40, 192)):
            assert np.abs(pictures[picture] - scene.image(frame)).mean() < 4  # what the compression costs


def test_pictures_show_the_frame_that_is_due():
    np.testing.assert_array_equal(choose_movie_frames(400, 200, 25), np.arange(50) * 8)
    np.testing.assert_array_equal(choose_movie_frames(4, 10, 25), [0, 0, 0, 1, 1, 2, 2, 2, 3, 3])
    np.testing.assert_array_equal(choose_movie_frames(300, 60, 30, start=60, stop=120), np.arange(60, 120, 2))
    assert len(choose_movie_frames(1, 200, 25)) == 1


@pytest.mark.parametrize(("start", "stop"), [(5, 5), (-1, 5), (0, 11)])
def test_a_part_that_is_not_there_is_refused(start, stop):
    with pytest.raises(InputError, match="film: expected a part"):
        choose_movie_frames(10, 30, 25, start, stop)


def test_odd_sizes_become_even(performance, ffmpeg, film, tmp_path):
    path = write_movie(performance, tmp_path / "odd.mp4", size=(161, 91), stop=24)
    assert decode(ffmpeg, path, (162, 92)).shape == (5, 92, 162, 3)


def test_interrupted_films_leave_nothing_and_keep_the_older_one(performance, film, tmp_path):
    older = tmp_path / "tip.mp4"
    older.write_bytes(b"older")

    def stop_at_three(done, total):
        assert total == 50
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_movie(performance, older, size=SIZE, progress=stop_at_three)
    assert [p.name for p in tmp_path.iterdir()] == ["tip.mp4"]
    assert older.read_bytes() == b"older"


def test_a_failing_encoder_is_one_clear_line(performance, film, tmp_path, monkeypatch):
    broken = tmp_path / "ffmpeg"
    broken.write_text("#!/bin/sh\necho noise >&2\necho 'Unknown encoder libx264' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr(movie, "find_ffmpeg", lambda: str(broken))
    with pytest.raises(MimiqueError, match="could not write the film: Unknown encoder libx264"):
        write_movie(performance, tmp_path / "tip.mp4", size=SIZE)
    assert [p.name for p in tmp_path.iterdir()] == ["ffmpeg"]


def test_no_ffmpeg_at_all_is_one_clear_line(monkeypatch):
    monkeypatch.setattr(movie.shutil, "which", lambda _: None)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"no ffmpeg.*mimique\[film\]"):
        find_ffmpeg()


def test_bad_targets_are_refused_before_anything_is_drawn(performance, tmp_path):
    with pytest.raises(InputError, match=r"\.mp4"):
        write_movie(performance, tmp_path / "film.avi")
    with pytest.raises(InputError, match="no folder"):
        write_movie(performance, tmp_path / "nowhere" / "film.mp4")


def read_gif(path):
    with Image.open(path) as film:
        pictures, durations = [], []
        for number in range(film.n_frames):
            film.seek(number)
            durations.append(film.info["duration"])
            pictures.append(np.asarray(film.convert("RGB")).astype(int))
        return pictures, durations, film.info.get("loop")


@pytest.mark.parametrize("fps", [25.0, 30.0, 12.5])
def test_a_gif_shows_the_same_and_keeps_time(performance, film, tmp_path, fps):
    path = write_movie(performance, tmp_path / "tip.gif", fps=fps, size=(161, 91))
    pictures, durations, loop = read_gif(path)
    assert loop == 0 and pictures[0].shape == (91, 161, 3)
    assert sum(durations) == 2000
    with Scene(performance, (161, 91)) as scene:
        start = 0
        for picture, duration in zip(pictures, durations, strict=True):
            frame = choose_movie_frames(240, 120.0, fps)[round(start / 1000 * fps)]
            assert np.abs(picture - scene.image(int(frame))).mean() < 4
            start += duration


def test_a_gif_is_written_as_it_is_drawn_and_what_stands_still_costs_nothing(tmp_path, rng):
    path, still = tmp_path / "still.gif", rng.integers(0, 256, (60, 80, 3)).astype(np.uint8)
    with GifWriter(path, (80, 60), 50.0) as writer:
        writer.write(still)
        moved = still.copy()
        moved[20:30, 40:50] = 255 - moved[20:30, 40:50]
        writer.write(moved)
        for _ in range(40_000):  # 800 s, more than one picture of a GIF can last
            writer.write(moved)
        writer.write(still)
    pictures, durations, _ = read_gif(path)
    assert sum(durations) == 40_003 * 20
    assert len(pictures) == 4
    assert path.stat().st_size < 3 * still.size


def test_without_ffmpeg_a_film_becomes_a_gif_and_says_why(performance, film, tmp_path, monkeypatch):
    monkeypatch.setattr(movie.shutil, "which", lambda _: None)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.warns(UserWarning, match=r"no ffmpeg.*wrote tip\.gif instead"):
        path = write_movie(performance, tmp_path / "tip.mp4", size=(160, 90), stop=24, fps=100)
    assert path == tmp_path / "tip.gif" and [p.name for p in tmp_path.iterdir()] == ["tip.gif"]
    assert sum(read_gif(path)[1]) == 200  # at 50 pictures a second, what players can do


def test_a_notebook_gets_the_film_within_its_page(performance, film, ffmpeg, tmp_path):
    shown = show(performance, size=(160, 90), seconds=0.4)
    found = re.fullmatch(
        r'<video src="data:video/mp4;base64,([^"]+)" width="160" controls loop muted></video>', shown._repr_html_()
    )
    (tmp_path / "film.mp4").write_bytes(base64.b64decode(found[1]))
    assert decode(ffmpeg, tmp_path / "film.mp4", (160, 90)).shape == (10, 90, 160, 3)


def test_a_film_of_the_face_alone_and_of_two_on_one_clock(performance, film, ffmpeg, tmp_path):
    slow = Performance(performance.rig, performance.weights[::4], 15.0, title="slow")  # four seconds
    path = write_movie(performance, tmp_path / "two.mp4", size=SIZE, fps=10, view=View(curves=False), beside=slow)
    pictures = decode(ffmpeg, path)
    assert len(pictures) == 40
    left, right = pictures[:, 20:, : SIZE[0] // 2], pictures[:, 20:, SIZE[0] // 2 :]
    for half, change in ((left, 9), (right, 19)):
        jumps = np.abs(np.diff(half, axis=0)).mean(axis=(1, 2, 3))
        assert jumps.argmax() == change and jumps[change] > 10 * np.delete(jumps, change).max()
