"""Colours of the avatar and the regions that a renderer may treat apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import lips, pieces
from .head import Part, base_head
from .lids import direction
from .muscles import falloff, ramp
from .sculpture import EYE_CENTRE, EYE_RADIUS
from .template import EYE, MOUTH

Floats = NDArray[np.float64]

SKIN = (0.87, 0.68, 0.57)
BLUSH = (0.86, 0.52, 0.45)
LIPS = (0.74, 0.40, 0.38)
IRIS = (0.30, 0.42, 0.44)
BROWS = (0.33, 0.22, 0.165)
HAIR = (0.25, 0.17, 0.13)


def vertex_colours(
    skin: tuple[float, float, float] = SKIN,
    lip: tuple[float, float, float] = LIPS,
    iris: tuple[float, float, float] = IRIS,
    hair: tuple[float, float, float] = HAIR,
    brow: tuple[float, float, float] = BROWS,
) -> Floats:
    """Return a colour for every vertex, (n_vertices, 3), red, green, blue from 0 to 1; the same for all people."""
    head = base_head()
    q = np.abs(head.vertices) * [1, 0, 0] + head.vertices * [0, 1, 1]
    colours = np.tile(np.array(skin), (len(q), 1))

    def blend(where: NDArray[np.bool_], amount: Floats, colour: tuple[float, float, float]) -> None:
        colours[where] += amount[where, None] * (np.array(colour) - colours[where])

    on_skin = head.part == Part.SKIN
    blush = 0.30 * falloff(q, (42, -34, 70), (34, 28, 46)) + 0.20 * falloff(q, (0, -42, 106), (26, 22, 26))
    blend(on_skin | (head.part == Part.EAR), blush, BLUSH)
    blend(on_skin, 0.9 * falloff(q, (5.8, -49.7, 93.4), (4.8, 4.8, 6.6)), (0.30, 0.14, 0.11))
    in_mouth = on_skin & (head.zone == MOUTH)
    red = np.where(in_mouth, 1 - ramp(head.ring, lips.BORDER - 0.55, lips.BORDER + 0.3), 0.0)
    blend(in_mouth, red, lip)
    deep = np.where(in_mouth, 1 - ramp(head.ring, 0.5, lips.CONTACT), 0.0)
    blend(in_mouth, deep, (0.35, 0.13, 0.13))
    lid = on_skin & (head.zone == EYE)
    blend(lid, 0.30 * (1 - ramp(head.ring, 1.0, 3.2)), (0.72, 0.45, 0.38))
    # the hollow under the brow is painted lighter, or it looks tired in any light from above
    hollow = falloff(q, (21, 10, 78), (17, 12, 22))
    blend(on_skin, 0.60 * hollow + 0.35 * falloff(q, (4, 8, 88), (12, 13, 20)), (0.97, 0.80, 0.70))
    upper = lid & (head.turn > 0.4) & (head.turn < 12.2)
    line = np.where(upper, ramp(head.ring, 0.9, 1.4) * (1 - ramp(head.ring, 2.0, 2.6)), 0.0)
    blend(upper, 0.75 * line * ramp(head.turn, 0.5, 3.5), (0.16, 0.09, 0.07))

    eye = head.part == Part.EYEBALL
    arm = q - EYE_CENTRE
    angle = np.degrees(np.arccos(np.clip(arm[:, 2] / np.linalg.norm(arm, axis=1), -1, 1)))
    colours[eye] = (0.95, 0.94, 0.92)
    in_iris = eye & (angle < pieces.IRIS)
    ray = np.interp(angle, [pieces.PUPIL, 16, 23, 27.6], [0.75, 1.25, 1.05, 0.7])[:, None]
    lighter = 1 + 0.22 * np.clip(-arm[:, 1:2] / 6.0, -1, 1)  # light gathers at the lower side of an iris
    colours[in_iris] = np.clip(np.array(iris) * ray[in_iris] * lighter[in_iris], 0, 1)
    colours[eye & (angle >= pieces.IRIS) & (angle < pieces.LIMBUS)] = np.array(iris) * 0.35
    colours[eye & (angle < pieces.PUPIL)] = (0.02, 0.02, 0.025)
    # a painted reflection, on the same side in both eyes: without it the look is dead in soft light
    sparkle = EYE_CENTRE + (EYE_RADIUS + 0.3) * direction(np.radians(-10.5), np.radians(11.5))
    for centre in (sparkle, sparkle - [2 * EYE_CENTRE[0], 0.0, 0.0]):
        near = 1 - ramp(np.linalg.norm(head.vertices - centre, axis=1), 1.0, 2.1)
        blend(eye, near, (1.0, 1.0, 1.0))
    white = eye & (angle >= pieces.LIMBUS)
    colours[white] *= 1 - 0.16 * ramp(arm[white, 1:2], 1.0, 9.0)  # the upper lid's shade
    back = eye & (angle > 60)
    colours[back] = (0.88, 0.80, 0.76)

    colours[head.part == Part.MOUTH_INSIDE] = (0.22, 0.06, 0.07)
    colours[np.isin(head.part, [Part.UPPER_TEETH, Part.LOWER_TEETH])] = (0.93, 0.91, 0.86)
    colours[head.part == Part.TONGUE] = (0.58, 0.26, 0.27)
    colours[head.part == Part.BROW] = brow
    colours[head.part == Part.LASHES] = (0.10, 0.07, 0.06)
    on_hair = head.part == Part.HAIR
    around = np.arctan2(q[on_hair, 0], q[on_hair, 2] + 6.0)
    strands = 1 + 0.16 * np.sin(23 * around) * np.sin(9 * around + 1.0) + 0.10 * np.sin(41 * around)
    colours[on_hair] = np.array(hair) * strands[:, None]
    return np.clip(colours, 0.0, 1.0)


def regions() -> dict[str, NDArray[np.int64]]:
    """Return vertex numbers by what a renderer treats apart: skin, eyeball, mouth inside, teeth, brow, lashes, hair."""
    part = base_head().part
    names = {
        "skin": (Part.SKIN, Part.EAR),
        "eyeball": (Part.EYEBALL,),
        "mouth_inside": (Part.MOUTH_INSIDE, Part.TONGUE),
        "teeth": (Part.UPPER_TEETH, Part.LOWER_TEETH),
        "brow": (Part.BROW,),
        "lashes": (Part.LASHES,),
        "hair": (Part.HAIR,),
    }
    return {name: np.flatnonzero(np.isin(part, parts)) for name, parts in names.items()}
