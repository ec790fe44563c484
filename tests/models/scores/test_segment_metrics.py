from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.metrics import match_boundaries
from mimique.models.scores import segment_metrics as metrics


def spell(text: str) -> list:
    """Labels of frames from letters; a point is a gap."""
    return [None if letter == "." else letter for letter in text]


runs = st.lists(st.tuples(st.sampled_from("NAD."), st.integers(1, 6)), min_size=1, max_size=10)
takes = runs.map(lambda items: "".join(letter * length for letter, length in items))


def same_length(one: str, other: str) -> tuple[list, list]:
    n = min(len(one), len(other))
    return spell(one[:n]), spell(other[:n])


pairs = st.tuples(takes, takes).map(lambda two: same_length(*two))


def slow_segments(labels: list) -> list:
    """Label and set of frames of each segment, found one frame at a time."""
    found: list = []
    for frame, label in enumerate(labels):
        if label is None:
            continue
        if found and frame - 1 in found[-1][1] and found[-1][0] == label:
            found[-1][1].add(frame)
        else:
            found.append((label, {frame}))
    return found


def masked(reference: list, predicted: list) -> list:
    return [None if r is None else p for r, p in zip(reference, predicted, strict=True)]


def slow_f1(reference: list, predicted: list, overlap: float) -> tuple[int, int, int]:
    """Lea et al. 2017, 4.1, over sets of frames."""
    wanted, given_ = slow_segments(reference), slow_segments(masked(reference, predicted))
    hit = set()
    for label, frames in given_:
        shares = [len(frames & other) / len(frames | other) if label == name else 0.0 for name, other in wanted]
        if shares and max(shares) >= overlap:
            best = shares.index(max(shares))
            if best not in hit:
                hit.add(best)
    return len(hit), len(given_), len(wanted)


@settings(max_examples=150)
@given(pairs, st.sampled_from([0.1, 0.25, 0.5, 1.0]))
def test_segmental_f1_is_that_of_the_definition(pair: tuple, overlap: float) -> None:
    found = metrics.segmental_f1(*pair, overlap)
    assert (found.n_matched, found.n_predicted, found.n_reference) == slow_f1(*pair, overlap)


def test_segmental_f1_by_hand() -> None:
    # N: 4 of 5 frames shared. The first A: 3 of 6; the second: 1 of 8. J is not predicted.
    reference = spell("NNNNAAAAAAJJ")
    predicted = spell("NNNNNAAANAAA")
    at_half = metrics.segmental_f1(reference, predicted, 0.5)
    assert (at_half.n_matched, at_half.n_predicted, at_half.n_reference) == (2, 4, 3)
    assert at_half.precision == 0.5
    assert at_half.recall == pytest.approx(2 / 3)
    assert float(at_half) == at_half.f1 == pytest.approx(4 / 7)
    assert metrics.segmental_f1(reference, predicted, 0.75).n_matched == 1


def test_a_segment_is_found_once() -> None:
    # Both halves overlap the reference by 9 of 20 frames; the second is a false positive.
    found = metrics.segmental_f1(spell("N" * 20), spell("N" * 9 + "A" * 2 + "N" * 9), 0.25)
    assert (found.n_matched, found.n_predicted, found.n_reference) == (1, 3, 1)


def test_slivers_cost_segments_and_no_accuracy() -> None:
    reference = spell("N" * 50 + "A" * 50)
    slivers = spell("N" * 25 + "A" + "N" * 24 + "A" * 25 + "N" + "A" * 24)
    assert metrics.segmental_f1(reference, reference, 0.5).f1 == 1
    assert metrics.segmental_f1(reference, slivers, 0.5).f1 == pytest.approx(4 / 8)
    assert metrics.edit_score(reference, slivers) == pytest.approx(1 - 4 / 6)


def test_answers_in_unannotated_time_are_left_out() -> None:
    reference = spell("NNNN....AAAA....")
    predicted = spell("NNNNDDDDAAAADDNN")
    assert metrics.segmental_f1(reference, predicted, 0.5).f1 == 1
    assert metrics.edit_score(reference, predicted) == 1
    assert metrics.boundary_scores(reference, predicted, 2).n_found == 0
    # A labelled frame without an answer is missed.
    assert metrics.segmental_f1(spell("NNNNAAAA"), spell("NNNN...."), 0.5).recall == 0.5


def slow_edit(first: list, second: list) -> int:
    """Levenshtein distance by its recursion."""
    if not first or not second:
        return len(first) + len(second)
    kept = slow_edit(first[1:], second[1:]) + (first[0] != second[0])
    return min(kept, slow_edit(first[1:], second) + 1, slow_edit(first, second[1:]) + 1)


short = st.lists(st.sampled_from("NAD"), max_size=5)


@settings(max_examples=60)
@given(short, short)
def test_edit_score_is_levenshteins(one: list, other: list) -> None:
    # Three frames a segment; a gap between them, so that equal neighbours stay two.
    n = 4 * max(len(one), len(other))
    first, second = (
        spell("".join(c * 3 + "." for c in some).ljust(n, "N" if pad else ".")) for some, pad in ((one, 0), (other, 0))
    )
    names = [label for label, _ in slow_segments(first)]
    heard = [label for label, _ in slow_segments(masked(first, second))]
    found = metrics.edit_score(first, second)
    if not names and not heard:
        assert np.isnan(found)
    else:
        assert found == pytest.approx(1 - slow_edit(names, heard) / max(len(names), len(heard)))


def test_edit_score_of_saturday_and_sunday() -> None:
    # The textbook's example (Jurafsky and Martin use "intention" and "execution", distance 5 by substitutions of 1).
    assert metrics.edit_score(list("saturday"), list("sundayyy")) == pytest.approx(1 - 3 / 8)
    assert metrics.edit_score(list("intention"), list("execution")) == pytest.approx(1 - 5 / 9)


@settings(max_examples=80)
@given(pairs)
def test_invariants(pair: tuple) -> None:
    reference, predicted = pair
    rename = {"N": "z", "A": "N", "D": "A", None: None}
    other = [rename[label] for label in reference], [rename[label] for label in predicted]
    for overlap in metrics.OVERLAPS:
        found = metrics.segmental_f1(reference, predicted, overlap)
        assert found == metrics.segmental_f1(*other, overlap)
        assert np.isnan(found.f1) or 0 <= found.f1 <= 1
    counts = [metrics.segmental_f1(reference, predicted, k).n_matched for k in metrics.OVERLAPS]
    assert counts == sorted(counts, reverse=True)
    score = metrics.edit_score(reference, predicted)
    assert np.isnan(score) or 0 <= score <= 1
    np.testing.assert_equal(score, metrics.edit_score(*other))
    matched = [metrics.boundary_scores(reference, predicted, k).n_matched for k in metrics.TOLERANCES]
    assert matched == sorted(matched)
    if None not in reference + predicted:
        assert score == metrics.edit_score(predicted, reference)
        there, back = (metrics.boundary_scores(*two, 2) for two in (pair, pair[::-1]))
        assert there.n_matched == back.n_matched
        np.testing.assert_equal([there.precision, there.mean_distance], [back.recall, back.mean_distance])
    # Everything agrees with itself.
    if any(label is not None for label in reference):
        assert metrics.edit_score(reference, reference) == 1
        assert all(metrics.segmental_f1(reference, reference, k).f1 == 1 for k in (0.1, 1.0))
    if len(metrics.find_boundaries(reference)):
        assert metrics.boundary_scores(reference, reference, 0).f1 == 1
        assert metrics.mean_boundary_offset(reference, reference) == 0


def test_boundaries_lie_between_two_labels() -> None:
    assert metrics.find_boundaries(spell("NNAA..AADD.N")).tolist() == [2, 8]
    assert metrics.find_boundaries([]).tolist() == []


def test_planted_boundaries() -> None:
    reference = spell("N" * 20 + "A" * 20 + "N" * 20 + "J" * 20)
    predicted = spell("N" * 21 + "A" * 16 + "N" * 30 + "J" * 13)  # 1 late, 3 early, 7 late
    matched = [metrics.boundary_scores(reference, predicted, k).n_matched for k in metrics.TOLERANCES]
    assert matched == [1, 1, 2, 3]
    assert metrics.mean_boundary_offset(reference, predicted) == pytest.approx(11 / 3)
    assert metrics.mean_boundary_offset(reference, predicted, signed=True) == pytest.approx(5 / 3)
    assert metrics.mean_boundary_offset(reference, predicted, 5) == 2
    assert np.isnan(metrics.mean_boundary_offset(reference, spell("N" * 80)))


def slow_match(found: list, reference: list, tolerance: float) -> tuple[int, float]:
    """Most pairs and, with that many, the least total distance, of all assignments."""
    if len(found) > len(reference):
        found, reference = reference, found
    for size in range(len(found), 0, -1):
        sums = [
            sum(abs(a - b) for a, b in zip(some, order, strict=True))
            for some in combinations(found, size)
            for order in permutations(reference, size)
            if all(abs(a - b) <= tolerance for a, b in zip(some, order, strict=True))
        ]
        if sums:
            return size, min(sums)
    return 0, 0.0


few = st.lists(st.integers(0, 20), max_size=4)


@settings(max_examples=150)
@given(few, few, st.sampled_from([0, 1, 3, 8, np.inf]))
def test_matching_is_the_nearest_of_the_largest(found: list, reference: list, tolerance: float) -> None:
    rows = match_boundaries(found, reference, tolerance)
    a, b = np.sort(found), np.sort(reference)
    away = [abs(int(a[i]) - int(b[j])) for i, j in rows]
    assert (len(rows), sum(away)) == slow_match(found, reference, tolerance)


def test_a_border_takes_the_nearest_partner() -> None:
    # Going through both lists in order would pair 10 with 12, and tell an offset of −2.
    assert match_boundaries([10, 12], [12], 2).tolist() == [[1, 0]]


def test_pooling_is_what_the_takes_give_together() -> None:
    first = spell("NNNNAAAAADD"), spell("NNNAAAAADDD")
    second = spell("NNNNNNNJJJJJJJ"), spell("NNNNJJJJJJNNNN")
    # A gap between the takes keeps their segments apart.
    joined = [one + [None] * 30 + other for one, other in zip(first, second, strict=True)]
    apart = metrics.pool_f1([metrics.segmental_f1(*two, 0.5) for two in (first, second)])
    assert apart == metrics.segmental_f1(*joined, 0.5)
    borders = metrics.pool_boundaries([metrics.boundary_scores(*two, 5) for two in (first, second)])
    assert borders == metrics.boundary_scores(*joined, 5)
    assert np.isnan(metrics.pool_f1([]).f1)
    assert np.isnan(metrics.pool_boundaries([]).f1)


def test_nothing_to_score_is_nan() -> None:
    for labels in ([], [None, None]):
        assert np.isnan(metrics.segmental_f1(labels, labels, 0.5).f1)
        assert np.isnan(metrics.edit_score(labels, labels))
        assert np.isnan(metrics.boundary_scores(labels, labels, 1).f1)
        assert np.isnan(metrics.mean_boundary_offset(labels, labels))
    assert metrics.edit_score(["N"], [None]) == 0
    assert metrics.boundary_scores(["N", "N"], ["N", "N"], 1).n_reference == 0


def test_bad_input() -> None:
    for overlap in (0, -0.1, 1.5, np.nan):
        with pytest.raises(InputError, match="overlap: expected a share"):
            metrics.segmental_f1(["N"], ["N"], overlap)
    with pytest.raises(InputError, match="one length"):
        metrics.edit_score(["N"], ["N", "A"])
    with pytest.raises(InputError, match="tolerance"):
        metrics.boundary_scores(["N", "A"], ["N", "A"], -1)
