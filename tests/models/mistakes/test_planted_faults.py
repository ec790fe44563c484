import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique import InputError
from mimique.models.mistakes.planted_faults import AFFECT_CODES, FAULTS, FaultSettings, plant_faults

RATE = 200.0


def make_tier(n_steps: int = 41, hold: int = 240, move: int = 80) -> pd.DataFrame:
    """Neutral and affects in turn, with transitions, as people annotate isolated expressions."""
    affects = [name for name in AFFECT_CODES if name != "neutral"]
    steps = [affects[i // 2 % 6] if i % 2 else "neutral" for i in range(n_steps)]
    rows, onset = [], 0
    for i, step in enumerate(steps):
        rows.append((onset, onset + hold, step, "", ""))
        onset += hold
        if i + 1 < n_steps:
            rows.append((onset, onset + move, AFFECT_CODES[step] + AFFECT_CODES[steps[i + 1]], step, steps[i + 1]))
            onset += move
    return pd.DataFrame(rows, columns=["onset", "offset", "label", "from_label", "to_label"])


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_faults_are_where_the_list_says_and_nowhere_else(seed: int) -> None:
    clean = make_tier()
    tier, faults = plant_faults(
        clean, RATE, rng=np.random.default_rng(seed), settings=FaultSettings(share=0.05, shift=(0.1, 0.2))
    )
    assert (tier["offset"] > tier["onset"]).all()
    assert (tier["onset"].to_numpy()[1:] >= tier["offset"].to_numpy()[:-1]).all()
    assert set(faults["problem"]) <= set(FAULTS)
    # What is left untouched is as it was.
    key = ["onset", "offset", "label"]
    same = tier[key].merge(clean[key], how="left", indicator=True)["_merge"] == "both"
    for row in tier[~same.to_numpy()].itertuples():
        near = (faults["true_onset"] - 90 <= row.offset) & (row.onset <= faults["true_offset"] + 90)
        assert near.any()
    for fault in faults.itertuples():
        here = tier[(tier["onset"] < fault.offset) & (fault.onset < tier["offset"])]
        if fault.problem == "shifted boundary":
            assert fault.onset in set(tier["onset"])
            assert 20 <= abs(fault.onset - fault.true_onset) <= 40
            assert fault.true_onset in set(clean["onset"])
        elif fault.problem == "missing segment":
            assert len(here) == (1 if fault.variant == "overlooked" else 0)
        elif fault.problem == "doubled segment":
            assert here["label"].tolist() == [fault.label] * 2
        elif fault.problem == "short segment":
            assert fault.offset - fault.onset < 0.1 * RATE
        else:
            assert here["label"].tolist() == [fault.label]
            assert fault.label != fault.true_label


@pytest.mark.parametrize("kind", FAULTS)
def test_each_kind_is_planted_alone(kind: str) -> None:
    chosen = FaultSettings(share=0.2, shift=(0.1, 0.2))
    _, faults = plant_faults(make_tier(), RATE, rng=np.random.default_rng(1), kinds=[kind], settings=chosen)
    assert len(faults) >= 2
    assert set(faults["problem"]) == {kind}


def test_swapped_label_renames_its_transitions() -> None:
    tier, faults = plant_faults(
        make_tier(), RATE, rng=np.random.default_rng(1), kinds=["swapped label"], settings=FaultSettings(share=0.1)
    )
    place = int(np.flatnonzero(tier["onset"] == faults["onset"].iloc[0])[0])
    label = tier["label"][place]
    assert tier["to_label"][place - 1] == label == tier["from_label"][place + 1]
    assert tier["label"][place - 1] == AFFECT_CODES[tier["from_label"][place - 1]] + AFFECT_CODES[label]


def test_same_seed_same_faults_and_no_share_no_faults() -> None:
    chosen = FaultSettings(share=0.1)
    first = plant_faults(make_tier(), RATE, rng=np.random.default_rng(4), settings=chosen)
    second = plant_faults(make_tier(), RATE, rng=np.random.default_rng(4), settings=chosen)
    assert all(a.equals(b) for a, b in zip(first, second, strict=True))
    tier, faults = plant_faults(make_tier(), RATE, rng=np.random.default_rng(4), settings=FaultSettings(share=0.0))
    assert not len(faults)
    pd.testing.assert_frame_equal(tier, make_tier(), check_dtype=False)


def test_wrong_settings_are_refused(rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="share"):
        FaultSettings(share=2)
    with pytest.raises(InputError, match="rising"):
        FaultSettings(shift=(0.5, 0.1))
    with pytest.raises(InputError, match="kinds"):
        plant_faults(make_tier(), RATE, rng=rng, kinds=["typo"])
