"""The 51 ARKit shapes on the avatar: what each does, in mm and degrees.

Names and order are Apple's (ARKit ``ARFaceAnchor.BlendShapeLocation``, without ``tongueOut``). Left shapes are
built, right ones are their mirror images. Amounts follow what adults' faces do at full effort: a smile lifts a mouth
corner by about a centimetre, brows rise about as much, the jaw opens the lips by three centimetres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import lips
from .gaze import move_lids, turn_eye
from .head import Head, Part
from .morphology import Morphology, eye_geometry
from .muscles import Pull, crease, falloff, plateau, pull_all, ramp
from .template import EYE, MOUTH

Floats = NDArray[np.float64]

_EYES = ("eyeBlink", "eyeLookDown", "eyeLookIn", "eyeLookOut", "eyeLookUp", "eyeSquint", "eyeWide")
SHAPES: tuple[str, ...] = (
    *(name + "Left" for name in _EYES),
    *(name + "Right" for name in _EYES),
    *("jawForward", "jawLeft", "jawRight", "jawOpen"),
    *("mouthClose", "mouthFunnel", "mouthPucker", "mouthLeft", "mouthRight"),
    *("mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft", "mouthFrownRight"),
    *("mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight"),
    *("mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper"),
    *("mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft", "mouthLowerDownRight"),
    *("mouthUpperUpLeft", "mouthUpperUpRight"),
    *("browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
    *("cheekPuff", "cheekSquintLeft", "cheekSquintRight", "noseSneerLeft", "noseSneerRight"),
)

# places on the left side of the base face, mm
_CORNER = (26.0, -68.0, 84.0)
_CHEEK = (41.0, -32.0, 72.0)
_FOLD = (30.0, -52.0, 84.0)
_ALA = (15.0, -45.0, 94.0)
_UPPER_LIP = (12.0, -64.0, 96.0)
_LOWER_LIP = (12.0, -75.0, 95.0)
_BROW_IN, _BROW_MID, _BROW_OUT = (11.0, 17.0, 88.0), (29.0, 22.0, 84.0), (46.0, 19.0, 70.0)

_PULLS: dict[str, tuple[Pull, ...]] = {
    "mouthSmile": (
        # the corner rises most, the rest of the lips a little: a bowl, not a wedge
        Pull(_CORNER, (26, 31, 42), (5.0, 5.4, -3.5)),
        Pull(_CORNER, (50, 27, 45), (2.6, 3.8, -1.5)),
        Pull((15.5, -68, 92), (14, 14, 34), (0.0, -2.3, 0.0)),
        Pull(_CHEEK, (30, 26, 40), (1.5, 4.5, 4.0)),
        Pull(_FOLD, (20, 22, 35), (1.5, 1.5, 1.0)),
    ),
    "mouthFrown": (
        Pull(_CORNER, (30, 32, 45), (1.5, -9.0, -1.5)),
        Pull((20, -92, 86), (22, 22, 40), (0.0, -1.5, 1.0)),
    ),
    "mouthDimple": (Pull(_CORNER, (24, 24, 40), (5.0, 1.5, -4.5)), Pull((36, -68, 74), (16, 22, 30), (0.5, 0.0, -2.0))),
    "mouthStretch": (
        Pull(_CORNER, (34, 34, 45), (8.5, -4.5, -5.0)),
        Pull((32, -92, 66), (30, 34, 45), (3.0, -4.0, 0.0)),
    ),
    "mouthPress": (
        Pull(_UPPER_LIP, (26, 11, 28), (0.5, -1.6, -1.8), "upper"),
        Pull(_LOWER_LIP, (26, 13, 28), (0.5, 2.4, -1.9), "lower"),
        Pull(_CORNER, (20, 20, 36), (2.0, 0.3, -1.5)),
    ),
    "mouthLowerDown": (
        Pull((14, -75, 94), (32, 26, 42), (1.6, -9.5, -0.5), "lower"),
        Pull((15, -92, 88), (26, 24, 40), (0.5, -2.5, 0.8), "lower"),
    ),
    "mouthUpperUp": (
        Pull((14, -65, 95), (31, 24, 42), (1.0, 7.2, -0.5), "upper"),
        Pull((24, -52, 90), (20, 20, 36), (1.0, 3.0, 1.5), "upper"),
        Pull(_ALA, (12, 12, 22), (0.8, 1.5, 0.0)),
    ),
    "browDown": (
        Pull(_BROW_IN, (25, 24, 40), (-2.6, -7.0, 1.8)),
        Pull(_BROW_MID, (30, 26, 40), (-1.2, -4.2, 1.0)),
        Pull(_BROW_OUT, (22, 24, 36), (0.3, 0.6, 0.3)),
    ),
    "browOuterUp": (
        Pull(_BROW_OUT, (30, 34, 42), (0.8, 8.0, -0.8)),
        Pull(_BROW_MID, (17, 32, 44), (0.3, 3.4, 0.0)),
    ),
    "cheekSquint": (
        Pull((38, -24, 76), (32, 26, 42), (0.5, 5.0, 3.2)),
        Pull((36, -14, 78), (26, 16, 36), (0.0, 2.2, 0.8)),
    ),
    "noseSneer": (
        Pull(_ALA, (18, 21, 30), (1.6, 5.6, 0.3)),
        Pull((10, -22, 92), (16, 22, 30), (0.4, 3.6, 2.2)),
        Pull((9, 6, 90), (18, 16, 30), (-0.6, -2.0, 1.6)),
        Pull((16, -62, 96), (18, 18, 30), (0.6, 3.0, 0.4), "upper"),
    ),
}
# from the nose's wing past the corner of the mouth; what stands up beside it (mm) with which shape
_NASOLABIAL = np.array([[15.5, -35.0], [20.0, -43.0], [26.5, -51.0], [32.0, -59.0], [35.0, -67.0], [35.5, -75.0]])
_FOLD_WIDTH = 5.0
_FOLDS = {"mouthSmile": 1.0, "noseSneer": 1.0, "mouthUpperUp": 0.5}
# shapes of both sides at once; the mirrored pull is added on the right
_BOTH: dict[str, tuple[Pull, ...]] = {
    "browInnerUp": (
        Pull((10.0, 19.0, 88.0), (24, 32, 44), (-0.4, 7.0, -0.4)),
        Pull((24.0, 24.0, 86.0), (20, 26, 40), (-0.6, 2.2, 0.0)),
    ),
    "cheekPuff": (
        Pull((40, -62, 68), (36, 36, 50), (10.5, 0.0, 7.0)),
        Pull((0, -70, 98), (26, 24, 30), (0.0, 0.0, 2.2)),
    ),
    "mouthShrugUpper": (Pull((8, -66, 98), (30, 20, 34), (0.0, 4.2, 1.5), "upper"),),
    "mouthShrugLower": (
        Pull((8, -77, 97), (30, 22, 36), (0.0, 5.6, 2.6), "lower"),
        Pull((6, -103, 90), (34, 26, 40), (0.0, 5.0, 2.2)),
    ),
}
# opening of the lids that comes with a shape: (upper, lower) as shares of the opening
_LIDS: dict[str, tuple[float, float]] = {
    "eyeBlink": (-0.90, 0.09),
    "eyeLookDown": (-0.32, -0.15),
    "eyeLookUp": (0.14, 0.05),
    "eyeSquint": (-0.13, 0.26),
    "eyeWide": (0.24, -0.08),
    "cheekSquint": (0.0, 0.14),
}
_GAZE = {"eyeLookDown": (0.0, -21.0), "eyeLookIn": (-30.0, 0.0), "eyeLookOut": (30.0, 0.0), "eyeLookUp": (0.0, 21.0)}
_SQUINT_PULLS = (Pull((36, -17, 78), (28, 18, 38), (0.0, 2.2, 0.8)),)
_WIDE_PULLS = (Pull((31, 16, 82), (26, 14, 36), (0.0, 1.2, 0.0)),)

JAW_HINGE = np.array([0.0, -14.0, 6.0])
JAW_ANGLE = 17.0


def _mirrored(head: Head, moved: Floats) -> Floats:
    """Return the mirror image of a displacement."""
    return moved[head.mirror] * np.array([-1.0, 1.0, 1.0])


def _jaw_open(head: Head, vertices: Floats, hinge: Floats) -> Floats:
    """Return the jaw's turn about the axis through both joints, with its slide forwards."""
    angle = np.radians(JAW_ANGLE)
    arm = vertices - hinge
    y = np.cos(angle) * arm[:, 1] - np.sin(angle) * arm[:, 2]
    z = np.sin(angle) * arm[:, 1] + np.cos(angle) * arm[:, 2]
    turned = np.stack([np.zeros(len(arm)), y - arm[:, 1], z - arm[:, 2] + 2.0], -1)
    moved = head.jaw[:, None] * turned
    # the corners come in a little as the lips stretch over the opening
    moved[:, 0] -= 0.13 * vertices[:, 0] * plateau(head.vertices, (0, -72, 88), (50, 30, 60), core=0.4) * _soft(head)
    return moved


def _near_mouth(head: Head) -> Floats:
    """Return 1 on the lips, falling to 0 at nose, cheek and chin."""
    q = head.vertices
    rise = q[:, 1] + 70.0
    d = np.hypot(q[:, 0] / 27.0, rise / np.where(rise > 0, 9.0, 14.0))
    return np.where(q[:, 2] > 30, 1 - ramp(d, 1.0, 2.5), 0.0) * _soft(head)


def _soft(head: Head) -> Floats:
    """Return 1 where skin moves with its muscles (skin and brows), 0 on eyes, teeth, hair, ears and inner lids."""
    soft = np.isin(head.part, [Part.SKIN, Part.BROW]).astype(float)
    bag = head.part == Part.MOUTH_INSIDE  # its rim goes with the lips, its depth stays
    soft[bag] = ramp(head.vertices[bag, 2], 45.0, 68.0)
    lid = head.zone == EYE
    soft[lid] *= ramp(head.ring[lid], 2.5, 6.0)
    return soft


def _mouth_close(head: Head, jaw_open: Floats) -> Floats:
    """Return what brings the lips together again while the jaw is open: both lips meet a third of the way down."""
    q = head.vertices
    lip_edge = np.flatnonzero(
        (head.zone == MOUTH) & (head.ring == lips.CONTACT) & (head.turn >= lips.TURNS / 2) & (q[:, 0] >= 0)
    )
    lip_edge = lip_edge[np.argsort(q[lip_edge, 0])]
    at = np.abs(q[:, 0])
    opposite = np.stack([np.interp(at, q[lip_edge, 0], jaw_open[lip_edge, k]) for k in range(3)], -1)
    opposite[:, 0] *= np.sign(q[:, 0])
    near = _near_mouth(head)
    # in front of the teeth, not back with the jaw
    meeting = opposite * np.array([0.36, 0.36, 0.05])
    return near[:, None] * (meeting - jaw_open)


def _funnel(head: Head, narrow: float, forward: float, open_: float, flare: float) -> Floats:
    """Return lips drawn together and pushed forward: pucker (closed) and funnel (open)."""
    q = head.vertices
    near = plateau(q, (0.0, -75.0, 92.0), (58.0, 36.0, 70.0), core=0.25) * _soft(head)
    lip = np.where(head.zone == MOUTH, 1 - ramp(head.ring, 4.5, 8.0), 0.0)
    moved = np.zeros_like(q)
    moved[:, 0] = -narrow * near * q[:, 0]
    moved[:, 2] = near * forward * (0.55 + 0.45 * np.exp(-((q[:, 0] / 20.0) ** 2)))
    away = (1 - 2 * head.lower) * np.sqrt(np.clip(1 - (q[:, 0] / 27.0) ** 2, 0, 1))
    moved[:, 1] = open_ * lip * away
    inside = np.where(head.zone == MOUTH, np.clip(1 - np.abs(head.ring - 4.0) / 2.5, 0, 1), 0.0)
    moved[:, 2] += flare * inside * np.sqrt(np.clip(1 - (q[:, 0] / 27.0) ** 2, 0, 1))
    return moved


def _roll(head: Head, upper: bool) -> Floats:
    """Return one lip rolled in over its teeth: the red turns inwards and its border follows."""
    q = head.vertices
    here = (1 - head.lower) if upper else head.lower
    middle = np.sqrt(np.clip(1 - (q[:, 0] / 29.0) ** 2, 0, 1))
    red = np.where(
        head.zone == MOUTH,
        np.interp(head.ring, [0, 1, 2, 3, 4, 5, 6, 7, 8], [0, 0.2, 0.6, 0.9, 1, 0.75, 0.4, 0.15, 0]),
        0.0,
    )
    down = np.where(
        head.zone == MOUTH, np.interp(head.ring, [0, 2, 3, 4, 5, 6, 7, 8], [0, 0.0, 0.1, 0.7, 1.0, 0.75, 0.3, 0]), 0.0
    )
    moved = np.zeros_like(q)
    sign = -1.0 if upper else 1.0
    moved[:, 1] = sign * (4.2 if upper else 5.0) * down * here * middle
    moved[:, 2] = -(4.5 if upper else 4.8) * red * here * middle
    return moved


def _sideways(head: Head) -> Floats:
    """Return the mouth drawn to the left."""
    q = head.vertices
    soft = _soft(head)[:, None]
    near = plateau(q, (0.0, -70.0, 90.0), (62.0, 44.0, 75.0), core=0.35)[:, None]
    drawn = near * np.stack([np.full(len(q), 8.5), 0.04 * q[:, 0], -0.10 * q[:, 0]], -1)
    # the leading cheek gathers and is pushed out, the other one is stretched flat
    gathered = falloff(q, (38.0, -66.0, 76.0), (28.0, 30.0, 40.0))[:, None] * np.array([1.0, 1.0, 2.5])
    return soft * (drawn + gathered)


def build_deltas(head: Head, vertices: Floats, morphology: Morphology) -> Floats:
    """Return the displacement of every shape at weight 1.

    Parameters
    ----------
    head
        The base head, in whose coordinates the pulls are placed.
    vertices
        (n_vertices, 3) the person's neutral face, mm: jaw and lids turn about this person's own joints.
    morphology
        The person's proportions.

    Returns
    -------
    (51, n_vertices, 3) in the order of :data:`SHAPES`, mm.
    """
    q = head.vertices
    soft = _soft(head)[:, None]
    # share of a left-sided pull: nothing on the right but a sliver at the midline, and left + right = both
    side = ramp(q[:, 0], -6.0, 6.0)[:, None]
    centre, size = eye_geometry(morphology)
    scale = np.array([1 + 0.07 * morphology.face_width, 1 + 0.07 * morphology.face_height, 1.0])
    done: dict[str, Floats] = {}

    def left_right(name: str, moved: Floats) -> None:
        done[name + "Left"], done[name + "Right"] = moved, _mirrored(head, moved)

    for name in _EYES:
        moved = np.zeros_like(q)
        if name in _GAZE:
            moved += turn_eye(head, vertices, centre, *_GAZE[name])
        if name in _LIDS:
            moved += move_lids(head, vertices, centre, size, *_LIDS[name])
        extra = {"eyeSquint": _SQUINT_PULLS, "eyeWide": _WIDE_PULLS}.get(name, ())
        moved += side * soft * pull_all(q, head.lower, extra)
        left_right(name, moved)
    fold = crease(q, _NASOLABIAL, _FOLD_WIDTH)[:, None] * np.array([0.4, 0.1, 0.9])
    for name, pulls in _PULLS.items():
        moved = pull_all(q, head.lower, pulls) + _FOLDS.get(name, 0.0) * fold
        moved = side * soft * moved * scale
        if name in _LIDS:
            moved += move_lids(head, vertices, centre, size, *_LIDS[name])
        left_right(name, moved)
    for name, pulls in _BOTH.items():
        moved = side * soft * pull_all(q, head.lower, pulls) * scale
        done[name] = moved + _mirrored(head, moved)

    jaw = _jaw_open(head, vertices, JAW_HINGE)
    done["jawOpen"] = jaw
    done["jawForward"] = head.jaw[:, None] * np.array([0.0, -0.8, 6.5])
    done["jawLeft"] = head.jaw[:, None] * np.stack([np.full(len(q), 7.5), np.full(len(q), -1.0), -0.04 * q[:, 0]], -1)
    done["jawRight"] = _mirrored(head, done["jawLeft"])
    done["mouthClose"] = _mouth_close(head, jaw)
    done["mouthFunnel"] = _funnel(head, narrow=0.24, forward=6.0, open_=5.0, flare=2.5)
    done["mouthPucker"] = _funnel(head, narrow=0.42, forward=7.0, open_=0.0, flare=1.5)
    done["mouthLeft"] = _sideways(head)
    done["mouthRight"] = _mirrored(head, done["mouthLeft"])
    done["mouthRollLower"], done["mouthRollUpper"] = _roll(head, upper=False), _roll(head, upper=True)
    return np.stack([done[name] for name in SHAPES])
