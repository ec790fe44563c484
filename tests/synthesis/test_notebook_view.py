"""Playing in a notebook: the clock decides the frame, and the controls do what they say."""

import asyncio
import io

import numpy as np
import pytest
from mimique.errors import MimiqueError
from mimique.synthesis.notebook_view import NotebookView, has_widgets
from mimique.synthesis.playback import NotebookFilm, show
from PIL import Image

from .test_scene import make_performance

pytest.importorskip("ipywidgets", reason="ipywidgets is not installed")


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def view(clock):
    performance = make_performance()
    segments = [(0, 3), (3, performance.n_frames)]
    try:
        made = NotebookView(performance, size=(160, 120), segments=segments, clock=clock)
    except MimiqueError as error:
        pytest.skip(str(error))
    yield made
    made.close()


def picture(view):
    return np.asarray(Image.open(io.BytesIO(view.picture.value)))


def test_it_begins_with_the_first_frame_at_rest(view):
    assert picture(view).shape == (120, 160, 3)
    assert view.slider.value == view.scene.frame == 0
    assert view.buttons["play"].icon == "play"


def test_buttons_and_slider_move_it(view):
    view.buttons["forward"].click()
    assert view.slider.value == view.scene.frame == 1
    view.buttons["next"].click()
    assert view.scene.frame == 3
    view.buttons["previous"].click()
    assert view.scene.frame == 0
    view.slider.value = 4
    assert view.scene.frame == view.player.frame == 4
    view.buttons["back"].click()
    assert view.slider.value == 3


def test_playing_follows_the_clock_and_leaves_frames_out(view, clock):
    async def play():
        view.buttons["play"].click()
        assert view.buttons["play"].icon == "pause"
        clock.now = 2.4 / view.player.rate  # two frames later, of which the first was never drawn
        await asyncio.sleep(0.05)
        assert view.scene.frame == 2
        clock.now = 1e3
        await asyncio.wait_for(view._task, 30)

    asyncio.run(play())
    assert view.slider.value == view.scene.n_frames - 1
    assert view.buttons["play"].icon == "play"


def test_speed_and_loop_are_told_in_the_player(view):
    view.speed.value = 4
    assert view.player.speed == 4.0
    view.buttons["loop"].click()
    assert view.player.loop == (0, 3) and view.scene.loop == (0, 3)


def test_the_camera_changes_the_picture(view):
    before = picture(view).astype(int)
    view.camera.value = "side"
    assert np.abs(picture(view) - before).mean() > 0.5


def test_a_notebook_is_given_the_widget(view):
    bundle = view._repr_mimebundle_()
    data = bundle[0] if isinstance(bundle, tuple) else bundle
    assert "application/vnd.jupyter.widget-view+json" in data


def test_outside_a_notebook_it_is_a_film(monkeypatch):
    assert not has_widgets()
    try:
        assert isinstance(show(make_performance(), size=(96, 96), seconds=0.1), NotebookFilm)
    except MimiqueError as error:
        pytest.skip(str(error))
    monkeypatch.setattr("mimique.synthesis.playback.has_widgets", lambda: True)
    made = show(make_performance(), size=(96, 96))
    assert isinstance(made, NotebookView)
    made.close()
