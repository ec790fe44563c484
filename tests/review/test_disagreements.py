"""Where readings differ: frame by frame, and what is only the same border set twice."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.workbench.review.coding.disagreements import find_agreed, find_differences, jitter_frames

N_FRAMES = 120


def make_rows(*segments):
    return [
        {"id": number, "onset": onset, "offset": offset, "label": label, "status": "reviewed", "origin": "human"}
        for number, (onset, offset, label) in enumerate(segments)
    ]


def paint(rows):
    frames = [None] * N_FRAMES
    for row in rows:
        frames[row["onset"] : row["offset"]] = [row["label"]] * (row["offset"] - row["onset"])
    return frames


@st.composite
def readings(draw):
    borders = sorted(draw(st.sets(st.integers(0, N_FRAMES), max_size=12)))
    segments = []
    for onset, offset in itertools.pairwise(borders):
        label = draw(st.sampled_from(["A", "B", "C", None]))
        if label is not None:
            segments.append((onset, offset, label))
    return make_rows(*segments)


@given(readings(), readings())
def test_without_jitter_the_differences_are_the_runs_of_frames_that_differ(first, second):
    found = find_differences(first, second, jitter=0)
    pairs = list(zip(paint(first), paint(second), strict=True))
    expected, onset = [], 0
    for pair, frames in itertools.groupby(pairs):
        length = len(list(frames))
        if pair[0] != pair[1]:
            expected.append((onset, onset + length, *pair))
        onset += length
    assert [(one.onset, one.offset, one.first, one.second) for one in found] == expected


@given(readings(), readings())
def test_without_jitter_what_is_agreed_is_all_the_rest(first, second):
    agreed = find_agreed([first, second], jitter=0)
    frames = [None] * N_FRAMES
    for one in agreed:
        assert all(frame is None for frame in frames[one.onset : one.offset])
        frames[one.onset : one.offset] = [one.label] * (one.offset - one.onset)
    expected = [a if a == b else None for a, b in zip(paint(first), paint(second), strict=True)]
    assert frames == expected


@given(readings(), readings(), st.integers(0, 15))
def test_differences_and_agreement_share_no_frame_and_go_both_ways(first, second, jitter):
    there = find_differences(first, second, jitter=jitter)
    back = find_differences(second, first, jitter=jitter)
    assert [(one.onset, one.offset, one.second, one.first) for one in back] == [
        (one.onset, one.offset, one.first, one.second) for one in there
    ]
    taken = np.zeros(N_FRAMES, dtype=int)
    for one in (*there, *find_agreed([first, second], jitter=jitter)):
        taken[one.onset : one.offset] += 1
    assert taken.max(initial=0) <= 1
    # What is left open although somebody labelled it lies at the end of a reading, by less than the jitter.
    said = np.array([a is not None or b is not None for a, b in zip(paint(first), paint(second), strict=True)])
    left = np.flatnonzero(said & (taken == 0))
    for run in np.split(left, np.flatnonzero(np.diff(left) > 1) + 1):
        assert len(run) < max(jitter, 1)


@given(readings())
def test_a_reading_agrees_with_itself(rows):
    assert find_differences(rows, rows, jitter=8) == []
    agreed = find_agreed([rows, rows, rows], jitter=8)
    assert [(one.onset, one.offset, one.label) for one in agreed] == [
        (row["onset"], row["offset"], row["label"]) for row in rows
    ]


def test_a_border_set_a_few_frames_later_is_the_same_border_in_the_middle():
    first, second = make_rows((0, 50, "A"), (50, 100, "B")), make_rows((0, 57, "A"), (57, 100, "B"))
    assert find_differences(first, second, jitter=8) == []
    agreed = find_agreed([first, second], jitter=8)
    assert [(one.onset, one.offset, one.label) for one in agreed] == [(0, 53, "A"), (53, 100, "B")]
    assert [(one.onset, one.offset) for one in find_differences(first, second, jitter=7)] == [(50, 57)]


def test_onsets_and_offsets_of_labels_beside_nothing_may_be_a_few_frames_apart_too():
    first, second = make_rows((10, 50, "A")), make_rows((14, 47, "A"))
    assert find_differences(first, second, jitter=8) == []
    assert [(one.onset, one.offset) for one in find_agreed([first, second], jitter=8)] == [(12, 48)]


@pytest.mark.parametrize("label", ["C", None])
def test_a_short_label_that_one_of_both_has_is_a_disagreement(label):
    second = make_rows((0, 50, "A"), (53, 100, "B"))
    first = make_rows((0, 50, "A"), *([(50, 53, label)] if label else []), (53, 100, "A"))
    found = find_differences(first, second, jitter=8)
    assert (53, 100, "A", "B") in [(one.onset, one.offset, one.first, one.second) for one in found]
    blink = find_differences(make_rows((0, 100, "A")), make_rows((0, 50, "A"), (50, 53, "C"), (53, 100, "A")), jitter=8)
    assert [(one.onset, one.offset, one.first, one.second) for one in blink] == [(50, 53, "A", "C")]


def test_the_remainder_of_a_border_belongs_to_the_disagreement_beside_it():
    first, second = make_rows((0, 50, "A"), (50, 100, "B")), make_rows((0, 46, "A"), (46, 100, "C"))
    found = find_differences(first, second, jitter=8)
    assert [(one.onset, one.offset, one.first, one.second) for one in found] == [(46, 100, "B", "C")]


def test_neighbours_of_one_label_stay_apart_only_where_all_have_the_border():
    first = make_rows((0, 30, "A"), (30, 60, "A"), (60, 90, "A"))
    second = make_rows((0, 30, "A"), (30, 90, "A"))
    assert [(one.onset, one.offset) for one in find_agreed([first, second], jitter=8)] == [(0, 30), (30, 90)]


def test_spellings_of_one_label_agree():
    first, second = make_rows((0, 50, "anger")), make_rows((0, 50, "A"))
    assert len(find_differences(first, second, jitter=8)) == 1
    assert find_differences(first, second, jitter=8, canonical=lambda text: text[0].upper()) == []


def test_three_readers_agree_where_all_do_and_the_median_border_counts():
    some = [make_rows((0, end, "A"), (end, 100, "B")) for end in (50, 52, 56)]
    agreed = find_agreed(some, jitter=8)
    assert [(one.onset, one.offset, one.label) for one in agreed] == [(0, 52, "A"), (52, 100, "B")]
    some[2] = make_rows((0, 100, "A"))
    assert [(one.onset, one.offset) for one in find_agreed(some, jitter=8)] == [(0, 50)]


def test_the_jitter_is_a_time():
    assert jitter_frames(200.0) == pytest.approx(8.0)
    assert jitter_frames(30.0) == pytest.approx(1.2)
