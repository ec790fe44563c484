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


@pytest.mark.parametrize(("key", "speed"), [("1", 0.25), ("2", 0.5), ("3", 1.0), ("4", 2.0), ("5", 4.0)])
def test_speeds_stretch_time_from_the_present_frame_on(clock, key, speed):
    player = Player(10_000, 100.0, clock)
    player.play()
    clock.now += 1.0
    assert player.press(key)
    assert player.frame == 100 and player.playing
    clock.now += 2.0
    assert player.frame == 100 + int(200 * speed)
    assert ("speed" in player.state) is (speed != 1)


def test_plus_and_minus_stop_at_the_ends(clock):
    player = Player(100, 10.0, clock)
    for _ in range(9):
        player.press("plus")
    assert player.speed == 4.0
    for _ in range(9):
        player.press("minus")
    assert player.speed == 0.25
    player.press("equal", shift=True)
    assert player.speed == 0.5 and player.state == "speed ½"


SEGMENTS = [(10, 30), (30, 50), (80, 95)]


def test_a_loop_goes_round_and_keeps_time(clock):
    player = Player(100, 10.0, clock, SEGMENTS)
    player.seek(45)
    player.press("l")
    assert player.loop == (30, 50) and player.state == "loop"
    player.play()
    for elapsed, frame in ((0.4, 49), (0.5, 30), (2.4, 49), (2.5, 30), (10.5, 30), (11.0, 35)):
        clock.now = 100.0 + elapsed
        assert player.frame == frame
        assert player.playing
    player.press("l")
    assert player.loop is None
    clock.now += 60
    assert (player.frame, player.playing) == (99, False)


def test_a_loop_where_there_is_no_segment_is_the_whole_take_and_may_play_from_its_end(clock):
    player = Player(20, 10.0, clock)
    player.seek(19)
    player.press("L", shift=True)
    player.play()
    clock.now += 0.1
    assert player.loop == (0, 20) and player.frame == 0


def test_next_and_previous_segment(clock):
    player = Player(100, 10.0, clock, [*SEGMENTS, (95, 300), (5, 5)])
    seen = []
    for key in "nnnnnpppp":
        player.press(key)
        seen.append(player.frame)
    assert seen == [10, 30, 80, 95, 95, 80, 30, 10, 10]
    player.seek(40)
    player.press("p")
    assert player.frame == 30  # its own onset first
    player.press("l")
    player.press("n")
    assert player.loop == (80, 95)
    player.seek(5)
    assert player.loop is None


def test_back_soon_after_an_onset_goes_to_the_segment_before(clock):
    player = Player(100, 10.0, clock, SEGMENTS)
    player.seek(30)
    player.play()
    clock.now += 0.3
    player.press("p")
    assert player.frame == 10 and player.playing


@given(
    keys=st.lists(
        st.tuples(st.sampled_from(["space", "n", "p", "l", "1", "5", "minus", "Right", "End"]), st.floats(0, 9))
    )
)
def test_whatever_is_pressed_the_frame_is_one_of_the_take(keys):
    clock = Clock()
    player = Player(100, 25.0, clock, SEGMENTS)
    for key, wait in keys:
        assert player.press(key)
        clock.now += wait
        assert 0 <= player.frame < 100
        assert player.loop is None or player.loop[0] < player.loop[1]
