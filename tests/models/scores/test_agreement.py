from collections import Counter
from itertools import pairwise, permutations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models import metrics
from mimique.models.scores import agreement
from sklearn.metrics import cohen_kappa_score
from sklearn.metrics import mean_absolute_error as oracle_error

# Cohen, "Weighted kappa", Psychological Bulletin 70 (1968), Table 1: 200 cases by two judges, in percent. The paper
# prints κ = .492 for it; 0.44 + 0.20 + 0.06 agree, 0.30 + 0.09 + 0.02 by chance.
COHEN_1968 = [[44, 7, 9], [5, 20, 5], [1, 3, 6]]

# Krippendorff, "Computing Krippendorff's alpha-reliability" (2011), section C: four observers (rows), twelve units; a
# point is a missing value. The paper gives 0.743 for names (section C) and 0.815 for ranks (section D).
KRIPPENDORFF_2011 = """
1 2 3 3 2 1 4 1 2 . . .
1 2 3 3 2 2 4 1 2 5 . 3
. 3 3 3 2 3 4 2 2 5 1 .
1 2 3 3 2 4 4 1 2 5 1 .
"""
# The three coders and fifteen units of the encyclopaedia's article on α (Wikipedia, "Krippendorff's alpha", "A
# computational example"), for names 0.691.
THREE_CODERS = """
. . . . . 3 4 1 2 1 1 3 3 . 3
1 . 2 1 3 3 4 3 . . . . . . .
. . 2 1 3 4 4 . 2 1 1 3 3 . 4
"""


def read_units(text: str) -> list:
    rows = [[None if value == "." else int(value) for value in line.split()] for line in text.split("\n") if line]
    return list(zip(*rows, strict=True))


def spread(table: list) -> tuple[list, list]:
    cells = [(i, j) for i, row in enumerate(table) for j, count in enumerate(row) for _ in range(count)]
    return [i for i, _ in cells], [j for _, j in cells]


letters = st.sampled_from(["N", "A", "D", None])
degrees = st.sampled_from([0, 1, 2, 3, None])
both = st.lists(st.tuples(letters, letters), min_size=1, max_size=40)
graded = st.lists(st.tuples(degrees, degrees), min_size=1, max_size=40)


# Cohen's κ


def test_kappa_of_cohens_table() -> None:
    assert agreement.cohen_kappa(*spread(COHEN_1968)) == pytest.approx(0.492, abs=5e-4)


@settings(max_examples=100)
@given(graded, st.sampled_from([None, "linear", "quadratic"]))
def test_kappa_is_scikit_learns_on_frames_that_both_annotated(pairs: list, weights: str | None) -> None:
    found = agreement.cohen_kappa(*zip(*pairs, strict=True), weights)
    kept = [pair for pair in pairs if None not in pair]
    if len({degree for pair in kept for degree in pair}) < 2:
        assert np.isnan(found)
    else:
        first, second = zip(*kept, strict=True)
        expected = cohen_kappa_score(first, second, labels=[0, 1, 2, 3], weights=weights)
        assert found == pytest.approx(expected, abs=1e-12)


def test_degrees_that_nobody_used_keep_their_place_on_the_scale() -> None:
    a, b = [0, 2, 3, 3, 2, 0], [0, 3, 3, 2, 2, 2]
    on_scale = cohen_kappa_score(a, b, labels=[0, 1, 2, 3], weights="linear")
    assert agreement.cohen_kappa(a, b, "linear") == pytest.approx(on_scale)
    assert agreement.cohen_kappa(a, b, "linear", classes=[0, 1, 2, 3]) == pytest.approx(on_scale)
    names = {0: "none", 2: "much", 3: "very much"}
    scale = ["none", "some", "much", "very much"]
    found = agreement.cohen_kappa([names[x] for x in a], [names[x] for x in b], "linear", classes=scale)
    assert found == pytest.approx(on_scale)
    assert agreement.cohen_kappa(a, b, "linear") != pytest.approx(cohen_kappa_score(a, b, weights="linear"))


@settings(max_examples=60)
@given(both)
def test_kappa_invariants(pairs: list) -> None:
    a, b = zip(*pairs, strict=True)
    found = agreement.cohen_kappa(a, b)
    rename = {"N": "A", "A": "x", "D": "B", None: None}
    for other in (agreement.cohen_kappa(b, a), agreement.cohen_kappa([rename[x] for x in a], [rename[x] for x in b])):
        assert other == pytest.approx(found, nan_ok=True)
    assert np.isnan(found) or -1 <= found <= 1
    same = agreement.cohen_kappa(a, a)
    assert same == 1 if len({x for x in a if x}) > 1 else np.isnan(same)


def test_kappa_is_zero_by_chance(rng: np.random.Generator) -> None:
    a = rng.choice(4, p=[0.6, 0.2, 0.1, 0.1], size=100_000)
    b = rng.choice(4, p=[0.3, 0.3, 0.2, 0.2], size=100_000)
    for weights in (None, "linear", "quadratic"):
        assert agreement.cohen_kappa(a, b, weights) == pytest.approx(0, abs=0.02)  # type: ignore[arg-type]


def test_one_kappa_in_the_package() -> None:
    assert metrics.cohen_kappa is agreement.cohen_kappa


def test_nothing_in_common_is_nan() -> None:
    for a, b in (([], []), (["N", None], [None, "N"]), (["N", "N"], ["N", "N"])):
        assert np.isnan(agreement.cohen_kappa(a, b))
    assert np.isnan(agreement.duration_weighted_agreement(["N", None], [None, "N"]))
    assert np.isnan(agreement.mean_absolute_error([1, None], [None, 1]))


# Degrees


@given(graded)
def test_mean_absolute_error_is_scikit_learns(pairs: list) -> None:
    kept = [pair for pair in pairs if None not in pair]
    found = agreement.mean_absolute_error(*zip(*pairs, strict=True))
    assert np.isnan(found) if not kept else found == pytest.approx(oracle_error(*zip(*kept, strict=True)))


def test_degrees_of_a_table_with_nan() -> None:
    assert agreement.mean_absolute_error(pd.Series([0.0, np.nan, 3.0]), [1, 2, 1]) == pytest.approx(1.5)


# Whole segments

runs = st.lists(st.tuples(letters, st.integers(1, 5)), min_size=1, max_size=8)
takes = runs.map(lambda items: [label for label, length in items for _ in range(length)])


def slow_duration_weighted(a: list, b: list) -> float:
    agreeing = total = 0
    for own, other in ((a, b), (b, a)):
        borders = [0, *(t for t in range(1, len(own)) if own[t] != own[t - 1]), len(own)]
        for onset, offset in pairwise(borders):
            votes = [vote for vote in other[onset:offset] if vote is not None]
            if own[onset] is None or not votes:
                continue
            total += len(votes)
            # Of equals, the counter keeps the one that came first.
            agreeing += len(votes) * (Counter(votes).most_common(1)[0][0] == own[onset])
    return agreeing / total if total else float("nan")


@settings(max_examples=80)
@given(takes, takes)
def test_duration_weighted_agreement(one: list, other: list) -> None:
    n = min(len(one), len(other))
    a, b = one[:n], other[:n]
    found = agreement.duration_weighted_agreement(a, b)
    assert found == pytest.approx(slow_duration_weighted(a, b), nan_ok=True)
    assert found == pytest.approx(agreement.duration_weighted_agreement(b, a), nan_ok=True)
    rename = {"N": "A", "A": "x", "D": "B", None: None}
    renamed = agreement.duration_weighted_agreement([rename[x] for x in a], [rename[x] for x in b])
    assert found == pytest.approx(renamed, nan_ok=True)
    if any(a):
        assert agreement.duration_weighted_agreement(a, a) == 1


def test_a_border_costs_nothing_and_a_label_its_duration() -> None:
    a = ["N"] * 60 + ["J"] * 40
    assert agreement.duration_weighted_agreement(a, ["N"] * 70 + ["J"] * 30) == 1
    # 20 of 100 frames are in a segment that only one of them saw as anger; the other's whole J still agrees.
    assert agreement.duration_weighted_agreement(a, ["N"] * 60 + ["J"] * 21 + ["A"] * 19) == pytest.approx(181 / 200)


# Krippendorff's α


@pytest.mark.parametrize(
    ("text", "metric", "published"),
    [
        (KRIPPENDORFF_2011, "nominal", 0.743),
        (KRIPPENDORFF_2011, "ordinal", 0.815),
        (THREE_CODERS, "nominal", 0.691),
    ],
)
def test_published_alphas(text: str, metric: str, published: float) -> None:
    found = agreement.krippendorff_alpha(read_units(text), metric)  # type: ignore[arg-type]
    assert found == pytest.approx(published, abs=5e-4)


def slow_alpha(units: list, metric: str) -> float:
    """Mean disagreement of pairs within units over that of all pairs of values, straight from the definition."""
    paired = [[v for v in unit if v is not None] for unit in units]
    paired = [unit for unit in paired if len(unit) > 1]
    values = [v for unit in paired for v in unit]
    count = Counter(values)

    def apart(c: int, k: int) -> float:
        if metric == "nominal":
            return float(c != k)
        low, high = min(c, k), max(c, k)
        return (sum(count[g] for g in range(low, high + 1)) - (count[c] + count[k]) / 2) ** 2

    within = sum(sum(apart(c, k) for c, k in permutations(unit, 2)) / (len(unit) - 1) for unit in paired)
    among = sum(apart(c, k) for c, k in permutations(values, 2))
    return 1 - within / len(values) / (among / len(values) / (len(values) - 1)) if among else float("nan")


tables = st.integers(2, 4).flatmap(
    lambda n: st.lists(st.lists(degrees, min_size=n, max_size=n), min_size=1, max_size=10)
)


@settings(max_examples=100)
@given(tables, st.sampled_from(["nominal", "ordinal"]))
def test_alpha_is_that_of_the_definition(units: list, metric: str) -> None:
    found = agreement.krippendorff_alpha(units, metric)  # type: ignore[arg-type]
    assert found == pytest.approx(slow_alpha(units, metric), nan_ok=True)
    shuffled = [unit[::-1] for unit in units[::-1]]
    assert agreement.krippendorff_alpha(shuffled, metric) == pytest.approx(found, nan_ok=True)  # type: ignore[arg-type]
    # Ranks do not ask how far apart degrees are, names not even for their order.
    stretch = {0: 0, 1: 10, 2: 11, 3: 500, None: None} if metric == "ordinal" else {0: 2, 1: 3, 2: 0, 3: 1, None: None}
    renamed = [[stretch[v] for v in unit] for unit in units]
    assert agreement.krippendorff_alpha(renamed, metric) == pytest.approx(found, nan_ok=True)  # type: ignore[arg-type]


def test_alpha_of_agreement_chance_and_nothing(rng: np.random.Generator) -> None:
    same = np.repeat(rng.choice(3, size=50), 2).reshape(-1, 2)
    for metric in ("nominal", "ordinal"):
        assert agreement.krippendorff_alpha(same, metric) == 1  # type: ignore[arg-type]
        by_chance = rng.choice(4, size=(20_000, 3))
        assert agreement.krippendorff_alpha(by_chance, metric) == pytest.approx(0, abs=0.02)  # type: ignore[arg-type]
    assert np.isnan(agreement.krippendorff_alpha([["a", "a"], ["a", None]]))
    assert np.isnan(agreement.krippendorff_alpha([["a", None], [None, "b"]]))


def test_ranks_by_name() -> None:
    units = read_units(KRIPPENDORFF_2011)
    names = [None, "e", "b", "a", "d", "c"]
    named = [[None if v is None else names[v] for v in unit] for unit in units]
    assert agreement.krippendorff_alpha(named, "ordinal", classes=names[1:]) == pytest.approx(0.815, abs=5e-4)


def test_bad_input() -> None:
    with pytest.raises(InputError, match="weights: expected None"):
        agreement.cohen_kappa(["a"], ["a"], "cubic")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="degrees that are numbers, but got 'N'"):
        agreement.cohen_kappa(["N"], ["N"], "linear")
    with pytest.raises(InputError, match="one length"):
        agreement.cohen_kappa(["a"], [])
    with pytest.raises(InputError, match="degrees that are numbers"):
        agreement.mean_absolute_error(["1"], ["2"])
    with pytest.raises(InputError, match="metric: expected"):
        agreement.krippendorff_alpha([[1, 2]], "ratio")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="a row a unit"):
        agreement.krippendorff_alpha([1, 2, 3])  # type: ignore[list-item]
    with pytest.raises(InputError, match="rows of one length"):
        agreement.krippendorff_alpha([[1, 2], [1]])
    with pytest.raises(InputError, match="degrees that are numbers"):
        agreement.krippendorff_alpha([["a", "b"]], "ordinal")
