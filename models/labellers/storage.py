"""Fitted labellers as arrays and JSON, and back: no code is kept, and nothing is learned again when one is loaded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.validation import check_is_fitted

from ...errors import InputError
from .base import FrameLabeller
from .hidden_markov import HiddenMarkovLabeller
from .network_labeller import NetworkLabeller
from .per_frame import MergingLabeller, PerFrameLabeller
from .random_field import RandomFieldLabeller
from .stored_forest import StoredForest, forest_to_arrays

__all__ = ["labeller_from_arrays", "labeller_to_arrays"]

FORMAT = 1
KINDS: dict[str, type[FrameLabeller]] = {
    "per-frame": PerFrameLabeller,
    "merging": MergingLabeller,
    "hidden-markov": HiddenMarkovLabeller,
    "random-field": RandomFieldLabeller,
    "network": NetworkLabeller,
}
LEARNED: dict[str, tuple[str, ...]] = {
    "per-frame": (),
    "merging": (),
    "hidden-markov": ("prior_", "start_", "transition_", "emission_weight_", "prior_weight_"),
    "random-field": ("emission_", "bias_", "start_", "transition_", "loss_", "n_iter_", "mean_", "spread_"),
    "network": ("mean_", "spread_", "losses_", "best_epoch_"),
}
"""Arrays and numbers that each kind learns, besides classifiers and the parameters of networks."""
NOT_KEPT = ("callback", "checkpoint", "device")


def labeller_to_arrays(labeller: FrameLabeller) -> tuple[dict[str, NDArray], dict[str, Any]]:
    """Return all that makes a fitted labeller.

    Returns
    -------
    arrays
        By name; a forest's begin with ``forest.``, a linear classifier's with ``linear.``; ``network`` holds all
        parameters of a network, one after the other.
    metadata
        JSON values: ``format, kind, parameters, numbers, layers, classes, n_features, takes, take_seconds``.

    Raises
    ------
    InputError
        If the classifier of frames is neither a forest nor the linear one: how to keep another, nobody knows.
    """
    check_is_fitted(labeller)
    kind = next((name for name, own in KINDS.items() if type(labeller) is own), None)
    if kind is None:
        raise InputError(f"labeller: expected one of mimique's own to store, but got {type(labeller).__name__}")
    learned = {name: getattr(labeller, name) for name in LEARNED[kind] if hasattr(labeller, name)}
    arrays = {name: value for name, value in learned.items() if isinstance(value, np.ndarray)}
    if isinstance(labeller, PerFrameLabeller) and hasattr(labeller, "classifier_"):
        arrays |= _classifier_to_arrays(labeller.classifier, labeller.classifier_)
    layers: list[list[Any]] = []
    if isinstance(labeller, NetworkLabeller):
        layers = [[name, list(values.shape)] for name, values in labeller.arrays_.items()]
        arrays["network"] = np.concatenate([values.ravel() for values in labeller.arrays_.values()])
    parameters = {name: value for name, value in labeller.get_params(deep=False).items() if name not in NOT_KEPT}
    metadata = {
        "format": FORMAT,
        "kind": kind,
        "parameters": {
            name: list(value) if isinstance(value, (tuple, np.ndarray)) else value for name, value in parameters.items()
        },
        "numbers": {name: value for name, value in learned.items() if name not in arrays},
        "layers": layers,
        "classes": labeller.classes_.tolist(),
        "n_features": int(labeller.n_features_in_),
        "takes": [str(name) for name in labeller.takes_],
        "take_seconds": [float(seconds) for seconds in labeller.take_seconds_],
    }
    return arrays, metadata


def labeller_from_arrays(arrays: Mapping[str, ArrayLike], metadata: Mapping[str, Any]) -> FrameLabeller:
    """Return the labeller that :func:`labeller_to_arrays` described.

    It answers as the one that was stored did: bit for bit, networks on another device within rounding.

    Raises
    ------
    InputError
        If something is missing, or was written by a newer version.
    """
    lacking = [key for key in ("format", "kind", "parameters", "classes", "n_features") if key not in metadata]
    if lacking:
        raise InputError(f"stored labeller: expected {', '.join(lacking)}, but it is not there")
    if metadata["format"] != FORMAT or metadata["kind"] not in KINDS:
        raise InputError(
            f"stored labeller: expected format {FORMAT} and a kind among {', '.join(KINDS)}, but got format "
            f"{metadata['format']} and kind {metadata['kind']!r}; update mimique"
        )
    kind = str(metadata["kind"])
    given = {name: np.asarray(values) for name, values in arrays.items()}
    parameters = {k: tuple(v) if isinstance(v, list) else v for k, v in metadata["parameters"].items()}
    try:
        labeller = KINDS[kind](**parameters)
        labeller.classes_ = np.array(metadata["classes"])
        labeller.n_features_in_ = int(metadata["n_features"])
        labeller.takes_ = tuple(metadata.get("takes", ()))
        labeller.take_seconds_ = tuple(metadata.get("take_seconds", ()))
        learned = {**given, **metadata.get("numbers", {})}
        for name in LEARNED[kind]:
            if name in learned:
                setattr(labeller, name, learned[name])
        if isinstance(labeller, NetworkLabeller):
            labeller.arrays_ = _split_layers(given["network"], metadata["layers"])
            labeller.plan_ = labeller._make_plan(len(labeller.mean_), "cpu")
        elif isinstance(labeller, PerFrameLabeller):
            n_described = labeller.n_features_in_ * (1 + len(labeller.velocity))
            if not (isinstance(labeller, RandomFieldLabeller) and labeller.emissions == "descriptors"):
                labeller.classifier_ = _classifier_from_arrays(given, n_described)
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"stored labeller: something is missing or does not fit ({error}); train again") from error
    return labeller


def _classifier_to_arrays(asked: Any, classifier: Any) -> dict[str, NDArray]:
    if isinstance(classifier, RandomForestClassifier) and asked == "forest":
        return {f"forest.{name}": values for name, values in forest_to_arrays(classifier).items()}
    if isinstance(classifier, StoredForest):
        return {f"forest.{name}": values for name, values in classifier.arrays.items()}
    if isinstance(classifier, Pipeline) and asked == "linear":
        scaler, machine = (step for _, step in classifier.steps)
        return {
            "linear.mean": scaler.mean_,
            "linear.scale": scaler.scale_,
            "linear.coef": machine.coef_,
            "linear.intercept": machine.intercept_,
            "linear.classes": machine.classes_,
        }
    raise InputError(f"classifier: expected 'forest' or 'linear' in a labeller that is stored, but got {asked!r}")


def _classifier_from_arrays(arrays: Mapping[str, NDArray], n_features: int) -> Any:
    forest, linear = _under("forest.", arrays), _under("linear.", arrays)
    if forest:
        return StoredForest(forest, n_features)
    scaler, machine = StandardScaler(), LogisticRegression()
    scaler.mean_, scaler.scale_, scaler.n_features_in_ = linear["mean"], linear["scale"], n_features
    scaler.var_ = scaler.scale_**2
    machine.coef_, machine.intercept_ = linear["coef"], linear["intercept"]
    machine.classes_, machine.n_features_in_ = linear["classes"], n_features
    if machine.coef_.shape[1:] != (n_features,) or scaler.mean_.shape != (n_features,):
        raise InputError(f"stored labeller: expected a classifier of {n_features} descriptors; train again")
    return make_pipeline(scaler, machine)


def _split_layers(joined: NDArray, layers: list[list[Any]]) -> dict[str, NDArray]:
    sizes = [int(np.prod(shape, dtype=np.int64)) for _, shape in layers]
    if sum(sizes) != len(joined):
        raise InputError(f"stored labeller: expected {sum(sizes)} parameters of a network, but got {len(joined)}")
    parts = np.split(joined, np.cumsum(sizes)[:-1])
    return {str(name): part.reshape(shape) for part, (name, shape) in zip(parts, layers, strict=True)}


def _under(prefix: str, arrays: Mapping[str, NDArray]) -> dict[str, NDArray]:
    return {name.removeprefix(prefix): values for name, values in arrays.items() if name.startswith(prefix)}
