"""Heat maps: values in mm, colours that keep their order, and a scale that holds for the whole take."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.synthesis.captions import draw_scale_bar
from mimique.synthesis.heat import Heat, colour_table, round_up
from mimique.synthesis.moving_mesh import MovingMesh
from mimique.synthesis.performance import Performance
from mimique.synthesis.rig import Rig
from mimique.synthesis.screen_layout import Layout


def make_performance(**changes) -> Performance:
    """A line of ten vertices, 10 mm apart; the right half rises by 8 mm at weight 1; markers on three of them."""
    neutral = np.column_stack([np.arange(10) * 10.0, np.zeros(10), np.zeros(10)])
    deltas = np.zeros((1, 10, 3))
    deltas[0, 5:, 1] = 8.0
    rig = Rig(neutral, [[i, i + 1, i + 2] for i in range(8)], deltas, ("up",))
    weights = np.array([[0.0], [0.5], [1.0]])
    vertices = np.array([0, 5, 9])
    markers = rig.pose(weights, vertices) + np.array([[0, 0, 1.0], [0, 3.0, 4.0], [2.0, 0, 0]])
    given = {"rig": rig, "weights": weights, "rate": 10.0, "markers": markers, "marker_vertices": vertices}
    return Performance(**(given | changes))


def values(performance, what, frame):
    mesh = MovingMesh(performance.rig)
    mesh.pose(performance.weights[frame])
    return Heat(performance, what).values(frame, mesh)


def test_displacement_is_the_distance_from_the_neutral():
    found, share = values(make_performance(), "displacement", 1)
    np.testing.assert_allclose(found, [0] * 5 + [4] * 5, atol=1e-5)
    np.testing.assert_allclose(share, [0] * 5 + [1] * 5)  # what no shape moves keeps its colour
    assert Heat(make_performance(), "displacement").ceiling == 10


def test_residuals_are_those_of_the_markers_and_between_them_their_weighted_mean():
    p = make_performance()
    np.testing.assert_allclose(p.residuals_at(2), [1, 5, 2], atol=1e-9)
    found, share = values(p, "residual", 2)
    spacing = np.median([50, 40, 40])
    kernel = np.exp(-((p.rig.neutral[:, None, 0] - p.rig.neutral[None, [0, 5, 9], 0]) ** 2) / (2 * spacing**2))
    np.testing.assert_allclose(found, kernel @ [1, 5, 2] / kernel.sum(axis=1), rtol=1e-5)
    assert share.max() <= 1
    assert Heat(p, "residual").ceiling == 5


def test_a_missing_marker_does_not_count():
    markers = make_performance().markers.copy()
    markers[2, 1] = np.nan
    found, _ = values(make_performance(markers=markers), "residual", 2)
    assert found.min() >= 1 and found.max() <= 2
    lost = make_performance(weights=np.array([[0.0], [0.5], [np.nan]]))
    assert np.isnan(lost.residuals_at(2)).all()
    assert (values(lost, "residual", 2)[1] == 0).all()  # nothing known: nothing coloured


def test_residuals_that_are_not_known_are_refused_in_one_line():
    with pytest.raises(InputError, match=r"residual.*not known.*displacement"):
        Heat(make_performance(markers=None, marker_vertices=None), "residual")


def test_colours_are_even_steps_of_lightness_also_for_the_colour_blind():
    rgb = colour_table() / 255
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    lightness = 116 * np.cbrt(linear @ [0.2126, 0.7152, 0.0722]) - 16  # CIE 1976
    steps = np.diff(lightness[::15])
    assert steps.min() > 0 and steps.max() < 2 * steps.min()
    # Viénot, Brettel and Mollon 1999: what people without red or without green cones see.
    for simulated in (
        [[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]],
        [[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]],
    ):
        seen = linear @ np.array(simulated).T
        assert (np.diff((seen @ [0.2126, 0.7152, 0.0722])[::15]) > 0).all()


@given(st.floats(1e-6, 1e6))
def test_scales_end_on_round_numbers_no_less_than_the_value(value):
    assert value <= round_up(value) * (1 + 1e-6) and round_up(value) <= 2.01 * value
    assert round_up(0) == round_up(float("nan")) == 1


def test_the_scale_bar_shows_all_colours_from_least_to_most():
    layout = Layout(960, 540, scale_bar=True)
    bar = draw_scale_bar("displacement", 10.0, layout)
    assert bar.shape == (540 - layout.strip_height, layout.scale_width, 3)
    column = bar[:, 20].astype(int)
    here = [np.abs(column - colour).sum(axis=1).argmin() for colour in colour_table()[[0, 128, 255]].astype(int)]
    assert here[0] > here[1] > here[2]
