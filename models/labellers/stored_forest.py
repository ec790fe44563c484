"""A random forest as plain arrays: its splits and the class shares of its leaves, and nothing that could be run.

The splits are given back to scikit-learn's own tree, which is fast, and whose layout may change from version to
version. So a few rows are also walked through the stored splits one by one, and a forest that answers otherwise is
refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import RandomForestClassifier
from sklearn.tree import DecisionTreeClassifier
from sklearn.tree._tree import Tree

from ...errors import InputError

__all__ = ["StoredForest", "forest_to_arrays", "walk_forest"]

N_PROBES = 16


def forest_to_arrays(forest: RandomForestClassifier) -> dict[str, NDArray]:
    """Return the arrays of a fitted forest.

    Returns
    -------
    ``n_nodes`` and ``depth`` (n_trees,); for all nodes, tree after tree, ``left`` and ``right`` (the place of the
    child in its tree, -1 in a leaf), ``feature`` and ``threshold``; for all leaves in the same order ``shares``
    ``(n_leaves, n_classes)``; and ``classes``.
    """
    trees = [estimator.tree_ for estimator in forest.estimators_]
    left = np.concatenate([tree.children_left for tree in trees])
    return {
        "n_nodes": np.array([tree.node_count for tree in trees], dtype=np.int64),
        "depth": np.array([tree.max_depth for tree in trees], dtype=np.int64),
        "left": left.astype(np.int32),
        "right": np.concatenate([tree.children_right for tree in trees]).astype(np.int32),
        "feature": np.concatenate([tree.feature for tree in trees]).astype(np.int32),
        "threshold": np.concatenate([tree.threshold for tree in trees]),
        "shares": np.concatenate([tree.value[:, 0] for tree in trees])[left < 0],
        "classes": np.asarray(forest.classes_).astype(np.int64),
    }


class StoredForest:
    """A forest made of arrays; answers what the forest that they came from answered, bit for bit.

    Parameters
    ----------
    arrays
        Of :func:`forest_to_arrays`.
    n_features
        Width of the rows that it is asked about.

    Raises
    ------
    InputError
        If the arrays do not fit together, or this version of scikit-learn cannot be given trees in this way.
    """

    def __init__(self, arrays: Mapping[str, NDArray], n_features: int) -> None:
        self.arrays = {name: np.asarray(values) for name, values in arrays.items()}
        self.n_features = n_features
        _check(self.arrays, n_features)
        self.classes_ = self.arrays["classes"]
        try:
            self._trees = _make_trees(self.arrays, n_features)
        except (TypeError, ValueError, KeyError, IndexError) as error:
            raise InputError(
                f"stored forest: this version of scikit-learn takes no stored trees ({error}); train again"
            ) from error
        probes = np.random.default_rng(0).choice(self.arrays["threshold"], (N_PROBES, n_features)).astype(np.float32)
        if not np.array_equal(self.predict_proba(probes), walk_forest(self.arrays, probes)):
            raise InputError(
                "stored forest: this version of scikit-learn reads the stored trees otherwise; train again"
            )

    def predict_proba(self, rows: NDArray) -> NDArray[np.float64]:
        """Mean over the trees of the class shares in the leaf, ``(n_rows, n_classes)``."""
        narrow = np.ascontiguousarray(rows, dtype=np.float32)
        total = np.zeros((len(narrow), len(self.classes_)))
        for tree in self._trees:
            total += tree.predict(narrow).reshape(total.shape)
        return total / len(self._trees)


def walk_forest(arrays: Mapping[str, NDArray], rows: NDArray) -> NDArray[np.float64]:
    """Class shares of rows, by following the stored splits in plain NumPy; slower than :class:`StoredForest`."""
    narrow = np.asarray(rows, dtype=np.float32)
    shares = _spread(arrays)
    total = np.zeros((len(narrow), shares.shape[1]))
    ends = np.cumsum(arrays["n_nodes"])
    for end, n_nodes in zip(ends, arrays["n_nodes"], strict=True):
        own = slice(end - n_nodes, end)
        left, right, feature, threshold = (arrays[key][own] for key in ("left", "right", "feature", "threshold"))
        node = np.zeros(len(narrow), dtype=np.int64)
        moving = np.flatnonzero(left[node] >= 0)
        while len(moving):
            at = node[moving]
            goes_left = narrow[moving, feature[at]] <= threshold[at]
            node[moving] = np.where(goes_left, left[at], right[at])
            moving = moving[left[node[moving]] >= 0]
        total += shares[own][node]
    return total / len(ends)


def _spread(arrays: Mapping[str, NDArray]) -> NDArray[np.float64]:
    """Class shares of all nodes; zero inside the trees, where nobody stops."""
    shares = np.zeros((len(arrays["left"]), arrays["shares"].shape[1]))
    shares[arrays["left"] < 0] = arrays["shares"]
    return shares


def _make_trees(arrays: Mapping[str, NDArray], n_features: int) -> list[Any]:
    n_classes = arrays["shares"].shape[1]
    stub = DecisionTreeClassifier(max_depth=1).fit(np.arange(4.0)[:, None], [0, 0, 1, 1]).tree_
    kind = stub.__getstate__()["nodes"].dtype
    nodes = np.zeros(len(arrays["left"]), dtype=kind)
    for name, key in (("left_child", "left"), ("right_child", "right")):
        nodes[name] = arrays[key]
    nodes["feature"], nodes["threshold"] = arrays["feature"], arrays["threshold"]
    shares = _spread(arrays)[:, None, :]
    trees = []
    ends = np.cumsum(arrays["n_nodes"])
    for end, n_nodes, depth in zip(ends, arrays["n_nodes"], arrays["depth"], strict=True):
        own = slice(int(end - n_nodes), int(end))
        tree = Tree(n_features, np.array([n_classes], dtype=np.intp), 1)
        tree.__setstate__(
            {"max_depth": int(depth), "node_count": int(n_nodes), "nodes": nodes[own], "values": shares[own].copy()}
        )
        trees.append(tree)
    return trees


def _check(arrays: Mapping[str, NDArray], n_features: int) -> None:
    """Refuse arrays that would send the walk astray: scikit-learn's tree trusts them blindly."""
    lacking = [
        k for k in ("n_nodes", "depth", "left", "right", "feature", "threshold", "shares", "classes") if k not in arrays
    ]
    if lacking:
        raise InputError(f"stored forest: expected {', '.join(lacking)}, but it is not there")
    n_nodes, left, right = arrays["n_nodes"], arrays["left"], arrays["right"]
    wrong = "stored forest: expected splits that fit together, but they do not; the model is damaged, train again"
    total = int(n_nodes.sum()) if n_nodes.ndim == 1 and (n_nodes > 0).all() else -1
    lengths = {len(arrays[key]) for key in ("left", "right", "feature", "threshold")}
    if lengths != {total} or not len(n_nodes) or len(arrays["depth"]) != len(n_nodes):
        raise InputError(wrong)
    leaf = left < 0
    size = np.repeat(n_nodes, n_nodes)
    place = np.arange(total) - np.repeat(np.cumsum(n_nodes) - n_nodes, n_nodes)
    # A child comes after its parent, so that every walk ends.
    inside = (left > place) & (right > place) & (left < size) & (right < size)
    fitting = arrays["feature"][~leaf].min(initial=0) >= 0 and arrays["feature"][~leaf].max(initial=0) < n_features
    if not (inside | leaf).all() or not fitting or arrays["shares"].shape != (int(leaf.sum()), len(arrays["classes"])):
        raise InputError(wrong)
