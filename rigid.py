"""Least-squares rigid and similarity fits of point sets, many at once (Reverdy 2019, 5.2.1).

For points ``p_i`` and their images ``q_i`` the fit minimises ``Σ w_i ‖s R p_i + t − q_i‖²`` over rotations ``R``
(reflections excluded), translations ``t`` and, where asked for, one scale ``s``. The rotation comes from the singular
value decomposition of the 3 × 3 covariance of the two sets (Kabsch 1976; with scale: Umeyama 1991).

Conventions: points are rows, ``(n_points, 3)``; ``apply`` gives ``s·p·Rᵀ + t``. Leading axes are batch axes. A point
with a NaN in either set is not used. Where fewer than three points remain, or they lie on one line, the fit is NaN:
such a set leaves a turn about the line open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

# A point set counts as collinear when its second largest extent is below this part of its largest.
COLLINEAR = 1e-3


@dataclass(frozen=True)
class RigidFit:
    """Rotation, translation and scale per batch entry; NaN where no fit exists.

    Parameters
    ----------
    rotation
        (..., 3, 3) proper rotation matrices.
    translation
        (..., 3), in the unit of the target.
    scale
        (...), 1 for rigid fits.
    n_points
        (...) number of points that were used.
    rms
        (...) weighted root mean square distance between moved source and target, unit of the target.
    """

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    scale: NDArray[np.float64]
    n_points: NDArray[np.int64]
    rms: NDArray[np.float64]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Where a fit exists, shape (...)."""
        return np.isfinite(self.scale)

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Move ``points`` (..., n, 3) from the source's frame to the target's."""
        moved = np.asarray(points, dtype=np.float64) @ np.swapaxes(self.rotation, -1, -2)
        return moved * self.scale[..., None, None] + self.translation[..., None, :]

    def inverse(self) -> RigidFit:
        """Return the transform that leads from the target's frame back to the source's."""
        back = np.swapaxes(self.rotation, -1, -2)
        translation = -np.einsum("...ij,...j->...i", back, self.translation) / self.scale[..., None]
        return RigidFit(back, translation, 1.0 / self.scale, self.n_points, self.rms / self.scale)


def fit_rigid(
    source: ArrayLike, target: ArrayLike, *, weights: ArrayLike | None = None, scale: bool = False
) -> RigidFit:
    """Fit the rotation and translation (and scale) that bring ``source`` onto ``target``.

    Parameters
    ----------
    source, target
        (..., n_points, 3), NaN where a point is missing; the leading axes broadcast against each other.
    weights
        (..., n_points) or (n_points,), not negative; zero leaves a point out. All equal by default.
    scale
        Whether to fit one scale as well (a similarity).

    Returns
    -------
    RigidFit
        NaN for entries with fewer than three usable points, or whose points lie on one line in either set.

    Raises
    ------
    InputError
        If the shapes do not fit together or a weight is negative or not finite.
    """
    source = np.asarray(source, dtype=np.float64)
    target = np.asarray(target, dtype=np.float64)
    if source.ndim < 2 or target.ndim < 2 or source.shape[-1] != 3 or source.shape[-2:] != target.shape[-2:]:
        raise InputError(
            f"rigid fit: expected two point sets of shape (..., n, 3) with the same n, "
            f"but got {source.shape} and {target.shape}"
        )
    try:
        source, target = np.broadcast_arrays(source, target)
        seen = np.isfinite(source).all(-1) & np.isfinite(target).all(-1)
        w = (
            np.ones(seen.shape)
            if weights is None
            else np.broadcast_to(np.asarray(weights, dtype=np.float64), seen.shape)
        )
    except ValueError as error:
        raise InputError(f"rigid fit: batch axes or weights do not fit together ({error})") from error
    if not np.isfinite(w).all() or (w < 0).any():
        raise InputError("rigid fit: expected weights that are finite and not negative")
    used = seen & (w > 0)
    w = np.where(used, w, 0.0)
    total = w.sum(-1)
    n_points = used.sum(-1)
    share = w / np.where(total > 0, total, 1.0)[..., None]

    p, p_mean = _centre(source, used, share)
    q, q_mean = _centre(target, used, share)
    solvable = (n_points >= 3) & _spans_plane(p, share) & _spans_plane(q, share)

    covariance = np.einsum("...ni,...nj->...ij", q * share[..., None], p)
    u, singular, vt = np.linalg.svd(covariance)
    handed = np.where(np.linalg.det(u @ vt) < 0, -1.0, 1.0)  # a reflection fits mirrored sets better: exclude it
    signs = np.stack([np.ones_like(handed), np.ones_like(handed), handed], axis=-1)
    rotation = (u * signs[..., None, :]) @ vt
    spread = np.einsum("...n,...ni,...ni->...", share, p, p)
    factor = (singular * signs).sum(-1) / np.where(spread > 0, spread, 1.0) if scale else np.ones(total.shape)
    translation = q_mean - factor[..., None] * np.einsum("...ij,...j->...i", rotation, p_mean)
    gap = factor[..., None, None] * (p @ np.swapaxes(rotation, -1, -2)) - q
    rms = np.sqrt(np.einsum("...n,...ni,...ni->...", share, gap, gap))
    return RigidFit(
        np.where(solvable[..., None, None], rotation, np.nan),
        np.where(solvable[..., None], translation, np.nan),
        np.where(solvable, factor, np.nan),
        n_points,
        np.where(solvable, rms, np.nan),
    )


def _centre(
    points: NDArray[np.float64], used: NDArray[np.bool_], share: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Subtract the weighted mean; unused points become zero."""
    filled = np.where(used[..., None], points, 0.0)
    mean = np.einsum("...n,...ni->...i", share, filled)
    return np.where(used[..., None], filled - mean[..., None, :], 0.0), mean


def _spans_plane(centred: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Say where a point set has at least two extents, that is, is neither one point nor on one line."""
    spread = np.einsum("...n,...ni,...nj->...ij", share, centred, centred)
    extents = np.sqrt(np.clip(np.linalg.eigvalsh(spread), 0.0, None))
    return (extents[..., 2] > 0) & (extents[..., 1] > COLLINEAR * extents[..., 2])
