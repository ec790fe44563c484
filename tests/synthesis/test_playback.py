"""The player: which frame is due, whatever the clock and the user do."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.synthesis.playback import Player


class Clock:
    """Time that passes only when the test says so."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock():
    return Clock()


def test_frames_are_dropped_and_time_is_kept(clock):
    player = Player(2000, 200.0, clock)
    player.play()
    shown = []
    for _ in range(30):  # drawing takes 71 ms a frame
        clock.now += 0.071
        shown.append(player.frame)
    assert shown == [int(0.071 * 200 * (i + 1) + 1e-6) for i in range(30)]
    assert shown[-1] == 426  # 2.13 s


def test_it_stands_until_played_and_pauses_at_the_end(clock):
    player = Player(10, 10.0, clock)
    clock.now += 5
    assert (player.frame, player.playing) == (0, False)
    player.toggle()
    clock.now += 0.55
    assert (player.frame, player.playing) == (5, True)
    clock.now += 60
    assert (player.frame, player.playing) == (9, False)
    player.toggle()  # play again from the start
    assert (player.frame, player.playing) == (0, True)


def test_pause_keeps_the_frame_that_was_due(clock):
    player = Player(100, 25.0, clock)
    player.play()
    clock.now += 1.0
    player.toggle()
    clock.now += 9
    assert player.frame == 25
    player.toggle()
    clock.now += 0.2
    assert player.frame == 30


def test_seek_plays_on_and_step_pauses(clock):
    player = Player(100, 25.0, clock)
    player.play()
    clock.now += 1.0
    player.seek(60)
    assert player.playing
    clock.now += 0.4
    assert player.frame == 70
    player.step(-1)
    clock.now += 1
    assert (player.frame, player.playing) == (69, False)


def test_playing_twice_does_not_restart_the_clock(clock):
    player = Player(100, 10.0, clock)
    player.play()
    clock.now += 1
    player.play()
    clock.now += 1
    assert player.frame == 20


@pytest.mark.parametrize(
    ("key", "shift", "frame"),
    [
        ("Right", False, 51),
        ("Left", False, 49),
        ("Right", True, 75),
        ("Left", True, 25),
        ("Home", False, 0),
        ("End", False, 99),
    ],
)
def test_keys(clock, key, shift, frame):
    player = Player(100, 25.0, clock)
    player.seek(50)
    assert player.press(key, shift)
    assert player.frame == frame


def test_other_keys_are_left_alone(clock):
    player = Player(100, 25.0, clock)
    assert not player.press("w")
    assert player.press("space")
    assert player.playing


@pytest.mark.parametrize(("n_frames", "rate"), [(0, 25.0), (10, 0.0), (10, float("nan"))])
def test_nothing_to_play_is_refused(n_frames, rate):
    with pytest.raises(InputError, match="player"):
        Player(n_frames, rate)


@given(
    n_frames=st.integers(1, 50),
    rate=st.sampled_from([1.0, 29.97, 60.0, 200.0]),
    actions=st.lists(
        st.tuples(
            st.sampled_from(["space", "Left", "Right", "Home", "End", "seek"]),
            st.booleans(),
            st.floats(0, 3, allow_nan=False),
            st.integers(-100, 100),
        )
    ),
)
def test_the_frame_is_always_one_of_the_take(n_frames, rate, actions):
    clock = Clock()
    player = Player(n_frames, rate, clock)
    for key, shift, wait, frame in actions:
        if key == "seek":
            player.seek(frame)
            assert player.frame == min(max(frame, 0), n_frames - 1)
        else:
            player.press(key, shift)
        before = player.frame
        clock.now += wait
        assert 0 <= before <= player.frame < n_frames
