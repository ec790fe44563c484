import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models import LabelledTake
from mimique.models.labelled_take import find_covering_labels, find_transitions


def tier(*rows: tuple) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["onset", "offset", "label"])


def make(segments: pd.DataFrame, n_frames: int = 100) -> LabelledTake:
    return LabelledTake("t", "s", "EU", 200.0, segments, n_frames=n_frames)


def test_transitions_by_any_of_the_columns() -> None:
    table = tier((0, 10, "neutral"), (10, 20, "NJ"), (20, 30, "joy"))
    assert find_transitions(table).tolist() == [False, False, False]
    assert find_transitions(table.assign(kind=["stable", "transition", None])).tolist() == [False, True, False]
    assert find_transitions(table.assign(is_transition=[False, True, False])).tolist() == [False, True, False]
    ends = table.assign(from_label=[None, "neutral", "joy"], to_label=["", "joy", "joy"])
    assert find_transitions(ends).tolist() == [False, True, False]


def test_reference_is_what_covers_most() -> None:
    segments = tier((0, 30, "neutral"), (30, 50, "NJ"), (50, 80, "joy")).assign(is_transition=[False, True, False])
    onsets, offsets = [0, 20, 28, 40, 70, 75, 76, 90], [30, 40, 52, 80, 90, 85, 87, 100]
    labels, transitions, shares = find_covering_labels(onsets, offsets, make(segments))
    assert labels.tolist() == ["neutral", "neutral", "NJ", "joy", "joy", "joy", None, None]
    assert transitions.tolist() == [False, False, True, False, False, False, False, False]
    np.testing.assert_allclose(shares, [1, 0.5, 20 / 24, 0.75, 0.5, 0.5, 7 / 11, 1])


def test_pieces_of_one_label_count_together() -> None:
    segments = tier((0, 4, "joy"), (4, 10, "fear"), (10, 14, "joy"))
    labels, _, shares = find_covering_labels([0], [14], make(segments))
    assert labels.tolist() == ["joy"]
    assert shares.tolist() == [8 / 14]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(1, 12), min_size=1, max_size=10), st.data())
def test_against_counting_frames(lengths: list, data: st.DataObject) -> None:
    """Slow second version: one label a frame, then the most frequent."""
    rows, frame = [], 0
    for length in lengths:
        label = data.draw(st.sampled_from(["a", "b", "c", ""]))
        if label:
            rows.append((frame, frame + length, label))
        frame += length
    take = make(tier(*rows), frame)
    frames = np.full(frame, "", dtype=object)
    for onset, offset, label in rows:
        frames[onset:offset] = label
    onset = data.draw(st.integers(0, frame - 1))
    offset = data.draw(st.integers(onset + 1, frame))
    labels, _, shares = find_covering_labels([onset], [offset], take)
    counts = pd.Series(frames[onset:offset]).value_counts()
    assert counts[labels[0] or ""] == counts.max()
    assert shares[0] == pytest.approx(counts.max() / (offset - onset))


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([(0, 10, "a"), (9, 20, "b")], "'a' at .0, 10. and 'b' at .9, 20. overlap"),
        ([(0, 101, "a")], "'a' is at .0, 101."),
        ([(5, 5, "a")], "'a' is at .5, 5."),
    ],
)
def test_bad_tiers(rows: list, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make(tier(*rows))


def test_bad_takes() -> None:
    with pytest.raises(InputError, match="label is missing"):
        make(tier()[["onset", "offset"]])
    with pytest.raises(InputError, match="neither"):
        LabelledTake("t", "s", "EU", 200.0, tier())
    with pytest.raises(InputError, match="frame rate"):
        LabelledTake("t", "s", "EU", 0.0, tier(), n_frames=3)
    with pytest.raises(InputError, match="expected 3 frames of weights, but got 4"):
        LabelledTake("t", "s", "EU", 200.0, tier(), np.zeros((4, 2)), n_frames=3)
