"""The six affects and neutral as weights of ARKit shapes.

Prototypes after the Facial Action Coding System (Ekman, Friesen and Hager 2002, EMFACS): joy AU6+12, sadness 1+4+15,
surprise 1+2+5+26, fear 1+2+4+5+20+26, anger 4+5+7+23, disgust 9+10+15+17.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import NotFoundError
from .shapes import SHAPES

# a name without a side stands for both sides
_PROTOTYPES: dict[str, dict[str, float]] = {
    "neutral": {},
    "anger": {
        "browDown": 1.0, "eyeWide": 0.30, "eyeSquint": 0.50, "noseSneer": 0.30, "mouthPress": 0.9,
        "mouthFrown": 0.35, "mouthRollLower": 0.30, "mouthRollUpper": 0.20, "jawForward": 0.25, "mouthShrugLower": 0.3,
    },
    "disgust": {
        "noseSneer": 1.0, "mouthUpperUp": 0.75, "browDown": 0.45, "eyeSquint": 0.75, "cheekSquint": 0.7,
        "mouthFrown": 0.5, "mouthShrugLower": 0.55,
    },
    "fear": {
        "browInnerUp": 1.0, "browOuterUp": 0.15, "browDown": 0.35, "eyeWide": 1.0, "mouthStretch": 0.95,
        "jawOpen": 0.22, "mouthLowerDown": 0.45,
    },
    "joy": {
        "mouthSmile": 1.0, "cheekSquint": 0.9, "eyeSquint": 0.45, "mouthUpperUp": 0.32, "mouthLowerDown": 0.20,
        "jawOpen": 0.08, "browOuterUp": 0.12,
    },
    "sadness": {
        "browInnerUp": 0.95, "browDown": 0.3, "mouthFrown": 0.85, "mouthShrugLower": 0.5, "eyeLookDown": 0.35,
        "eyeBlink": 0.15, "eyeSquint": 0.2, "mouthRollLower": 0.1,
    },
    "surprise": {"browInnerUp": 0.95, "browOuterUp": 1.0, "eyeWide": 0.85, "jawOpen": 0.70, "mouthFunnel": 0.3},
}  # fmt: skip

AFFECTS: tuple[str, ...] = tuple(sorted(_PROTOTYPES))


def affect_pose(affect: str) -> NDArray[np.float64]:
    """Return the weights of an affect's prototype at full intensity.

    Parameters
    ----------
    affect
        anger, disgust, fear, joy, neutral, sadness or surprise.

    Returns
    -------
    (51,) weights from 0 to 1 in the order of :data:`~mimique.synthesis.avatar.shapes.SHAPES`.

    Raises
    ------
    NotFoundError
        If there is no such affect.
    """
    if affect not in _PROTOTYPES:
        raise NotFoundError(f"affect: no {affect!r}; there are {', '.join(AFFECTS)}")
    prototype = _PROTOTYPES[affect]
    weights = np.zeros(len(SHAPES))
    for number, shape in enumerate(SHAPES):
        bare = shape.removesuffix("Left").removesuffix("Right")
        weights[number] = prototype.get(shape, prototype.get(bare, 0.0))
    return weights
