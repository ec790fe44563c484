"""The bare head as an implicit surface: smooth unions of a few ellipsoids and tapered capsules.

The surface is where :func:`head_distance` is zero; it is negative inside. The head is symmetric because every
primitive is evaluated at ``(|x|, y, z)``. Eyes are at the height ``y = 0``, the ear axis near ``z = 0``; mm.
The union of primitives with a polynomial smooth minimum is the usual way to sculpt with distance functions
(Wyvill et al. 1986 blend potentials in the same spirit).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Distances = NDArray[np.float64]
Components = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

EYE_CENTRE = np.array([31.8, 0.0, 61.6])
EYE_RADIUS = 16.5
LID_RADIUS = EYE_RADIUS + 2.0


def ellipsoid(p: Components, centre: tuple[float, float, float], radii: tuple[float, float, float]) -> Distances:
    """Return the first-order distance to an ellipsoid, ``f (f − 1) / |∇f| f`` with ``f = |(p − c) / r|``, mm."""
    x, y, z = ((value - c) / r for value, c, r in zip(p, centre, radii, strict=True))
    f = np.sqrt(x * x + y * y + z * z) + 1e-9
    x, y, z = (value / r for value, r in zip((x, y, z), radii, strict=True))
    return f * (f - 1.0) / (np.sqrt(x * x + y * y + z * z) + 1e-9)


def tapered_capsule(
    p: Components, start: tuple[float, float, float], end: tuple[float, float, float], r0: float, r1: float
) -> Distances:
    """Return the distance to a line segment less a radius that runs from ``r0`` to ``r1``, mm."""
    ax, ay, az = (e - s for e, s in zip(end, start, strict=True))
    x, y, z = (value - s for value, s in zip(p, start, strict=True))
    along = np.clip((x * ax + y * ay + z * az) / (ax * ax + ay * ay + az * az), 0.0, 1.0)
    x, y, z = x - along * ax, y - along * ay, z - along * az
    return np.sqrt(x * x + y * y + z * z) - (r0 + (r1 - r0) * along)


def join(a: Distances, b: Distances, blend: float) -> Distances:
    """Return the union of two solids, rounded over ``blend`` mm."""
    h = np.clip(1.0 - np.abs(a - b) / blend, 0.0, 1.0)
    return np.minimum(a, b) - h * h * blend * 0.25


def carve(a: Distances, b: Distances, blend: float) -> Distances:
    """Return the first solid without the second, rounded over ``blend`` mm."""
    return -join(-a, b, blend)


def _skull(p: Components) -> Distances:
    head = ellipsoid(p, (0, 38, -10), (71, 76, 91))
    head = join(head, ellipsoid(p, (0, 30, 27), (62, 53, 58)), 26)  # forehead
    head = join(head, ellipsoid(p, (0, 6, -38), (58, 52, 52)), 30)  # back of the head
    head = join(head, ellipsoid(p, (0, -26, 22), (63, 79, 65)), 32)  # face
    head = join(head, tapered_capsule(p, (43, -56, 8), (11, -98, 66), 12.5, 12.5), 28)  # jaw line
    head = join(head, tapered_capsule(p, (0, -50, -22), (0, -150, -34), 42, 43), 24)  # neck
    head = join(head, tapered_capsule(p, (0, -195, -30), (90, -220, -40), 50, 30), 60)  # shoulders
    return head


def _face(p: Components, head: Distances) -> Distances:
    head = join(head, ellipsoid(p, (38, -31, 54), (21, 20, 21.5)), 28)  # cheek
    head = join(head, tapered_capsule(p, (9, 18, 73.5), (47, 20, 56), 9.5, 10.5), 22)  # brow ridge
    head = carve(head, ellipsoid(p, (33, -3, 94.5), (21, 12, 15.5)), 20)  # orbit
    head = carve(head, ellipsoid(p, (17, -3, 89.5), (5.0, 6.5, 13)), 12)  # beside the nose
    head = join(head, ellipsoid(p, (0, -71, 56), (31, 27, 36.5)), 24)  # muzzle
    head = join(head, ellipsoid(p, (0, -98, 71), (17, 14, 17)), 20)  # chin
    head = carve(head, tapered_capsule(p, (-12, -87, 104), (12, -87, 104), 8, 8), 14)
    return head


def _nose(p: Components, head: Distances) -> Distances:
    head = join(head, tapered_capsule(p, (0, 4, 73), (0, -33, 98), 6.6, 7.0), 18)  # bridge
    head = carve(head, ellipsoid(p, (0, 2, 106.0), (12, 10, 11)), 24)  # nasion
    head = join(head, ellipsoid(p, (0, -38, 101.5), (8.8, 8.4, 9.8)), 11)  # tip
    head = join(head, ellipsoid(p, (9.0, -43.0, 91.5), (5.6, 6.4, 9.2)), 9)  # ala
    head = join(head, tapered_capsule(p, (0, -44, 101), (0, -49.5, 88), 3.4, 4.2), 7)  # columella
    head = carve(head, ellipsoid(p, (5.6, -49.0, 96.0), (2.6, 3.8, 5.2)), 4)  # nostril
    return carve(head, tapered_capsule(p, (0, -55, 97.5), (0, -60, 98), 2.2, 2.6), 5)  # philtrum


def head_distance(points: Points) -> Distances:
    """Return the signed distance to the bare head.

    Parameters
    ----------
    points
        (..., 3) positions, mm.

    Returns
    -------
    (...,) distances in mm, negative inside; exact at the surface, first order away from it.
    """
    p = (np.abs(points[..., 0]), points[..., 1].copy(), points[..., 2].copy())
    head = _nose(p, _face(p, _skull(p)))
    x, y, z = EYE_CENTRE
    return join(head, ellipsoid(p, (x, y, z), (LID_RADIUS,) * 3), 7)  # closed lids over the eyeball


def head_normal(points: Points) -> Points:
    """Return the outward unit normals, (..., 3), by central differences over a tetrahedron."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.25
    gradient = sum(head_distance(points + c)[..., None] * c for c in corners)
    return gradient / (np.linalg.norm(gradient, axis=-1, keepdims=True) + 1e-12)


def project(points: Points, steps: int = 4) -> Points:
    """Return the points moved along the gradient onto the head's surface, (..., 3), mm."""
    moved = np.array(points, dtype=np.float64)
    for _ in range(steps):
        moved -= head_distance(moved)[..., None] * head_normal(moved)
    return moved


def cast(origins: Points, directions: Points, reach: float, steps: int = 40) -> Points:
    """Return where rays from outside first meet the head, (..., 3), mm.

    Rays start ``reach`` mm along ``directions`` from ``origins`` and run back towards the origins.
    """
    along = np.full(len(directions), float(reach))
    active = np.arange(len(directions))
    for _ in range(steps):
        gap = head_distance(origins[active] + along[active, None] * directions[active])
        along[active] = np.maximum(along[active] - 0.85 * gap, 0.0)
        active = active[(np.abs(gap) > 1e-4) & (along[active] > 0.0)]
        if len(active) == 0:
            break
    return origins + along[:, None] * directions
