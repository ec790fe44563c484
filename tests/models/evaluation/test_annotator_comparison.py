import numpy as np
import pandas as pd
import pytest
from mimique.models import LabelledTake
from mimique.models.evaluation.annotator_comparison import compare_annotators
from mimique.models.evaluation.intervals import accuracy_of, kappa_of, macro_f1_of
from mimique.models.metrics import score_labels
from sklearn.metrics import accuracy_score, cohen_kappa_score, f1_score


def make_answers(labels_by_take, classifier="1-nn", segmentation="manual"):
    """Segments of 100 frames at 100 Hz; reference and label by take."""
    rows = []
    for take, pairs in labels_by_take.items():
        for k, (reference, label) in enumerate(pairs):
            rows.append((take, take[0], segmentation, classifier, 100 * k, 100 * k + 100, 1.0, reference, label))
    columns = ["take", "signer", "segmentation", "classifier", "onset", "offset", "seconds", "reference", "label"]
    return pd.DataFrame(rows, columns=columns)


def make_second(take, rows, n_frames=400):
    tier = pd.DataFrame(rows, columns=["onset", "offset", "label"])
    moving = tier["label"].str.fullmatch("[A-Z][a-z]?[A-Z][a-z]?")
    return LabelledTake(take, take[0], "EU", 100.0, tier.assign(is_transition=moving), n_frames=n_frames)


def test_scores_of_counts_are_scikit_learns(rng):
    names = np.array(["anger", "joy", "fear", "neutral"])
    reference, given = names[rng.integers(4, size=200)], names[rng.integers(3, size=200)]
    given[:90] = reference[:90]
    counts = score_labels(reference, given, classes=list(names)).confusion.to_numpy()
    assert accuracy_of(counts) == pytest.approx(accuracy_score(reference, given))
    assert kappa_of(counts) == pytest.approx(cohen_kappa_score(reference, given))
    assert macro_f1_of(counts) == pytest.approx(f1_score(reference, given, average="macro"))
    assert np.isnan([accuracy_of(0 * counts), kappa_of(0 * counts), macro_f1_of(0 * counts)]).all()
    assert np.isnan(kappa_of(np.diag([5.0, 0, 0, 0])))


def test_person_and_machine_are_scored_on_the_same_segments_by_the_same_rule(rng):
    pairs = [("joy", "joy"), ("fear", "joy"), ("joy", "joy"), ("fear", "fear")]
    answers = pd.concat(
        [make_answers({"a1": pairs, "a2": pairs}), make_answers({"a1": pairs, "a2": pairs}, classifier="3-nn")]
    )
    # By hand: in a1 the person says joy, fear (60 of 100 frames), a transition (left out), joy (wrong).
    first = make_second(
        "a1", [(0, 100, "joy"), (100, 160, "fear"), (160, 200, "joy"), (200, 300, "FJ"), (300, 400, "joy")]
    )
    second = make_second("a2", [(0, 90, "joy"), (110, 200, "fear"), (210, 300, "joy"), (300, 340, "fear")])
    table = compare_annotators(answers, [first, second], "A2", rng=rng, n_draws=50)
    everyone = table[table["signer"] == "all"].set_index("rater")
    assert everyone["kind"].to_dict() == {"A2": "person", "1-nn": "machine", "3-nn": "machine"}
    # a2's last segment: 40 frames of fear, 60 of nothing, so it is left out too.
    assert everyone["n_segments"].tolist() == [6, 6, 6]
    assert everyone["left_out"].tolist() == [2, 2, 2]
    assert everyone.loc["A2", "accuracy"] == pytest.approx(5 / 6)
    assert everyone.loc["1-nn", "accuracy"] == pytest.approx(4 / 6)
    reference = ["joy", "fear", "fear", "joy", "fear", "joy"]
    assert everyone.loc["A2", "kappa"] == pytest.approx(
        cohen_kappa_score(reference, ["joy", "fear", "joy", "joy", "fear", "joy"])
    )
    assert everyone.loc["A2", "kappa"] == pytest.approx(everyone.loc["A2", "kappa_duration"])  # all last a second
    assert (everyone["accuracy_low"] <= everyone["accuracy"]).all()
    assert (everyone["accuracy"] <= everyone["accuracy_high"]).all()


def test_readings_are_never_mixed(rng):
    pairs = [("joy", "joy"), ("fear", "joy"), ("joy", "joy"), ("fear", "fear")]
    answers = make_answers({"a1": pairs, "a2": pairs})
    right = [(0, 100, "joy"), (100, 200, "fear"), (200, 300, "joy"), (300, 400, "fear")]
    wrong = [(0, 100, "fear"), (100, 200, "joy"), (200, 300, "fear"), (300, 400, "joy")]
    takes = [make_second("a1", right), make_second("a2", wrong)]
    readings = {"a1": "with proposals", "a2": "from scratch"}
    table = compare_annotators(answers, takes, "A2", rng=rng, readings=readings, n_draws=20)
    people = table[(table["kind"] == "person") & (table["signer"] == "all")].set_index("reading")
    assert people["accuracy"].to_dict() == {"with proposals": 1.0, "from scratch": 0.0}
    assert people["n_takes"].tolist() == [1, 1]
    assert people["accuracy_low"].isna().all()  # one take says nothing about others


def test_takes_without_a_second_person_are_not_compared(rng):
    answers = make_answers({"a1": [("joy", "joy"), ("fear", "fear")]})
    assert compare_annotators(answers, [], "A2", rng=rng).empty
    silent = make_second("a1", [(300, 400, "joy")])
    assert compare_annotators(answers, [silent], "A2", rng=rng).empty
