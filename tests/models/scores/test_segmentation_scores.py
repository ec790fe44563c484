import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.labelled_take import LabelledTake
from mimique.models.metrics import score_boundaries
from mimique.models.scores.segment_metrics import boundary_scores, segmental_f1
from mimique.models.scores.segmentation_scores import count_matched_borders, prepare_reference, score_cut


def labelled(rows: list, n_frames: int) -> LabelledTake:
    table = pd.DataFrame(rows, columns=["onset", "offset", "label"])
    return LabelledTake("t", "s", "IE", 200.0, table, n_frames=n_frames)


def test_by_hand() -> None:
    # Two touching segments of one label are one; [60, 70) is a gap; so borders lie at 20 and 40 only.
    reference = prepare_reference(
        labelled([(0, 20, "N"), (20, 30, "A"), (30, 40, "A"), (40, 60, "N"), (70, 99, "N")], 99)
    )
    assert reference.borders.tolist() == [20, 40]
    assert list(zip(reference.onsets, reference.offsets, strict=True)) == [(0, 20), (20, 40), (40, 60), (70, 99)]
    cut = pd.DataFrame({"onset": [0, 23, 39, 65, 80], "offset": [23, 39, 65, 80, 99]})
    counts = score_cut(reference, cut, 200.0, tolerances=(1, 3))
    assert counts["borders"] == 3  # at 65 nobody annotated
    assert counts["reference_borders"] == 2
    assert (counts["matched_1"], counts["matched_3"]) == (1, 2)
    assert counts["pairs"] == 2
    assert counts["offset"] == pytest.approx((3 - 1) / 200)
    assert counts["distance"] == pytest.approx((3 + 1) / 200)
    assert (counts["segments"], counts["reference_segments"]) == (5, 4)
    # [70, 80) takes the last reference at an overlap of 10 of 29 only; [80, 99) overlaps it by 19 of 29.
    assert (counts["found_10"], counts["found_50"]) == (4, 4)


cuts = st.lists(st.integers(1, 79), max_size=12, unique=True).map(sorted)


@settings(max_examples=150)
@given(cuts, cuts, st.integers(0, 15))
def test_as_many_are_matched_as_by_the_best_alignment(found: list, wanted: list, tolerance: int) -> None:
    n = count_matched_borders(np.array(found, dtype=np.int64), np.array(wanted, dtype=np.int64), tolerance)
    assert n == score_boundaries(found, wanted, tolerance).n_matched


@settings(max_examples=100)
@given(cuts, cuts, st.lists(st.booleans(), min_size=80, max_size=80))
def test_counts_are_those_of_frame_labels(found: list, wanted: list, gaps: list) -> None:
    """Second version: numbered frames and the scores of labels; one label for all cannot be said there, borders can."""
    numbers = np.searchsorted(found, np.arange(80), side="right").astype(object)
    truth = np.searchsorted(wanted, np.arange(80), side="right").astype(object)
    truth[np.array(gaps) & (np.arange(80) % 7 == 0)] = None
    rows = []
    for frame, label in enumerate(truth):
        if label is not None:
            rows.append((frame, frame + 1, str(label)))
    if not rows:
        return
    ends = [0, *found, 80]
    cut = pd.DataFrame({"onset": ends[:-1], "offset": ends[1:]})
    counts = score_cut(prepare_reference(labelled(rows, 80)), cut, 200.0)
    for tolerance in (1, 10):
        expected = boundary_scores(truth, numbers, tolerance)
        assert counts[f"matched_{tolerance}"] == expected.n_matched
        assert counts["borders"] == expected.n_found
        assert counts["reference_borders"] == expected.n_reference
    labels = segmental_f1(truth, numbers, 0.5)
    assert (counts["segments"], counts["reference_segments"]) == (labels.n_predicted, labels.n_reference)
    assert counts["found_50"] >= labels.n_matched


def test_the_reference_itself_is_right_everywhere() -> None:
    take = labelled([(0, 20, "N"), (20, 33, "NA"), (33, 80, "A")], 80)
    counts = score_cut(prepare_reference(take), take.segments, 200.0)
    assert counts["matched_1"] == counts["borders"] == counts["reference_borders"] == 2
    assert counts["found_50"] == counts["segments"] == counts["reference_segments"] == 3
    assert counts["offset"] == counts["distance"] == 0


def test_bad_overlap() -> None:
    take = labelled([(0, 20, "N")], 80)
    with pytest.raises(InputError, match="overlap: expected"):
        score_cut(prepare_reference(take), take.segments, 200.0, overlaps=(0.0,))
