"""Contact sheets: which frames, where, and with what under them."""

import numpy as np
import pytest
from mimique.errors import InputError, MimiqueError
from mimique.synthesis.affect_colours import AFFECT_COLOURS
from mimique.synthesis.contact_sheet import choose_sheet_frames, draw_sheet, write_sheet
from mimique.synthesis.scene import Scene
from mimique.synthesis.view import View
from PIL import Image

from .test_scene import make_performance


def test_a_face_a_second():
    np.testing.assert_array_equal(choose_sheet_frames(1000, 200.0, 1.0), [0, 200, 400, 600, 800])
    np.testing.assert_array_equal(choose_sheet_frames(1001, 200.0, 1.0), [0, 200, 400, 600, 800, 1000])
    np.testing.assert_array_equal(choose_sheet_frames(1, 200.0, 1.0), [0])
    np.testing.assert_array_equal(choose_sheet_frames(30, 29.97, 0.5), [0, 14, 29])


@pytest.mark.parametrize(("every", "says"), [(0.0, "positive"), (-1.0, "positive"), (0.01, "too many.*every 0.8 s")])
def test_what_does_not_suit_the_take_is_refused(every, says):
    with pytest.raises(InputError, match=says):
        choose_sheet_frames(600 * 25, 25.0, every)


def test_faces_and_labels_stand_in_order(tmp_path):
    performance = make_performance()  # neutral for a second, then joy
    try:
        sheet = draw_sheet(performance, every=0.5, tile=(80, 100))
        with Scene(performance, (80, 100), view=View(curves=False)) as scene:
            faces = [scene.image(frame) for frame in (0, 15, 30, 45)]
    except MimiqueError as error:
        pytest.skip(f"this machine cannot draw: {error}")
    for number, face in enumerate(faces):
        x = 6 + number * 86
        np.testing.assert_array_equal(sheet[40:140, x : x + 80], face)
        for affect, shown in (("neutral", number < 2), ("joy", number >= 2)):
            colour = [int(AFFECT_COLOURS[affect][i : i + 2], 16) for i in (1, 3, 5)]
            found = (np.abs(sheet[140:, x : x + 80].astype(int) - colour).max(axis=2) <= 2).sum()
            assert bool(found > 60) is shown
    path = write_sheet(performance, tmp_path / "sheet.png", every=0.5, tile=(80, 100))
    np.testing.assert_array_equal(np.asarray(Image.open(path)), sheet)
    assert [p.name for p in tmp_path.iterdir()] == ["sheet.png"]


def test_bad_targets_are_refused_before_anything_is_drawn(tmp_path):
    with pytest.raises(InputError, match=r"\.png"):
        write_sheet(make_performance(), tmp_path / "sheet.jpg")
    with pytest.raises(InputError, match="no folder"):
        write_sheet(make_performance(), tmp_path / "nowhere" / "sheet.png")
