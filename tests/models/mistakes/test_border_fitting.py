import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.mistakes.border_fitting import fit_borders

RATE = 100.0


def make_face(bounds: list[int], states: list[int], n_classes: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Frames and movement of a face that does exactly what these segments say."""
    frames, moving = np.full((bounds[-1], n_classes), 0.1 / (n_classes - 1)), np.zeros(bounds[-1])
    for onset, offset, state in zip(bounds[:-1], bounds[1:], states, strict=True):
        if state < 0:
            moving[onset:offset], frames[onset:offset] = 0.95, 1 / n_classes
        else:
            moving[onset:offset] = 0.05
            frames[onset:offset, state] = 0.9
    return frames, moving


@given(st.integers(-60, 60), st.integers(1, 4))
def test_a_moved_border_is_put_back(shift: int, place: int) -> None:
    bounds, states = [0, 150, 180, 330, 360, 500], [0, -1, 1, -1, 0]
    frames, moving = make_face(bounds, states)
    tier = list(bounds)
    tier[place] = int(np.clip(tier[place] + shift, tier[place - 1] + 5, tier[place + 1] - 5))
    found = fit_borders(tier, states, frames, moving, RATE)
    assert found.given.tolist() == tier[1:-1]
    assert found.fitted[place - 1] == bounds[place]
    assert (found.gain >= 0).all()
    if tier[place] == bounds[place]:
        assert np.allclose(found.gain, 0)
    else:
        assert found.gain[place - 1] > 0


def test_between_two_held_expressions_the_face_tells() -> None:
    frames, moving = make_face([0, 100, 200], [0, 1])
    assert fit_borders([0, 140, 200], [0, 1], frames, moving, RATE).fitted.tolist() == [100]


def test_gaps_say_nothing_and_reach_is_kept() -> None:
    frames, moving = make_face([0, 100, 400], [0, 1])
    frames[:], moving[:] = np.nan, np.nan
    found = fit_borders([0, 140, 400], [0, 1], frames, moving, RATE)
    assert found.gain.tolist() == [0]
    frames, moving = make_face([0, 100, 400], [0, 1])
    assert fit_borders([0, 300, 400], [0, 1], frames, moving, RATE, reach=0.5).fitted.tolist() == [250]


def test_bounds_that_do_not_rise_are_refused() -> None:
    frames, moving = make_face([0, 100, 200], [0, 1])
    with pytest.raises(InputError, match="rising"):
        fit_borders([0, 100, 100], [0, 1], frames, moving, RATE)
    with pytest.raises(InputError, match="rising"):
        fit_borders([0, 100, 300], [0, 1], frames, moving, RATE)
