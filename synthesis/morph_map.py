"""Radial basis functions from a signer's face to the rig's (Reverdy 2019, 5.18-5.20; Dutreve 2011, 3.2.3 and 4.2).

``F(m) = Σ_k u_k φ(‖m − M0[k]‖) + q(m)`` with an affine part ``q`` and the side conditions ``Σ u_k = 0`` and
``Σ u_k M0[k] = 0`` takes every marker of the signer's neutral exactly to its place on the rig.

Distances are measured in units of the centres' root mean square radius, so the map is the same in mm, cm or m.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import null_space
from scipy.spatial.distance import cdist

from ..arrays import check_array
from ..errors import InputError, RigError

Array = NDArray[np.floating[Any]]


def _thin_plate(r: Array, _: Array) -> Array:
    return r * r * np.log(np.where(r > 0, r, 1.0))


KERNELS: dict[str, Callable[[Array, Array], Array]] = {
    "triharmonic": lambda r, _: r**3,
    "biharmonic": lambda r, _: r,
    "linear": lambda r, _: r,
    "thin-plate": _thin_plate,
    "gaussian": lambda r, sigma: np.exp(-(r**2) / (2 * sigma**2)),
    "multiquadric": lambda r, sigma: np.sqrt(r**2 + sigma**2),
}
"""``φ(r)`` and, for the last two, the width ``σ_j`` of each centre: its distance to the nearest other (Dutreve, 4.2).
``biharmonic`` and ``linear`` are two names of ``φ(r) = r``, the best of five in Dutreve's Figure 4.6."""

# Centres closer than this part of their root mean square radius count as coincident, thinner sets as flat.
COINCIDENT = 1e-6
FLAT = 1e-3
BLOCK = 1 << 15


@dataclass(frozen=True)
class MorphMap:
    """A fitted map of space; call it with points. Make one with :meth:`fit`.

    Parameters
    ----------
    kernel
        Name of the radial function, a key of :data:`KERNELS`.
    origin, radius
        (3,) mean of the centres and their root mean square distance from it.
    centres
        (P, 3) the signer's neutral markers in units of ``radius`` around ``origin``.
    widths
        (P,) distance of each centre to its nearest neighbour, same unit.
    coefficients
        (P, 3) the ``u_k``, in the target's unit.
    affine
        (4, 3) rows for x, y, z and 1, in the target's unit; zeros where the map has no affine part.
    """

    kernel: str
    origin: Array
    radius: float
    centres: Array
    widths: Array
    coefficients: Array
    affine: Array

    @classmethod
    def fit(
        cls,
        source: ArrayLike,
        target: ArrayLike,
        kernel: str = "triharmonic",
        affine: bool = True,
        ridge: float = 0.0,
        names: Sequence[str] | None = None,
    ) -> MorphMap:
        """Fit the map that takes ``source`` to ``target``.

        Parameters
        ----------
        source
            (P, 3) the signer's neutral markers.
        target
            (P, 3) their places on the rig, mm.
        kernel
            triharmonic (r³), biharmonic or linear (r), thin-plate (r² ln r), gaussian, multiquadric.
        affine
            Whether to add the affine part and its side conditions (5.19).
        ridge
            λ ≥ 0, no unit. 0 passes exactly through the targets; above it, ``‖H u + S a − T‖² + λ‖u‖²`` is least
            (Dutreve 2011, 3.9, with the affine part of 3.16).
        names
            P marker names for messages.

        Raises
        ------
        RigError
            If markers are missing, coincide, are too few, or, with an affine part, lie in one plane.
        InputError
            If the kernel is unknown or the ridge negative.
        """
        source = check_array(source, name="morph map source", shape=(None, 3))
        target = check_array(target, name="morph map target", shape=(len(source), 3), finite=True)
        if kernel not in KERNELS:
            raise InputError(f"morph map: expected a kernel out of {', '.join(KERNELS)}, but got {kernel!r}")
        if not np.isfinite(ridge) or ridge < 0:
            raise InputError(f"morph map: expected a ridge of 0 or more, but got {ridge}")
        labels = [str(n) for n in names] if names is not None else [f"marker {i}" for i in range(len(source))]
        if len(labels) != len(source):
            raise InputError(f"morph map: expected {len(source)} names, but got {len(labels)}")
        origin, radius = _check_centres(source, labels, affine)
        centres = (source - origin) / radius
        distances = cdist(centres, centres)
        widths = np.where(np.eye(len(centres), dtype=bool), np.inf, distances).min(1)
        H = KERNELS[kernel](distances, widths)
        S = np.hstack([centres, np.ones((len(centres), 1))])
        coefficients, plane = _solve(H, S if affine else S[:, :0], target, ridge)
        if not affine:
            plane = np.zeros((4, 3))
        fitted = cls(kernel, origin, radius, centres, widths, coefficients, plane)
        scale = np.sqrt(((target - target.mean(0)) ** 2).sum(1).mean())
        if not ridge and not np.abs(fitted(source) - target).max() <= 1e-6 * max(scale, 1e-12):
            raise RigError(
                f"morph map: the {kernel} system of these markers is too ill-conditioned; use another kernel"
            )
        return fitted

    def __call__(self, points: ArrayLike) -> Array:
        """Take points (..., 3) of the signer to the rig; NaN stays NaN."""
        points = check_array(points, name="points")
        if points.shape[-1:] != (3,):
            raise InputError(f"points: expected shape (..., 3), but got {points.shape}")
        flat = (points.reshape(-1, 3) - self.origin) / self.radius
        out = np.full_like(flat, np.nan)
        seen = np.flatnonzero(np.isfinite(flat).all(1))
        phi = KERNELS[self.kernel]
        for start in range(0, len(seen), BLOCK):
            rows = seen[start : start + BLOCK]
            part = flat[rows]
            out[rows] = phi(cdist(part, self.centres), self.widths) @ self.coefficients
            out[rows] += part @ self.affine[:3] + self.affine[3]
        return out.reshape(points.shape)


def _check_centres(source: Array, labels: list[str], affine: bool) -> tuple[Array, float]:
    """Return mean and root mean square radius, or say why these centres cannot carry a map."""
    lost = [name for name, seen in zip(labels, np.asarray(np.isfinite(source).all(axis=1)), strict=True) if not seen]
    if lost:
        raise RigError(
            f"morph map: the neutral lacks {', '.join(lost)}; choose another neutral frame or leave them out"
        )
    needed = 4 if affine else 1
    if len(source) < needed:
        raise RigError(f"morph map: expected at least {needed} markers, but got {len(source)}")
    origin = source.mean(0)
    spread = np.sqrt(np.clip(np.linalg.eigvalsh((source - origin).T @ (source - origin)), 0, None) / len(source))
    radius = float(np.sqrt((spread**2).sum()))
    if len(source) > 1:
        distances = cdist(source, source) + np.diag(np.full(len(source), np.inf))
        i, j = np.unravel_index(distances.argmin(), distances.shape)
        if distances[i, j] <= COINCIDENT * radius or radius == 0:
            raise RigError(f"morph map: {labels[i]} and {labels[j]} coincide in the neutral; leave one of them out")
    if affine and spread[0] <= FLAT * spread[2]:
        raise RigError("morph map: the markers lie in one plane, so they fix no affine part; use affine=False")
    return origin, radius if radius > 0 else 1.0


def _solve(H: Array, S: Array, target: Array, ridge: float) -> tuple[Array, Array]:
    """Solve (5.19), or its ridge form within the side conditions."""
    n, m = S.shape
    try:
        if ridge == 0:
            system = np.block([[H, S], [S.T, np.zeros((m, m))]])
            solution = np.linalg.solve(system, np.vstack([target, np.zeros((m, 3))]))
            return solution[:n], solution[n:]
        Z = null_space(S.T) if m else np.eye(n)
        rows = np.block([[H @ Z, S], [np.sqrt(ridge) * Z, np.zeros((n, m))]])
        solution = np.linalg.lstsq(rows, np.vstack([target, np.zeros((n, 3))]), rcond=None)[0]
    except np.linalg.LinAlgError as error:
        raise RigError(f"morph map: the markers' system has no solution ({error}); use another kernel") from error
    return Z @ solution[: Z.shape[1]], solution[Z.shape[1] :]
