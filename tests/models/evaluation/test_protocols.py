import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.models import CLASSIFIERS, LabelledTake, evaluate_reverdy2019, fit_affect_classifier, label_segments
from mimique.models.evaluation.protocols import collect_training_samples, evaluate_across_signers, score_model

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
    found = evaluate_reverdy2019(takes, rng=rng, automatic={"EU_1": pieces}, classifiers=["1-nn"], strict=False)
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


def test_intervals_are_those_of_a_plain_bootstrap_over_takes() -> None:
    """A slow second version: draw takes, gather their segments, score them."""
    takes = [*corpus(), perform("cr_EU_3", "cr", "EU", ["joy", "neutral", "fear", "anger", "neutral"], 6)]
    for take in takes[3:]:
        take.weights[:] += 1.0 * np.random.default_rng(len(take.weights)).normal(size=(1, 10))
    found = evaluate_reverdy2019(takes, rng=np.random.default_rng(1), classifiers=["1-nn"], n_draws=2000)
    row = found.table[(found.table["signer"] == "cr") & (found.table["segmentation"] == "manual")].iloc[0]
    answers = found.answers[(found.answers["segmentation"] == "manual")]
    by_take = [some for _, some in answers.groupby("take")]
    assert row["n_takes"] == len(by_take) == 3
    draw, scores = np.random.default_rng(2), []
    for _ in range(2000):
        drawn = pd.concat([by_take[k] for k in draw.integers(3, size=3)])
        scores.append((drawn["reference"] == drawn["label"]).mean())
    assert 0 < row["accuracy"] < 1
    np.testing.assert_allclose(
        row[["accuracy_low", "accuracy_high"]].astype(float), np.quantile(scores, [0.025, 0.975])
    )
    assert row["accuracy_low"] <= row["accuracy"] <= row["accuracy_high"]


def test_one_test_take_has_no_interval() -> None:
    takes = [*corpus()[:2], perform("cr_EU_1", "cr", "EU", ["neutral", "joy", "anger", "fear"], 3)]
    row = evaluate_reverdy2019(takes, rng=np.random.default_rng(1), classifiers=["1-nn"]).table.iloc[0]
    assert row["accuracy"] == 1
    assert np.isnan(row[["accuracy_low", "accuracy_high", "macro_f1_low"]].astype(float)).all()


def test_class_counts_stand_beside_the_scores(rng: np.random.Generator) -> None:
    found = evaluate_reverdy2019(corpus(), rng=rng, classifiers=["1-nn"], per_second=None)
    counts = found.classes[found.classes["signer"] == "cr"].set_index("label")
    assert counts["n_train"].to_dict() == {"anger": 200, "fear": 100, "joy": 200, "neutral": 500}
    assert counts["n_manual"].to_dict() == {"anger": 1, "fear": 1, "joy": 1, "neutral": 4}
    assert counts["n_automatic"].sum() == 7


def test_across_signers_no_frame_of_the_tested_signer_is_learned(rng: np.random.Generator) -> None:
    """The tested signer does everything the other way round: own models are right, the others' cannot be."""
    swap = {"joy": "fear", "fear": "joy", "anger": "anger", "neutral": "neutral"}
    odd = [
        LabelledTake(
            t.name, "odd", t.protocol, RATE, t.segments.assign(label=t.segments["label"].replace(swap)), t.weights
        )
        for t in corpus("odd")
    ]
    takes = [*corpus("a"), *corpus("b"), *odd]
    own = evaluate_reverdy2019(takes, rng=rng, classifiers=["rbf-svm"]).table
    across = evaluate_across_signers(takes, rng=rng, classifiers=["rbf-svm"]).table
    assert (own["accuracy"] == 1).all()
    scored = across[across["segmentation"] == "manual"].set_index("signer")
    assert scored.loc["odd", "accuracy"] == pytest.approx(5 / 7)  # all but joy and fear
    assert scored["n_train"].to_dict() == {"a": 200, "b": 200, "odd": 200, "all": 600}
    with pytest.raises(InputError, match="at least two signers, but all are of cr"):
        evaluate_across_signers(corpus(), rng=rng)


def test_a_class_on_one_side_of_the_split_is_refused(rng: np.random.Generator) -> None:
    takes = corpus()
    with pytest.raises(InputError, match=r"signer cr: 'fear' is tested \(EU\) but never trained on \(IE or SE\)"):
        evaluate_reverdy2019([perform("i", "cr", "IE", ["neutral", "joy", "anger"]), *takes[2:4]], rng=rng)
    with pytest.raises(InputError, match=r"signer cr: 'anger' is trained on \(IE or SE\) but never tested \(EU\)"):
        evaluate_reverdy2019(takes[:3], rng=rng)
    assert len(evaluate_reverdy2019(takes[:3], rng=rng, classifiers=["1-nn"], strict=False).table) == 4


def test_one_segment_and_weights_of_nan_are_refused(rng: np.random.Generator) -> None:
    takes = corpus()
    with pytest.raises(InputError, match=r"at least two segments to test on, but EU takes hold one only \('joy'\)"):
        evaluate_reverdy2019([*takes[:2], perform("e", "cr", "EU", ["joy"])], rng=rng)
    lost = LabelledTake("lost", "cr", "IE", RATE, takes[0].segments, np.full_like(takes[0].weights, np.nan))
    with pytest.raises(InputError, match="take lost: expected weights, but all its frames are NaN"):
        evaluate_reverdy2019([*takes, lost], rng=rng)


def test_a_stored_model_is_scored_as_the_evaluation_scores_it(rng: np.random.Generator) -> None:
    takes = corpus()
    model = fit_affect_classifier("1-nn", *collect_training_samples(takes[:2]), rng=rng)
    tested = [take for take in takes if take.protocol == "EU"]
    table = score_model(model, tested, rng=rng).set_index("segmentation")
    expected = evaluate_reverdy2019(takes, rng=rng, classifiers=["1-nn"]).table.iloc[:2].set_index("segmentation")
    for column in ("n_segments", "accuracy", "accuracy_duration", "macro_f1", "majority", "left_out_transition"):
        assert table[column].to_dict() == expected[column].to_dict()
    assert score_model(model, [perform("x", "cr", "EU", ["joy"])], rng=rng)["n_segments"].tolist() == [1, 1]
