import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.models import LabelledTake, recording_times


def test_seconds_by_hand() -> None:
    first = pd.DataFrame(
        {
            "onset": [0, 200, 240, 500, 540],
            "offset": [200, 240, 440, 540, 600],
            "label": ["neutral", "NJ", "joy", "JN", "joy"],
            "is_transition": [False, True, False, True, False],
            "intensity": [np.nan, np.nan, 2, np.nan, 0],
        }
    )
    second = pd.DataFrame({"onset": [0], "offset": [120], "label": ["anger"]})
    takes = [
        LabelledTake("b", "cr", "EU", 120.0, second, n_frames=120),
        LabelledTake("a", "cr", "IE", 200.0, first, n_frames=640),
        LabelledTake("c", "ab", "IE", 60.0, second, n_frames=150),
        LabelledTake("d", "cr", "IE", 200.0, first.iloc[:1], n_frames=200),
    ]
    table = recording_times(takes)
    assert table.index.tolist() == [("cr", "IE"), ("cr", "EU"), ("ab", "IE"), ("all", "")]
    columns = ["anger", "disgust", "fear", "joy", "sadness", "surprise", "neutral"]
    columns += ["unlabelled", "transitions", "total"]
    assert table.columns.tolist() == columns
    np.testing.assert_allclose(table.loc[("cr", "IE")], [0, 0, 0, 1, 0, 0, 2.3, 0.5, 0.4, 4.2])
    np.testing.assert_allclose(table.loc[("cr", "EU")], [1, 0, 0, 0, 0, 0, 0, 0, 0, 1])
    np.testing.assert_allclose(table.loc[("ab", "IE")], [2, 0, 0, 0, 0, 0, 0, 0.5, 0, 2.5])
    np.testing.assert_allclose(table.loc[("all", "")], table.iloc[:-1].sum())
    np.testing.assert_allclose(table[columns[:-1]].sum(axis=1), table["total"])


def test_table_b1_is_redrawn_from_its_own_cells() -> None:
    """Reverdy 2019, Table B.1, row cl2cr_IE, as one take of its cells one after another."""
    cells = {
        "anger": 17.6, "disgust": 17.5, "fear": 19.1, "joy": 23.6, "sadness": 29.2, "surprise": 17.5, "neutral": 42.6,
        "": 2.0, "NA": 36.1,
    }  # fmt: skip
    rows, frame = [], 0
    for label, seconds in cells.items():
        n_frames = round(seconds * 200)
        if label:
            rows.append((frame, frame + n_frames, label, "transition" if label == "NA" else "stable"))
        frame += n_frames
    tier = pd.DataFrame(rows, columns=["onset", "offset", "label", "kind"])
    table = recording_times([LabelledTake("t", "cl2cr", "IE", 200.0, tier, n_frames=frame)])
    np.testing.assert_allclose(table.loc[("cl2cr", "IE")], [*cells.values(), 205.2])  # the thesis prints 205.3


def test_labels_outside_the_columns_have_their_own() -> None:
    tier = pd.DataFrame({"onset": [0], "offset": [50], "label": ["contempt"]})
    table = recording_times([LabelledTake("t", "s", "XX", 100.0, tier, n_frames=60)])
    assert table.loc[("s", "XX"), "other"] == pytest.approx(0.5)
    assert table.loc[("s", "XX"), "unlabelled"] == pytest.approx(0.1)


def test_no_takes_are_zero_seconds() -> None:
    assert recording_times([]).loc[("all", ""), "total"] == 0


def test_repeated_columns() -> None:
    with pytest.raises(InputError, match="distinct"):
        recording_times([], affects=["joy", "joy"])
