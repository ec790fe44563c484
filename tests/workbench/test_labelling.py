"""Labelled segments as a tier: held expressions and what lies between them."""

import pandas as pd
from hypothesis import given
from hypothesis import strategies as st
from mimique.workbench.pipeline.labelling import join_equal_neighbours

AFFECTS = ("neutral", "anger", "joy")


def labelled(rows):
    columns = ["onset", "offset", "kind", "label", "confidence", "from_label", "to_label"]
    return pd.DataFrame(rows, columns=columns)


def test_a_transition_between_two_expressions_is_named_after_both():
    tier = join_equal_neighbours(
        labelled(
            [
                (0, 100, "stable", "neutral", 0.9, "", ""),
                (100, 130, "transition", "anger", 0.4, "neutral", "joy"),
                (130, 300, "stable", "joy", 0.8, "", ""),
            ]
        )
    )
    assert tier["label"].tolist() == ["neutral", "NJ", "joy"]
    assert tier[["from_label", "to_label"]].to_numpy().tolist() == [
        ["neutral", "neutral"],
        ["neutral", "joy"],
        ["joy", "joy"],
    ]


def test_a_movement_within_one_expression_belongs_to_it():
    tier = join_equal_neighbours(
        labelled(
            [
                (0, 100, "stable", "joy", 1.0, "", ""),
                (100, 150, "transition", "anger", 0.2, "", ""),
                (150, 200, "stable", "joy", 0.6, "", ""),
            ]
        )
    )
    assert tier[["onset", "offset", "label"]].to_numpy().tolist() == [[0, 200, "joy"]]
    assert abs(tier["confidence"][0] - (100 * 1.0 + 50 * 0.2 + 50 * 0.6) / 200) < 1e-12


def test_segments_that_do_not_touch_stay_apart():
    rows = [(0, 100, "stable", "joy", 1.0, "", ""), (120, 200, "stable", "joy", 1.0, "", "")]
    assert len(join_equal_neighbours(labelled(rows))) == 2


@given(st.lists(st.tuples(st.integers(1, 50), st.sampled_from(AFFECTS), st.booleans()), min_size=1, max_size=12))
def test_the_time_covered_stays_and_neighbours_differ(pieces):
    rows, onset = [], 0
    for length, label, moving in pieces:
        rows.append([onset, onset + length, "transition" if moving else "stable", label, 0.5, "", ""])
        onset += length
    for k in range(1, len(rows) - 1):
        before, row, after = rows[k - 1], rows[k], rows[k + 1]
        if row[2] == "transition" and before[2] == after[2] == "stable" and before[3] != after[3]:
            row[5:] = before[3], after[3]
    tier = join_equal_neighbours(labelled(rows))
    assert tier["onset"].iloc[0] == 0
    assert tier["offset"].iloc[-1] == onset
    assert (tier["onset"].iloc[1:].to_numpy() == tier["offset"].iloc[:-1].to_numpy()).all()
    held = (tier["from_label"] == tier["to_label"]).to_numpy()
    same = tier["label"].iloc[1:].to_numpy() == tier["label"].iloc[:-1].to_numpy()
    assert not (same & held[1:] & held[:-1]).any()
    for k in range(1, len(tier) - 1):
        if not held[k]:
            assert tier["from_label"][k] == tier["to_label"][k - 1]
            assert tier["to_label"][k] == tier["from_label"][k + 1]
