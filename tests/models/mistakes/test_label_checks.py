"""Mistakes planted in easy cases must all be found: faces do what the clean tier says, plus little noise."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.corpus.annotations.tier_rules import check_tier
from mimique.models import LabelledTake
from mimique.models.mistakes.label_checks import COLUMNS, check_structure, find_label_mistakes
from mimique.models.mistakes.label_evidence import LabelEvidence, collect_label_evidence
from mimique.models.mistakes.planted_faults import AFFECT_CODES, FAULTS, FaultSettings, plant_faults

RATE = 100.0
AFFECTS = [name for name in AFFECT_CODES if name != "neutral"]


def make_take(name: str, signer: str, rng: np.random.Generator, n_steps: int = 13) -> LabelledTake:
    """Affects held in turn with neutral; weights glide from one pose to the next during transitions."""
    order = rng.permutation(AFFECTS)
    steps = [str(order[i // 2 % 6]) if i % 2 else "neutral" for i in range(n_steps)]
    rows, curve, onset = [], [], 0
    pose = {name: np.eye(8)[k] for k, name in enumerate(AFFECT_CODES)}
    for i, step in enumerate(steps):
        hold = int(rng.integers(110, 150))
        rows.append((onset, onset + hold, step, "", ""))
        curve.append(np.repeat(pose[step][None], hold, axis=0))
        onset += hold
        if i + 1 < n_steps:
            after = steps[i + 1]
            rows.append((onset, onset + 30, AFFECT_CODES[step] + AFFECT_CODES[after], step, after))
            u = (np.arange(30)[:, None] + 0.5) / 30
            curve.append((1 - u) * pose[step] + u * pose[after])
            onset += 30
    weights = np.concatenate(curve) + 0.01 * rng.standard_normal((onset, 8))
    table = pd.DataFrame(rows, columns=["onset", "offset", "label", "from_label", "to_label"])
    return LabelledTake(name, signer, "IE", RATE, table, weights)


@pytest.fixture(scope="module")
def takes() -> list[LabelledTake]:
    rng = np.random.default_rng(5)
    return [make_take(f"{signer}_{k}", signer, rng) for signer in ("s1", "s2") for k in range(4)]


def find_in(takes: list[LabelledTake], with_models: bool = True, n_folds: int = 2) -> pd.DataFrame:
    rules = {
        take.name: check_tier(
            take.segments.assign(label=[AFFECT_CODES.get(name, name) for name in take.segments["label"]])
        )
        for take in takes
    }
    evidence = collect_label_evidence(takes, rng=np.random.default_rng(0), n_folds=n_folds) if with_models else {}
    return find_label_mistakes(takes, evidence, rules=rules)


def test_a_clean_corpus_has_no_mistakes(takes: list[LabelledTake]) -> None:
    found = find_in(takes)
    assert found.columns.tolist() == COLUMNS
    assert not len(found)


@pytest.mark.parametrize("kind", FAULTS)
def test_planted_faults_are_found(kind: str, takes: list[LabelledTake]) -> None:
    rng = np.random.default_rng(8)
    faulty, planted = [], []
    for take in takes:
        settings = FaultSettings(share=0.08 if kind == "missing segment" else 0.05, shift=(0.2, 0.5))
        tier, faults = plant_faults(take.segments, RATE, rng=rng, kinds=[kind], settings=settings)
        faulty.append(dataclasses.replace(take, segments=tier))
        planted.append(faults.assign(take=take.name))
    faults = pd.concat(planted, ignore_index=True)
    assert len(faults) >= 2
    with_models = kind in ("swapped label", "shifted boundary", "missing segment")
    found = find_in(faulty, with_models, 4 if kind == "missing segment" else 2)
    if kind == "missing segment":  # what is overlooked is also what movement is learned from
        found = found[found["problem"] == kind]
    assert (found["problem"] == kind).all()
    assert len(found) == len(faults)
    for fault in faults.itertuples():
        here = found[(found["take"] == fault.take) & (found["onset"] < fault.offset) & (fault.onset < found["offset"])]
        assert len(here) == 1
        if kind in ("swapped label", "missing segment"):
            assert here["suggestion"].iloc[0] == fault.true_label
        if kind == "shifted boundary":
            assert abs(int(here["suggestion"].iloc[0]) - fault.true_onset) <= 8


def test_structure_is_told_without_any_model() -> None:
    table = pd.DataFrame(
        [
            (0, 100, "joy"),
            (100, 200, "joy"),
            (205, 300, "joy"),
            (300, 305, "fear"),
            (350, 450, "joy"),
            (440, 500, "fear"),
        ],
        columns=["onset", "offset", "label"],
    )
    found = check_structure(table, 100.0)
    assert found["problem"].value_counts().to_dict() == {
        "doubled segment": 2,
        "short segment": 1,
        "missing segment": 1,
        "shifted boundary": 1,
    }
    assert found[found["problem"] == "missing segment"][["onset", "offset"]].values.tolist() == [[305, 350]]
    assert "touch" in found["reason"][found["problem"] == "doubled segment"].iloc[0]
    assert not len(check_structure(table.iloc[:0], 100.0))


def test_surest_come_first_and_least_score_cuts() -> None:
    segments = pd.DataFrame({"onset": [0, 100, 200], "offset": [100, 200, 300], "label": ["a", "b", "a"]})
    take = LabelledTake("t", "s", "IE", 100.0, segments, n_frames=300)
    p = np.array([[0.001, 0.999], [0.2, 0.8], [0.008, 0.992]])
    evidence = {"t": LabelEvidence(("a", "b"), p, np.repeat(p, 100, axis=0), np.full(300, np.nan))}
    found = find_label_mistakes([take], evidence)
    assert found["onset"].tolist() == [0, 200]
    assert found["score"].is_monotonic_decreasing
    assert "'b' 99%" in found["reason"].iloc[1]
    assert len(find_label_mistakes([take], evidence, least_score=0.9)) == 1


def test_what_cannot_be_judged_is_refused(takes: list[LabelledTake], rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="at least two"):
        collect_label_evidence(takes[:1], rng=rng)
    with pytest.raises(InputError, match="differ"):
        collect_label_evidence([takes[0], takes[0]], rng=rng)
    bare = dataclasses.replace(takes[0], weights=None)
    with pytest.raises(InputError, match="has none; solve first"):
        collect_label_evidence([bare, takes[1]], rng=rng)
    evidence = {takes[0].name: LabelEvidence(("a",), np.ones((2, 1)), np.ones((5, 1)), np.zeros(5))}
    with pytest.raises(InputError, match="evidence of its"):
        find_label_mistakes(takes[:1], evidence)
    with pytest.raises(InputError, match="check_tier"):
        find_label_mistakes(takes[:1], {}, rules={takes[0].name: pd.DataFrame({"problem": ["x"]})})
