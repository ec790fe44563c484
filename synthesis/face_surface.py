"""The skin of a rig: which vertices belong to it, which can be seen, where its middle is, how it unrolls.

A rig may hold eyeballs, teeth, lashes and hair beside the skin, and the skin may run on into mouth, nostrils and eye
sockets. A marker can only sit on skin that can be seen, so everything that places one asks here first. Axes are the
rig's: +X the subject's left, +Y up, +Z out of the face.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ..errors import RigError
from .rig import Rig

Array = NDArray[np.floating[Any]]
Indices = NDArray[np.int64]

WELD = 1e-5
"""Vertices nearer than this share of the mesh's size are one point of the surface (files split them along seams)."""

STILL_SHARE = 0.01
"""A shape moves a part of the mesh where it moves some vertex of it by more than this share of its greatest motion."""

YAWS = (0.0, -40.0, 40.0, -80.0, 80.0)  # degrees: the sides from which a face is looked at
COVER = 4.0  # mm; what lies farther before the skin covers it: hair, a cap
PIXELS = 180  # across the skin, for the test of what hides what


@dataclass(frozen=True)
class FaceSurface:
    """The skin of a rig.

    Parameters
    ----------
    skin
        (n_vertices,) whether a vertex belongs to the skin.
    visible
        (n_vertices,) whether it is skin that can be seen from the front or a side, and no hair covers it.
    middle
        x of the plane of symmetry, mm.
    mirror
        (n_vertices,) the vertex nearest each vertex's mirror image: skin for skin, and other parts for other parts.
    mirror_gap
        (n_vertices,) how far, mm, that vertex is from the mirror image.
    normals
        (n_vertices, 3) outward unit normals; 0 where a vertex is in no triangle.
    links
        (n_vertices, n_vertices) 1 for every edge, and between vertices in the same place.
    """

    skin: NDArray[np.bool_]
    visible: NDArray[np.bool_]
    middle: float
    mirror: Indices
    mirror_gap: Array
    normals: Array
    links: csr_array

    @property
    def symmetric(self) -> bool:
        """Whether nearly every vertex of the skin has a partner on the other side."""
        size = float(np.median(self.mirror_gap[self.skin]))
        return size < 0.5 and float(np.percentile(self.mirror_gap[self.skin], 95)) < 1.5


def find_face_surface(rig: Rig) -> FaceSurface:
    """Return the skin of a rig.

    The skin is the connected part that the most shapes move; of several, the largest.

    Raises
    ------
    RigError
        If the mesh has no triangles, or no shape moves anything.
    """
    if not len(rig.triangles):
        raise RigError("rig: it has no triangles; the skin cannot be told from other parts")
    links = _link(rig)
    skin = _find_skin(rig, links)
    normals = _normals(rig)
    middle, mirror, gap = _mirror(rig, skin)
    return FaceSurface(skin, _see(rig, skin, normals), middle, mirror, gap, normals, links)


def mirror_vertices(rig: Rig, tolerance: float = 3.0) -> Indices:
    """Return the number of the vertex nearest each vertex's mirror image, −1 where none is within ``tolerance`` mm.

    The plane of symmetry is x = constant, wherever the skin is most symmetric. Skin is paired with skin. A vertex on
    the plane is its own partner. On a mesh whose two sides differ the map need not be its own inverse.

    Returns
    -------
    (n_vertices,) int64.
    """
    if not len(rig.triangles):
        raise RigError("rig: it has no triangles; the skin cannot be told from other parts")
    _, mirror, gap = _mirror(rig, _find_skin(rig, _link(rig)))
    return np.where(gap <= tolerance, mirror, -1)


def unroll(points: Array, axis: tuple[float, float], radius: float) -> Array:
    """Unroll points from a cylinder round the head, (n, 2): arc length from the middle of the face, and height, mm.

    Parameters
    ----------
    points
        (n, 3), mm.
    axis
        x and z of the vertical axis of the cylinder.
    radius
        Its radius, mm: arcs are measured there.
    """
    angle = np.arctan2(points[:, 0] - axis[0], points[:, 2] - axis[1])
    return np.stack([radius * angle, points[:, 1]], axis=1)


def _link(rig: Rig) -> csr_array:
    """Return 1 for every edge and for every pair of vertices in one place."""
    triangles, n = rig.triangles, rig.n_vertices
    ends = [triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]
    size = float(np.ptp(rig.neutral, axis=0).max())
    ends.append(KDTree(rig.neutral).query_pairs(WELD * size, output_type="ndarray").astype(np.int64))
    pairs = np.concatenate(ends)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    links = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    links.data[:] = 1.0
    return links


def _find_skin(rig: Rig, links: csr_array) -> NDArray[np.bool_]:
    count, part = connected_components(links, directed=False)
    moved = np.linalg.norm(rig.deltas, axis=2)
    greatest = moved.max(axis=1)
    if not greatest.any():
        raise RigError("rig: no shape moves any vertex; its skin cannot be told from other parts")
    shapes = np.zeros(count)
    for share, top in zip(moved, greatest, strict=True):
        reached = np.zeros(count)
        np.maximum.at(reached, part, share)
        shapes += (reached > STILL_SHARE * top) & (top > 0)
    corners = rig.neutral[rig.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    area = np.bincount(part[rig.triangles[:, 0]], areas, minlength=count)
    # Parts that half of the shapes or more move are faces; skin is the largest of them, whatever brows and lips do.
    often = shapes >= 0.6 * shapes.max()
    return part == int(np.argmax(np.where(often, area, -1.0)))


def _normals(rig: Rig) -> Array:
    corners = rig.neutral[rig.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(rig.neutral)
    for i in range(3):
        np.add.at(normals, rig.triangles[:, i], across)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)


def _mirror(rig: Rig, skin: NDArray[np.bool_]) -> tuple[float, Indices, Array]:
    """Find the plane of symmetry of the skin by closest points, and every vertex's partner."""
    points = rig.neutral[skin]
    tree = KDTree(points)
    best = (np.inf, 0.0)
    for middle in (0.0, float(points[:, 0].min() + points[:, 0].max()) / 2):
        for _ in range(10):
            gaps, nearest = tree.query(points * [-1, 1, 1] + [2 * middle, 0, 0])
            near = gaps <= np.median(gaps) + 1e-12
            step = float(np.mean(points[near, 0] + points[nearest[near], 0]) / 2) - middle
            middle += step
            if abs(step) < 1e-4:
                break
        best = min(best, (float(np.median(gaps)), middle))
    middle = best[1]
    mirror, gap = np.arange(rig.n_vertices), np.zeros(rig.n_vertices)
    for group in (skin, ~skin):
        numbers = np.flatnonzero(group)
        if len(numbers):
            here = rig.neutral[numbers]
            away, nearest = KDTree(here).query(here * [-1, 1, 1] + [2 * middle, 0, 0])
            mirror[numbers], gap[numbers] = numbers[nearest], away
    return middle, mirror, gap


def _see(rig: Rig, skin: NDArray[np.bool_], normals: Array) -> NDArray[np.bool_]:
    """Test which vertices of the skin nothing hides from some side, by depth images.

    Other parts of the mesh may lie ``COVER`` before the skin: brows and lashes do, and are no obstacle to a marker.
    """
    on_skin = skin[rig.triangles].all(axis=1)
    size = float(np.ptp(rig.neutral[skin], axis=0)[:2].max())
    pixel = size / PIXELS
    samples = _sample(rig.neutral[rig.triangles[on_skin]], 0.75 * pixel)
    others = _sample(rig.neutral[rig.triangles[~on_skin]], 0.75 * pixel)
    seen = np.zeros(rig.n_vertices, dtype=bool)
    for yaw in np.radians(YAWS):
        right, out = np.array([np.cos(yaw), 0, -np.sin(yaw)]), np.array([np.sin(yaw), 0, np.cos(yaw)])
        turn = np.stack([right, [0.0, 1.0, 0.0], out], axis=1)
        points, facing = rig.neutral @ turn, normals @ out
        # On a slope the depth changes within one pixel.
        slack = pixel * (1.0 + np.sqrt(np.clip(1 - facing**2, 0, 1)) / np.maximum(facing, 0.2))
        free = skin & (facing > 0.05) & (points[:, 2] >= _depth(samples @ turn, points, pixel) - slack)
        free &= points[:, 2] >= _depth(others @ turn, points, pixel) - slack - COVER
        seen |= free
    return seen


def _depth(samples: Array, points: Array, pixel: float) -> Array:
    """Return the depth image of some samples (n, 3) at the places of ``points``; −inf where there is nothing."""
    if not len(samples):
        return np.full(len(points), -np.inf)
    low = np.minimum(samples[:, :2].min(axis=0), points[:, :2].min(axis=0))
    cells = np.floor((samples[:, :2] - low) / pixel).astype(np.int64)
    places = np.floor((points[:, :2] - low) / pixel).astype(np.int64)
    width, height = np.maximum(cells.max(axis=0), places.max(axis=0)) + 1
    depth = np.full(width * height, -np.inf)
    np.maximum.at(depth, cells[:, 0] * height + cells[:, 1], samples[:, 2])
    return np.asarray(depth[places[:, 0] * height + places[:, 1]])


def _sample(corners: Array, step: float) -> Array:
    """Return points on triangles (T, 3, 3), no farther apart than about ``step``, (n, 3)."""
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(sides / step), 1, 60).astype(np.int64)
    out = [np.empty((0, 3))]
    for n in np.unique(parts):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
        inside = (i + j) <= n
        weights = np.stack([i[inside], j[inside], n - i[inside] - j[inside]], axis=1) / n
        out.append(np.einsum("wc,tcx->twx", weights, corners[parts == n]).reshape(-1, 3))
    return np.concatenate(out)
