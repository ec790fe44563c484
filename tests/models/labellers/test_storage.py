"""Labellers as arrays and JSON: what comes back answers the same, bit for bit."""

import json

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.labellers import LABELLERS, PerFrameLabeller, RandomFieldLabeller, has_torch
from mimique.models.labellers.storage import labeller_from_arrays, labeller_to_arrays
from mimique.models.labellers.stored_forest import StoredForest, forest_to_arrays, walk_forest
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression

NETWORKS = ("lstm", "gru", "tcn")


def frames(seed=0, n_takes=3):
    rng = np.random.default_rng(seed)
    y = np.repeat(rng.choice(["joy", "neutral", "transition"], 12 * n_takes), 25).astype(object)
    X = rng.standard_normal((len(y), 4)) + np.array([[2 * (label == "joy"), label == "neutral", 0, 0] for label in y])
    return X, y, np.repeat([f"take{i}" for i in range(n_takes)], 300)


def stored(labeller):
    arrays, metadata = labeller_to_arrays(labeller)
    return labeller_from_arrays(arrays, json.loads(json.dumps(metadata, allow_nan=False)))


@pytest.mark.parametrize("name", list(LABELLERS))
def test_it_answers_as_before(name):
    if name in NETWORKS and not has_torch():
        pytest.skip("PyTorch is not installed")
    quick = {"max_epochs": 2, "n_hidden": 8, "device": "cpu"} if name in NETWORKS else {}
    labeller = LABELLERS[name](np.random.default_rng(0), rate=50.0, **quick).fit(*frames())
    again = stored(stored(labeller))
    X, _, groups = frames(seed=1)
    for one, other in zip(labeller.predict_with_proba(X), again.predict_with_proba(X), strict=True):
        np.testing.assert_array_equal(one, other)
    assert again.takes_ == labeller.takes_
    with pytest.raises(InputError, match="take0, take1"):
        again.score(X, frames()[1], groups)
    with pytest.raises(InputError, match="3 features"):
        again.predict(X[:, :3])


def test_field_on_descriptors():
    labeller = RandomFieldLabeller(50.0, emissions="descriptors", max_iterations=5).fit(*frames())
    X = frames(seed=1)[0]
    np.testing.assert_array_equal(stored(labeller).predict_proba(X), labeller.predict_proba(X))


def test_a_classifier_of_ones_own_is_refused():
    labeller = PerFrameLabeller(50.0, classifier=LogisticRegression()).fit(*frames())
    with pytest.raises(InputError, match="'forest' or 'linear'"):
        labeller_to_arrays(labeller)


@pytest.mark.parametrize("n_classes", [2, 3])
def test_forests_bit_for_bit(n_classes):
    rng = np.random.default_rng(0)
    X, y = rng.standard_normal((300, 5)), rng.integers(n_classes, size=300)
    forest = RandomForestClassifier(20, random_state=0).fit(X, y)
    arrays = forest_to_arrays(forest)
    asked = rng.standard_normal((200, 5))
    expected = forest.predict_proba(asked)
    np.testing.assert_array_equal(walk_forest(arrays, asked), expected)
    np.testing.assert_array_equal(StoredForest(arrays, 5).predict_proba(asked), expected)


@pytest.mark.parametrize(
    ("key", "spoil"),
    [
        ("left", lambda a: np.where(a > 0, 0, a)),  # a loop
        ("right", lambda a: a + 10_000),
        ("feature", lambda a: a + 5),
        ("threshold", lambda a: a[:-1]),
        ("shares", lambda a: a[:-1]),
        ("n_nodes", lambda a: a + 1),
        ("depth", lambda a: a[:-1]),
    ],
)
def test_damaged_forests_are_refused(key, spoil):
    rng = np.random.default_rng(0)
    forest = RandomForestClassifier(3, random_state=0).fit(rng.standard_normal((50, 5)), rng.integers(2, size=50))
    arrays = forest_to_arrays(forest)
    with pytest.raises(InputError, match="damaged"):
        StoredForest({**arrays, key: spoil(arrays[key])}, 5)
    with pytest.raises(InputError, match=f"expected {key}"):
        StoredForest({name: values for name, values in arrays.items() if name != key}, 5)


def test_lacking_and_newer_parts_are_told():
    arrays, metadata = labeller_to_arrays(LABELLERS["hmm"](np.random.default_rng(0), rate=50.0).fit(*frames()))
    with pytest.raises(InputError, match="expected classes"):
        labeller_from_arrays(arrays, {key: value for key, value in metadata.items() if key != "classes"})
    with pytest.raises(InputError, match="update mimique"):
        labeller_from_arrays(arrays, {**metadata, "format": 2})
    with pytest.raises(InputError, match="train again"):
        labeller_from_arrays(arrays, {**metadata, "parameters": {"colour": "red"}})
    with pytest.raises(InputError, match="train again"):
        labeller_from_arrays({k: v for k, v in arrays.items() if "forest" not in k}, metadata)
