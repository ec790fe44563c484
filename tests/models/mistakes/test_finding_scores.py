"""Counts by hand."""

import pandas as pd
import pytest
from mimique import InputError
from mimique.models.mistakes.finding_scores import count_findings, match_findings, score_border_oracle, score_counts


def table(rows: list[tuple]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["take", "problem", "onset", "offset"])


def test_each_finding_counts_once_and_for_its_kind() -> None:
    faults = table([("a", "swapped label", 0, 10), ("a", "swapped label", 5, 15), ("b", "short segment", 0, 5)])
    findings = table([("a", "swapped label", 8, 9), ("b", "swapped label", 0, 5), ("b", "short segment", 4, 6)])
    assert match_findings(faults, findings).tolist() == [True, False, True]
    scored = score_counts(count_findings(faults, findings)).set_index("problem")
    assert scored.loc["swapped label", ["planted", "found", "right"]].tolist() == [2, 2, 1]
    assert scored.loc["swapped label", "f1"] == pytest.approx(0.5)
    assert scored.loc["short segment", "f1"] == 1.0


def test_oracle_finds_what_scatter_does_not_hide() -> None:
    truth = {"a": pd.DataFrame({"onset": [0, 100, 200, 300], "offset": [100, 200, 300, 400]})}
    # True borders 100, 200, 300; the annotator is 3 frames off at 100, a planted shift of 30 is at 200.
    tier = pd.DataFrame({"onset": [0, 103, 230, 300], "offset": [103, 230, 300, 400], "label": list("abab")})
    faults = table([("a", "shifted boundary", 230, 231)]).assign(true_onset=200)
    found = score_border_oracle({"a": tier}, faults, truth, 100.0)
    assert found[["planted", "found", "right", "own_slips"]].values.tolist() == [[1, 1, 1, 0]]
    assert found["threshold"].iloc[0] == pytest.approx(0.3)
    with pytest.raises(InputError, match="true segments"):
        score_border_oracle({"b": tier}, faults, truth, 100.0)
