"""Evaluating, training and labelling as a user meets them, on a corpus of two signers with known weights."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from mimique import InputError
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.workbench.cli import run
from mimique.workbench.pipeline.labelled_takes import tell_reading
from sklearn.metrics import cohen_kappa_score

RATE, SHAPES = 100.0, [f"shape{k}" for k in range(6)]
POSES = dict(zip(("neutral", "joy", "fear", "anger"), np.vstack([np.zeros(6), np.eye(6)[:3]]), strict=True))
PLAN = {
    "IE_1": ["neutral", "joy", "neutral", "fear"],
    "SE_1": ["anger", "joy", "anger", "neutral"],
    "EU_1": ["neutral", "joy", "fear"],
    "EU_2": ["anger", "neutral", "joy"],
}


def perform(labels, seed, shift=0.0):
    """A second of each affect and 0.3 s between; weights with noise, and the tier."""
    rng, rows, parts, frame = np.random.default_rng(seed), [], [], 0
    for k, label in enumerate(labels):
        if k:
            s = (np.arange(30)[:, None] + 0.5) / 30
            parts.append(POSES[labels[k - 1]] + s * s * (3 - 2 * s) * (POSES[label] - POSES[labels[k - 1]]))
            rows.append((frame, frame + 30, labels[k - 1][0].upper() + label[0].upper()))
            frame += 30
        parts.append(np.repeat(POSES[label][None], 100, axis=0))
        rows.append((frame, frame + 100, label))
        frame += 100
    return (
        np.concatenate(parts) + shift + 0.01 * rng.normal(size=(frame, 6)),
        pd.DataFrame(rows, columns=["onset", "offset", "label"]),
    )


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """Two signers; A1 labelled all takes, A2 the EU takes, with one other opinion."""
    path = tmp_path_factory.mktemp("protocol") / "corpus"
    corpus = Corpus.create(path)
    with corpus.transaction("Make", author="lead") as edit:
        for signer, simulated in (("s1", {}), ("s2", {"simulated": "yes"})):
            for seed, (name, labels) in enumerate(PLAN.items()):
                weights, tier = perform(labels, seed)
                take = f"{signer}_{name}"
                points = np.zeros((len(weights), 2, 3))
                facts = {"signer": signer, "protocol": name.partition("_")[0], **simulated}
                edit.put_take(take, make_take(points, ["M1", "M2"], RATE, **facts))
                edit.put_weights(take, weights, shapes=SHAPES, solve="known")
                edit.put_tier(take, "affect", tier, author="A1")
                if "EU" in name:
                    other = tier.assign(
                        label=tier["label"].replace("fear", "anger") if signer == "s1" else tier["label"]
                    )
                    edit.put_tier(take, "affect", other, author="A2")
    return path


@pytest.fixture
def corpus(base, tmp_path):
    """A copy that a test may change."""
    return Corpus.open(shutil.copytree(base, tmp_path / "corpus"))


def refused(capsys, *words):
    """Run a command that must be refused in one line; return the line."""
    capsys.readouterr()
    code = run([str(word) for word in words])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.err.count("\n") == 1
    assert "Traceback" not in captured.err
    return captured.err


def test_evaluation_as_json_and_csv(base, tmp_path, capsys):
    out = tmp_path / "scores.csv"
    assert (
        run(
            [
                "evaluate",
                str(base),
                "--protocol",
                "reverdy2019",
                "--classifiers",
                "1-nn,linear-svm",
                "--json",
                "--out",
                str(out),
            ]
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert (found["protocol"], found["annotator"], found["simulated"]) == ("reverdy2019", "A1", True)
    manual = [row for row in found["results"] if row["segmentation"] == "manual"]
    assert len(manual) == 6
    for row in manual:
        assert row["accuracy_low"] <= row["accuracy"] == 1 <= row["accuracy_high"] + 1e-12
        assert {"accuracy_duration", "majority", "chance", "left_out_transition"} <= set(row)
    assert {row["n_train"] for row in manual if row["signer"] == "s1"} == {800}  # every stable frame of IE and SE
    counts = {row["label"]: row["n_manual"] for row in found["classes"] if row["signer"] == "all"}
    assert counts == {"anger": 2, "fear": 2, "joy": 4, "neutral": 4}
    table = pd.read_csv(out)
    assert len(table) == 12
    assert table["simulated"].all()
    assert {path.name for path in tmp_path.iterdir()} == {"scores.csv", "scores_classes.csv", "scores_people.csv"}


def test_the_person_stands_beside_the_machine(base, capsys):
    assert run(["evaluate", str(base), "--classifiers", "1-nn", "--json"]) == 0
    people = json.loads(capsys.readouterr().out)["people"]
    manual = {(row["signer"], row["rater"]): row for row in people if row["segmentation"] == "manual"}
    assert {row["reading"] for row in people} == {"from scratch"}
    # By hand: of s1's six segments one is anger to A2 and fear to A1.
    reference = ["neutral", "joy", "fear", "anger", "neutral", "joy"]
    opinion = ["neutral", "joy", "anger", "anger", "neutral", "joy"]
    assert manual["s1", "A2"]["accuracy"] == pytest.approx(5 / 6)
    assert manual["s1", "A2"]["kappa"] == pytest.approx(cohen_kappa_score(reference, opinion))
    assert manual["s2", "A2"]["kappa"] == manual["s1", "1-nn"]["kappa"] == 1
    assert manual["s1", "A2"]["n_segments"] == manual["s1", "1-nn"]["n_segments"] == 6


def test_proposals_and_adjudication_are_kept_apart(corpus, capsys):
    tier = corpus.tier("s1_EU_1", "affect", author="A2")
    with corpus.transaction("Review", author="lead") as edit:
        origins = ["model"] + ["human"] * (len(tier) - 1)
        edit.put_tier("s1_EU_1", "affect", tier.assign(origin=origins, status="reviewed"), author="A2")
        agreed = corpus.tier("s2_EU_1", "affect", author="A1").assign(status="adjudicated")
        edit.put_tier("s2_EU_1", "affect", agreed, author="A1")
    assert run(["evaluate", str(corpus.path), "--classifiers", "1-nn", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    n_takes = {
        row["reading"]: row["n_takes"]
        for row in found["people"]
        if (row["signer"], row["segmentation"], row["rater"]) == ("all", "manual", "A2")
    }
    assert n_takes == {"from scratch": 2, "with proposals": 1}
    assert any("adjudicated" in note for note in found["notes"])
    assert tell_reading(tier) == "from scratch"


def test_across_signers_and_without_a_second_person(corpus, capsys):
    with corpus.transaction("Drop", author="lead") as edit:
        for take in ("s1_EU_1", "s1_EU_2", "s2_EU_1", "s2_EU_2"):
            edit.delete_tier(take, "affect", "A2")
    assert run(["evaluate", str(corpus.path), "--protocol", "across-signers", "--classifiers", "1-nn"]) == 0
    text = capsys.readouterr().out
    assert "Across signers" in text
    assert "(simulated)" in text
    assert "no human score" in text


def test_a_model_knows_all_that_it_was_made_from(corpus, capsys):
    before = corpus.snapshot
    assert run(["train", str(corpus.path), "--classifier", "1-nn", "--author", "lead"]) == 0
    corpus.refresh()
    facts = corpus.model_metadata("s1-1-nn")
    assert (facts["snapshot"], facts["signers"], facts["simulated"]) == (before, ["s1"], False)
    assert facts["takes"] == ["s1_IE_1", "s1_SE_1"]
    assert facts["tested_takes"] == ["s1_EU_1", "s1_EU_2"]
    assert {"mimique", "python", "numpy", "scipy", "scikit-learn"} == set(facts["versions"])
    assert facts["metrics"][0]["accuracy"] == 1
    capsys.readouterr()
    assert run(["model", "show", str(corpus.path), "s1-1-nn"]) == 0
    card = capsys.readouterr().out
    assert card.startswith("# Model s1-1-nn\n")
    for part in ("s1_IE_1", before, "1.00 [1.00, 1.00]", "## Limits", "scikit-learn", "| manual | 6 |"):
        assert part in card
    assert "simulated" not in card
    assert run(["model", "show", str(corpus.path), "s2-1-nn"]) == 0
    assert capsys.readouterr().out.startswith("# Model s2-1-nn (simulated)")
    assert run(["model", "show", str(corpus.path), "s2-1-nn", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["classifier"] == "1-nn"
    assert "no model 'nobody'" in refused(capsys, "model", "show", corpus.path, "nobody")


def test_training_across_signers_uses_the_others_only_and_labels_whoever_has_no_own_model(corpus, capsys):
    words = ["train", str(corpus.path), "--classifier", "1-nn", "--cross-signers", "--author", "lead"]
    assert run([*words, "--signer", "s1"]) == 0
    corpus.refresh()
    assert corpus.models() == ["without-s1-1-nn"]
    facts = corpus.model_metadata("without-s1-1-nn")
    assert (facts["held_out_signer"], facts["signer"], facts["signers"]) == ("s1", None, ["s2"])
    assert all(take.startswith("s2_") for take in facts["takes"])
    assert all(take.startswith("s1_EU") for take in facts["tested_takes"])
    assert run(["segment", str(corpus.path), "--take", "s1_EU_1", "--author", "lead"]) == 0
    assert run(["label", str(corpus.path), "--take", "s1_EU_1", "--author", "lead"]) == 0
    corpus.refresh()
    tier = corpus.tier("s1_EU_1", "affect", author="without-s1-1-nn")
    assert tier["label"].tolist() == ["neutral", "NJ", "joy", "JF", "fear"]
    capsys.readouterr()
    assert run(["model", "show", str(corpus.path), "without-s1-1-nn"]) == 0
    assert "signer s1 was held out" in capsys.readouterr().out
    assert run([*words, "--signer", "s1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["outcome"] == "unchanged"


def test_a_model_without_annotated_tests_says_so(corpus, capsys):
    with corpus.transaction("Drop", author="lead") as edit:
        for take in ("s1_EU_1", "s1_EU_2"):
            edit.delete_tier(take, "affect", "A1")
    assert run(["train", str(corpus.path), "--classifier", "1-nn", "--signer", "s1", "--author", "lead"]) == 0
    capsys.readouterr()
    assert run(["model", "show", str(corpus.path), "s1-1-nn"]) == 0
    assert "Not tested: no annotated take was held out." in capsys.readouterr().out


def test_models_refuse_other_shapes_and_another_vocabulary(corpus, capsys):
    path = str(corpus.path)
    assert run(["train", path, "--classifier", "1-nn", "--signer", "s1", "--author", "lead"]) == 0
    assert run(["segment", path, "--author", "lead"]) == 0
    corpus.refresh()
    weights, _ = perform(PLAN["EU_1"], 2)
    with corpus.transaction("Other rig", author="lead") as edit:
        edit.put_weights("s1_EU_1", weights, shapes=["jawOpen", *SHAPES[1:]], solve="other")
    line = refused(capsys, "label", path, "--model", "s1-1-nn", "--take", "s1_EU_1")
    assert "take 's1_EU_1'" in line
    assert "differ in jawOpen, shape0" in line
    assert run(["vocabulary", path, "add", "boredom", "--author", "lead"]) == 0
    line = refused(capsys, "label", path, "--model", "s1-1-nn", "--take", "s1_EU_2")
    assert "the vocabulary 'affect' has changed since it was trained (boredom new); train it again" in line
    assert Corpus.open(path).tiers("s1_EU_2")["author"].tolist() == ["A1", "A2", "mimique"]


def test_other_shapes_in_one_evaluation(corpus, capsys):
    weights, _ = perform(PLAN["EU_1"], 2)
    with corpus.transaction("Other rig", author="lead") as edit:
        edit.put_weights("s1_EU_1", weights, shapes=SHAPES[::-1], solve="other")
    assert "their order differs" in refused(capsys, "evaluate", corpus.path)


def relabel(corpus, take, author="A1", **changes):
    with corpus.transaction("Change", author="lead") as edit:
        edit.put_tier(take, "affect", corpus.tier(take, "affect", author=author).assign(**changes), author=author)


def test_a_class_on_one_side_only(corpus, capsys):
    tier = corpus.tier("s1_EU_1", "affect", author="A1")
    relabel(corpus, "s1_EU_1", label=tier["label"].replace({"fear": "joy", "JF": "joy"}))
    line = refused(capsys, "evaluate", corpus.path)
    assert "signer s1: 'fear' is trained on (IE or SE) but never tested (EU)" in line
    assert run(["evaluate", str(corpus.path), "--classifiers", "1-nn", "--lenient"]) == 0
    capsys.readouterr()
    relabel(corpus, "s1_EU_1", label=tier["label"].replace({"fear": "surprise", "JF": "JSu"}))
    line = refused(capsys, "evaluate", corpus.path)
    assert "signer s1: 'surprise' is tested (EU) but never trained on" in line


def test_one_segment_to_test(corpus, capsys):
    with corpus.transaction("Cut", author="lead") as edit:
        edit.delete_tier("s1_EU_2", "affect", "A1")
        edit.put_tier("s1_EU_1", "affect", corpus.tier("s1_EU_1", "affect", author="A1").iloc[:1], author="A1")
    assert "hold one only ('neutral')" in refused(capsys, "evaluate", corpus.path)


def test_weights_that_are_all_nan(corpus, capsys):
    path = str(corpus.path)
    assert run(["segment", path, "--author", "lead"]) == 0
    corpus.refresh()
    n_frames = len(perform(PLAN["IE_1"], 0)[0])
    with corpus.transaction("Lose", author="lead") as edit:
        edit.put_weights("s1_IE_1", np.full((n_frames, 6), np.nan), shapes=SHAPES, solve="lost")
    for words in (["evaluate"], ["train"]):
        assert "take s1_IE_1: expected weights, but all its frames are NaN" in refused(capsys, words[0], path)
    assert run(["train", path, "--classifier", "1-nn", "--signer", "s2", "--author", "lead"]) == 0
    line = refused(capsys, "label", path, "--model", "s2-1-nn", "--take", "s1_IE_1")
    assert "take 's1_IE_1': expected weights, but all its frames are NaN" in line


def test_unknown_labels(corpus, capsys):
    tier = corpus.tier("s1_IE_1", "affect", author="A1")
    relabel(corpus, "s1_IE_1", label=tier["label"].replace("joy", "jooy"))
    for command in ("evaluate", "train"):
        line = refused(capsys, command, corpus.path)
        assert "take 's1_IE_1', tier 'affect' of A1: the label 'jooy' at frame 130 is not in the vocabulary" in line


def test_a_signer_without_a_reference_tier(corpus, capsys):
    with corpus.transaction("Drop", author="lead") as edit:
        for name in PLAN:
            edit.delete_tier(f"s2_{name}", "affect", "A1")
    assert "signer s2: expected a tier 'affect' by 'A1'" in refused(capsys, "evaluate", corpus.path)
    assert "signer s2: expected a tier 'affect' by 'A1'" in refused(capsys, "train", corpus.path, "--signer", "s2")
    assert run(["evaluate", str(corpus.path), "--classifiers", "1-nn", "--lenient"]) == 0
    assert "no take of the protocols IE, SE, EU is of this signer" in refused(
        capsys, "evaluate", corpus.path, "--signer", "s9"
    )


def test_tiers_that_overlap_never_get_into_a_corpus(corpus):
    tier = corpus.tier("s1_SE_1", "affect", author="A1")
    with pytest.raises(InputError, match=r"take 's1_SE_1', tier 'affect' by 'A1': .* overlap"):
        relabel(corpus, "s1_SE_1", offset=tier["offset"] + np.where(tier.index == 0, 5, 0))


def test_an_empty_corpus(tmp_path, capsys):
    Corpus.create(tmp_path / "corpus")
    for command in ("evaluate", "train"):
        assert "the corpus has no takes yet" in refused(capsys, command, tmp_path / "corpus")
    assert "no take has segments yet" in refused(capsys, "label", tmp_path / "corpus")


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["--protocol", "thesis"], "intensity, but got 'thesis'"),
        (["--out", "scores.txt"], "expected a file that ends in .csv"),
        (["--out", "nowhere/scores.csv"], "there is no folder"),
        (["--classifiers", "oracle"], "expected one of 1-nn"),
        (["--annotator", "nobody"], "annotators of it are: A1, A2"),
        (["--protocol", "across-signers", "--signer", "s1"], "at least two signers"),
        (["--test", "IE"], "IE is in both"),
        (["--frames-per-second", "-3"], "samples per second above 0"),
    ],
)
def test_wishes_that_cannot_be_met(base, capsys, words, part):
    assert part in refused(capsys, "evaluate", base, *words)


def test_training_across_one_signer(corpus, capsys):
    with corpus.transaction("Drop", author="lead") as edit:
        for name in PLAN:
            edit.delete_take(f"s2_{name}")
    assert "at least two signers, but all are of s1" in refused(capsys, "train", corpus.path, "--cross-signers")
