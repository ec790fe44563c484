"""Regions of the moving face, and where no marker can sit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from .landmark_finder import FaceLandmarks
from .landmark_names import MIDDLE
from .rig import Rig

__all__ = ["REGIONS", "face_regions", "forbidden_vertices"]

REGIONS = ("brows", "lids", "nose", "cheeks", "lips", "chin")
"""The regions of a face; the forehead belongs to the brows, jaw and neck to cheeks and chin."""

_SEEDS: dict[str, tuple[dict[str, float], ...]] = {
    "brows": (
        {"brow_inner": 1.0}, {"brow_mid": 1.0}, {"brow_outer": 1.0}, {"glabella": 1.0}, {"forehead": 1.0},
        {"temple": 1.0}, {"brow_mid": 1.0, "forehead": 0.5, "glabella": -0.5},
        {"brow_outer": 1.0, "forehead": 0.5, "glabella": -0.5},
    ),
    "lids": (
        {"eye_inner": 1.0}, {"eye_outer": 1.0}, {"lid_upper": 1.0}, {"lid_lower": 1.0},
        {"eye_inner": 0.4, "lid_upper": 0.6}, {"eye_outer": 0.4, "lid_upper": 0.6},
        {"eye_inner": 0.4, "lid_lower": 0.6}, {"eye_outer": 0.4, "lid_lower": 0.6},
    ),
    "nose": (
        {"nasion": 1.0}, {"nasion": 0.5, "nose_tip": 0.5}, {"nose_tip": 1.0}, {"nose_ala": 1.0},
        {"nose_base": 0.9, "nose_tip": 0.1}, {"nasion": 0.3, "nose_tip": 0.3, "nose_ala": 0.4},
    ),
    "cheeks": (
        {"cheek": 1.0}, {"cheekbone": 1.0}, {"jaw_corner": 1.0}, {"cheekbone": 0.5, "jaw_corner": 0.5},
        {"cheek": 0.4, "mouth_corner": 0.3, "jaw_corner": 0.3}, {"cheek": 0.6, "lid_lower": 0.4},
        {"cheek": 0.5, "nose_crease": 0.5}, {"cheek": 0.5, "eye_inner": 0.3, "nose_crease": 0.2}, {"ear": 1.0},
    ),
    "lips": (
        {"lip_upper_border": 1.0}, {"lip_lower_border": 1.0}, {"mouth_corner": 1.0},
        {"mouth_corner": 0.5, "lip_upper_border": 0.5}, {"mouth_corner": 0.5, "lip_lower_border": 0.5},
        {"lip_upper_border": 0.7, "nose_base": 0.3}, {"lip_lower_border": 0.5, "chin_fold": 0.5},
        {"mouth_corner": 0.6, "lip_upper_border": 0.2, "nose_crease": 0.2},
    ),
    "chin": (
        {"chin": 1.0}, {"chin_bottom": 1.0}, {"chin_fold": 1.0}, {"chin": 0.75, "jaw_corner": 0.25},
        {"chin_bottom": 0.5, "jaw_corner": 0.5}, {"chin_fold": 0.6, "mouth_corner": 0.2, "jaw_corner": 0.2},
    ),
}  # fmt: skip

LID_EDGE = 3.5  # mm round the edge of a lid where no marker holds
LIP_EDGE = 3.0  # mm; where the lips are nearer to each other than this, they touch


def face_regions(
    rig: Rig, least: float = 0.5, *, landmarks: FaceLandmarks | None = None
) -> dict[str, NDArray[np.int64]]:
    """Part the moving skin into brows, lids, nose, cheeks, lips and chin.

    A vertex belongs to the region of the nearest of some 70 seeds, which are landmarks and places between them, on the
    unrolled face. The inside of mouth, nostrils and lids goes with the skin before it.

    Parameters
    ----------
    rig
        The face.
    least
        Vertices that no shape moves by more than this, mm, are left out.
    landmarks
        The rig's landmarks, where they were found before.

    Returns
    -------
    Vertex numbers of each of :data:`REGIONS`, sorted; disjoint, together all moving vertices of the skin.

    Raises
    ------
    InputError
        If a landmark cannot be found.
    """
    found = FaceLandmarks(rig) if landmarks is None else landmarks
    seeds, owner = [], []
    for number, region in enumerate(REGIONS):
        for mix in _SEEDS[region]:
            for place in _places(found, mix):
                seeds.append(place)
                owner.append(number)
    moving = np.flatnonzero(found.surface.skin & (np.linalg.norm(rig.deltas, axis=2).max(axis=0) > least))
    _, nearest = KDTree(np.array(seeds)).query(found.unroll(rig.neutral[moving]))
    region_of = np.array(owner)[nearest]
    return {region: moving[region_of == number] for number, region in enumerate(REGIONS)}


def forbidden_vertices(rig: Rig, *, landmarks: FaceLandmarks | None = None) -> dict[str, NDArray[np.int64]]:
    """Return the vertices that can carry no marker, by reason.

    Returns
    -------
    ``lids``: the closing part of the upper lids and all within 3.5 mm of a lid's edge; ``inner_lips``: where the lips
    touch each other; ``hidden``: inside mouth, nostrils and sockets, under hair, and every part that is not skin.
    Sorted; mouth and eye corners stay free.

    Raises
    ------
    InputError
        If a landmark cannot be found.
    """
    found = FaceLandmarks(rig) if landmarks is None else landmarks
    return {
        "lids": np.flatnonzero(_on_lids(found)),
        "inner_lips": np.flatnonzero(_between_lips(found)),
        "hidden": np.flatnonzero(~found.outside),
    }


def _places(found: FaceLandmarks, mix: dict[str, float]) -> list[NDArray[np.floating[Any]]]:
    """Return a seed's places on the unrolled face: one on the midline, or one on each side."""
    sides = ("",) if all(name in MIDDLE for name in mix) else ("_left", "_right")
    out = []
    for side in sides:
        points = np.stack([found.position(name if name in MIDDLE else name + side) for name in mix])
        out.append(np.array(list(mix.values())) @ found.unroll(points))
    return out


def _on_lids(found: FaceLandmarks) -> NDArray[np.bool_]:
    points, out = found.rig.neutral, np.zeros(found.rig.n_vertices, dtype=bool)
    for side in ("left", "right"):
        inner, outer, upper, lower = (
            found.position(f"{name}_{side}") for name in ("eye_inner", "eye_outer", "lid_upper", "lid_lower")
        )
        share = (points[:, 0] - inner[0]) / (outer[0] - inner[0])
        within = found.surface.skin & (share > 0.05) & (share < 0.95) & (points[:, 2] > inner[2] - found.width / 4)
        far = found.moves.distance("eyeBlink", side.title()) * within
        closes = far > 0.5 * float(far[found.vertex(f"lid_upper_{side}")])
        # The edges as parabolas through the corners and the lids' middles.
        arch = 4 * share * (1 - share)
        line = inner[1] + share * (outer[1] - inner[1])
        centre = 0.5 * (inner[1] + outer[1])
        top, bottom = line + arch * (upper[1] - centre), line + arch * (lower[1] - centre)
        near = (points[:, 1] < top + LID_EDGE) & (points[:, 1] > bottom - LID_EDGE)
        out |= within & (closes | near)
    return out


def _between_lips(found: FaceLandmarks) -> NDArray[np.bool_]:
    rig, low = found.rig, found.lower_lip
    flat = found.unroll(rig.neutral)
    corners = np.stack([found.position("mouth_corner_left"), found.position("mouth_corner_right")])
    ends = found.unroll(corners)[:, 0]
    upper, lower = found.position("lip_upper_border"), found.position("lip_lower_border")
    tall = upper[1] - lower[1]
    mouth = found.surface.skin & (flat[:, 0] < ends.max()) & (flat[:, 0] > ends.min())
    mouth &= (rig.neutral[:, 1] < upper[1] + tall) & (rig.neutral[:, 1] > lower[1] - tall)
    out = np.zeros(rig.n_vertices, dtype=bool)
    for one, other in ((mouth & low, mouth & ~low), (mouth & ~low, mouth & low)):
        numbers = np.flatnonzero(one)
        if len(numbers) and other.any():
            away, _ = KDTree(rig.neutral[other]).query(rig.neutral[numbers])
            out[numbers[away < LIP_EDGE]] = True
    beside, _ = KDTree(corners).query(rig.neutral)
    return out & (beside > LIP_EDGE)
