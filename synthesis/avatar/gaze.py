"""Eyes and lids: gaze turns the eyeballs, lids slide over them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import lids, pieces
from .head import Head, Part, lid_vertices
from .muscles import ramp
from .sculpture import EYE_RADIUS

Floats = NDArray[np.float64]

# how much of the margin's turn each ring of the lid follows: the crease half, the orbit not at all
_FOLLOW = (np.arange(7.0), np.array([1.0, 1.0, 1.0, 0.82, 0.42, 0.12, 0.0]))


def turn_eye(head: Head, vertices: Floats, centre: Floats, yaw: float, pitch: float) -> Floats:
    """Return the displacement that turns the left eyeball, (n_vertices, 3), mm.

    Parameters
    ----------
    head, vertices
        Base head and a person's vertices.
    centre
        (3,) centre of the person's left eyeball, mm.
    yaw, pitch
        Degrees towards the subject's left and upwards.
    """
    y, p = np.radians([yaw, pitch])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(p), np.sin(p)], [0, -np.sin(p), np.cos(p)]])
    moved = np.zeros_like(vertices)
    here = (head.part == Part.EYEBALL) & (head.vertices[:, 0] > 0)
    arm = vertices[here] - centre
    moved[here] = arm @ (about_y @ about_x).T - arm
    return moved


def move_lids(head: Head, vertices: Floats, centre: Floats, size: float, upper: float, lower: float) -> Floats:
    """Return the displacement of the left lids and lashes, (n_vertices, 3), mm.

    Parameters
    ----------
    head, vertices
        Base head and a person's vertices.
    centre, size
        The person's left eyeball: centre (3,) in mm, size relative to the base face.
    upper, lower
        How far each margin goes, as a share of the opening: upper −1 closes from above, lower +0.1 lifts.

    Notes
    -----
    Lid skin turns about the eyeball's centre, so it keeps its distance from it; a linear blendshape moves it along
    the chord instead, which would cut into the eyeball half way. The end of a large turn is therefore pushed out
    until the chord's middle clears the eyeball too.
    """
    moved = np.zeros_like(vertices)
    left = head.vertices[:, 0] > 0
    here = left & (lid_vertices(head) | (head.part == Part.LASHES))
    is_lash = head.part[here] == Part.LASHES
    ring, turn = head.ring[here].copy(), head.turn[here].copy()
    ring[is_lash] = 2.0
    turn[is_lash] = np.tile(pieces.lash_turns(), is_lash.sum() // pieces.LASH_STEPS)
    half = lids.TURNS / 2
    on_upper = turn <= half
    _, margin = lids.margin(turn)
    _, opposite = lids.margin((lids.TURNS - turn) % lids.TURNS)
    opening = np.abs(margin - opposite)
    share = np.where(on_upper, upper, lower) * np.interp(ring, *_FOLLOW)
    arm = vertices[here] - centre
    radius = np.linalg.norm(arm, axis=1)
    elevation = np.arcsin(arm[:, 1] / radius)
    azimuth = np.arctan2(arm[:, 0], arm[:, 2])
    step = share * opening
    # the crease unfolds onto the lid as it comes down
    lid = (EYE_RADIUS + 2.4) * size
    unfold = np.clip(-step / np.radians(20.0), 0.0, 1.0) * ramp(ring, 2.5, 3.5) * on_upper
    turned = radius + 0.6 * unfold * np.minimum(lid - radius, 0.0)
    # a lid that comes down beside the nose is stretched over the hollow there
    hollow = np.clip(1 - ((ring - 3.0) / 1.6) ** 2, 0.0, 1.0) * np.clip(1 - ((turn - 1.6) / 3.2) ** 2, 0.0, 1.0)
    turned = turned + 2.2 * max(-upper, 0.0) * hollow * on_upper
    # the whole lid rises alike, so that its layers keep their order
    nearest, clear = (EYE_RADIUS + lids.MARGIN_HEIGHT) * size, (EYE_RADIUS + 0.45) * size
    swing = max(abs(upper), abs(lower)) * opening
    rise = np.maximum(2 * clear / np.maximum(np.cos(swing / 2), 0.5) - 2 * nearest, 0.0)
    turned = turned + rise * np.interp(ring, *_FOLLOW)
    moved[here] = turned[:, None] * lids.direction(azimuth, elevation + step) - arm
    return moved
