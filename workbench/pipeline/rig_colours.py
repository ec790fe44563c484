"""Colours of rigs that mimique knows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...synthesis import Rig


def find_colours(rig: Rig) -> NDArray[np.float64] | None:
    """Return the avatar's own colours (n_vertices, 3) where the rig is the avatar, whatever its name in the corpus."""
    from ...synthesis.avatar import SHAPES, base_head, vertex_colours

    if tuple(SHAPES) != rig.shapes or rig.n_vertices != len(base_head().vertices):
        return None
    return vertex_colours()
