"""What the names of a rig's shapes mean: which ARKit shape each stands for, and what did not map."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from .arkit import ARKIT_NAMES, arkit_name, arkit_side
from .rig import Rig

SAME, SPELLED, HALF, NONE = "same name", "spelled otherwise", "one side of it", "no ARKit shape"
"""Values of the column ``how`` of :func:`describe_shape_names`."""


def describe_shape_names(rig: Rig | Sequence[str]) -> pd.DataFrame:
    """Return the ARKit shape that each shape of a rig stands for.

    Parameters
    ----------
    rig
        A rig, or the names alone.

    Returns
    -------
    One row a shape, in the rig's order: ``shape``; ``arkit``, empty where there is none; ``how``: "same name",
    "spelled otherwise", "one side of it" (of a shape that ARKit does not split) or "no ARKit shape".
    """
    names = rig.shapes if isinstance(rig, Rig) else tuple(rig)
    rows = []
    for name in names:
        arkit = arkit_name(name)
        how = NONE if arkit is None else SAME if arkit == name else HALF if arkit_side(name) else SPELLED
        rows.append((name, arkit or "", how))
    return pd.DataFrame(rows, columns=["shape", "arkit", "how"], dtype=str)


def find_absent_shapes(rig: Rig | Sequence[str]) -> list[str]:
    """Return the ARKit shapes that no shape of the rig stands for, sorted."""
    found = set(describe_shape_names(rig)["arkit"])
    return [name for name in ARKIT_NAMES if name not in found]
