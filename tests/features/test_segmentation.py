import inspect
import re
from dataclasses import asdict, fields

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.features import measure_restlessness, motion_energy, segment
from mimique.features.segmentation import (
    SegmentationSettings,
    cut_motion,
    measure_joint_restlessness,
    measure_motion,
)

# Sharp enough to find where an eased movement begins and ends; the defaults cut where it is half as fast.
SHARP = {"window": 0.25, "threshold": 10.0, "flank": 0.8}
BORDERS = np.array([1.0, 1.4, 2.6, 2.9, 4.0, 4.6, 6.1, 6.5])


def smoothstep(t: np.ndarray, onset: float, offset: float) -> np.ndarray:
    s = np.clip((t - onset) / (offset - onset), 0, 1)
    return s * s * (3 - 2 * s)


def perform(rng: np.random.Generator, rate: float, *, noise: float = 0.01, n_shapes: int = 51, seconds: float = 8.0):
    """Four expressions with planted transitions: to A, to B directly, back to neutral, to A."""
    t = np.arange(round(seconds * rate)) / rate
    a, b = np.zeros((2, n_shapes))
    a[:8] = [0.9, 0.7, 0.4, 0.4, 0.3, 0.6, 0.2, 0.5]
    b[5:12] = [0.2, 0.8, 0.5, 0.4, 0.7, 0.3, 0.6]
    poses = [np.zeros(n_shapes), a, b, np.zeros(n_shapes), a]
    weights = np.zeros((len(t), n_shapes))
    for before, after, onset, offset in zip(poses[:-1], poses[1:], BORDERS[::2], BORDERS[1::2], strict=True):
        weights += smoothstep(t, onset, offset)[:, None] * (after - before)
    return weights + noise * rng.normal(size=weights.shape)


def inner_borders(table: pd.DataFrame, rate: float) -> np.ndarray:
    return table["onset"].to_numpy()[1:] / rate


@pytest.mark.parametrize("rate", [60.0, 120.0, 200.0])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.02])
def test_planted_borders_are_found_and_no_others(rng: np.random.Generator, rate: float, noise: float) -> None:
    if rate == 60.0 and noise == 0.02:
        noise = 0.011  # white noise of 0.02 at 200 Hz is as strong, per hertz, as 0.011 at 60 Hz
    weights = perform(rng, rate, noise=noise)
    for chosen, tolerance in ((SHARP, 0.05), ({}, 0.1)):
        table = segment(weights, rate, **chosen)
        np.testing.assert_allclose(inner_borders(table, rate), BORDERS, atol=tolerance)
        assert list(table["kind"]) == ["stable", "transition"] * 4 + ["stable"]


def test_half_as_fast_is_where_the_defaults_cut() -> None:
    """In closed form: a smooth step moves at 4 s (1 - s) of its highest speed, which is a half at s = (1 ± √½) / 2."""
    t = np.arange(1000) / 200
    pose = np.linspace(0.2, 0.9, 20)
    table = segment(smoothstep(t, 1.5, 3.5)[:, None] * pose, 200.0, tau=0.0, window=0.1)
    expected = 1.5 + 2.0 * (1 + np.array([-1, 1]) * np.sqrt(0.5)) / 2
    np.testing.assert_allclose(inner_borders(table, 200.0), expected, atol=0.011)  # two frames


def test_settings_have_the_defaults_of_segment() -> None:
    parameters = inspect.signature(segment).parameters
    for field in fields(SegmentationSettings):
        assert parameters[field.name].default == field.default, field.name


def test_motion_cut_in_two_steps_is_the_same(rng: np.random.Generator) -> None:
    weights = perform(rng, 100.0)
    settings = SegmentationSettings(window=0.2, threshold=6.0, borders="peaks", directness=0.1)
    motion = measure_motion(weights, 100.0, tau=settings.tau, window=settings.window)
    quiet = measure_joint_restlessness([(weights, 100.0)], settings)
    assert cut_motion(motion, settings, quiet).equals(segment(weights, 100.0, **asdict(settings)))


def test_peaks_lie_within_the_transitions(rng: np.random.Generator) -> None:
    table = segment(perform(rng, 200.0), 200.0, borders="peaks")
    found = inner_borders(table, 200.0)
    assert len(found) == 4
    assert ((found > BORDERS[::2]) & (found < BORDERS[1::2])).all()
    assert set(table["kind"]) == {"stable"}


@pytest.mark.parametrize("n_shapes", [8, 20, 51])
def test_noise_at_rest_has_no_border(rng: np.random.Generator, n_shapes: int) -> None:
    for _ in range(5):
        table = segment(0.3 + 0.01 * rng.normal(size=(6000, n_shapes)), 200.0)
        assert table.values.tolist() == [[0, 6000, "stable"]]


def test_a_face_without_any_motion() -> None:
    assert segment(np.full((300, 5), 0.2), 100.0).values.tolist() == [[0, 300, "stable"]]


def test_a_blink_is_no_border_but_counts_as_printed(rng: np.random.Generator) -> None:
    weights = perform(rng, 200.0)
    t = np.arange(len(weights)) / 200
    weights[:, 20:22] += (0.9 * (smoothstep(t, 5.2, 5.3) - smoothstep(t, 5.34, 5.5)))[:, None]
    np.testing.assert_allclose(inner_borders(segment(weights, 200.0, **SHARP), 200.0), BORDERS, atol=0.05)
    assert len(segment(weights, 200.0)) == len(BORDERS) + 1
    found = inner_borders(segment(weights, 200.0, directness=0.0, **SHARP), 200.0)
    assert len(found) == len(BORDERS) + 2
    assert ((found > 5.1) & (found < 5.6)).sum() == 2


def climb_down(level: np.ndarray, peak: int, step: int) -> float:
    """Lowest level on the way from a peak until something higher, a second, or the end."""
    valley, frame = level[peak], peak
    while 0 <= frame < len(level) and abs(frame - peak) <= 120 and level[frame] <= level[peak]:
        valley = min(valley, level[frame])
        frame += step
    return valley


def walk_to_flank(level: np.ndarray, peak: int, step: int, height: float) -> list[int]:
    frames = []
    while 0 <= peak < len(level) and level[peak] >= height:
        frames.append(peak)
        peak += step
    return frames


def test_against_a_slow_reading_of_the_rule(rng: np.random.Generator) -> None:
    """Second version, frame by frame, of what the module's text says; every movement taken for a transition."""
    weights = perform(rng, 120.0)
    energy = motion_energy(weights, 120.0, tau=0.05, window=0.25)
    level = np.sqrt(energy.velocity**2 + (0.05 * energy.acceleration) ** 2)
    low, quiet, high = np.quantile(level, [0.02, 0.1, 0.99])
    least = 10.0 * max((quiet - low) / 0.7722, 0.01 * (high - low))
    moving = np.zeros(len(level), dtype=bool)
    for peak in range(1, len(level) - 1):
        prominence = level[peak] - max(climb_down(level, peak, -1), climb_down(level, peak, 1))
        if level[peak - 1] < level[peak] > level[peak + 1] and prominence >= least:
            height = level[peak] - 0.8 * prominence
            moving[walk_to_flank(level, peak, -1, height) + walk_to_flank(level, peak, 1, height)] = True
    text = "".join("x" if flag else "." for flag in moving)
    text = re.sub(r"(?<=x)\.{1,11}(?=x)", lambda gap: "x" * len(gap[0]), text)  # 0.1 s are 12 frames
    expected = [match.start() for match in re.finditer(r"(?<=x)\.|(?<=\.)x", text)]
    assert len(expected) == len(BORDERS)
    assert segment(weights, 120.0, directness=0.0, **SHARP)["onset"].tolist()[1:] == expected


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 400),
    st.integers(0, 2**32 - 1),
    st.lists(st.tuples(st.integers(0, 399), st.integers(1, 60)), max_size=4),
    st.sampled_from(["flanks", "peaks"]),
    st.floats(0, 0.3),
)
def test_segments_tile_what_is_not_a_gap(
    n_frames: int, seed: int, gaps: list, borders: str, min_duration: float
) -> None:
    weights = np.cumsum(np.random.default_rng(seed).normal(size=(n_frames, 3)), axis=0)
    for onset, length in gaps:
        weights[onset : onset + length, 1] = np.nan
    table = segment(weights, 100.0, threshold=2.0, min_duration=min_duration, borders=borders)
    covered = np.zeros(n_frames, dtype=int)
    for onset, offset in zip(table["onset"], table["offset"], strict=True):
        assert onset < offset
        covered[onset:offset] += 1
    np.testing.assert_array_equal(covered, np.isfinite(weights).all(axis=1).astype(int))
    assert table["onset"].is_monotonic_increasing
    assert table.dtypes["onset"] == table.dtypes["offset"] == np.int64
    assert set(table["kind"]) <= {"stable", "transition"}


@settings(max_examples=20, deadline=None)
@given(st.floats(0.05, 20), st.floats(-3, 3))
def test_gain_and_offset_change_nothing(gain: float, offset: float) -> None:
    weights = perform(np.random.default_rng(5), 100.0)
    assert segment(weights, 100.0).equals(segment(gain * weights + offset, 100.0))


def test_no_segment_is_shorter_than_asked(rng: np.random.Generator) -> None:
    weights = np.cumsum(rng.normal(size=(3000, 4)), axis=0)
    table = segment(weights, 100.0, threshold=1.0, min_duration=0.25, directness=0.0)
    assert len(table) > 10
    assert (table["offset"] - table["onset"]).min() >= 25


def test_one_restlessness_for_a_signer_replaces_the_takes_own(rng: np.random.Generator) -> None:
    weights = perform(rng, 200.0)
    own = measure_restlessness(motion_energy(weights, 200.0, window=0.35).level)
    assert measure_joint_restlessness([(weights, 200.0)]) == own
    joined = np.concatenate([motion_energy(some, 200.0, window=0.35).level for some in (weights, 2 * weights)])
    assert measure_joint_restlessness([(weights, 200.0), (2 * weights, 200.0)]) == measure_restlessness(joined)
    assert segment(weights, 200.0, restlessness=own).equals(segment(weights, 200.0))
    assert len(segment(weights, 200.0, restlessness=100 * own)) == 1


def test_nothing_but_gaps() -> None:
    table = segment(np.full((50, 3), np.nan), 100.0)
    assert len(table) == 0
    assert list(table.columns) == ["onset", "offset", "kind"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"window": 0.0}, "window: expected"),
        ({"tau": -1.0}, "tau: expected"),
        ({"threshold": 0.0}, "threshold: expected"),
        ({"flank": 1.0}, "flank: expected"),
        ({"directness": 1.5}, "directness: expected"),
        ({"min_duration": -1.0}, "min_duration: expected"),
        ({"borders": "valleys"}, "borders: expected"),
        ({"restlessness": -1.0}, "restlessness: expected"),
    ],
)
def test_bad_arguments(arguments: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        segment(np.zeros((50, 2)), 100.0, **arguments)
