from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.features.segmentation import SegmentationSettings, measure_joint_restlessness, segment
from mimique.models.labelled_take import LabelledTake
from mimique.models.metrics import score_boundaries
from mimique.models.segmentation.change_points import (
    METHODS,
    ChangePointSettings,
    cut_by_change_points,
    prepare_signals,
    tune_change_points,
)
from mimique.models.segmentation.tuning import tune_segmentation

GRID = {"threshold": (6.0, 14.0, 400.0), "flank": (0.3, 0.5, 0.9), "directness": (0.0, 0.5)}


def perform(rng: np.random.Generator, signer: str, name: str, rate: float = 100.0) -> LabelledTake:
    """Neutral, an expression, neutral; borders where a smooth step is half as fast; small quick movements between."""
    t = np.arange(round(6 * rate)) / rate
    pose, curve = rng.uniform(0.2, 1.0, size=20), np.zeros_like(t)
    for onset, sign in ((1.5, 1), (4.0, -1)):
        s = np.clip((t - onset) / 0.6, 0, 1)
        curve += sign * s * s * (3 - 2 * s)
    blink = np.exp(-(((t - 3.0) / 0.08) ** 2))
    weights = curve[:, None] * pose + 0.01 * rng.normal(size=(len(t), 20))
    weights[:, :2] += 0.8 * blink[:, None]
    inside = 0.3 * (1 - np.sqrt(0.5))
    ends = np.round(rate * np.array([0, 1.5 + inside, 2.1 - inside, 4 + inside, 4.6 - inside, 6])).astype(int)
    table = pd.DataFrame({"onset": ends[:-1], "offset": ends[1:], "label": ["N", "NA", "A", "AN", "N"]})
    return LabelledTake(name, signer, "IE", rate, table, weights)


@pytest.fixture(scope="module")
def takes() -> list:
    rng = np.random.default_rng(3)
    return [perform(rng, f"s{k // 2}", f"t{k}") for k in range(6)]


@pytest.fixture(scope="module")
def tuning(takes):
    return tune_segmentation(takes, grid=GRID, tolerance=0.05)


def test_counts_are_those_of_segment_and_of_the_other_matching(takes, tuning) -> None:
    for place in range(0, len(tuning.settings), 3):
        chosen = tuning.settings[place]
        for index, take in enumerate(takes):
            own = [(one.weights, one.rate) for one in takes if one.signer == take.signer]
            quiet = measure_joint_restlessness(own, chosen)
            found = segment(take.weights, take.rate, restlessness=quiet, **asdict(chosen))["onset"].to_numpy()[1:]
            expected = score_boundaries(found, take.segments["onset"].to_numpy()[1:], 5)
            counts = (expected.n_matched, expected.n_found, expected.n_reference)
            assert tuple(tuning.counts[place, index]) == counts


def test_the_default_comes_first_and_wins_among_equals(takes, tuning) -> None:
    assert tuning.settings[0] == SegmentationSettings()
    assert tuning.varying == ["threshold", "directness", "flank"]
    alone = tune_segmentation(takes, grid={"min_duration": (0.05, 0.1)})
    assert alone.choose() == SegmentationSettings()


def test_the_planted_rule_is_found(tuning) -> None:
    best = tuning.choose()
    assert best.flank == 0.5
    assert best.threshold < 400
    assert tuning.score(best) > 0.9
    other = replace(best, directness=0.5)
    assert tuning.score(replace(other, threshold=400.0)) == 0.0  # nothing is found
    assert tuning.score(other) > tuning.score(replace(other, flank=0.9)) + 0.2


def test_a_left_out_signer_has_no_part_in_the_choice(takes, tuning) -> None:
    """Spoil one signer's reference: the others' choice for that signer stays, and only their score falls."""
    shifted = [
        replace(one, segments=one.segments.assign(onset=[0, 10, 20, 30, 40], offset=[10, 20, 30, 40, 600]))
        if one.signer == "s0"
        else one
        for one in takes
    ]
    before, after = tuning.leave_one_out(), tune_segmentation(shifted, grid=GRID, tolerance=0.05).leave_one_out()
    names = ["threshold", "flank", "directness"]
    assert before.loc[0, "signer"] == "s0"
    pd.testing.assert_series_equal(before.loc[0, names], after.loc[0, names])
    assert after.loc[0, "tuned"] < 0.2 < before.loc[0, "tuned"]
    assert before.loc[0, "tuned"] == tuning.score(
        replace(SegmentationSettings(), **before.loc[0, names].to_dict()), ["s0"]
    )


def test_one_signer_is_left_out_take_by_take(takes) -> None:
    table = tune_segmentation(takes[:2], grid={"threshold": (14.0, 20.0)}).leave_one_out()
    assert table["take"].tolist() == ["t0", "t1"]
    with pytest.raises(InputError, match="at least two annotated takes"):
        tune_segmentation(takes[:1], grid={"threshold": (14.0, 20.0)}).leave_one_out()


def test_segments_as_the_target(takes) -> None:
    tuning = tune_segmentation(takes, grid=GRID, target="segments")
    assert tuning.score(tuning.choose()) > 0.9
    assert (tuning.counts[:, :, 2] == 5).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"takes": []}, "at least one annotated take"),
        ({"grid": {"speed": (1.0,)}}, "grid: expected some of .* but got speed"),
        ({"grid": {"flank": ()}}, "flank has none"),
        ({"grid": {"flank": (2.0,)}}, "flank: expected a number above 0 and below 1"),
        ({"target": "labels"}, "target: expected borders or segments"),
        ({"tolerance": 0.0}, "tolerance: expected seconds"),
    ],
)
def test_bad_input(takes, arguments: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        tune_segmentation(**{"takes": takes, **arguments})


def test_unknown_settings_and_signers(tuning) -> None:
    with pytest.raises(InputError, match="combination of the grid"):
        tuning.score(SegmentationSettings(window=0.9))
    with pytest.raises(InputError, match="signers: expected"):
        tuning.choose(["nobody"])


@pytest.mark.parametrize("method", METHODS)
def test_change_points_of_a_step_in_the_right_place(method: str) -> None:
    pytest.importorskip("ruptures")
    rng = np.random.default_rng(0)
    samples = np.repeat([[0.0, 0.0], [3.0, -2.0], [0.0, 1.0]], 40, axis=0) + 0.05 * rng.normal(size=(120, 2))
    table = cut_by_change_points([(100, 340, samples)], 100.0, ChangePointSettings(method, "weights", 0.05))
    assert table.values.tolist() == [[100, 180], [180, 260], [260, 340]]  # 40 samples of 50 Hz are 80 frames


@pytest.mark.parametrize("method", METHODS)
def test_change_points_are_tuned_and_cover_every_frame(takes, method: str) -> None:
    pytest.importorskip("ruptures")
    tuning = tune_change_points(takes[:4], method)
    best = tuning.choose(["s0"])
    assert tuning.score(best) > 0.3
    cut = cut_by_change_points(prepare_signals(takes[:2])[best.signal]["t0"], 100.0, best)
    assert cut["onset"].iloc[0] == 0
    assert cut["offset"].iloc[-1] == 600
    assert (cut["onset"].to_numpy()[1:] == cut["offset"].to_numpy()[:-1]).all()
    with pytest.raises(InputError, match="signal: expected"):
        ChangePointSettings(method, "sound", 1.0)


def test_without_ruptures_there_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mimique.models.segmentation.change_points.has_ruptures", lambda: False)
    with pytest.raises(InputError, match=r"install mimique\[compare\]"):
        cut_by_change_points([(0, 9, np.zeros((9, 1)))], 50.0, ChangePointSettings("pelt", "level", 1.0))
