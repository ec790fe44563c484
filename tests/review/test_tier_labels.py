"""Spellings of one label, and transitions that follow what they lie between."""

import itertools

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.corpus.annotations.label_vocabulary import LabelVocabulary
from mimique.corpus.annotations.tier_rules import check_transitions
from mimique.workbench.review.drafts.operations import apply_operation
from mimique.workbench.review.drafts.tier_labels import TierLabels

AFFECTS = TierLabels(LabelVocabulary.usual("affect"))
CODES = ("N", "A", "D", "F", "J", "Sa", "Su")


def make(*labels, gap_after=()):
    """Segments of ten frames side by side, but for a frame of nothing after some."""
    rows, frame = [], 0
    for number, label in enumerate(labels):
        row = {"id": number + 1, "onset": frame, "offset": frame + 10, "label": label, "status": "proposed"}
        rows.append({**row, "origin": "model", "confidence": 0.7, "revision": 0, "kind": "interval"})
        frame += 10 + (number in gap_after)
    return rows


def apply(rows, operation, labels=AFFECTS):
    change = apply_operation(rows, operation, 1000, itertools.count(100).__next__, labels=labels)
    gone = {row["id"] for row in change.removed}
    left = [row for row in rows if row["id"] not in gone] + list(change.added)
    return sorted(left, key=lambda row: row["onset"])


def named(rows):
    return [row["label"] for row in rows]


def relabel(rows, number, label, labels=AFFECTS):
    return apply(rows, {"kind": "relabel", "segments": [number], "label": label}, labels)


def test_both_transitions_follow_a_relabelled_segment_and_stay_proposed():
    rows = relabel(make("N", "NF", "F", "FN", "N"), 3, "J")
    assert named(rows) == ["N", "NJ", "J", "JN", "N"]
    assert [row["status"] for row in rows] == ["proposed", "proposed", "reviewed", "proposed", "proposed"]
    assert [(row["origin"], "confidence" in row) for row in (rows[1], rows[2])] == [("human", False)] * 2


def test_a_transition_that_named_something_else_or_does_not_touch_stays():
    assert named(relabel(make("N", "NA", "F", "FN", "N"), 3, "J")) == ["N", "NA", "J", "JN", "N"]
    assert named(relabel(make("N", "NF", "F", gap_after=(1,)), 3, "J")) == ["N", "NF", "J"]


def test_a_transition_between_the_same_becomes_part_of_what_was_relabelled():
    rows = relabel(make("N", "NF", "F", "FA", "A"), 3, "A")
    assert [(row["label"], row["onset"], row["offset"], row["status"]) for row in rows] == [
        ("N", 0, 10, "proposed"), ("NA", 10, 20, "proposed"), ("A", 20, 40, "reviewed"), ("A", 40, 50, "proposed"),
    ]  # fmt: skip
    assert (rows[2]["id"], rows[2]["parents"]) == (3, "3,4")
    rows = relabel(make("N", "NF", "F"), 3, "N")
    assert [(row["label"], row["onset"], row["offset"]) for row in rows] == [("N", 0, 10), ("N", 10, 30)]
    rows = relabel(make("NF", "F"), 2, "N")  # nothing lies before the transition
    assert [(row["label"], row["onset"], row["offset"]) for row in rows] == [("N", 0, 20)]
    rows = apply(make("N", "NJ", "J", "JN", "N"), {"kind": "merge", "segments": [1, 2, 3], "label": "N"})
    assert [(row["label"], row["onset"], row["offset"]) for row in rows] == [("N", 0, 40), ("N", 40, 50)]
    both = relabel(make("A", "AF", "F", "FA", "A"), 3, "A")
    assert [(row["label"], row["onset"], row["offset"]) for row in both] == [("A", 0, 10), ("A", 10, 40), ("A", 40, 50)]


def test_merging_and_adding_name_the_transitions_after_their_new_neighbours():
    merged = apply(make("N", "NJ", "J", "JA", "A"), {"kind": "merge", "segments": [1, 2, 3], "label": "N"})
    assert named(merged) == ["N", "NA", "A"]
    added = apply(make("N", "NJ", "J"), {"kind": "add", "onset": 20, "offset": 25, "label": "Sa"})
    assert named(added) == ["N", "NSa", "Sa", "J"]


@pytest.mark.parametrize(("given_label", "kept"), [("N", "neutral"), ("neutral", "neutral"), ("neutre", "neutral")])
def test_the_same_label_in_another_spelling_is_an_accept(given_label, kept):
    rows = relabel(make("neutral", "NF", "fear"), 1, given_label)
    assert (rows[0]["label"], rows[0]["status"], rows[0]["origin"], rows[0]["confidence"]) == (
        kept, "reviewed", "model", 0.7,
    )  # fmt: skip
    assert named(rows) == ["neutral", "NF", "fear"]


def test_a_label_is_spelled_as_the_tier_spells():
    assert named(relabel(make("neutral", "NF", "fear", "FN", "neutral"), 3, "J")) == [
        "neutral", "NJ", "joy", "JN", "neutral",
    ]  # fmt: skip
    assert named(relabel(make("neutre", "NF", "peur"), 3, "J")) == ["neutre", "NJ", "joie"]
    assert named(relabel(make("N", "NF", "F"), 3, "joy")) == ["N", "NJ", "J"]


def test_free_labels_stay_as_they_are():
    assert named(relabel(make("a", "ab", "b"), 3, "c", TierLabels())) == ["a", "ab", "c"]


held = st.lists(st.sampled_from(CODES), min_size=2, max_size=7).map(
    lambda labels: [label for label, _ in itertools.groupby(labels)]
)


@given(held, st.data())
def test_a_tier_that_keeps_the_rules_keeps_them_when_a_segment_is_relabelled(labels, data):
    """The rules are those of the checks of annotators' tiers (corpus.annotations.tier_rules)."""
    pairs = [labels[0], *(part for one, two in itertools.pairwise(labels) for part in (one + two, two))]
    rows = make(*pairs)
    place = data.draw(st.integers(0, len(labels) - 1))
    neighbours = {labels[k] for k in (place - 1, place + 1) if 0 <= k < len(labels)}
    new = data.draw(st.sampled_from([code for code in CODES if code not in neighbours]))
    changed = relabel(rows, 2 * place + 1, new)
    assert len(check_transitions(pd.DataFrame(rows))) == 0
    assert len(check_transitions(pd.DataFrame(changed)[["onset", "offset", "label"]])) == 0
    assert named(changed)[::2] == [new if k == place else label for k, label in enumerate(labels)]


@given(st.lists(st.sampled_from([*CODES, "NF", "FN", "JA", "AJ", "FA"]), min_size=1, max_size=8), st.data())
def test_whatever_is_done_to_any_tier_it_stays_one(labels, data):
    """Segments stay side by side, nobody else's time is taken, and no frame changes its label unseen."""
    rows = make(*labels, gap_after=data.draw(st.sets(st.integers(0, 7))))
    names = [row["id"] for row in rows]
    first = data.draw(st.integers(0, len(names) - 1))
    onset = data.draw(st.integers(0, rows[-1]["offset"] - 1))
    operation = data.draw(
        st.sampled_from(
            [
                {"kind": "relabel", "segments": [names[first]], "label": data.draw(st.sampled_from(CODES))},
                {"kind": "merge", "segments": names[first : first + 3]},
                {"kind": "add", "onset": onset, "offset": onset + 7, "label": data.draw(st.sampled_from(CODES))},
            ]
        )
    )
    if operation["kind"] == "merge" and len(operation["segments"]) < 2:
        return
    after = apply(rows, operation)
    assert all(one["offset"] <= two["onset"] for one, two in itertools.pairwise(after))
    covered = {frame for row in rows for frame in range(row["onset"], row["offset"])}
    if operation["kind"] == "relabel":
        assert {frame for row in after for frame in range(row["onset"], row["offset"])} == covered
