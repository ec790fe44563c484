"""A second person's answers as evidence: Bayes by hand, and borders that are theirs."""

import numpy as np
import pandas as pd
import pytest
from mimique.models.mistakes.label_evidence import LabelEvidence
from mimique.models.mistakes.second_annotator import PRIOR, SecondReader, match_borders


def tier(rows: list[tuple[int, int, str]]) -> pd.DataFrame:
    table = pd.DataFrame(rows, columns=["onset", "offset", "label"])
    return table.assign(kind=["transition" if len(label) == 2 else "stable" for label in table["label"]])


def test_answers_weigh_as_bayes_says() -> None:
    first = tier([(i * 10, i * 10 + 10, "a" if i % 2 else "b") for i in range(10)])
    second = first.assign(label=[*first["label"][:-1], "b"])
    p = np.tile([0.5, 0.5], (10, 1))
    evidence = LabelEvidence(("a", "b"), p, np.ones((100, 2)) / 2, np.zeros(100))
    reader = SecondReader([(first, second)])
    found = reader.weigh(evidence, first, second).segments
    # Rows: of 5 a, 4 were answered a and 1 b; of 5 b, all b.
    a, b = np.array([4 + PRIOR, 1 + PRIOR]), np.array([PRIOR, 5 + PRIOR])
    likely = (a / a.sum(), b / b.sum())
    assert found[1, 0] == pytest.approx(likely[0][0] / (likely[0][0] + likely[1][0]))
    assert found[9, 1] == pytest.approx(likely[1][1] / (likely[0][1] + likely[1][1]))


def test_borders_of_the_same_labels_go_before_nearer_ones() -> None:
    borders = pd.DataFrame({"onset": [100, 500], "before": ["n", "n"], "after": ["nj", "nj"], "kind": [0, 0]})
    second = tier([(0, 130, "n"), (130, 160, "nj"), (160, 300, "j"), (300, 310, "jn"), (310, 400, "n")])
    found = match_borders(borders, second, 100.0)
    assert found[0] == 130
    assert np.isnan(found[1])
