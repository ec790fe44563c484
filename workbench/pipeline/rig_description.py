"""What a rig of a corpus is made of, and what its shapes are called elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from ...corpus.store.view import CorpusView
from ...synthesis import Rig
from ...synthesis.rig_parts import split_parts
from ...synthesis.shape_names import describe_shape_names, find_absent_shapes


def describe_stored_rig(corpus: CorpusView, name: str) -> tuple[dict[str, Any], pd.DataFrame, pd.DataFrame]:
    """Describe a rig.

    Parameters
    ----------
    corpus, name
        Which rig.

    Returns
    -------
    (summary, shapes, parts)
        Counts and names; one row a shape: ``shape, arkit, how`` (see
        :func:`mimique.synthesis.shape_names.describe_shape_names`), ``vertices`` that it moves, ``most`` that one moves
        (mm); one row a part: ``part, vertices, triangles, shapes`` that touch it.

    Raises
    ------
    NotFoundError
        If there is no such rig.
    """
    rig = Rig.from_dataset(corpus.rig(name))
    moved = np.linalg.norm(rig.deltas, axis=2)
    shapes = describe_shape_names(rig)
    shapes["vertices"] = (moved > 0).sum(axis=1)
    shapes["most"] = np.round(moved.max(axis=1, initial=0.0), 2)
    rows = [
        (part.name, len(part.vertices), len(part.triangles), len(part.shapes))
        for part in (split_parts(rig) if len(rig.triangles) else [])
    ]
    parts = pd.DataFrame(rows, columns=["part", "vertices", "triangles", "shapes"])
    unmapped = [str(shape) for shape in shapes["shape"][shapes["arkit"] == ""]]
    summary = {
        "rig": name,
        "vertices": rig.n_vertices,
        "triangles": len(rig.triangles),
        "parts": max(len(parts), 1),
        "shapes": rig.n_shapes,
        "with an ARKit name": rig.n_shapes - len(unmapped),
        "without": ", ".join(unmapped),
        "ARKit shapes not there": ", ".join(find_absent_shapes(rig)),
        "marker maps": ", ".join(corpus.marker_maps(name)),
    }
    return summary, shapes, parts
