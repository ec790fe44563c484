"""A half-reviewed tier teaches what a person looked at, and nothing else."""

import pandas as pd
from mimique.workbench.pipeline.labelled_takes import leave_out_proposals, name_affects


def make(rows):
    columns = ["onset", "offset", "label", "status", "origin"]
    return name_affects(pd.DataFrame(rows, columns=columns))


def test_only_what_was_looked_at_stays_and_the_transitions_between():
    table = make(
        [
            (0, 10, "N", "reviewed", "model"),
            (10, 14, "NJ", "proposed", "model"),
            (14, 30, "J", "reviewed", "human"),
            (30, 34, "JA", "proposed", "model"),
            (34, 50, "A", "proposed", "model"),
            (50, 54, "AN", "proposed", "model"),
            (60, 70, "N", "reviewed", "human"),
            (72, 76, "NF", "proposed", "model"),  # touches nothing
            (76, 90, "F", "reviewed", "model"),
            (90, 95, "FN", "reviewed", "human"),
            (95, 99, "N", "proposed", "import"),
        ]
    )
    left = leave_out_proposals(table)
    assert [*zip(left["onset"], left["label"], strict=True)] == [
        (0, "neutral"), (10, "NJ"), (14, "joy"), (60, "neutral"), (76, "fear"), (90, "FN"), (95, "neutral"),
    ]  # fmt: skip


def test_what_people_labelled_from_scratch_stays_whole():
    table = make([(0, 10, "N", "proposed", "human"), (10, 20, "NJ", "proposed", "human")])
    pd.testing.assert_frame_equal(leave_out_proposals(table), table)
