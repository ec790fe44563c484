"""A plain cap of short hair and the ears: both keep still, and both give the eye its bearings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from .grids import Piece, grid_triangles
from .muscles import ramp
from .sculpture import head_normal
from .template import lift

Floats = NDArray[np.float64]

# azimuth from the front (degrees) and height (mm) of the hairline: forehead, temple, sideburn, over the ear, nape
_HAIRLINE = np.array(
    [[0, 65.5], [11, 68.5], [23, 70], [34, 65], [44, 54], [52, 42], [58, 31], [64, 22], [70, 13], [75, 1], [78, -6],
     [83, -8], [87, 3], [92, 11], [98, 11], [105, 2], [111, -12], [119, -26], [132, -40], [150, -48],
     [165, -51], [180, -52.0]]
)  # fmt: skip
# distance from the hairline (mm) of the rows that round the edge off; the first is under the skin
_EDGE = np.array([0.0, 1.6, 3.6, 7.0, 12.0])


def hair(rows: int = 24, columns: int = 40) -> Piece:
    """Return the left half of the hair: the skull's surface raised, thin at its edge, which is tucked in."""
    azimuth = np.radians(np.interp(np.linspace(0, 1, columns), [0, 0.44, 0.78, 1], [0, 70, 120, 180]))
    degrees = np.degrees(azimuth)
    v = np.linspace(0.0, 0.95, 160)
    grid = lift(np.repeat(azimuth, len(v)), np.tile(v, columns)).reshape(columns, len(v), 3)
    line = PchipInterpolator(*_HAIRLINE.T)(degrees)
    points, away = [], []
    for k in range(columns):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(grid[k], axis=0), axis=1))])
        end = np.interp(-line[k], -grid[k, :, 1], along)
        edge = end - _EDGE
        along_rows = np.concatenate([np.linspace(0.0, edge[-1], rows - len(_EDGE) + 1), edge[-2::-1]])
        points.append(np.stack([np.interp(along_rows, along, grid[k, :, i]) for i in range(3)], -1))
        away.append(end - along_rows)
    skull, d = np.stack(points, axis=1), np.stack(away, axis=1)  # (rows, columns, 3), (rows, columns)
    # cropped close at temple and nape, fuller in front and on top
    slope = np.interp(degrees, [0, 40, 80, 120, 180], [16.0, 22.0, 40.0, 55.0, 60.0])
    rim = np.interp(degrees, [0, 50, 75, 180], [1.3, 1.1, 0.8, 0.8])
    raised = -2.0 + (rim + 2.0) * ramp(d, -1.0, 2.6) + (9.0 - rim) * (1 - np.exp(-d / slope))
    # combed back: faint waves that run from the hairline to the crown
    raised = raised + 0.35 * np.sin(azimuth * 13) * ramp(d, 6.0, 30.0) * (1 - ramp(d, 60.0, 120.0))
    normal = head_normal(skull.reshape(-1, 3)).reshape(skull.shape)
    hair_points = skull + raised[..., None] * normal
    hair_points[:, [0, -1], 0] = 0.0
    vertices = np.concatenate([hair_points[1:].reshape(-1, 3), [[0.0, hair_points[0, 0, 1], hair_points[0, 0, 2]]]])
    numbers = np.arange((rows - 1) * columns).reshape(rows - 1, columns)
    crown = np.full(columns - 1, len(vertices) - 1)
    fan = np.stack([crown, numbers[0, :-1], numbers[0, 1:]], -1)
    return vertices, np.concatenate([grid_triangles(numbers)[:, ::-1], fan])


def ear(rings: int = 15, steps: int = 24) -> Piece:
    """Return the left ear: rim, fold, bowl and lobe as rings of a shallow dish, its back running into the head."""
    around = np.linspace(0, 2 * np.pi, steps, endpoint=False)  # 0 backwards, a quarter up
    back, up = np.cos(around), np.sin(around)
    outline_back = np.where(back > 0, 17.0 + 3.0 * up, 12.5) * back
    outline_up = 29.0 * up
    outline_back = outline_back * np.where(up < 0, 1 - 0.26 * up**2, 1.0)
    forward = ramp(-back, 0.1, 0.75) * ramp(up, -1.0, 0.15)  # the rim dives into the cheek in front
    lobe = ramp(-up, 0.45, 0.85)
    rho = np.array([0.0, 0.14, 0.28, 0.40, 0.50, 0.60, 0.70, 0.79, 0.87, 0.94, 1.0, 1.02, 0.95, 0.82, 0.6])[:rings]
    flat = np.array([-5.5, -5.2, -4.2, -1.0, 1.8, 2.4, 1.2, 0.3, 1.3, 2.6, 2.0, 0.2, -1.8, -8.0, -27.0])[:rings]
    grid = np.empty((rings, steps, 3))
    for k in range(rings):
        rise = flat[k] + 0.0 * around
        smooth_lobe = 0.8 + (1.2 if k < 11 else 0.0)
        if 2 < k < 11:
            rise = rise * (1 - lobe) + (smooth_lobe - 0.06 * (k - 5) ** 2) * lobe
            rise = rise - forward * (2.0 + 5.0 * rho[k] ** 2)
        elif k >= 11:
            rise = rise - forward * 7.5
        a = 0.5 + outline_back * rho[k] - 1.5 * (1 - rho[k])
        b = outline_up * rho[k] - 4.0 * (1 - rho[k])
        grid[k] = np.stack([rise, b, a], -1)
    lean, flare = np.radians(11.0), np.radians(24.0)
    rise, b, a = grid[..., 0], grid[..., 1], grid[..., 2]
    a, b = a * np.cos(lean) + b * np.sin(lean), b * np.cos(lean) - a * np.sin(lean)
    x = 70.5 + rise * np.cos(flare) + (a + 6.0) * np.sin(flare)
    z = -6.0 - a * np.cos(flare) + rise * np.sin(flare)
    y = -10.0 + b
    vertices = np.stack([x, y, z], -1)
    numbers = 1 + np.arange((rings - 1) * steps).reshape(rings - 1, steps)
    points = np.concatenate([vertices[0, :1], vertices[1:].reshape(-1, 3)])
    fan = np.stack([np.zeros(steps, int), numbers[0], np.roll(numbers[0], -1)], -1)
    triangles = np.concatenate([fan, grid_triangles(numbers, closed=True)[:, ::-1]])
    return points, triangles
