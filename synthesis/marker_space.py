"""Are marker positions in the rig's space? Positions in another unit or place must not become plausible weights."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RigError
from .alignment import size_ratio

Array = NDArray[np.floating[Any]]

LIKELY_UNITS = {0.001: "metres", 0.01: "decimetres", 0.1: "centimetres", 1 / 25.4: "inches", 10.0: "tenths of mm"}


def check_size(positions: Array, rest: Array) -> None:
    """Refuse markers that span much less or more than the vertices that they sit on.

    Parameters
    ----------
    positions
        (..., P, 3), mm, NaN where missing.
    rest
        (P, 3) their vertices on the rig, mm.

    Raises
    ------
    RigError
        Naming the likely unit.
    """
    ratio = size_ratio(positions, rest)
    if not np.isfinite(ratio) or len(rest) < 3 or 0.4 < ratio < 2.5:
        return
    close = min(LIKELY_UNITS, key=lambda r: abs(np.log(ratio / r))) if ratio > 0 else 0.0
    likely = close > 0 and abs(np.log(ratio / close)) < 0.5
    hint = f"they seem to be in {LIKELY_UNITS[close]}" if likely else "align and adapt them first"
    raise RigError(
        f"positions: expected markers in mm and about as large as the rig's, but they span {ratio:.3g} of it; {hint} "
        "(or the rig's unit is wrong)"
    )


def check_space(positions: Array, rest: Array) -> None:
    """Refuse positions whose size or place shows that they are not in the rig's space.

    Raises
    ------
    RigError
        Naming the likely unit, or asking for alignment.
    """
    check_size(positions, rest)
    with np.errstate(invalid="ignore"):
        moved = np.sqrt(((positions - rest) ** 2).sum(2))
    radius = float(np.sqrt(((rest - rest.mean(0)) ** 2).sum(1).mean()))
    moved = moved[np.isfinite(moved).any(1)]
    if len(moved) and radius > 0:
        typical = float(np.median(np.sqrt(np.nanmean(moved**2, axis=1))))
        if typical > radius:
            raise RigError(
                f"positions: the markers are {typical:.0f} mm from their vertices in a typical frame, on a layout of "
                f"{radius:.0f} mm radius; stabilise, align and adapt them to the rig first"
            )
