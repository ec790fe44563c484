"""Anatomical landmarks on any rig, found by what its shapes move and by the form of its skin.

No template is laid over the face and no vertex number is known beforehand: mouth corners lie where a smile pulls, lids
where a blink closes them, the tip of the nose is farthest forward on the profile. So the same names mean the same
places on rigs of any topology, with or without eyeballs, teeth and hair. Left and right are the subject's.

How sure a landmark is:

- ``high``: a movement or a sharp feature of the skin shows it; within about 5 mm.
- ``fair``: a movement or a soft feature shows it roughly; within about 10 mm.
- ``low``: a proportion of the face that other landmarks span; the place is a convention.

The distances are those from 16 landmarks that the ICT FaceKit publishes (Multi-PIE scheme), over 12 of its identities,
and from the embedded avatar's own in 10 morphologies, none of which had a part in settling the rules (their generic
faces had): at most 4.7 mm for the high ones and 10.6 mm for the fair ones, half of them within 2 and 5 mm. Where two
schemes mean different points, as at the root of the nose, that counts as distance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from .landmark_finder import FaceLandmarks
from .landmark_names import LANDMARKS, MIDDLE, PAIRED
from .rig import Rig

__all__ = ["LANDMARKS", "MIDDLE", "PAIRED", "FaceLandmarks", "find_landmarks", "locate_landmarks"]


def find_landmarks(
    rig: Rig, names: Iterable[str] | None = None, *, shapes: Mapping[str, str] | None = None
) -> dict[str, int]:
    """Return the vertex of each landmark.

    Parameters
    ----------
    rig
        The face, with ARKit's shapes or MakeHuman's expression units; eyeballs, teeth and hair may be in its mesh.
    names
        Which landmarks, out of :data:`LANDMARKS`; all by default.
    shapes
        ARKit name of each shape whose own name does not say it: ``{"AU12": "mouthSmile"}``.

    Returns
    -------
    name -> vertex number. On a mesh whose sides mirror each other, so do the landmarks.

    Raises
    ------
    InputError
        If a name is unknown, or the rig's shapes or skin do not show a landmark: which one, and what is missing.
    """
    found = FaceLandmarks(rig, shapes=shapes)
    return {name: found.vertex(name) for name in (LANDMARKS if names is None else names)}


def locate_landmarks(
    rig: Rig, names: Iterable[str] | None = None, *, shapes: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """Return the same as a table ``landmark, vertex, sure, rule``."""
    found = find_landmarks(rig, names, shapes=shapes)
    about = [MIDDLE.get(name) or PAIRED[name.rpartition("_")[0]] for name in found]
    return pd.DataFrame(
        {
            "landmark": pd.array(list(found), dtype="str"),
            "vertex": np.array(list(found.values()), dtype=np.int64),
            "sure": pd.array([sure for sure, _ in about], dtype="str"),
            "rule": pd.array([rule for _, rule in about], dtype="str"),
        }
    )
