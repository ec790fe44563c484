import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.models import CLASSIFIERS, LabelledTake, evaluate_reverdy2019, fit_affect_classifier, label_segments
from mimique.models.evaluation import collect_training_samples

RATE = 100.0
POSES = {
    "neutral": np.zeros(10),
    "joy": np.eye(10)[0] + np.eye(10)[1],
    "fear": np.eye(10)[2] + np.eye(10)[3],
    "anger": np.eye(10)[4] + np.eye(10)[1],
}


def perform(name: str, signer: str, protocol: str, labels: list[str], seed: int = 0) -> LabelledTake:
    """Hold each affect for a second, with transitions of 0.3 s between."""
    rng = np.random.default_rng([seed, len(labels)])
    rows, parts, frame = [], [], 0
    s = (np.arange(30) + 0.5) / 30
    for index, label in enumerate(labels):
        if index:
            before = labels[index - 1]
            ease = (s * s * (3 - 2 * s))[:, None]
            parts.append(POSES[before] + ease * (POSES[label] - POSES[before]))
            rows.append((frame, frame + 30, before[0].upper() + label[0].upper(), "transition"))
            frame += 30
        parts.append(np.tile(POSES[label], (100, 1)))
        rows.append((frame, frame + 100, label, "stable"))
        frame += 100
    weights = np.concatenate(parts) + 0.01 * rng.normal(size=(frame, 10))
    tier = pd.DataFrame(rows, columns=["onset", "offset", "label", "kind"])
    return LabelledTake(name, signer, protocol, RATE, tier, weights)


def corpus(signer: str = "cr") -> list[LabelledTake]:
    return [
        perform(f"{signer}_IE_1", signer, "IE", ["neutral", "joy", "neutral", "fear", "neutral"], 1),
        perform(f"{signer}_SE_1", signer, "SE", ["neutral", "anger", "joy", "anger", "neutral"], 2),
        perform(f"{signer}_EU_1", signer, "EU", ["neutral", "joy", "fear", "neutral"], 3),
        perform(f"{signer}_EU_2", signer, "EU", ["neutral", "anger", "neutral"], 4),
        perform(f"{signer}_IGE_1", signer, "IGE", ["joy", "fear"], 5),
    ]


def test_easy_corpus_is_labelled_right_by_all_on_both_segmentations(rng: np.random.Generator) -> None:
    found = evaluate_reverdy2019([*corpus("cr"), *corpus("cl")], rng=rng)
    table = found.table
    assert len(table) == 3 * len(CLASSIFIERS) * 2
    assert set(table["signer"]) == {"cr", "cl", "all"}
    assert (table["accuracy"] == 1).all()
    assert (table["accuracy_duration"] == 1).all()
    manual = table[(table["segmentation"] == "manual") & (table["signer"] == "cr")]
    assert (manual["n_segments"] == 7).all()
    assert (manual["left_out_transition"] == 5).all()
    np.testing.assert_allclose(manual["majority"], 4 / 7)
    np.testing.assert_allclose(manual["seconds"], 7.0)
    np.testing.assert_allclose(manual["chance"], 1 / 4)
    automatic = table[(table["segmentation"] == "automatic") & (table["signer"] == "all")]
    assert (automatic["n_segments"] == 14).all()
    assert (automatic["left_out_transition"] == 10).all()
    assert found.confusions["all", "1-nn", "manual"].loc["joy", "joy"] == 2


def test_training_takes_stable_frames_of_the_training_protocols_only() -> None:
    takes = corpus()
    samples, labels = collect_training_samples(takes[:2], per_second=None)
    assert len(samples) == 10 * 100
    assert set(labels) == set(POSES)
    thinned, names = collect_training_samples(takes[:2], per_second=10)
    assert len(thinned) == 10 * 10
    for label, pose in POSES.items():
        np.testing.assert_allclose(thinned[names == label].mean(axis=0), pose, atol=0.01)


def test_scores_by_hand_with_wrong_and_uneven_segments(rng: np.random.Generator) -> None:
    takes = corpus()[:2]
    weights = np.concatenate([np.tile(POSES["joy"], (300, 1)), np.tile(POSES["fear"], (100, 1)), np.zeros((200, 10))])
    weights[450:460] = np.nan
    tier = pd.DataFrame(
        {"onset": [0, 300, 400, 450], "offset": [300, 400, 440, 460], "label": ["joy", "anger", "neutral", "neutral"]}
    )
    takes.append(LabelledTake("EU_1", "cr", "EU", RATE, tier, weights))
    pieces = pd.DataFrame({"onset": [0, 50, 300, 395, 450, 500], "offset": [50, 300, 395, 450, 458, 600]})
    found = evaluate_reverdy2019(takes, rng=rng, automatic={"EU_1": pieces}, classifiers=["1-nn"])
    rows = found.table[found.table["signer"] == "cr"].set_index("segmentation")
    # By hand: joy right (3 s), anger taken for fear (1 s), neutral right (0.4 s), the last all gaps.
    assert rows.loc["manual", ["n_segments", "left_out_missing"]].tolist() == [3, 1]
    assert rows.loc["manual", "accuracy"] == pytest.approx(2 / 3)
    assert rows.loc["manual", "accuracy_duration"] == pytest.approx(3.4 / 4.4)
    assert rows.loc["manual", "balanced_accuracy"] == pytest.approx(2 / 3)
    assert rows.loc["manual", "macro_f1"] == pytest.approx((1 + 0 + 1 + 0) / 4)  # fear is given, and never right
    assert rows.loc["manual", "majority_duration"] == pytest.approx(3 / 4.4)
    # Automatic: joy twice (0.5 and 2.5 s) right, anger (0.95 s) wrong, neutral (0.55 s) right, gaps, nothing.
    left_out = ["n_segments", "left_out_transition", "left_out_unlabelled", "left_out_missing"]
    assert rows.loc["automatic", left_out].tolist() == [4, 0, 1, 1]
    assert rows.loc["automatic", "accuracy"] == pytest.approx(3 / 4)
    assert rows.loc["automatic", "accuracy_duration"] == pytest.approx(3.55 / 4.5)
    answers = found.answers[found.answers["segmentation"] == "automatic"]
    assert answers["reference"].tolist() == ["joy", "joy", "anger", "neutral"]
    assert answers["label"].tolist() == ["joy", "joy", "fear", "neutral"]
    np.testing.assert_allclose(answers["share"], [1, 1, 1, 40 / 55])
    assert answers["confidence"].between(0, 1).all()


def test_same_generator_same_table() -> None:
    one, two = (evaluate_reverdy2019(corpus(), rng=np.random.default_rng(4)).answers for _ in range(2))
    pd.testing.assert_frame_equal(one, two)


def test_bad_corpora(rng: np.random.Generator) -> None:
    takes = corpus()
    with pytest.raises(InputError, match="expected labelled takes, but got none"):
        evaluate_reverdy2019([], rng=rng)
    with pytest.raises(InputError, match="signer cr: expected stable labelled segments in EU takes to test on"):
        evaluate_reverdy2019(takes[:2], rng=rng)
    with pytest.raises(InputError, match="signer cr: expected stable labelled segments in IE or SE takes to train on"):
        evaluate_reverdy2019(takes[2:], rng=rng)
    with pytest.raises(InputError, match="EU is in both"):
        evaluate_reverdy2019(takes, rng=rng, train_protocols=["EU"])
    with pytest.raises(InputError, match="only 'joy'"):
        evaluate_reverdy2019([perform("a", "cr", "IE", ["joy"]), *takes[2:]], rng=rng)
    bare = LabelledTake("bare", "cr", "IE", RATE, takes[0].segments, n_frames=takes[0].n_frames)
    with pytest.raises(InputError, match="bare has none"):
        evaluate_reverdy2019([*takes, bare], rng=rng)
    narrow = LabelledTake("narrow", "cr", "EU", RATE, takes[0].segments, takes[0].weights[:, :4])
    with pytest.raises(InputError, match="has 10 and narrow has 4"):
        evaluate_reverdy2019([*takes, narrow], rng=rng)


def test_labelled_segments_name_the_ends_of_transitions(rng: np.random.Generator) -> None:
    model = fit_affect_classifier("rbf-svm", *collect_training_samples(corpus()[:2]), rng=rng)
    take = perform("t", "cr", "EU", ["neutral", "joy", "fear"])
    pieces = take.segments[["onset", "offset", "kind"]].copy()
    found = label_segments(model, take.weights, pieces)
    assert found["label"].tolist()[::2] == ["neutral", "joy", "fear"]
    assert found["from_label"].tolist() == ["", "neutral", "", "joy", ""]
    assert found["to_label"].tolist() == ["", "joy", "", "fear", ""]
    assert found["confidence"].between(0, 1).all()


def test_labelled_segments_without_weights_have_no_label(rng: np.random.Generator) -> None:
    model = fit_affect_classifier("1-nn", *collect_training_samples(corpus()[:2]), rng=rng)
    weights = np.tile(POSES["joy"], (40, 1))
    weights[20:] = np.nan
    found = label_segments(model, weights, pd.DataFrame({"onset": [20, 0], "offset": [40, 20]}))
    assert found["label"].tolist() == ["joy", ""]
    assert np.isnan(found["confidence"][1])
    assert found["onset"].tolist() == [0, 20]
    nothing = label_segments(model, weights, pd.DataFrame({"onset": [], "offset": []}, dtype=np.int64))
    assert len(nothing) == 0
