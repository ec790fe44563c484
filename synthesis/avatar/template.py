"""The left half of the skin as a triangle mesh: loops around eye and mouth, even triangles elsewhere.

A coarse mesh is laid out once and subdivided once. Around the eye and around the mouth it is a grid of *rings*
(0 inside the opening, the last one outside on the cheek) and *turns* (steps along a ring), so that lids and lips
have clean loops and positions there are plain functions of (ring, turn). The rest is a Poisson-disc sample of the
surface, triangulated on a flat chart and relaxed on the surface under a size field.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from . import lids, lips
from .grids import grid_triangles
from .sculpture import cast, project

SURFACE, EYE, MOUTH = 0, 1, 2
NECK_BASE = -165.0

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class HalfSkin:
    """Left half (x ≥ 0) of the skin: positions (n, 3), triangles, and per vertex zone, ring and turn."""

    vertices: Floats
    triangles: Ints
    zone: Ints
    ring: Floats
    turn: Floats
    midline: NDArray[np.bool_]


def _ray(v: Floats) -> tuple[Floats, Floats]:
    """Return height of a ray's origin on the head's axis (mm) and its elevation (rad) for 0 (crown) ≤ v ≤ 1 (neck)."""
    low = np.clip((v - 0.62) / 0.38, 0.0, 1.0)
    slide = low**1.3
    elevation = np.where(v < 0.62, 90.0 - 138.0 * v / 0.62, -48.0 * (1.0 - slide))
    return 35.0 + (NECK_BASE - 35.0) * slide, np.radians(elevation)


_AXIS_DEPTH = -6.0


def lift(azimuth: Floats, v: Floats) -> Floats:
    """Return the surface points that lie on the rays (azimuth from the front, v)."""
    height, elevation = _ray(v)
    zero = np.zeros_like(height)
    origin = np.stack([zero, height, zero + _AXIS_DEPTH], -1)
    flat = np.cos(elevation)
    direction = np.stack([np.sin(azimuth) * flat, np.sin(elevation), np.cos(azimuth) * flat], -1)
    return cast(origin, direction, reach=190.0)


def _unlift(points: Floats) -> tuple[Floats, Floats]:
    """Return (azimuth, v) of points near the surface, by bisection along v."""
    azimuth = np.arctan2(points[:, 0], points[:, 2] - _AXIS_DEPTH)
    away = np.hypot(points[:, 0], points[:, 2] - _AXIS_DEPTH)
    low, high = np.zeros(len(points)), np.ones(len(points))
    for _ in range(40):
        middle = 0.5 * (low + high)
        height, elevation = _ray(middle)
        above = np.cos(elevation) * (points[:, 1] - height) - np.sin(elevation) * away > 0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return azimuth, 0.5 * (low + high)


class _Chart:
    """Flat chart of the half head: polar, crown at the origin, near-conformal on the side of the head."""

    def __init__(self) -> None:
        self.v = np.linspace(0.01, 1.0, 200)
        profile = lift(np.full(200, np.pi / 2), self.v)
        steps = np.linalg.norm(np.diff(profile, axis=0), axis=1)
        across = np.abs(profile[:-1, 0] + profile[1:, 0]) / 2
        self.log_radius = np.concatenate([[0.0], np.cumsum(steps / across)])

    def __call__(self, points: Floats) -> Floats:
        azimuth, v = _unlift(points)
        radius = np.exp(np.interp(v, self.v, self.log_radius)) * np.minimum(v / 0.01, 1.0)
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], -1)


def target_size(points: Floats) -> Floats:
    """Return the wished edge length of the coarse mesh, mm: fine on nose and face, wide on skull and neck."""

    def near(centre: tuple[float, float, float], inner: float, outer: float) -> Floats:
        return np.clip((np.linalg.norm(points - np.array(centre), axis=-1) - inner) / (outer - inner), 0.0, 1.0)

    size = 6.4 + 14.6 * near((0, -28, 92), 64, 190)
    hidden = np.clip((points[..., 1] - 74.0) / 12.0, 0, 1) + np.clip((-30.0 - points[..., 2]) / 25.0, 0, 1)
    size = size + 9.0 * np.minimum(hidden, 1.0) * (points[..., 1] > -45)
    size = np.minimum(size, 4.0 + 29.0 * near((9, -44, 94), 13, 124))
    return size


def _sample(chart: _Chart, fixed: Floats, keep_out: list[Floats], rng: np.random.Generator) -> Floats:
    """Return a Poisson-disc sample of the open surface that keeps its distance from the fixed points."""
    azimuth, v = np.meshgrid(np.linspace(0, np.pi, 110), np.linspace(0.012, 0.995, 150), indexing="ij")
    grid = lift(azimuth.ravel(), v.ravel())
    size = target_size(grid)
    # many candidates per cell where the mesh is fine
    copies = np.repeat(np.arange(len(grid)), np.where(size < 6, 6, np.where(size < 9, 2, 1)))
    jitter = rng.uniform(-0.5, 0.5, (len(copies), 2))
    shape = azimuth.shape
    i, j = np.unravel_index(copies, shape)
    f, g = np.clip(i + jitter[:, 0], 0, shape[0] - 1.001), np.clip(j + jitter[:, 1], 0, shape[1] - 1.001)
    i, j = f.astype(int), g.astype(int)
    f, g = (f - i)[:, None], (g - j)[:, None]
    table = grid.reshape(*shape, 3)
    points = (
        table[i, j] * (1 - f) * (1 - g)
        + table[i + 1, j] * f * (1 - g)
        + table[i, j + 1] * (1 - f) * g
        + table[i + 1, j + 1] * f * g
    )
    points = points[rng.permutation(len(points))]
    flat = chart(points)
    allowed = points[:, 0] > 0.35 * target_size(points)
    for polygon in keep_out:
        allowed &= ~_inside(flat, polygon)
    points = points[allowed]
    size = target_size(points) * 0.74
    taken = np.empty((len(fixed) + len(points), 3))
    taken[: len(fixed)] = fixed
    count = len(fixed)
    for point, wish in zip(points, size, strict=True):
        if ((taken[:count] - point) ** 2).sum(1).min() > wish * wish:
            taken[count] = point
            count += 1
    return taken[len(fixed) : count]


def _inside(points: Floats, polygon: Floats) -> NDArray[np.bool_]:
    """Say which flat points lie inside a polygon (crossing number)."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    return (crosses & (x < at)).sum(1) % 2 == 1


def _spaced(path: Floats) -> Floats:
    """Return points along a dense path, spaced by the size field, both ends kept."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    count = np.concatenate([[0.0], np.cumsum(steps / target_size((path[1:] + path[:-1]) / 2))])
    whole = max(round(float(count[-1])), 1)
    wanted = np.linspace(0.0, count[-1], whole + 1)
    return np.stack([np.interp(wanted, count, path[:, k]) for k in range(3)], -1)


def _edges(triangles: Ints) -> tuple[Ints, Ints]:
    """Return inner edges as (n, 4) vertex numbers (start, end, apex left, apex right) and their (n, 2) triangles."""
    start, end, apex = (triangles[:, order].ravel() for order in ([0, 1, 2], [1, 2, 0], [2, 0, 1]))
    face = np.repeat(np.arange(len(triangles)), 3)
    forward = start < end
    order_f = np.lexsort((end[forward], start[forward]))
    order_b = np.lexsort((start[~forward], end[~forward]))
    f, b = np.flatnonzero(forward)[order_f], np.flatnonzero(~forward)[order_b]
    size = int(triangles.max()) + 1
    _, at_f, at_b = np.intersect1d(start[f] * size + end[f], end[b] * size + start[b], return_indices=True)
    f, b = f[at_f], b[at_b]
    return np.stack([start[f], end[f], apex[f], apex[b]], -1), np.stack([face[f], face[b]], -1)


def _flip(vertices: Floats, triangles: Ints, locked: set[tuple[int, int]]) -> Ints:
    """Return the triangles after flipping edges whose opposite angles exceed a half turn (Delaunay on the surface)."""
    triangles = triangles.copy()
    for _ in range(6):
        edges, faces = _edges(triangles)
        a, b, c, d = (vertices[edges[:, k]] for k in range(4))
        across = [
            np.arctan2(np.linalg.norm(np.cross(a - apex, b - apex), axis=1), ((a - apex) * (b - apex)).sum(1))
            for apex in (c, d)
        ]
        # the two triangles that would replace them must face the same way
        up = np.cross(b - a, c - a)
        turns = ((np.cross(a - c, d - c) * up).sum(1) > 0) & ((np.cross(b - d, c - d) * up).sum(1) > 0)
        present = set(map(tuple, np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).tolist()))
        touched: set[int] = set()
        flips = 0
        for e in np.flatnonzero((across[0] + across[1] > 3.17) & turns):
            start, end, left, right = (int(x) for x in edges[e])
            first, second = (int(x) for x in faces[e])
            joined = (min(left, right), max(left, right))
            if (start, end) in locked or joined in present or first in touched or second in touched:
                continue
            triangles[first], triangles[second] = (left, start, right), (right, end, left)
            present.add(joined)
            touched.update((first, second))
            flips += 1
        if flips == 0:
            break
    return triangles


def _relax(
    vertices: Floats, triangles: Ints, free: NDArray[np.bool_], midline: NDArray[np.bool_], pull: float
) -> Floats:
    """Return the vertices after one step towards the size-weighted centroids of their triangles, on the surface."""
    corners = vertices[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    centre = corners.mean(1)
    weight = area / target_size(centre) ** 2.0
    total = np.bincount(triangles.ravel(), np.repeat(weight, 3), len(vertices))[:, None]
    mean = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(weight * centre[:, k], 3), len(vertices)) for k in range(3)], -1
    )
    moved = np.where(free[:, None], vertices + pull * (mean / np.maximum(total, 1e-12) - vertices), vertices)
    moved[free] = project(moved[free], steps=2)
    moved[midline, 0] = 0.0
    return moved


def _subdivide(triangles: Ints, n_vertices: int) -> tuple[Ints, Ints]:
    """Return the four-to-one subdivided triangles and the (edge, 2) parents of the new vertices."""
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, which = np.unique(pairs, axis=0, return_inverse=True)
    m = which.reshape(-1, 3) + n_vertices
    a, b, c = triangles.T
    ab, bc, ca = m.T
    fine = np.concatenate([np.stack(t, -1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return fine, edges


def build_half_skin(rng: np.random.Generator | None = None) -> HalfSkin:
    """Return the left half of the skin in the neutral base face.

    The layout depends on ``rng`` only through the sample of the open surface; by default it is the same every time.
    """
    rng = np.random.default_rng(7) if rng is None else rng
    chart = _Chart()
    eye_ring, eye_turn = (g.ravel() for g in np.meshgrid(np.arange(lids.RINGS), np.arange(lids.TURNS), indexing="ij"))
    lip_ring, lip_turn = (
        g.ravel() for g in np.meshgrid(np.arange(lips.RINGS), np.arange(lips.TURNS + 1), indexing="ij")
    )
    eye = lids.surface(eye_ring.astype(float), eye_turn.astype(float))
    mouth = lips.surface(lip_ring.astype(float), lip_turn.astype(float))
    n_eye, n_mouth = len(eye), len(mouth)
    outer_eye, outer_mouth = eye[-lids.TURNS :], mouth[-(lips.TURNS + 1) :]

    # the midline from the mouth's top over the crown to the neck, and from its bottom down the throat
    front, back = lift(np.zeros(600), np.linspace(0, 1, 600)), lift(np.full(400, np.pi), np.linspace(0, 1, 400))
    _, v_top = _unlift(outer_mouth[:1])
    _, v_bottom = _unlift(outer_mouth[-1:])
    rim = _spaced(lift(np.linspace(0, np.pi, 300), np.ones(300)))
    upper = _spaced(np.concatenate([back[::-1], front[np.linspace(0, 1, 600) < v_top[0]][1:], outer_mouth[:1]]))
    lower = _spaced(np.concatenate([outer_mouth[-1:], front[np.linspace(0, 1, 600) > v_bottom[0]]]))
    rim[0], rim[-1] = lower[-1], upper[0]
    border = np.concatenate([upper[:-1], lower[1:], rim[1:-1]])
    border[: len(upper) + len(lower) - 2, 0] = 0.0

    ring_points = np.concatenate([outer_eye, outer_mouth])
    keep_out = [chart(outer_eye), np.concatenate([chart(outer_mouth), chart(outer_mouth[:1] * [0, 1, 1])])]
    open_points = _sample(chart, np.concatenate([ring_points, border]), keep_out, rng)
    vertices = np.concatenate([eye, mouth, border, open_points])
    n_border = len(border)

    outer = np.concatenate(
        [np.arange(n_eye - lids.TURNS, n_eye), np.arange(n_eye + n_mouth - lips.TURNS - 1, n_eye + n_mouth)]
    )
    flat_numbers = np.concatenate([outer, np.arange(n_eye + n_mouth, len(vertices))])
    flat = chart(vertices[flat_numbers])
    flat[np.abs(vertices[flat_numbers, 0]) < 1e-9, 1] = 0.0
    triangles = Delaunay(flat).simplices
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    middle = (a + b + c) / 3
    holes = [flat[: lids.TURNS], flat[lids.TURNS : len(outer)]]
    good = (np.abs(area) > 1e-9) & ~_inside(middle, holes[0]) & ~_inside(middle, holes[1])
    triangles = flat_numbers[triangles[good]]

    midline = np.abs(vertices[:, 0]) < 1e-9
    zone = np.full(len(vertices), SURFACE)
    zone[:n_eye], zone[n_eye : n_eye + n_mouth] = EYE, MOUTH
    ring, turn = np.full(len(vertices), -1.0), np.full(len(vertices), -1.0)
    ring[: n_eye + n_mouth] = np.concatenate([eye_ring, lip_ring])
    turn[: n_eye + n_mouth] = np.concatenate([eye_turn, lip_turn])
    on_rim = np.zeros(len(vertices), bool)
    on_rim[n_eye + n_mouth + len(upper) + len(lower) - 2 : n_eye + n_mouth + n_border] = True
    on_rim[[n_eye + n_mouth, n_eye + n_mouth + len(upper) + len(lower) - 3]] = True
    free = (zone == SURFACE) & ~on_rim
    ends = np.sort(np.stack([outer[: lids.TURNS], np.roll(outer[: lids.TURNS], -1)], -1), axis=1)
    locked = {(int(p), int(q)) for p, q in ends} | {(int(p), int(p) + 1) for p in outer[lids.TURNS : -1]}
    for step in range(24):
        if step % 4 == 0:
            triangles = _flip(vertices, triangles, locked)
        vertices = _relax(vertices, triangles, free, midline & free, 0.7)
    triangles = _flip(vertices, triangles, locked)

    eye_numbers = np.arange(n_eye).reshape(lids.RINGS, lids.TURNS)
    mouth_numbers = n_eye + np.arange(n_mouth).reshape(lips.RINGS, lips.TURNS + 1)
    coarse = np.concatenate([triangles, grid_triangles(eye_numbers, closed=True), grid_triangles(mouth_numbers)])
    return _refine(vertices, coarse, zone, ring, turn, midline, on_rim)


def _blend_borders(
    vertices: Floats, triangles: Ints, zone: Ints, ring: Floats, midline: NDArray[np.bool_], steps: int = 4
) -> Floats:
    """Smooth the outermost loops and the skin next to them, where lids and lips pass into the face."""
    i, j = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    i, j = np.concatenate([i, j]), np.concatenate([j, i])
    outer = ((zone == EYE) & (ring >= 3.5)) | ((zone == MOUTH) & (ring >= 6.0))
    beside = np.zeros(len(vertices), bool)
    beside[j[outer[i] & (zone[j] == SURFACE)]] = True
    beside[j[beside[i] & (zone[j] == SURFACE)]] = True
    free = outer | beside
    count = np.bincount(i, minlength=len(vertices))[:, None]
    for _ in range(steps):
        mean = np.stack([np.bincount(i, vertices[j, k], len(vertices)) for k in range(3)], -1) / count
        vertices = np.where(free[:, None], 0.5 * vertices + 0.5 * mean, vertices)
        vertices[midline, 0] = 0.0
    return vertices


def _refine(
    vertices: Floats,
    coarse: Ints,
    zone: Ints,
    ring: Floats,
    turn: Floats,
    midline: NDArray[np.bool_],
    on_rim: NDArray[np.bool_],
) -> HalfSkin:
    """Subdivide once and put every new vertex on its own surface."""
    triangles, edges = _subdivide(coarse, len(vertices))
    p, q = edges.T
    apart = np.abs(turn[p] - turn[q])
    wraps = (zone[p] == EYE) & (apart > lids.TURNS / 2)
    same = (zone[p] == zone[q]) & ((apart <= 1) | wraps)
    zone = np.concatenate([zone, np.where(same, zone[p], SURFACE)])
    turn_between = np.where(wraps, ((turn[p] + turn[q] + lids.TURNS) / 2) % lids.TURNS, (turn[p] + turn[q]) / 2)
    in_zone = same & (zone[p] != SURFACE)
    ring = np.concatenate([ring, np.where(in_zone, (ring[p] + ring[q]) / 2, -1.0)])
    turn = np.concatenate([turn, np.where(in_zone, turn_between, -1.0)])
    midline = np.concatenate([midline, midline[p] & midline[q]])
    # an edge between two midline vertices across the mouth opening would not be on the midline
    on_rim = np.concatenate([on_rim, on_rim[p] & on_rim[q]])
    vertices = np.concatenate([vertices, (vertices[p] + vertices[q]) / 2])
    vertices[zone == EYE] = lids.surface(ring[zone == EYE], turn[zone == EYE])
    vertices[zone == MOUTH] = lips.surface(ring[zone == MOUTH], turn[zone == MOUTH])
    surface = zone == SURFACE
    vertices[surface] = project(vertices[surface], steps=3)
    vertices[on_rim, 1] = NECK_BASE
    vertices[midline, 0] = 0.0
    for _ in range(6):
        vertices = _relax(vertices, triangles, surface & ~on_rim, midline & surface, 0.5)
    vertices = _blend_borders(vertices, triangles, zone, ring, midline)
    inner, _ = _edges(triangles)
    p, q = inner[:, :2].T
    loops = inner[(zone[p] == zone[q]) & (zone[p] != SURFACE) & (ring[p] == ring[q]), :2]
    triangles = _flip(vertices, triangles, set(map(tuple, loops.tolist())))
    return HalfSkin(vertices, triangles, zone, ring, turn, midline)
