import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.scores import frame_labels, frame_metrics
from sklearn import metrics as oracle

maybe = st.sampled_from(["N", "A", "D", None])
frames = st.lists(st.tuples(maybe, maybe), min_size=1, max_size=60)


@settings(max_examples=80)
@given(frames)
def test_frame_scores_are_scikit_learns_on_the_annotated_frames(pairs: list) -> None:
    reference, predicted = (list(column) for column in zip(*pairs, strict=True))
    found = frame_metrics.score_frames(reference, predicted)
    kept = [(r, p or "missed") for r, p in pairs if r is not None]
    assert (found.n_frames, found.n_gaps) == (len(kept), len(pairs) - len(kept))
    assert found.n_missed == sum(p == "missed" for _, p in kept)
    if not kept:
        assert np.isnan([found.accuracy, found.balanced_accuracy, found.macro_f1, found.majority, found.chance]).all()
        return
    truth, answers = (list(column) for column in zip(*kept, strict=True))
    classes = sorted({*truth, *answers} - {"missed"})
    assert found.accuracy == pytest.approx(oracle.accuracy_score(truth, answers))
    f1 = oracle.f1_score(truth, answers, labels=classes, average="macro", zero_division=0)
    assert found.macro_f1 == pytest.approx(f1)
    recall = oracle.recall_score(truth, answers, labels=sorted(set(truth)), average="macro", zero_division=0)
    assert found.balanced_accuracy == pytest.approx(recall)
    confusion = oracle.confusion_matrix(truth, answers, labels=[*classes, "missed"])[:-1, :-1]
    np.testing.assert_array_equal(found.confusion.loc[classes, classes], confusion)
    precision = oracle.precision_score(truth, answers, labels=classes, average=None, zero_division=np.nan)
    np.testing.assert_allclose(found.classes.loc[classes, "precision"], precision)


def test_a_missing_answer_is_wrong_and_a_missing_reference_is_left_out() -> None:
    reference = ["A", "A", "A", "A", None, None]
    found = frame_metrics.score_frames(reference, ["A", "A", None, None, "A", "D"])
    assert found.accuracy == 0.5
    assert (found.n_frames, found.n_gaps, found.n_missed) == (4, 2, 2)
    assert found.classes.loc["A", "n_missed"] == 2
    assert found.confusion.to_numpy().sum() == 2


def test_nan_of_a_table_is_a_gap_too() -> None:
    reference = pd.Series(["A", None, "N"], dtype="str")
    found = frame_metrics.score_frames(reference, np.array(["A", "A", np.nan], dtype=object))
    assert (found.n_frames, found.n_missed, found.accuracy) == (2, 1, 0.5)


def test_chance_level() -> None:
    # Shares 1/2, 1/4, 1/4: guessing by them is right in 1/4 + 1/16 + 1/16.
    found = frame_metrics.chance_level(["N", "N", "A", "J", None])
    assert found.uniform == pytest.approx(1 / 3)
    assert found.proportional == pytest.approx(3 / 8)
    assert found.majority == 0.5
    assert np.isnan(frame_metrics.chance_level([None]).uniform)


def test_guessing_reaches_the_chance_level(rng: np.random.Generator) -> None:
    reference = rng.choice(["N", "A", "J"], p=[0.6, 0.3, 0.1], size=60_000)
    level = frame_metrics.chance_level(reference)
    guesses = rng.permutation(reference)
    assert frame_metrics.score_frames(reference, guesses).accuracy == pytest.approx(level.proportional, abs=0.01)
    evenly = rng.choice(["N", "A", "J"], size=60_000)
    assert frame_metrics.score_frames(reference, evenly).accuracy == pytest.approx(level.uniform, abs=0.01)


def test_class_counts() -> None:
    found = frame_metrics.class_counts(["N", "N", "A", None, "A", "N"], classes=["A", "N", "J"])
    assert found["n_frames"].tolist() == [2, 3, 0]
    assert found["n_segments"].tolist() == [2, 2, 0]
    assert found["share"].tolist() == [0.4, 0.6, 0]
    assert frame_metrics.class_counts([None], classes=["A"])["share"].isna().all()


@given(st.lists(maybe, max_size=40))
def test_segments_and_frames_round_trip(labels: list) -> None:
    segments = frame_labels.segments_of_frames(labels)
    assert frame_labels.frames_of_segments(segments, len(labels)).tolist() == labels
    assert all(labels[onset:offset] == [label] * (offset - onset) for label, onset, offset in segments)
    # Each is as long as it can be.
    assert all(onset == 0 or labels[onset - 1] != label for label, onset, _ in segments)
    assert all(offset == len(labels) or labels[offset] != label for label, _, offset in segments)


def test_a_tier_becomes_frames() -> None:
    tier = pd.DataFrame({"onset": [1, 3], "offset": [2, 5], "label": ["N", "A"]})
    assert frame_labels.frames_of_segments(tier, 6).tolist() == [None, "N", None, "A", "A", None]


def test_bad_input() -> None:
    with pytest.raises(InputError, match="one length, but got 1 and 2 frames"):
        frame_metrics.score_frames(["a"], ["a", "b"])
    with pytest.raises(InputError, match="expected b, but got a"):
        frame_metrics.score_frames(["a"], ["b"], classes=["b"])
    with pytest.raises(InputError, match="the one text 'NNA'"):
        frame_metrics.score_frames("NNA", "NNA")
    with pytest.raises(InputError, match=r"shape \(2, 2\)"):
        frame_metrics.score_frames([["a", "b"]] * 2, ["a", "b"])
    with pytest.raises(InputError, match="names or numbers"):
        frame_metrics.chance_level([{"a"}, {"b"}])
    with pytest.raises(InputError, match="each once"):
        frame_metrics.class_counts(["a"], classes=["a", "a"])
    with pytest.raises(InputError, match="'A' at \\[1, 3\\) overlaps"):
        frame_labels.frames_of_segments([("N", 0, 2), ("A", 1, 3)], 5)
    with pytest.raises(InputError, match="onset < offset <= 5"):
        frame_labels.frames_of_segments([("N", 3, 6)], 5)
