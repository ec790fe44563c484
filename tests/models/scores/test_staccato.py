import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.scores import staccato as module
from mimique.models.scores.staccato import count_nuclei, staccato


def paint(segments: list, n_frames: int) -> list:
    labels: list = [None] * n_frames
    for index, (onset, offset) in enumerate(segments):
        labels[onset:offset] = [f"s{index}"] * (offset - onset)
    return labels


def columns(segments: list) -> tuple[np.ndarray, np.ndarray]:
    table = np.array(segments, dtype=np.int64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def thomann_nuclei(people: list, tolerance: int = 0) -> list:
    """Thomann's definition, word by word, for any number of people: a graph of who overlaps whom, and its twins.

    Intervals agree if each overlaps each other, and none can be told from the others by what else it overlaps: in the
    graph in which everybody also overlaps himself, they have the same neighbours.
    """
    intervals = [interval for person in people for interval in person]
    groups: dict = {}
    for index, (onset, offset) in enumerate(intervals):
        around = frozenset(
            other
            for other, (on, off) in enumerate(intervals)
            if other == index or min(off, offset) - max(on, onset) > tolerance
        )
        groups.setdefault(around, []).append(index)
    return [members for members in groups.values() if len(members) > 1]


segment_lists = st.lists(st.tuples(st.integers(0, 3), st.integers(1, 6)), max_size=7).map(
    lambda items: [
        (sum(map(sum, items[:i])) + gap, sum(map(sum, items[:i])) + gap + length)
        for i, (gap, length) in enumerate(items)
    ]
)


@settings(max_examples=200)
@given(segment_lists, segment_lists, st.integers(0, 3))
def test_nuclei_are_thomanns(a: list, b: list, tolerance: int) -> None:
    found = count_nuclei(columns(a), columns(b), tolerance=tolerance)
    assert found == len(thomann_nuclei([a, b], tolerance))
    assert found == count_nuclei(columns(b), columns(a), tolerance=tolerance)


def test_nuclei_by_hand() -> None:
    # A pair; one that meets two; a pair inside; one alone.
    a = [(0, 10), (20, 40), (50, 60), (70, 75)]
    b = [(5, 15), (18, 25), (30, 45), (52, 55)]
    assert count_nuclei(columns(a), columns(b)) == 2
    assert sorted(map(len, thomann_nuclei([a, b]))) == [2, 2]


def test_tiers_without_gaps_need_a_tolerance(rng: np.random.Generator) -> None:
    a, b = [(0, 50), (50, 80), (80, 120)], [(0, 51), (51, 79), (79, 120)]
    strict = staccato(paint(a, 120), paint(b, 120), 50, rng)
    assert strict.n_nuclei == 0
    assert strict.degree <= 0
    assert staccato(paint(a, 120), paint(b, 120), 50, rng, tolerance=2).n_nuclei == 3


@settings(max_examples=40)
@given(segment_lists, segment_lists)
def test_invariants(a: list, b: list) -> None:
    n = max([offset for _, offset in a + b], default=0) + 5
    first, second = paint(a, n), paint(b, n)
    found = staccato(first, second, 20, np.random.default_rng(1))
    assert np.isnan(found.degree) or -1 <= found.degree <= 1
    assert 0 < found.p_value <= 1
    assert found.n_segments == len(a) + len(b)
    # Names do not matter.
    renamed = staccato([x and x + "!" for x in first], [x and "?" + x for x in second], 20, np.random.default_rng(1))
    assert renamed == found or np.isnan(found.degree)
    same = staccato(first, first, 20, np.random.default_rng(1))
    assert same.n_nuclei == len(a)
    assert np.isnan(same.degree) or same.degree == 1


def test_expected_by_chance_is_that_of_all_placements() -> None:
    # One segment each, of 4 and 3 frames in 20: all 17 × 18 placements are equally likely.
    hits = sum(min(i + 4, j + 3) > max(i, j) for i in range(17) for j in range(18))
    expected = 2 * hits / (17 * 18)
    found = staccato(paint([(0, 4)], 20), paint([(1, 4)], 20), 20_000, np.random.default_rng(3))
    assert found.expected == pytest.approx(expected, abs=0.02)
    assert found.degree == pytest.approx((2 - expected) / (2 - expected))
    apart = staccato(paint([(0, 4)], 20), paint([(10, 13)], 20), 500, np.random.default_rng(3))
    assert apart.degree == pytest.approx(-apart.expected / (2 - apart.expected))
    assert apart.p_value == 1
    # Chance nearly always makes these two meet, and they do not: the least there is.
    never = staccato(paint([(0, 10)], 20), paint([(10, 19)], 20), 500, np.random.default_rng(3))
    assert never.expected > 1.5
    assert never.degree == -1


def test_placements_are_equally_likely() -> None:
    # Two segments of 1 and 2 frames in 5: 2 orders, and two free frames shared out in 6 ways.
    rng = np.random.default_rng(5)
    counts: dict = {}
    for _ in range(12_000):
        onsets, offsets = module._scatter(np.array([1, 2]), 5, rng)
        assert onsets[0] >= 0
        assert offsets[0] <= onsets[1]
        assert offsets[1] <= 5
        counts[tuple(onsets), tuple(offsets)] = counts.get((tuple(onsets), tuple(offsets)), 0) + 1
    assert len(counts) == 12
    assert min(counts.values()) > 850
    assert max(counts.values()) < 1150


def test_chance_gives_zero_and_the_same_places_give_one() -> None:
    rng = np.random.default_rng(7)
    lengths = np.array([12, 20, 9, 15, 30, 11])
    degrees, p_values = [], []
    for _ in range(60):
        a, b = (paint(list(zip(*module._scatter(lengths, 400, rng), strict=True)), 400) for _ in range(2))
        found = staccato(a, b, 100, rng)
        degrees.append(found.n_nuclei * 2 - found.expected)
        p_values.append(found.p_value)
    assert np.mean(degrees) == pytest.approx(0, abs=0.6)
    assert 0.3 < np.mean(p_values) < 0.8
    a = [(20 * i + 50, 20 * i + 62) for i in range(12)]
    near = [(onset + 2, offset + 3) for onset, offset in a]
    found = staccato(paint(a, 400), paint(near, 400), 200, rng)
    assert found.degree == float(found) == 1
    assert found.p_value == pytest.approx(1 / 201)


def test_degenerate_is_nan(rng: np.random.Generator) -> None:
    everything = ["a"] * 30
    # Chance gives the most there can be.
    assert np.isnan(staccato(everything, everything, 5, rng).degree)
    assert np.isnan(staccato(everything, [None] * 30, 5, rng).degree)
    assert np.isnan(staccato([], [], 5, rng).degree)


def test_bad_input(rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="random generator"):
        staccato(["a"], ["a"])
    with pytest.raises(InputError, match="n_simulations"):
        staccato(["a"], ["a"], 0, rng)
    with pytest.raises(InputError, match="tolerance"):
        staccato(["a"], ["a"], 5, rng, tolerance=-1)
    with pytest.raises(InputError, match="one length"):
        staccato(["a"], [], 5, rng)
