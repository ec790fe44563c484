"""Calibration inside training: folds, held-out answers, the correction."""

import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.models import LabelledTake
from mimique.models.confidence.cross_calibration import FoldAnswers, calibrate_answers, collect_fold_answers, deal_folds

CLASSES = ("a", "b", "c")


def test_what_is_in_a_fold_is_also_elsewhere():
    # Each class is in two takes; were both in one fold, nothing would be left to learn it from.
    held = [{"n", "a"}, {"n", "b"}, {"n", "c"}, {"n", "a"}, {"n", "b"}, {"n", "c"}]
    folds = deal_folds([f"t{i}" for i in range(6)], held, 2)
    assert sorted(place for fold in folds for place in fold) == list(range(6))
    for fold in folds:
        assert set().union(*(held[place] for place in fold)) == {"n", "a", "b", "c"}
        assert len(fold) == 3
    together = deal_folds(["s1", "s1", "s2", "s3", "s3"], [{"a"}] * 5, 3)
    assert sorted(map(sorted, together)) == [[0, 1], [2], [3, 4]]
    with pytest.raises(InputError, match="n_folds"):
        deal_folds(["s1"], [{"a"}], 1)


def make_take(name, signer, labels):
    rows = [(10 * i, 10 * (i + 1), label) for i, label in enumerate(labels)]
    table = pd.DataFrame(rows, columns=["onset", "offset", "label"])
    return LabelledTake(name, signer, "IE", 100.0, table, np.zeros((10 * len(labels), 2)))


class Model:
    def __init__(self, takes):
        self.signers = {take.signer for take in takes}
        self.classes = tuple(sorted({label for take in takes for label in take.segments["label"]}))


def test_nobody_is_asked_about_takes_that_were_learned_from():
    takes = [make_take(f"t{i}", f"s{i % 3}", "ab" if i else "abc") for i in range(6)]
    asked = []

    def answer(model, take):
        assert take.signer not in model.signers
        asked.append(take.name)
        labels = take.segments["label"].to_numpy(dtype=object)
        return np.full((len(labels), len(model.classes)), 1 / len(model.classes)), labels

    found = collect_fold_answers(takes, 3, lambda number, taught: Model(taught), answer, CLASSES)
    assert sorted(asked) == [take.name for take in takes]
    assert found.probabilities.shape == (12, 3)
    assert found.left_out == 1  # c is known to s0 only
    assert set(found.units) == {"s0", "s1", "s2"}
    with pytest.raises(InputError, match="one take only"):
        collect_fold_answers(takes[:1], 3, lambda number, taught: Model(taught), answer, CLASSES)


def bold_answers(n=1500, seed=0):
    """Answers whose true probabilities are known, made bolder than they are: to the power of 3."""
    rng = np.random.default_rng(seed)
    true = rng.dirichlet([1, 1, 1], n)
    labels = np.array(CLASSES, dtype=object)[[rng.choice(3, p=row) for row in true]]
    bold = true**3 / (true**3).sum(axis=1, keepdims=True)
    return FoldAnswers(bold, labels, rng.choice(["s1", "s2", "s3"], n).astype(object), 0)


def test_the_correction_undoes_what_was_too_bold():
    found = calibrate_answers(bold_answers(), CLASSES)
    assert found.calibrator.temperature == pytest.approx(3, rel=0.15) or found.calibrator.method == "isotonic"
    facts = found.facts
    assert facts["ece"] > 0.15
    assert facts["ece_calibrated"] < 0.05
    assert facts["brier_calibrated"] < facts["brier"]
    assert facts["log_loss_calibrated"] < facts["log_loss"]


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda a: FoldAnswers(a.probabilities[:9], a.references[:9], a.units[:9], 0), "9 held-out segments"),
        (
            lambda a: FoldAnswers(
                a.probabilities[a.references != "b"], a.references[a.references != "b"], a.units[a.references != "b"], 0
            ),
            "no held-out segment was one of b",
        ),
        (lambda a: FoldAnswers(a.probabilities, a.references, np.full_like(a.units, "s1"), 0), "one take or signer"),
    ],
)
def test_too_little_gives_no_correction_and_the_reason(spoil, why):
    found = calibrate_answers(spoil(bold_answers()), CLASSES)
    assert found.calibrator is None
    assert why in found.facts["why"]
