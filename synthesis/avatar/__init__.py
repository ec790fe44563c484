"""The embedded avatar: a face that mimique draws itself, with the 51 ARKit shapes."""

from __future__ import annotations

from ..rig import Rig
from .affects import AFFECTS, affect_pose
from .colours import regions, vertex_colours
from .head import Part, base_head
from .markers import default_markers, landmarks, mirror_pairs
from .morphology import Morphology, apply_morphology, random_morphology
from .shapes import SHAPES, build_deltas

__all__ = [
    "AFFECTS",
    "SHAPES",
    "Morphology",
    "Part",
    "affect_pose",
    "base_head",
    "build_avatar",
    "default_markers",
    "landmarks",
    "mirror_pairs",
    "random_morphology",
    "regions",
    "vertex_colours",
]


def build_avatar(morphology: Morphology | None = None) -> Rig:
    """Return the avatar as a rig.

    Parameters
    ----------
    morphology
        A person's proportions; the base face by default.

    Returns
    -------
    Rig with the 51 ARKit shapes in Apple's order. Vertices and triangles are numbered alike for all people, so the
    same number is the same place on every face. Skin, eyeballs, brows, teeth and so on are separate components of
    one mesh; :func:`regions` tells them apart and :func:`vertex_colours` paints them.
    """
    morphology = Morphology() if morphology is None else morphology
    head = base_head()
    vertices = apply_morphology(head, morphology)
    return Rig(vertices, head.triangles, build_deltas(head, vertices, morphology), SHAPES)
