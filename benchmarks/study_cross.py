"""Actors of one mesh on the rig of another: nothing but the names of the shapes is shared."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from mimique.models.layouts import find_moving_vertices
from mimique.synthesis import arkit_name, propose_marker_map
from mimique.synthesis.avatar.markers import landmarks
from study_data import Scene

MULTIPIE = {
    "eye_outer_right": 36,
    "eye_inner_right": 39,
    "eye_inner_left": 42,
    "eye_outer_left": 45,
    "mouth_corner_right": 48,
    "mouth_corner_left": 54,
    "lip_upper_border": 51,
    "lip_lower_border": 57,
    "nose_tip": 30,
    "nasion": 27,
    "chin": 8,
    "nose_ala_right": 31,
    "nose_ala_left": 35,
}
"""The avatar's landmarks among the 68 of Multi-PIE, which come with the ICT rig."""


def cross_scene(ict: Scene, avatar: Scene, data: Path) -> Scene:
    """The avatar's actors, marked by its 40 face markers, on the ICT rig."""
    home = avatar.rig
    points = np.array(json.loads((data / "ict_facekit" / "landmarks.json").read_text())["multipie68"])
    known = {name: landmarks()[name] for name in MULTIPIE}
    marked = [int(v) for v in avatar.vertices]
    # A landmark that carries a marker is one point, under the landmark's name.
    names_at = {v: f"marker {v}" for v in marked} | {v: name for name, v in known.items()}
    places = {name: v for v, name in names_at.items()}
    table = propose_marker_map(
        ict.rig,
        home.neutral[list(places.values())],
        list(places),
        {name: int(points[k]) for name, k in MULTIPIE.items()},
        candidates=find_moving_vertices(ict.rig),
    ).set_index("marker")
    vertices = table.loc[[names_at[v] for v in marked], "vertex"].to_numpy()
    names = [arkit_name(s) for s in ict.rig.shapes]
    to_actor = np.zeros((ict.rig.n_shapes, home.n_shapes))
    for k, name in enumerate(names):
        if name in home.shapes:
            to_actor[k, home.index(str(name))] = 1.0 / names.count(name)
    return replace(
        ict,
        name="avatar's actors on ICT",
        actors=avatar.actors,
        vertices=vertices,
        held_out=np.empty(0, dtype=np.int64),
        actor_vertices=avatar.vertices,
        to_actor=to_actor,
    )
