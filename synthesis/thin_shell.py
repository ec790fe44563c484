"""Thin-shell energy of a rig's shapes, folded into one small matrix (Reverdy 2019, 5.25-5.29).

However fine the mesh, the energy of a pose ``D = Σ c_k δ_k`` is ``cᵀ E c`` with ``E`` of n_shapes × n_shapes,
computed once per rig and marker set.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..errors import InputError, RigError
from .mesh_operators import cotangent_weights, laplacian, thin_shell_operator, vertex_areas
from .rig import Rig

Array = NDArray[np.floating[Any]]

FORMS = ("residual", "energy")


def rig_length(rig: Rig) -> float:
    """Return the size, mm, of the skin that a rig's shapes move: the square root of its area.

    The area is ``(Σ M m)² / Σ M m²`` with ``m_v = Σ_k ‖δ_kv‖²`` and ``M`` the areas around the vertices: an effective
    area without a threshold, the same for any resolution of the mesh, and blind to how much of neck and scalp the rig
    carries.

    Raises
    ------
    RigError
        If no shape moves any vertex that has an area.
    """
    areas = vertex_areas(rig.neutral, rig.triangles)
    motion = np.einsum("kvd,kvd->v", rig.deltas, rig.deltas)
    motion = motion / max(float(motion.max(initial=0.0)), np.finfo(float).tiny)
    most = float((areas * motion**2).sum())
    if not most > 0:
        raise RigError("rig: no shape moves any vertex of a triangle; the shapes are empty or the mesh has no area")
    return float((areas * motion).sum() / np.sqrt(most))


def thin_shell_matrix(
    rig: Rig, vertices: NDArray[np.int64], form: str = "energy", k_s: float = 1.0, k_b: float = 1.0
) -> Array:
    """Return ``E`` (n_shapes, n_shapes) in mm², such that ``cᵀ E c`` is the thin-shell energy of the pose ``c``.

    ``form="energy"`` uses ``K = −k_s L* + k_b ℓ² L* M⁻¹ L*`` whole (2.16); ``form="residual"`` sums
    ``(M/ℓ²) ‖A d‖²`` with ``A = −k_s ℓ² L + k_b ℓ⁴ L²`` over the vertices that carry no marker (5.25, 5.27): rows are
    weighted by their area, so that the sum stands for an integral and does not grow with the resolution.

    ``ℓ`` is the length at which the rig's median shape has as much stretching as bending: it makes ``k_s = k_b = 1``
    a balance of two energies, whatever the unit. A length as large as the face would leave nothing but bending, since
    lids and lips fold within millimetres.

    Parameters
    ----------
    rig
        Neutral, triangles and deltas, mm.
    vertices
        The marker vertices, left out in the residual form.
    form
        residual or energy.
    k_s, k_b
        Stiffness against stretching and bending, not negative, no unit.
    """
    if form not in FORMS:
        raise InputError(f"form: expected {' or '.join(FORMS)}, but got {form!r}")
    neutral, triangles, deltas, owner = _weld(rig)
    weights, areas = cotangent_weights(neutral, triangles), vertex_areas(neutral, triangles)
    columns = deltas.transpose(1, 0, 2).reshape(len(neutral), -1)
    if form == "energy":
        stretch = _fold(columns, -(weights @ columns), rig.n_shapes)
        bend_rows = np.sqrt(areas)[:, None] * (laplacian(weights, areas) @ columns)
        bend = _fold(bend_rows, bend_rows, rig.n_shapes)
        return k_s * stretch + k_b * _balance(stretch, bend) * bend
    L = laplacian(weights, areas)
    first = L @ columns
    second = L @ first
    root = np.sqrt(areas)[:, None]
    square = np.sqrt(  # ℓ²
        _balance(_fold(root * first, root * first, rig.n_shapes), _fold(root * second, root * second, rig.n_shapes))
    )
    rows = root * (-k_s * first + k_b * square * second) * np.sqrt(square)
    rows[owner[vertices]] = 0.0
    return _fold(rows, rows, rig.n_shapes)


def _balance(stretch: Array, bend: Array) -> float:
    """Return the median ratio of the diagonals over the shapes that bend; 1 where none does."""
    bent = np.diag(bend) > 0
    return float(np.median(np.diag(stretch)[bent] / np.diag(bend)[bent])) if bent.any() else 1.0


def published_thin_shell_matrix(
    rig: Rig, vertices: NDArray[np.int64], unit: float, k_s: float = 1.0, k_b: float = 1.0
) -> Array:
    """Return ``(AB)_ncᵀ (AB)_nc`` (n_shapes, n_shapes) of 5.27 and 5.30 as printed, in lengths of ``unit`` mm."""
    neutral, deltas = rig.neutral / unit, rig.deltas / unit
    A: csr_array = thin_shell_operator(
        cotangent_weights(neutral, rig.triangles), vertex_areas(neutral, rig.triangles), k_s, k_b
    )
    rows = A @ deltas.transpose(1, 0, 2).reshape(len(neutral), -1)
    rows[vertices] = 0.0
    return _fold(rows, rows, rig.n_shapes)


def _fold(left: Array, right: Array, n_shapes: int) -> Array:
    """Sum over vertices and coordinates of (V, N·3) columns; symmetric up to rounding, made exactly so."""
    a = left.reshape(len(left), n_shapes, 3).transpose(0, 2, 1).reshape(-1, n_shapes)
    b = right.reshape(len(right), n_shapes, 3).transpose(0, 2, 1).reshape(-1, n_shapes)
    product = a.T @ b
    return 0.5 * (product + product.T)


def _weld(rig: Rig) -> tuple[Array, NDArray[np.int64], Array, NDArray[np.int64]]:
    """Join vertices that coincide and move alike: exporters split a mesh at its texture seams.

    Returns neutral, triangles and deltas of the joined mesh, and the joined vertex of each old one.
    """
    mixed = np.tensordot(np.cos(1.0 + np.arange(rig.n_shapes)), rig.deltas, axes=1)
    keys = np.hstack([rig.neutral, mixed])
    step = 1e-7 * max(float(np.ptp(rig.neutral, axis=0).max()), np.finfo(float).tiny)
    _, first, owner = np.unique(np.round(keys / step), axis=0, return_index=True, return_inverse=True)
    owner = owner.reshape(-1)
    return rig.neutral[first], owner[rig.triangles], rig.deltas[:, first], owner
