"""The simulated annotators: labels, boundaries, tiers."""

import numpy as np
import pytest
from mimique.synthesis.simulation import load_parameters, recording_times
from mimique.synthesis.simulation.annotators import keep_enough, see_steps, seen_degrees, shift_boundaries
from mimique.synthesis.simulation.poses import draw_instances, draw_style, instance_pose
from mimique.synthesis.simulation.protocols import Instance, Step, isolated_expression, sequence_of_expressions
from mimique.synthesis.simulation.tiers import affect_tier, instruction_tier, step_tier

CODES = {"neutral": "N", "anger": "A", "joy": "J"}


@pytest.fixture(scope="module")
def parameters():
    return load_parameters()


def rows(table):
    return [tuple(row) for row in table.itertuples(index=False)]


def test_affect_tier_names_transitions_and_joins_what_looks_alike():
    bounds = np.array([0, 10, 20, 30, 40, 50, 60, 70])
    assert rows(affect_tier(bounds, ["neutral", "anger", "joy", "neutral"], CODES)) == [
        (0, 10, "neutral", "", ""),
        (10, 20, "NA", "neutral", "anger"),
        (20, 30, "anger", "", ""),
        (30, 40, "AJ", "anger", "joy"),
        (40, 50, "joy", "", ""),
        (50, 60, "JN", "joy", "neutral"),
        (60, 70, "neutral", "", ""),
    ]
    assert rows(affect_tier(bounds, ["neutral", "neutral", "joy", "joy"], CODES)) == [
        (0, 30, "neutral", "", ""),
        (30, 40, "NJ", "neutral", "joy"),
        (40, 70, "joy", "", ""),
    ]


def test_recording_times_add_up_labels_and_transitions():
    tier = affect_tier(np.array([0, 10, 20, 30]), ["neutral", "anger"], CODES)
    assert recording_times([tier, tier], rate=10.0) == {"neutral": 2.0, "transition": 2.0, "anger": 2.0}


def test_step_and_instruction_tiers():
    bounds = np.array([0, 100, 150, 200, 250, 300])
    assert rows(step_tier(bounds, [None, "2", None])) == [(150, 200, "2")]
    script = isolated_expression("joy", 1)
    assert rows(instruction_tier(bounds, script, 60)) == [(0, 40, "neutral"), (40, 140, "joy"), (140, 300, "neutral")]
    assert script.steps[1] == Step("joy")


def test_annotators_see_the_neighbour_past_half_and_neutral_when_weak(parameters, rng):
    n = 2000
    half = [Instance("anger", 1.0, "disgust", parameters.annotators["confused_at"])] * n
    labels, _ = see_steps(half, parameters, "medium", rng=rng)
    assert 0.45 < labels.count("disgust") / n < 0.55
    pure, strengths = see_steps([Instance("anger", 1.0, "disgust", 0.0)] * n, parameters, "medium", rng=rng)
    assert set(pure) == {"anger"}
    assert np.std(strengths) == pytest.approx(parameters.annotators["intensity_spread"], rel=0.1)
    weak, strengths = see_steps([Instance("fear", 0.05, "surprise", 0.0)] * n, parameters, "medium", rng=rng)
    assert weak.count("neutral") / n > 0.99
    assert seen_degrees([0.0, 0.3, 0.7, 1.1], ["neutral", "joy", "joy", "joy"], parameters) == [0, 1, 2, 3]


def test_no_affect_is_lost_among_its_neighbours(parameters):
    instances = [Instance("anger", 1.0, "disgust", blend) for blend in (0.9, 0.6, 0.7, 0.8, 0.95)]
    kept = keep_enough([instances], [["disgust"] * 5], parameters)[0]
    assert kept == ["disgust", "anger", "anger", "anger", "disgust"]  # 0.6 of five, the least blended ones


def test_boundaries_move_by_the_jitter_and_keep_their_order(rng):
    bounds = np.arange(0, 400_001, 200)
    moved = shift_boundaries(bounds, 14.0, 0.35, rng=rng)
    assert moved[0] == 0 and moved[-1] == bounds[-1]
    assert np.std(moved - bounds) == pytest.approx(14.0, rel=0.08)
    tight = np.cumsum(rng.integers(1, 12, 500))
    assert (np.diff(shift_boundaries(tight, 50.0, 0.35, rng=rng)) > 0).all()


def test_affects_are_confused_as_people_confuse_them(parameters, rng):
    """Nearest centroid on held poses (Reverdy 2019, 6.3.3): anger and disgust, fear and sadness towards others."""
    shapes = avatar_shapes()
    script = sequence_of_expressions("joy", [a for a in parameters.affects if a != "joy"])
    counts = np.zeros((6, 6))
    for _ in range(8):
        style = draw_style(parameters, shapes, rng=rng)
        centroids = np.einsum("kv,kvn->kn", np.stack([1 - style.mixture, style.mixture], 1), style.poses)
        for _ in range(60):
            for instance in draw_instances(script, style, parameters, "medium", rng=rng):
                if instance.affect == "neutral":
                    continue
                pose = instance_pose(instance, style, parameters, "medium", rng=rng) - style.resting
                similarity = centroids @ pose / np.linalg.norm(centroids, axis=1)
                counts[parameters.affects.index(instance.affect), np.argmax(similarity)] += 1
    share = counts / counts.sum(axis=1, keepdims=True)
    wrong = share - np.diag(np.diag(share))
    names = np.array(parameters.affects)
    worst = dict(zip(names, names[np.argmax(wrong, axis=1)], strict=True))
    assert worst["anger"] == "disgust"
    assert worst["disgust"] == "anger"
    assert worst["fear"] == "surprise"
    assert worst["sadness"] in ("fear", "surprise")
    rate = dict(zip(names, wrong.sum(axis=1), strict=True))
    assert 0.03 < np.mean(list(rate.values())) < 0.35
    assert rate["joy"] == min(rate.values())


def avatar_shapes():
    from mimique.synthesis.avatar import SHAPES

    return SHAPES
