"""Bring a neutral marker frame onto the rig (Reverdy 2019, 5.2.1, first alignment).

The alignment need not be exact, since the morph map that follows is; it makes that map robust. Axes that were recorded
otherwise than the rig's (+X left, +Y up, +Z out of the face) are turned here.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import check_array
from ..errors import RigError
from ..rigid import RigidFit, fit_rigid


def align_points(source: ArrayLike, target: ArrayLike, *, scale: bool = False) -> RigidFit:
    """Fit the one rotation and translation (with ``scale``, also one size) from ``source`` onto ``target``.

    Parameters
    ----------
    source
        (P, 3) the neutral markers, NaN where one is missing.
    target
        (P, 3) the rig's vertices that they sit on, mm.
    scale
        Whether the sizes may differ (a similarity).

    Returns
    -------
    RigidFit
        ``fit.apply(positions)`` takes (..., P, 3) positions of the signer to the rig.

    Raises
    ------
    RigError
        If fewer than three pairs are usable or they lie on one line.
    """
    source = check_array(source, name="source points", shape=(None, 3))
    target = check_array(target, name="target points", shape=(len(source), 3))
    fit = fit_rigid(source, target, scale=scale)
    if not fit.valid:
        raise RigError(
            f"alignment: expected at least three markers that are not on one line, but {int(fit.n_points)} of "
            f"{len(source)} are usable; give more markers or another neutral frame"
        )
    return fit


def size_ratio(source: ArrayLike, target: ArrayLike) -> float:
    """Return how many times larger ``source`` is than ``target``: the ratio of their root mean square radii.

    Parameters
    ----------
    source, target
        (..., P, 3) matching points, NaN where missing; leading axes are averaged over by the median.

    Returns
    -------
    The ratio; NaN where fewer than two points are seen in common.
    """
    source, target = np.broadcast_arrays(np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64))
    seen = (np.isfinite(source) & np.isfinite(target)).all(-1)
    count = seen.sum(-1)
    radii = []
    for points in (source, target):
        filled = np.where(seen[..., None], points, 0.0)
        mean = filled.sum(-2) / np.maximum(count, 1)[..., None]
        spread = ((filled - mean[..., None, :]) ** 2).sum(-1)
        radii.append(np.where(seen, spread, 0.0).sum(-1))
    usable = (count >= 2) & (radii[1] > 0)
    return float(np.sqrt(np.median(radii[0][usable] / radii[1][usable]))) if usable.any() else float("nan")
