"""Counts that add up give the scores of the slow functions, and the bootstrap that of `bootstrap_interval`."""

import numpy as np
import pytest
from mimique import InputError
from mimique.models.scores.agreement import cohen_kappa, duration_weighted_agreement, krippendorff_alpha
from mimique.models.scores.bootstrap import bootstrap_interval
from mimique.models.scores.frame_metrics import score_frames
from mimique.models.scores.label_scores import (
    SCORES,
    add_counts,
    count_labels,
    draw_takes,
    find_intervals,
    score_counts,
)
from mimique.models.scores.segment_metrics import (
    boundary_scores,
    edit_score,
    mean_boundary_offset,
    pool_boundaries,
    pool_f1,
    segmental_f1,
)
from mimique.models.scores.staccato import staccato

RATE = 100.0
CLASSES = ("anger", "joy", "neutral", "transition")


def make_take(rng, n_segments=12, gaps=True):
    """Return a reference, and answers with other borders, some other labels, and gaps on either side."""
    reference, answers = [], []
    for _ in range(n_segments):
        label, length = str(rng.choice(CLASSES)), int(rng.integers(15, 60))
        reference += [label] * length
        other = label if rng.random() < 0.7 else str(rng.choice(CLASSES))
        answers += [other] * (length + int(rng.integers(-6, 7)))
    reference = np.array(reference, dtype=object)
    answers = np.array((answers + [answers[-1]] * len(reference))[: len(reference)], dtype=object)
    if gaps:
        reference[20:31], answers[50:57] = None, None
    return reference, answers


@pytest.fixture(scope="module")
def takes():
    rng = np.random.default_rng(3)
    return [make_take(rng, gaps=k % 2 == 0) for k in range(6)]


@pytest.fixture(scope="module")
def counts(takes):
    return [
        count_labels(*pair, CLASSES, RATE, rng=np.random.default_rng(0), moving="transition", n_simulations=20)
        for pair in takes
    ]


def test_pooled_scores_are_those_of_the_slow_functions(takes, counts):
    found = {name: float(value) for name, value in score_counts(add_counts(counts)).items()}
    reference, answers = (np.concatenate([pair[side] for pair in takes]) for side in (0, 1))
    frames = score_frames(reference, answers)
    for name in ("accuracy", "macro_f1", "majority", "chance"):
        assert found[name] == pytest.approx(getattr(frames, name), abs=1e-12)
    assert frames.n_missed > 0
    assert found["kappa"] == pytest.approx(cohen_kappa(reference, answers), abs=1e-12)
    assert found["alpha"] == pytest.approx(krippendorff_alpha(np.column_stack([reference, answers])), abs=1e-12)
    for name, overlap in (("f1_10", 0.1), ("f1_25", 0.25), ("f1_50", 0.5)):
        assert found[name] == pytest.approx(pool_f1(segmental_f1(*pair, overlap) for pair in takes).f1)
    assert found["edit"] == pytest.approx(np.mean([edit_score(*pair) for pair in takes]))
    for tolerance in (1, 2, 5, 10):
        slow = pool_boundaries(boundary_scores(*pair, tolerance) for pair in takes)
        for what in ("precision", "recall", "f1"):
            assert found[f"border_{what}_{tolerance}"] == pytest.approx(getattr(slow, what))
    n_both = [sum(a is not None and b is not None for a, b in zip(*pair, strict=True)) for pair in takes]
    slow = np.average([duration_weighted_agreement(*pair) for pair in takes], weights=n_both)
    assert found["agreement"] == pytest.approx(slow)
    assert set(SCORES) <= set(found)


def test_offsets_and_staccato_of_one_take_are_those_of_the_slow_functions(takes):
    pair = takes[1]
    one = count_labels(*pair, CLASSES, RATE, rng=np.random.default_rng(5), n_simulations=30)
    found = score_counts(one)
    assert found["offset_ms"] == pytest.approx(10 * mean_boundary_offset(*pair, 25, signed=True))
    assert found["distance_ms"] == pytest.approx(10 * mean_boundary_offset(*pair, 25))
    slow = staccato(*pair, 30, np.random.default_rng(5), tolerance=10)
    assert found["staccato"] == pytest.approx(slow.degree)


def test_late_answers_have_a_known_offset_and_stable_segments_do_not_count_transitions():
    reference = np.array(["joy"] * 100 + ["transition"] * 20 + ["anger"] * 100, dtype=object)
    late = np.concatenate([reference[:1].repeat(4), reference[:-4]])
    found = score_counts(count_labels(reference, late, CLASSES, RATE, rng=np.random.default_rng(0)))
    assert (found["offset_ms"], found["distance_ms"]) == (40, 40)
    assert (found["border_f1_2"], found["border_f1_5"]) == (0, 1)
    without = np.where(reference == "transition", "joy", reference)
    scored = count_labels(reference, without, CLASSES, RATE, rng=np.random.default_rng(0), moving="transition")
    scores = score_counts(scored)
    assert scores["f1_50"] == pytest.approx(2 * 2 / (2 + 3))
    assert scores["f1_50_stable"] == 1


def test_intervals_are_those_of_the_bootstrap_over_takes(takes, counts):
    draws = draw_takes(len(takes), np.random.default_rng(7), 200)
    drawn = score_counts(add_counts(counts, draws))
    whole = score_counts(add_counts(counts))
    each = [segmental_f1(*pair, 0.5) for pair in takes]
    slow = bootstrap_interval(each, lambda some: pool_f1(some).f1, np.random.default_rng(7), n=200)
    assert whole["f1_50"] == pytest.approx(slow.value)
    assert find_intervals(float(whole["f1_50"]), drawn["f1_50"]) == pytest.approx((slow.low, slow.high))


def test_signers_are_drawn_whole():
    draws = draw_takes(5, np.random.default_rng(0), 50, units=["b", "a", "b", "a", "a"])
    assert (draws[:, 0] == draws[:, 2]).all()
    assert (draws[:, 1] == draws[:, 3]).all()
    assert (draws[:, [0, 1]].sum(axis=1) == 2).all()
    assert len(np.unique(draws[:, 0])) > 1


def test_nothing_to_score_is_nan_and_not_a_number():
    nothing = np.full(30, None, dtype=object)
    found = score_counts(count_labels(nothing, nothing, CLASSES, RATE, rng=np.random.default_rng(0), n_simulations=2))
    assert {name for name, value in found.items() if not np.isnan(value)} == set()
    constant = np.full(30, "joy", dtype=object)
    found = score_counts(count_labels(constant, constant, CLASSES, RATE, rng=np.random.default_rng(0)))
    assert found["accuracy"] == found["f1_50"] == 1
    assert np.isnan(found["kappa"])
    assert np.isnan(found["alpha"])
    assert np.isnan(find_intervals(0.5, np.array([0.1, np.nan]))).all()
    with pytest.raises(InputError, match="at least one take"):
        add_counts([])
