"""What makes a rig or a marker set hard to solve, said in words.

Nothing here is an error: real rigs have shapes that nearly cancel each other (jawLeft and jawRight), and no marker set
sees every shape. A person should know which weights to trust.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .marker_map import check_vertices
from .rig import Rig

ALIKE = 0.9
"""Cosine between two shapes' displacements from which they count as repeating (or, negative, cancelling) each other."""

UNSEEN = 0.05
"""A shape counts as unseen when its markers move by less than this part of what its strongest vertex moves."""

ILL_CONDITIONED = 1e3
"""Ratio of the largest to the smallest singular value, of markers over shapes, that is worth a remark."""


def describe_rig(rig: Rig) -> list[str]:
    """Return one sentence for each pair of shapes that repeat or cancel each other, and for shapes that do nothing.

    Pairs are compared by the cosine of their displacements over all vertices; the closest come first.
    """
    flat = rig.deltas.reshape(rig.n_shapes, -1)
    size = np.linalg.norm(flat, axis=1)
    still = size == 0
    unit = flat / np.where(still, 1.0, size)[:, None]
    cosine = unit @ unit.T
    first, second = np.triu_indices(rig.n_shapes, 1)
    close = np.flatnonzero(np.abs(cosine[first, second]) > ALIKE)
    sentences = [f"{name} moves no vertex" for name, nothing in zip(rig.shapes, still, strict=True) if nothing]
    for k in close[np.argsort(-np.abs(cosine[first[close], second[close]]))]:
        a, b, c = rig.shapes[first[k]], rig.shapes[second[k]], cosine[first[k], second[k]]
        relation = "nearly repeats" if c > 0 else "nearly cancels"
        sentences.append(f"{a} {relation} {b} (cosine {c:.2f}): their weights are hard to tell apart")
    return sentences


def describe_markers(rig: Rig, vertices: ArrayLike) -> list[str]:
    """Return sentences about shapes that the markers on ``vertices`` (P,) do not see, and about conditioning.

    Raises
    ------
    RigError
        If a vertex does not exist or repeats.
    """
    chosen = check_vertices(rig, vertices)
    moved = np.linalg.norm(rig.deltas, axis=2)
    strongest, at_markers = moved.max(1), moved[:, chosen].max(1)
    unseen = (at_markers < UNSEEN * strongest) & (strongest > 0)
    sentences = [
        f"no marker sees {rig.shapes[k]}: it moves the skin by up to {strongest[k]:.1f} mm, "
        f"the markers by up to {at_markers[k]:.2f}"
        for k in np.flatnonzero(unseen)
    ]
    basis = rig.deltas[:, chosen].reshape(rig.n_shapes, -1)
    if basis.shape[1] < rig.n_shapes:
        sentences.append(f"{len(chosen)} markers have {basis.shape[1]} coordinates for {rig.n_shapes} shapes: too few")
    seen = np.linalg.svd(basis[~unseen & (strongest > 0)], compute_uv=False)
    if seen.size and seen[-1] * ILL_CONDITIONED < seen[0]:
        ratio = "without limit" if seen[-1] <= 1e-12 * seen[0] else f"{seen[0] / seen[-1]:.0f}"
        sentences.append(f"the shapes that markers see are hard to tell apart (singular values' ratio {ratio})")
    return sentences
