"""What is recorded, and for how long: against Reverdy 2019, 4.3.2, 6.1 and Table B.1."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.synthesis.simulation import load_parameters, recording_times
from mimique.synthesis.simulation.planning import plan_signer
from mimique.synthesis.simulation.protocols import corpus_size, write_scripts
from mimique.synthesis.simulation.signers import create_signer
from mimique.synthesis.simulation.tiers import annotate_take
from mimique.synthesis.simulation.timetable import apportion

# Table B.1 as printed: anger, disgust, fear, joy, sadness, surprise, neutral, unannotated, transitions, total (s).
TABLE = {
    ("s1", "IE"): [12.7, 22.7, 10.2, 31.1, 24.8, 8.0, 89.5, 0.3, 63.5, 262.8],
    ("s1", "SE"): [16.4, 23.2, 18.6, 23.2, 30.7, 5.9, 4.6, 0.0, 37.2, 159.7],
    ("s1", "IGE"): [14.6, 14.6, 23.1, 18.7, 19.3, 11.4, 93.5, 0.0, 59.6, 254.8],
    ("s1", "EU"): [62.4, 20.4, 55.3, 53.2, 49.2, 72.0, 251.9, 0.5, 118.0, 682.9],
    ("s2", "IE"): [17.6, 17.5, 19.1, 23.6, 29.2, 17.5, 42.6, 2.0, 36.1, 205.3],
    ("s2", "SE"): [5.1, 5.1, 7.8, 5.6, 8.6, 2.8, 8.0, 0.0, 20.3, 63.3],
    ("s2", "IGE"): [5.3, 5.3, 3.8, 16.5, 14.1, 8.5, 80.2, 4.0, 35.5, 173.3],
    ("s2", "EU"): [36.2, 13.6, 15.4, 40.5, 51.4, 7.1, 316.3, 1.1, 73.3, 554.9],
}
TOTALS = [170.2, 122.5, 153.3, 212.6, 227.2, 133.2, 886.7, 7.9, 443.5, 2357.0]
ROUNDING = 0.05 + 1e-9
AFFECTS = ["anger", "disgust", "fear", "joy", "sadness", "surprise"]


@pytest.fixture(scope="module")
def parameters():
    return load_parameters()


@pytest.fixture(scope="module")
def people(parameters):
    return [create_signer(number, parameters, seed=4) for number in range(2)]


def table_of(plans, parameters):
    rows = {}
    for plan in plans:
        for protocol in ("IE", "SE", "IGE", "EU"):
            takes = [take for take in plan if take.script.protocol == protocol]
            times = recording_times((annotate_take(t, parameters)["affect@A1"] for t in takes), parameters.rate)
            cells = [times[name] for name in [*AFFECTS, "neutral"]]
            total = sum(take.timetable.n_frames for take in takes) / parameters.rate
            transitions = times["transition"]
            rows[takes[0].signer.code, protocol] = [*cells, total - sum(cells) - transitions, transitions, total]
    return rows


@pytest.mark.parametrize(("difficulty", "seed"), [("easy", 1), ("medium", 0), ("medium", 4), ("hard", 9)])
def test_full_size_has_the_recording_times_of_table_b1(people, parameters, difficulty, seed):
    rows = table_of([plan_signer(s, None, parameters, difficulty, seed=seed) for s in people], parameters)
    for key, printed in TABLE.items():
        np.testing.assert_allclose(rows[key], printed, atol=ROUNDING, rtol=0, err_msg=str(key))
    np.testing.assert_allclose(np.sum(list(rows.values()), axis=0), TOTALS, atol=ROUNDING, rtol=0)


def test_a_third_signer_follows_the_first_row_group(parameters):
    third = create_signer(2, parameters, seed=4)
    rows = table_of([plan_signer(third, None, parameters, "medium", seed=4)], parameters)
    np.testing.assert_allclose(rows["s3", "EU"], TABLE["s1", "EU"], atol=ROUNDING, rtol=0)


@pytest.mark.parametrize("seconds", [60.0, 120.0, 300.0, 900.0])
def test_a_short_corpus_lasts_about_what_was_asked_and_has_every_affect(people, parameters, seconds):
    plans = [plan_signer(s, seconds / 2, parameters, "medium", seed=4) for s in people]
    frames = sum(take.timetable.n_frames for plan in plans for take in plan)
    assert abs(frames / parameters.rate - seconds) < 0.5
    for plan in plans:
        for protocol in ("IE", "SE", "EU"):
            takes = [t for t in plan if t.script.protocol == protocol]
            assert {step.affect for t in takes for step in t.script.steps} == {*AFFECTS, "neutral"}
            times = recording_times((annotate_take(t, parameters)["affect@A1"] for t in takes), parameters.rate)
            assert {*AFFECTS, "neutral"} <= set(times)
        assert any(t.script.protocol == "IGE" for t in plan)


def test_too_few_seconds_are_refused_with_the_least(people, parameters):
    with pytest.raises(InputError, match=r"at least \d+ s a signer, but got 10 s"):
        plan_signer(people[0], 10.0, parameters, "medium", seed=0)
    for wrong in (0.0, -3.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="expected a positive number"):
            plan_signer(people[0], wrong, parameters, "medium", seed=0)


@pytest.fixture(scope="module")
def scripts(parameters):
    return write_scripts(parameters, corpus_size(parameters, None), np.random.default_rng(1))


def sequence(script):
    return [step.affect for step in script.steps]


def test_there_are_6_ie_5_se_6_ige_and_18_eu(scripts):
    counts = {p: sum(s.protocol == p for s in scripts) for p in ("IE", "SE", "IGE", "EU")}
    assert counts == {"IE": 6, "SE": 5, "IGE": 6, "EU": 18}
    assert len({s.name for s in scripts}) == 35


def test_ie_is_one_affect_five_times_between_neutrals(scripts):
    for script in (s for s in scripts if s.protocol == "IE"):
        assert sequence(script) == ["neutral", *[script.affect, "neutral"] * 5]


def test_se_alternates_one_affect_with_each_other(scripts):
    chosen = [s for s in scripts if s.protocol == "SE"]
    assert len({s.affect for s in chosen}) == 5
    for script in chosen:
        steps = sequence(script)
        assert steps[0] == steps[-1] == "neutral"
        assert steps[1:-1:2] == [script.affect] * 6
        assert sorted(steps[2:-1:2]) == sorted(set(AFFECTS) - {script.affect})


def test_ige_rises_through_three_degrees_three_times(scripts):
    for script in (s for s in scripts if s.protocol == "IGE"):
        assert sequence(script) == ["neutral", *[script.affect, "neutral"] * 9]
        assert [s.degree for s in script.steps if s.degree] == [1, 2, 3] * 3


def test_eu_repeats_each_sentence_three_times(scripts):
    chosen = [s for s in scripts if s.protocol == "EU"]
    assert len({s.instruction for s in chosen}) == 18
    for script in chosen:
        assert len(script.utterances) == 3
        for before, after in script.utterances:
            assert script.steps[before].affect == script.steps[after].affect == "neutral"
            assert script.affect in {s.affect for s in script.steps[before:after]}
            assert all(s.affect != "neutral" for s in script.steps[before + 1 : after])


def test_neutral_between_degrees_lasts_one_to_two_seconds(people, parameters):
    for person in people:
        plan = plan_signer(person, None, parameters, "medium", seed=4)
        bounds = [t.bounds["truth"] for t in plan if t.script.protocol == "IGE"]
        neutral = np.concatenate([(b[5:-2:4] - b[4:-2:4]) / parameters.rate for b in bounds])
        assert 1.0 <= np.median(neutral) <= 2.0
        assert np.mean((neutral > 0.7) & (neutral < 2.5)) > 0.9


@given(
    weights=st.lists(st.floats(0.01, 100.0), min_size=1, max_size=30),
    floor=st.integers(0, 20),
    spare=st.integers(0, 10_000),
)
def test_apportion_spends_everything_and_keeps_the_floor(weights, floor, spare):
    total = floor * len(weights) + spare
    parts = apportion(np.array(weights), total, floor)
    assert parts.sum() == total
    assert parts.min() >= floor
    np.testing.assert_allclose(parts - floor, np.array(weights) / np.sum(weights) * spare, atol=1.0)


def test_apportion_refuses_what_does_not_fit():
    with pytest.raises(InputError, match="do not fit into 5 frames"):
        apportion(np.ones(3), 5, 2)


def test_parameters_are_complete_and_versioned(parameters):
    assert [int(part) for part in parameters.version.split(".")] >= [1, 0, 0]
    assert parameters.rate == 200
    assert set(parameters.poses) == set(parameters.confusion) == set(parameters.affects) == set(AFFECTS)
    assert list(parameters.difficulty) == ["easy", "medium", "hard"]
    assert parameters.codes == dict(zip(["neutral", *AFFECTS], ["N", "A", "D", "F", "J", "Sa", "Su"], strict=True))
    for confusion in parameters.confusion.values():
        assert sum(confusion["toward"].values()) == pytest.approx(1.0)
    for size in parameters.protocols["size"]:
        assert sum(size["share"].values()) == pytest.approx(1.0)
    with pytest.raises(InputError, match="expected one of easy, medium, hard, but got 'harder'"):
        parameters.level("harder")
