"""The 52 ARKit blendshape names and how a rig's own names map onto them.

Names as in Apple's documentation of ``ARFaceAnchor.BlendShapeLocation``. Left and right are the subject's. Files keep
their own names and order; this table stands beside them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_SIDED = {
    "eye": ("Blink", "LookDown", "LookIn", "LookOut", "LookUp", "Squint", "Wide"),
    "mouth": ("Smile", "Frown", "Dimple", "Stretch", "Press", "LowerDown", "UpperUp"),
    "brow": ("Down", "OuterUp"),
    "cheek": ("Squint",),
    "nose": ("Sneer",),
}
_SINGLE = (
    "jawForward",
    "jawLeft",
    "jawRight",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthLeft",
    "mouthRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "browInnerUp",
    "cheekPuff",
    "tongueOut",
)

ARKIT_NAMES: tuple[str, ...] = tuple(
    sorted(
        [f"{part}{move}{side}" for part, moves in _SIDED.items() for move in moves for side in ("Left", "Right")]
        + list(_SINGLE)
    )
)
"""The 52 names, sorted."""

_LOOKUP = {name.lower(): name for name in ARKIT_NAMES}
_SIDE = re.compile(r"[_.\- ]?(left|right|l|r)$", re.IGNORECASE)


def arkit_name(shape: str) -> str | None:
    """Return the ARKit name that a rig's shape stands for, or None.

    Understands Apple's own spelling in any case, with or without separators (``mouth_smile_left``) and the name of a
    mesh before it (``Head.jawOpen``), the suffixes ``_L`` and ``_R`` (ICT FaceKit), and sides of shapes that ARKit does
    not split (``browInnerUp_L`` is a part of ``browInnerUp``, ``cheekPuff_R`` of ``cheekPuff``).

    Examples
    --------
    >>> arkit_name("mouthSmile_L"), arkit_name("cheekPuff_R"), arkit_name("Jaw_Open"), arkit_name("nostrils")
    ('mouthSmileLeft', 'cheekPuff', 'jawOpen', None)
    """
    plain = shape.rpartition(".")[2] if shape.count(".") and not _SIDE.fullmatch(shape.rpartition(".")[2]) else shape
    if _join(plain) in _LOOKUP:
        return _LOOKUP[_join(plain)]
    side = _SIDE.search(plain)
    if side is None:
        return None
    stem = _join(plain[: side.start()])
    word = "left" if side.group(1).lower() in ("left", "l") else "right"
    return _LOOKUP.get(stem + word) or _LOOKUP.get(stem)


def _join(name: str) -> str:
    """Return a name in lower case without what separates its words."""
    return re.sub(r"[_\-. ]", "", name).lower()


def arkit_side(shape: str) -> str | None:
    """Return the side of a shape that a rig splits and ARKit does not: ``"left"``, ``"right"``, or None for a whole.

    Examples
    --------
    >>> arkit_side("browInnerUp_L"), arkit_side("browInnerUp"), arkit_side("mouthSmile_L")
    ('left', None, None)
    """
    name = arkit_name(shape)
    if name is None or name.endswith(("Left", "Right")):
        return None
    side = _SIDE.search(shape)
    return None if side is None else "left" if side.group(1).lower() in ("left", "l") else "right"


def match_shapes(shapes: Sequence[str], source: Sequence[str]) -> list[int | None]:
    """Return for each shape the place in ``source`` of what drives it: its own name, else the same ARKit name, or None.

    Examples
    --------
    >>> match_shapes(["jawOpen", "browInnerUp_L", "nostrils"], ["BrowInnerUp", "JawOpen"])
    [1, 0, None]
    """
    own = {name: place for place, name in enumerate(source)}
    by_arkit = {arkit: place for place, name in enumerate(source) if (arkit := arkit_name(name)) is not None}
    return [own.get(shape, by_arkit.get(arkit_name(shape) or "")) for shape in shapes]


def arkit_table(shapes: Iterable[str]) -> dict[str, str | None]:
    """Return each shape of a rig with its ARKit name (None where it has none), in the rig's order."""
    return {shape: arkit_name(shape) for shape in shapes}
