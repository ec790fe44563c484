"""How each landmark is found: the rules behind :mod:`.landmarks`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .face_movements import Movements
from .face_sections import cut_skin, farthest_from_chord
from .face_surface import FaceSurface, find_face_surface, unroll
from .landmark_names import LANDMARKS, MIDDLE
from .rig import Rig

Array = NDArray[np.floating[Any]]
Points = dict[str, Array]

BROW_MOVES = ("browDown", "browInnerUp", "browOuterUp")
ON_LINE = 0.01
"""A vertex within this share of the face's width is on the midline (people's midlines are not quite straight)."""

MOUTH_MOVES = ("mouthSmile", "mouthStretch", "mouthDimple")


class FaceLandmarks:
    """The landmarks of one rig, each found when it is first asked for.

    Parameters
    ----------
    rig, shapes
        As for :func:`find_landmarks`.
    """

    def __init__(self, rig: Rig, *, shapes: Mapping[str, str] | None = None) -> None:
        self.rig = rig
        self.surface: FaceSurface = find_face_surface(rig)
        self.moves = Movements(rig, shapes)
        self._points: Points = {}
        self._vertices: dict[str, int] = {}
        self._profile = cut_skin(rig, self.surface, 0, self.surface.middle)

    def vertex(self, name: str) -> int:
        """Return the vertex of a landmark; errors as :func:`find_landmarks` raises them."""
        if name not in LANDMARKS:
            raise InputError(f"landmark: expected one of {', '.join(LANDMARKS)}, but got {name!r}")
        if name not in self._vertices:
            self._vertices[name] = self._nearest(name)
        return self._vertices[name]

    def position(self, name: str) -> Array:
        """Return where the vertex of a landmark is, (3,), mm."""
        return np.asarray(self.rig.neutral[self.vertex(name)])

    @property
    def width(self) -> float:
        """Distance of the outer eye corners, mm: the length that proportions are measured in."""
        return float(np.linalg.norm(self._find("eye_outer_left") - self._find("eye_outer_right")))

    def unroll(self, points: Array) -> Array:
        """Unroll points (n, 3) from the cylinder round this head, (n, 2), mm; see :func:`.face_surface.unroll`."""
        eyes = self._find("eye_outer_left") + self._find("eye_outer_right")
        return unroll(points, (self.surface.middle, float(eyes[2]) / 2 - 0.8 * self.width), self.width)

    def on_skin(self, place: Array, middle: bool = False) -> int:
        """Return the visible vertex nearest a place (2,) on the unrolled face; on the midline where that is asked."""
        allowed = self.outside
        if middle:
            near = np.abs(self.rig.neutral[:, 0] - self.surface.middle)
            on_line = allowed & (near < ON_LINE * self.width)
            allowed = on_line if on_line.sum() > 30 else allowed & (near < 0.03 * self.width)
        numbers = np.flatnonzero(allowed)
        away = np.linalg.norm(self.unroll(self.rig.neutral[numbers]) - place, axis=1)
        return int(numbers[np.argmin(away)])

    @cached_property
    def outside(self) -> NDArray[np.bool_]:
        """(n_vertices,) visible skin without what lies in an eye's opening."""
        here, inside = self.rig.neutral, np.zeros(self.rig.n_vertices, dtype=bool)
        for side in ("left", "right"):
            inner, outer, upper, lower = (
                self.position(f"{n}_{side}") for n in ("eye_inner", "eye_outer", "lid_upper", "lid_lower")
            )
            share = (here[:, 0] - inner[0]) / (outer[0] - inner[0])
            line = inner[1] + share * (outer[1] - inner[1])
            middle = float((upper[0] - inner[0]) / (outer[0] - inner[0]))
            base = inner[1] + middle * (outer[1] - inner[1])
            # Each lid's edge as a parabola through the corners and the lid's middle.
            arch = np.clip(share * (1 - share) / (middle * (1 - middle)), 0, None)
            top, bottom = line + arch * (upper[1] - base), line + arch * (lower[1] - base)
            margin = 0.05 * float(upper[1] - lower[1])
            within = (here[:, 1] < top - margin) & (here[:, 1] > bottom + margin)
            within &= here[:, 2] < max(upper[2], lower[2]) + margin
            inside |= within & (share > 0.03) & (share < 0.97)
        return self.surface.visible & ~inside

    # Finding

    def _find(self, name: str) -> Array:
        """Return the point of a landmark, (3,), before it is moved to a vertex."""
        if name not in self._points:
            base = name if name in MIDDLE else name.rpartition("_")[0]
            finder: Callable[[str], None] = getattr(self, f"_find_{_FINDERS[base]}")
            finder(name)
        return self._points[name]

    def _nearest(self, name: str) -> int:
        """Return the visible vertex nearest the landmark's point; a mirrored one on a symmetric mesh."""
        if name.endswith("_right") and self.surface.symmetric:
            return int(self.surface.mirror[self.vertex(name.removesuffix("_right") + "_left")])
        point = self._find(name)
        numbers = np.flatnonzero(self.surface.visible)
        if name in MIDDLE:
            near = np.abs(self.rig.neutral[numbers, 0] - self.surface.middle)
            on_line = numbers[near < ON_LINE * self.width]
            numbers = on_line if len(on_line) > 30 else numbers
        if name in ("lip_upper", "lip_lower"):
            numbers = numbers[self.lower_lip[numbers] == (name == "lip_lower")]
        return int(numbers[np.argmin(np.linalg.norm(self.rig.neutral[numbers] - point, axis=1))])

    def _side(self, name: str) -> tuple[str, float, NDArray[np.bool_]]:
        """Return ``Left`` or ``Right``, its sign in x, and the visible skin of that side."""
        side, sign = ("Left", 1.0) if name.endswith("_left") else ("Right", -1.0)
        return side, sign, self.surface.visible & (sign * (self.rig.neutral[:, 0] - self.surface.middle) > 0)

    def _require(self, name: str, moves: Iterable[str]) -> None:
        wanted = list(moves)
        if not any(self.moves.has(move) for move in wanted):
            one = wanted[0] if len(wanted) == 1 else "one of " + ", ".join(wanted)
            raise InputError(
                f"landmark {name}: it is found by {one}, which the rig has not; "
                "say which of its shapes does that (shapes={'its name': '" + wanted[0] + "'})"
            )

    def _find_eye(self, name: str) -> None:
        self._require(name, ["eyeBlink"])
        side, sign, here = self._side(name)
        move = self.moves.displacement("eyeBlink", side)
        far = np.linalg.norm(move, axis=1) * here
        if not far.max() > 0.5:
            raise InputError(
                f"landmark {name}: eyeBlink moves no skin on the {side.lower()} side that can be seen; "
                "turn the rig so that +X is the subject's left, +Y up and +Z out of the face"
            )
        points, top = self.rig.neutral, int(far.argmax())
        if -move[top, 1] < 0.5 * far[top]:
            raise InputError(
                f"landmark {name}: eyeBlink does not move the upper lid down; "
                "turn the rig so that +Y is up and +Z out of the face"
            )
        # The lid's edge: in each of some columns the vertex that moves farthest. Its way is the gap of the lids there.
        reach = far > 0.2 * far.max()
        columns = np.linspace(points[reach, 0].min(), points[reach, 0].max(), 15)
        column = np.digitize(points[:, 0], columns)
        edge = np.array([np.where(reach & (column == c), far, 0).argmax() for c in np.unique(column[reach])])
        # What moves least of these is the fold beside the corner, not the edge.
        edge = edge[far[edge] > 0.45 * far.max()]
        if len(edge) < 4:
            raise InputError(f"landmark {name}: the lid's edge has too few vertices that eyeBlink moves")
        x, centre = points[edge, 0] - points[top, 0], points[top, 0]
        square = np.polyfit(x, far[edge], 2)
        roots = np.roots(square)
        if square[0] >= 0 or np.iscomplex(roots).any():
            raise InputError(f"landmark {name}: eyeBlink closes the lids nowhere fully open; check that shape")
        middle_y = np.polyfit(x, points[edge, 1] + 0.5 * move[edge, 1], 1)
        depth = np.polyfit(x, points[edge, 2] + 0.5 * move[edge, 2], 2)
        # Near its corners the gap closes faster than a parabola does, which therefore ends a little too far out.
        inner, outer = sorted(roots.real.mean() + 0.94 * (roots.real - roots.real.mean()), key=lambda r: sign * r)
        low = name.rpartition("_")[2]
        for label, root in (("eye_inner", inner), ("eye_outer", outer)):
            self._points[f"{label}_{low}"] = np.array(
                [centre + root, np.polyval(middle_y, root), np.polyval(depth, root)]
            )
        self._points[f"lid_upper_{low}"] = points[top]
        arrived = points[top] + move[top]
        still = np.flatnonzero(here & (far < 0.4 * far.max()) & (points[:, 1] < points[top, 1]))
        self._points[f"lid_lower_{low}"] = points[still[np.argmin(np.linalg.norm(points[still] - arrived, axis=1))]]

    def _find_mouth(self, name: str) -> None:
        self._require(name, MOUTH_MOVES)
        side, _, here = self._side(name)
        pull = np.zeros(self.rig.n_vertices)
        for move in MOUTH_MOVES:
            if self.moves.has(move):
                far = self.moves.distance(move, side) * here
                pull += far / max(float(far.max()), 1e-9)
        near = np.flatnonzero(pull > 0.9 * pull.max())
        self._points[name] = np.average(self.rig.neutral[near], axis=0, weights=pull[near])

    def _find_brow(self, name: str) -> None:
        self._require(name, BROW_MOVES)
        base, _, low = name.rpartition("_")
        side, _, here = self._side(name)
        inner, outer = self._find(f"eye_inner_{low}"), self._find(f"eye_outer_{low}")
        across = {"brow_inner": -0.15, "brow_mid": 0.5, "brow_outer": 1.0}[base]
        place = self.unroll(np.stack([inner, outer]))
        along = place[0, 0] + across * (place[1, 0] - place[0, 0])
        rise = np.zeros(self.rig.n_vertices)
        for move in BROW_MOVES:
            if self.moves.has(move):
                far = self.moves.distance(move, side) * here
                rise += far / max(float(far.max()), 1e-9)
        flat = self.unroll(self.rig.neutral)
        above = (flat[:, 1] - place[:, 1].max()) / self.width
        column = here & (np.abs(flat[:, 0] - along) < 0.06 * self.width) & (above > 0.1) & (above < 0.5)
        if not (column & (rise > 0)).any():
            raise InputError(f"landmark {name}: the brow shapes move no skin above the {low} eye")
        best = float(rise[column].max())
        ridge = np.flatnonzero(column & (rise > 0.85 * best))
        height = float(np.average(flat[ridge, 1], weights=rise[ridge]))
        self._points[name] = self.rig.neutral[self.on_skin(np.array([along, height]))]

    def _on_profile(self, name: str, low: float, high: float, key: Callable[[Array, Array], Array]) -> None:
        """Set a landmark to the place of the profile between two heights where ``key(y, z)`` is greatest."""
        y, z = self._profile
        inside = (y > low) & (y < high)
        if inside.sum() < 3:
            raise InputError(f"landmark {name}: the skin has no profile between heights {low:.0f} and {high:.0f} mm")
        best = int(np.argmax(key(y[inside], z[inside])))
        self._points[name] = np.array([self.surface.middle, y[inside][best], z[inside][best]])

    def _on_chord(self, name: str, start: Array, end: Array, sign: float) -> None:
        y, z = self._profile
        at = farthest_from_chord(y, z, float(start[1]), float(end[1]), sign)
        if not np.isfinite(at):
            raise InputError(f"landmark {name}: the skin's profile has no point between its neighbours")
        self._points[name] = np.array([self.surface.middle, at, float(np.interp(at, y, z))])

    def _heights(self) -> tuple[float, float, float]:
        """Return the heights of eyes and mouth, and their distance; the rig must stand upright and look along +Z."""
        eyes = [self._find(f"{n}_{s}") for n in ("eye_inner", "eye_outer") for s in ("left", "right")]
        mouth = [self._find(f"mouth_corner_{s}") for s in ("left", "right")]
        eye, lips = float(np.mean([p[1] for p in eyes])), float(np.mean([p[1] for p in mouth]))
        if eye - lips < 0.3 * self.width:
            raise InputError("rig: its eyes are not above its mouth; turn it so that +Y is up and +Z out of the face")
        return eye, lips, eye - lips

    def _find_nose_tip(self, name: str) -> None:
        eye, mouth, face = self._heights()
        self._on_profile(name, mouth + 0.25 * face, eye - 0.2 * face, lambda y, z: z)

    def _find_glabella(self, name: str) -> None:
        brow = float(np.mean([self._find(f"brow_inner_{s}")[1] for s in ("left", "right")]))
        face = self._heights()[2]
        self._on_profile(name, brow - 0.12 * face, brow + 0.08 * face, lambda y, z: z)

    def _find_nasion(self, name: str) -> None:
        self._on_chord(name, self._find("glabella"), self._find("nose_tip"), -1.0)

    def _find_lips(self, name: str) -> None:
        self._require(name, ["jawOpen"])
        _, mouth, face = self._heights()
        y, z = self._profile
        middle = np.flatnonzero(
            self.surface.visible
            & (np.abs(self.rig.neutral[:, 0] - self.surface.middle) < 0.05 * self.width)
            & (np.abs(self.rig.neutral[:, 1] - mouth) < 0.3 * face)
        )
        low = self.lower_lip
        ups, downs = middle[~low[middle]], middle[low[middle]]
        if not len(ups) or not len(downs):
            raise InputError(f"landmark {name}: jawOpen does not part the lips between the mouth corners")
        edge_up, edge_down = self.rig.neutral[ups, 1].min(), self.rig.neutral[downs, 1].max()
        for label, height in (("lip_upper", edge_up), ("lip_lower", edge_down)):
            self._points[label] = np.array([self.surface.middle, height, float(np.interp(height, y, z))])

    @cached_property
    def lower_lip(self) -> NDArray[np.bool_]:
        """(n_vertices,) what follows the jaw more than half as far as the middle of the lower lip does."""
        _, mouth, face = self._heights()
        drop = -self.moves.displacement("jawOpen")[:, 1]
        here = self.rig.neutral
        lips = self.surface.visible & (np.abs(here[:, 1] - mouth) < 0.3 * face)
        lips &= np.abs(here[:, 0] - self.surface.middle) < 0.05 * self.width
        return np.asarray(drop > 0.5 * float(drop[lips].max(initial=0.0)))

    def _find_upper_border(self, name: str) -> None:
        lip, tip = self._find("lip_upper"), self._find("nose_tip")
        self._on_profile(name, lip[1], lip[1] + 0.45 * (tip[1] - lip[1]), lambda y, z: z)

    def _find_nose_base(self, name: str) -> None:
        self._on_chord(name, self._find("nose_tip"), self._find("lip_upper_border"), -1.0)

    def _find_lower_border(self, name: str) -> None:
        lip, face = self._find("lip_lower"), self._heights()[2]
        self._on_profile(name, lip[1] - 0.22 * face, lip[1], lambda y, z: z)

    def _find_chin(self, name: str) -> None:
        lip, face = self._find("lip_lower_border"), self._heights()[2]
        # The corner first: seen from half below it is foremost on any chin, long or receding.
        self._on_profile("chin_bottom", lip[1] - 0.7 * face, lip[1] - 0.3 * face, lambda y, z: z - y)
        self._on_chord("chin_fold", lip, self._points["chin_bottom"], -1.0)
        self._on_chord("chin", self._points["chin_fold"], self._points["chin_bottom"], 1.0)

    def _find_forehead(self, name: str) -> None:
        glabella, tip, (y, z) = self._find("glabella"), self._find("nose_tip"), self._profile
        height = min(float(glabella[1] + 0.5 * (glabella[1] - tip[1])), float(y.max()))
        self._points[name] = np.array([self.surface.middle, height, float(np.interp(height, y, z))])

    def _find_wing(self, name: str) -> None:
        low, (_, sign, here) = name.rpartition("_")[2], self._side(name)
        tip, base, points = self._find("nose_tip"), self._find("nose_base"), self.rig.neutral
        tall = float(tip[1] - base[1])
        out = sign * (points[:, 0] - self.surface.middle)
        inner = abs(float(self._find(f"eye_inner_{low}")[0]) - self.surface.middle)
        # A nose is about as wide as the eyes' inner corners are apart; its wing there looks sideways.
        beside = here & (np.abs(out / inner - 0.85) < 0.35) & (points[:, 2] < tip[2] - 0.2 * (tip[2] - base[2]))
        beside &= (points[:, 1] > base[1] - 0.1 * tall) & (points[:, 1] < tip[1] + 0.1 * tall)
        if not beside.any():
            raise InputError(f"landmark {name}: the skin has no vertices beside the tip of the nose")
        sideways = sign * self.surface.normals[:, 0]
        wing = np.flatnonzero(beside & (sideways > 0.85 * sideways[beside].max()))
        place = np.average(points[wing], axis=0, weights=sideways[wing])
        x, z = cut_skin(self.rig, self.surface, 1, float(place[1]))
        x = sign * (x - self.surface.middle)
        order, start = np.argsort(x), sign * (float(place[0]) - self.surface.middle)
        crease = farthest_from_chord(x[order], z[order], start, 2.2 * inner, -1.0)
        if not np.isfinite(crease):
            raise InputError(f"landmark {name}: the skin has no level section beside the nose's wing")
        depth = float(np.interp(crease, x[order], z[order]))
        self._points[f"nose_ala_{low}"] = place
        self._points[f"nose_crease_{low}"] = np.array([self.surface.middle + sign * crease, place[1], depth])

    def _find_proportion(self, name: str) -> None:
        base, _, low = name.rpartition("_")
        eye, mouth, face = self._heights()
        names = ("eye_inner", "eye_outer")
        inner, outer = self.unroll(np.stack([self._find(f"{n}_{low}") for n in names]))
        sign = 1.0 if low == "left" else -1.0
        tip = self._find("nose_tip")[1]
        along, height = {
            "cheek": (0.25 * inner[0] + 0.75 * outer[0], 0.5 * (tip + mouth) + 0.1 * face),
            "cheekbone": (outer[0] + 0.15 * (outer[0] - inner[0]), 0.5 * (eye + tip)),
            "jaw_corner": (sign * 0.82 * self.width, mouth - 0.17 * face),
            "temple": (outer[0] + 0.75 * (outer[0] - inner[0]), eye + 0.3 * face),
        }[base]
        self._points[name] = self.rig.neutral[self.on_skin(np.array([along, height]))]

    def _find_ear(self, name: str) -> None:
        _, sign, here = self._side(name)
        brow, base = self._find("brow_mid_" + name.rpartition("_")[2])[1], self._find("nose_base")[1]
        numbers = np.flatnonzero(here & (self.rig.neutral[:, 1] < brow) & (self.rig.neutral[:, 1] > base))
        self._points[name] = self.rig.neutral[numbers[np.argmax(sign * self.rig.neutral[numbers, 0])]]


_FINDERS = {
    **dict.fromkeys(("eye_inner", "eye_outer", "lid_upper", "lid_lower"), "eye"),
    **dict.fromkeys(("brow_inner", "brow_mid", "brow_outer"), "brow"),
    **dict.fromkeys(("nose_ala", "nose_crease"), "wing"),
    **dict.fromkeys(("lip_upper", "lip_lower"), "lips"),
    **dict.fromkeys(("chin_fold", "chin", "chin_bottom"), "chin"),
    **dict.fromkeys(("cheek", "cheekbone", "jaw_corner", "temple"), "proportion"),
    **{name: name for name in ("forehead", "glabella", "nasion", "nose_tip", "nose_base", "ear")},
    "mouth_corner": "mouth",
    "lip_upper_border": "upper_border",
    "lip_lower_border": "lower_border",
}
