"""One contract for all labellers: scikit-learn's conventions, takes, gaps, rates."""

import pickle

import numpy as np
import pandas as pd
import pytest
import sklearn
from mimique.errors import InputError
from mimique.models.labellers import (
    LABELLERS,
    HiddenMarkovLabeller,
    MergingLabeller,
    NetworkLabeller,
    OrdinalClassifier,
    PerFrameLabeller,
    RandomFieldLabeller,
    has_torch,
    take_splits,
)
from sklearn.base import clone
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import GridSearchCV, GroupKFold, KFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import check_estimator

NETWORKS = ("lstm", "gru", "tcn")
QUICK = {"n_hidden": 12, "max_epochs": 15, "learning_rate": 0.03, "device": "cpu", "work_rate": 12.5, "velocity": ()}
SMALL = {
    **{name: {"classifier": "linear"} for name in LABELLERS if name not in NETWORKS},
    **dict.fromkeys(NETWORKS, QUICK),
    "tcn": {**QUICK, "n_layers": 3},
}


def performances(rate=50.0, n_takes=8, seed=0, noise=0.15):
    """Takes of three classes, held for half a second to one and a half, of five noisy curves."""
    X, y, groups = [], [], []
    poses = np.random.default_rng(99).standard_normal((3, 5))
    for take in range(n_takes):
        rng = np.random.default_rng((seed, take))
        seconds = rng.uniform(0.5, 1.5, size=6)
        codes = np.cumsum(rng.integers(1, 3, size=6)) % 3
        own = np.repeat(codes, np.rint(seconds * rate).astype(int))
        slow = rng.standard_normal((round(seconds.sum() * 10) + 20, 5))  # noise that is the same at every rate
        at = np.arange(len(own)) / rate * 10
        X.append(poses[own] + noise * np.column_stack([np.interp(at, np.arange(len(slow)), c) for c in slow.T]))
        y.append(np.array(["joy", "neutral", "transition"], dtype=object)[own])
        groups.append(np.full(len(own), f"take{take}", dtype=object))
    return np.concatenate(X), np.concatenate(y), np.concatenate(groups)


def make(name, rate=50.0, **more):
    if name in NETWORKS and not has_torch():
        pytest.skip("PyTorch is not installed")
    return LABELLERS[name](np.random.default_rng(0), rate=rate, **{**SMALL[name], **more})


every = pytest.mark.parametrize("name", list(LABELLERS))


@every
def test_it_learns_and_answers_every_frame(name):
    X, y, groups = performances()
    y[::17] = None
    test = np.isin(groups, ["take6", "take7"])
    labeller = make(name).fit(X[~test], y[~test], groups[~test])
    found = labeller.predict(X[test], groups[test])
    likely = labeller.predict_proba(X[test], groups[test])
    known = np.array([label is not None for label in y[test]])
    assert (found[known] == y[test][known]).mean() > 0.9
    assert likely.shape == (test.sum(), 3)
    np.testing.assert_allclose(likely.sum(axis=1), 1.0, atol=1e-6)
    assert labeller.score(X[test], y[test], groups[test]) == pytest.approx((found[known] == y[test][known]).mean())
    with pytest.raises(InputError, match="take5 has frames to train on"):
        labeller.score(X[groups == "take5"], y[groups == "take5"], groups[groups == "take5"])
    # Takes do not touch each other: each by itself gets the same labels as all together.
    alone = [labeller.predict(X[groups == take]) for take in ("take6", "take7")]
    np.testing.assert_array_equal(np.concatenate(alone), found)
    same = pickle.loads(pickle.dumps(labeller))
    np.testing.assert_array_equal(same.predict(X[test], groups[test]), found)


@every
def test_the_same_seed_gives_the_same_labeller(name):
    X, y, groups = performances(n_takes=5)
    quick = {"max_epochs": 2} if name in NETWORKS else {}
    a, b = (make(name, **quick).fit(X, y, groups).predict_proba(X, groups) for _ in range(2))
    np.testing.assert_array_equal(a, b)
    c = clone(make(name, **quick)).fit(X, y, groups).predict_proba(X, groups)
    np.testing.assert_array_equal(a, c)


@every
def test_the_rate_of_the_recording_does_not_matter(name):
    X, y, groups = performances(50.0, n_takes=4, noise=0.05)
    labeller = make(name, 50.0, **({"max_epochs": 4} if name in NETWORKS else {})).fit(X, y, groups)
    likely = labeller.predict_proba(X, groups)
    # The same motion recorded at 100 Hz: every frame is there twice.
    twice = np.repeat(X, 2, axis=0)
    again = labeller.set_params(rate=100.0).predict_proba(twice, np.repeat(groups, 2))
    np.testing.assert_allclose((again[::2] + again[1::2]) / 2, likely, atol=0.2)
    assert np.abs((again[::2] + again[1::2]) / 2 - likely).mean() < 0.01


@every
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda X, y, g: (np.where(np.arange(len(X))[:, None] == 3, np.nan, X), y, g), "frame 3 holds NaN"),
        (
            lambda X, y, g: (X, np.full(len(y), "joy", dtype=object), g),
            "two classes, but got one class, 'joy'",
        ),
        (lambda X, y, g: (X, np.full(len(y), None, dtype=object), g), "no labelled frame"),
        (lambda X, y, g: (X, y[:-1], g), "expected one per frame"),
        (lambda X, y, g: (X, y, g[:-1]), "expected the take of each"),
        (lambda X, y, g: (X, y, np.roll(g, 5)), "frames of a take together"),
        (lambda X, y, g: (X[:0], y[:0], g[:0]), "minimum of 1 is required"),
        (lambda X, y, g: (X, np.where(np.arange(len(y)) == 2, 7, y), g), "all text or all numbers"),
    ],
)
def test_bad_input_is_one_line(name, spoil, words):
    labeller = make(name)
    with pytest.raises(InputError, match=words) as caught:
        labeller.fit(*spoil(*performances(n_takes=2)))
    assert "\n" not in str(caught.value)


def test_other_features_are_refused():
    X, y, groups = performances(n_takes=3)
    labeller = make("per-frame-linear").fit(X, y, groups)
    with pytest.raises(InputError, match="4 features"):
        labeller.predict(X[:, :4])


@pytest.mark.parametrize(
    ("labeller", "words"),
    [
        (PerFrameLabeller(0.0), "rate"),
        (PerFrameLabeller(classifier="tree"), "classifier"),
        (PerFrameLabeller(velocity=(-1.0,)), "velocity"),
        (MergingLabeller(method="vote"), "method"),
        (MergingLabeller(min_duration=-1), "min_duration"),
        (HiddenMarkovLabeller(stay=1.0), "stay"),
        (HiddenMarkovLabeller(decoder="beam"), "decoder"),
        (RandomFieldLabeller(emissions="pixels"), "emissions"),
        (RandomFieldLabeller(penalty=0.0), "penalty"),
    ],
)
def test_bad_parameters(labeller, words):
    X, y, groups = performances(n_takes=2)
    with pytest.raises(InputError, match=f"^{words}"):
        labeller.fit(X, y, groups)


@pytest.mark.parametrize("name", ["forest-merging", "hmm", "crf"])
def test_smoothing_leaves_fewer_segments_and_more_right(name):
    X, y, groups = performances(noise=1.0)
    test = np.isin(groups, ["take6", "take7"])
    plain, smooth = (
        make(kind).fit(X[~test], y[~test], groups[~test]).predict(X[test], groups[test])
        for kind in ("per-frame-linear", name)
    )
    changes = [int((found[1:] != found[:-1]).sum()) for found in (y[test], plain, smooth)]
    assert changes[0] <= changes[2] + 3 < changes[1]
    assert (smooth == y[test]).mean() > (plain == y[test]).mean()


def test_merging_leaves_nothing_shorter_than_asked():
    X, y, groups = performances(noise=1.0)
    for method in ("absorption", "best-segmentation"):
        labeller = MergingLabeller(50.0, classifier="linear", min_duration=0.4, method=method, change=0.0)
        found = labeller.fit(X, y, groups).predict(X[groups == "take0"])
        borders = np.flatnonzero(found[1:] != found[:-1]) + 1
        # 0.4 s are 20 frames; a border lies on a sample of 2 frames, so one at the end may lose a frame.
        assert np.diff([0, *borders, len(found)]).min() >= 19


def test_signers_are_held_out_together():
    X, y, groups = performances()
    signers = np.where(np.isin(groups, ["take0", "take1", "take2"]), "s1", "s2")
    HiddenMarkovLabeller(50.0, classifier="linear").fit(X, y, groups, signers=signers)
    mixed = signers.copy()
    mixed[0] = "s2"
    with pytest.raises(InputError, match="one signer per take, but take0"):
        HiddenMarkovLabeller(50.0, classifier="linear").fit(X, y, groups, signers=mixed)


def test_grid_search_by_take_with_a_table_that_knows_its_takes():
    X, y, groups = performances(n_takes=6)
    index = pd.MultiIndex.from_arrays([groups, np.arange(len(X))], names=["take", "frame"])
    table = pd.DataFrame(X, index=index, columns=list("abcde"))
    search = GridSearchCV(
        MergingLabeller(50.0, classifier="linear"),
        {"min_duration": [0.1, 5.0]},
        cv=GroupKFold(3),
        error_score="raise",
    ).fit(table, y, groups=groups)
    assert search.best_params_ == {"min_duration": 0.1}
    assert search.best_estimator_.takes_ == tuple(f"take{i}" for i in range(6))


def test_grid_search_in_a_pipeline_with_routing():
    X, y, groups = performances(n_takes=6)
    with sklearn.config_context(enable_metadata_routing=True):
        pipeline = make_pipeline(StandardScaler(), HiddenMarkovLabeller(50.0, classifier="linear", emission_weight=1.0))
        search = GridSearchCV(
            pipeline, {"hiddenmarkovlabeller__emission_weight": [0.3, 1.0]}, cv=GroupKFold(3), error_score="raise"
        ).fit(X, y, groups=groups)
        assert search.best_score_ > 0.9
        assert len(search.best_estimator_[-1].takes_) == 6
        with pytest.raises(InputError, match="split: expected all frames of a take on one side"):
            search.set_params(cv=3).fit(X, y, groups=groups)


LINEAR = LogisticRegression(max_iter=1000)
ONE = {"rate": 25.0, "velocity": (), "single_take": True}
# Rows in another order, or fewer of them, are another sequence: its labels may differ.
ORDER = "what a frame is labelled depends on its neighbours"
SEQUENCE = {
    "check_methods_sample_order_invariance": ORDER,
    "check_methods_subset_invariance": ORDER,
    "check_classifiers_train": "Viterbi's path is not the likeliest label of each frame",
}


@pytest.mark.parametrize(
    ("labeller", "expected"),
    [
        (PerFrameLabeller(classifier=LINEAR, **ONE), {}),
        (MergingLabeller(classifier=LINEAR, min_duration=0.0, change=0.0, **ONE), {}),
        (HiddenMarkovLabeller(classifier=LINEAR, n_folds=2, **ONE), SEQUENCE),
        (RandomFieldLabeller(emissions="descriptors", max_iterations=5, **ONE), SEQUENCE),
        (OrdinalClassifier(), {"check_classifiers_train": "three clouds in the plane are not in one order"}),
    ],
    ids=lambda value: type(value).__name__ if hasattr(value, "fit") else "",
)
def test_check_estimator(labeller, expected):
    check_estimator(labeller, expected_failed_checks=expected, on_skip=None, on_fail="raise")


@pytest.mark.skipif(not has_torch(), reason="PyTorch is not installed")
@pytest.mark.parametrize("kind", NETWORKS)
def test_check_estimator_of_networks(kind):
    small = {"n_hidden": 8, "n_layers": 1, "max_epochs": 2, "min_duration": 0.0, "change": 0.0, "device": "cpu"}
    expected = {
        **SEQUENCE,
        "check_classifiers_train": "two passes over a sequence without an order teach a network nothing",
    }
    labeller = NetworkLabeller(network=kind, **small, **ONE)
    check_estimator(labeller, expected_failed_checks=expected, on_skip=None, on_fail="raise")


def test_frames_of_unknown_takes_are_refused():
    """Searches over plain arrays pass groups to the splitter only; what is read as one take may be many."""
    X, y, groups = performances(n_takes=4)
    labeller = make("per-frame-linear")
    with pytest.raises(InputError, match="expected the take of each frame, but got none"):
        labeller.fit(X, y)
    search = GridSearchCV(labeller, {"velocity": [(), (0.2,)]}, cv=GroupKFold(2), error_score="raise")
    with pytest.raises(InputError, match="expected the take of each frame, but got none"):
        search.fit(X, y, groups=groups)
    with pytest.raises(InputError, match="expected the take of each frame, but got none"):
        labeller.fit(X, y, groups).score(X, y)
    alone = make("per-frame-linear", single_take=True)
    assert 0.9 < alone.fit(X, y).score(X, y) <= 1


def test_a_take_that_is_cut_by_a_split_is_seen_by_any_scorer():
    X, y, groups = performances(n_takes=4)
    index = pd.MultiIndex.from_arrays([groups, np.arange(len(X))], names=["take", "frame"])
    table = pd.DataFrame(X, index=index)
    search = GridSearchCV(
        make("per-frame-linear"), {"velocity": [()]}, cv=KFold(3), scoring="accuracy", error_score="raise"
    )
    with pytest.raises(InputError, match="on one side, but take1 was trained on with"):
        search.fit(table, y)
    splits = take_splits(groups, 2, np.random.default_rng(0))
    assert search.set_params(cv=splits, error_score="raise").fit(table, y).best_score_ > 0.9
    fitted = make("per-frame-linear").fit(X, y, groups)
    assert len(fitted.predict(X[groups == "take1"], groups[groups == "take1"])) == 50 * fitted.take_seconds_[1]
    with pytest.raises(InputError, match="take1 was trained on with"):
        fitted.predict(X[groups == "take1"][5:], groups[groups == "take1"][5:])


@every
def test_both_answers_in_one_go(name):
    X, y, groups = performances(n_takes=3)
    labeller = make(name, **({"max_epochs": 2} if name in NETWORKS else {})).fit(X, y, groups)
    labels, likely = labeller.predict_with_proba(X, groups)
    np.testing.assert_array_equal(labels, labeller.predict(X, groups))
    np.testing.assert_array_equal(likely, labeller.predict_proba(X, groups))
