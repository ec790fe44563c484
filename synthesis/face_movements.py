"""Which shapes of a rig open its mouth, close its eyes, raise its brows: what landmarks are found by.

Shapes are known by their ARKit names. A rig of other names says which of its shapes stands for which; the expression
units of MakeHuman's base mesh are known here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .arkit import ARKIT_NAMES, arkit_name
from .rig import Rig

Array = NDArray[np.floating[Any]]

MAKEHUMAN = {
    **{f"eye-{s}-closure": f"eyeBlink{s.title()}" for s in ("left", "right")},
    **{f"eyebrows-{s}-down": f"browDown{s.title()}" for s in ("left", "right")},
    **{f"eyebrows-{s}-inner-up": f"browInnerUp{s.title()}" for s in ("left", "right")},
    **{f"eyebrows-{s}-extern-up": f"browOuterUp{s.title()}" for s in ("left", "right")},
    **{f"nose-{s}-elevation": f"noseSneer{s.title()}" for s in ("left", "right")},
    "mouth-corner-puller": "mouthSmile",
    "mouth-retraction": "mouthDimple",
    "mouth-open": "jawOpen",
}
"""What the units of MakeHuman's base mesh do, as ARKit names; without a side where one unit moves both."""

_SIDES = ("Left", "Right")


class Movements:
    """How far each vertex moves when the face does something.

    Parameters
    ----------
    rig
        The face.
    shapes
        ARKit name of each of the rig's shapes whose own name does not say it.

    Raises
    ------
    InputError
        If ``shapes`` names a shape that the rig has not, or a name that is not ARKit's.
    """

    def __init__(self, rig: Rig, shapes: Mapping[str, str] | None = None) -> None:
        self._rig = rig
        self._known: dict[str, list[int]] = {}
        given = dict(shapes or {})
        unknown = sorted(set(given) - set(rig.shapes))
        if unknown:
            raise InputError(f"shapes: the rig has no shape {', '.join(unknown)}")
        stems = {name.removesuffix("Left").removesuffix("Right") for name in ARKIT_NAMES}
        wrong = sorted({n for n in given.values() if n.removesuffix("Left").removesuffix("Right") not in stems})
        if wrong:
            raise InputError(f"shapes: expected names of ARKit's shapes, but got {', '.join(wrong)}")
        for number, shape in enumerate(rig.shapes):
            name = given.get(shape) or MAKEHUMAN.get(shape) or arkit_name(shape)
            if name is not None:
                self._known.setdefault(name, []).append(number)

    def has(self, move: str) -> bool:
        """Say whether some shape makes this movement on both sides."""
        return bool(self._known.get(move)) or all(self._known.get(move + side) for side in _SIDES)

    def distance(self, move: str, side: str | None = None) -> Array:
        """Return how far each vertex moves, (n_vertices,), mm; several shapes that share a movement add up.

        Parameters
        ----------
        move
            ARKit name without its side: ``mouthSmile``.
        side
            ``Left`` or ``Right`` for that side's shapes alone, where the rig has them.
        """
        return np.asarray(np.linalg.norm(self.displacement(move, side), axis=1))

    def displacement(self, move: str, side: str | None = None) -> Array:
        """Return the displacement of each vertex, (n_vertices, 3), mm; see :meth:`distance`."""
        names = [move, move + side] if side else [move, *(move + s for s in _SIDES)]
        numbers = [n for name in names for n in self._known.get(name, [])]
        if not numbers:
            raise InputError(f"rig: none of its shapes is {move}")
        return np.asarray(self._rig.deltas[numbers].sum(axis=0))
