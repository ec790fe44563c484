"""Colours as files of scenes have them: in proportion to light, not to what a screen is told."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from .rig import Rig


def linearise_colours(rig: Rig, colours: ArrayLike) -> NDArray[np.float64]:
    """Turn (n_vertices, 3) sRGB colours from 0 to 1 into linear ones (IEC 61966-2-1).

    Raises
    ------
    InputError
        If they are not one a vertex, or not from 0 to 1.
    """
    values = check_array(colours, name="colours", shape=(rig.n_vertices, 3), finite=True)
    if values.size and (values.min() < 0 or values.max() > 1):
        raise InputError(f"colours: expected values from 0 to 1, but got {values.min():g} to {values.max():g}")
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
