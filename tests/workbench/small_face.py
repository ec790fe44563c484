"""A small face for tests of the workbench: a dome with four shapes and sixteen markers, moved by known weights."""

from pathlib import Path

import numpy as np
from mimique.corpus import write_take
from mimique.corpus.take import make_take
from mimique.synthesis import Rig
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

SHAPES = ("browUp", "mouthSmile_L", "mouthSmile_R", "jawOpen")
HEAD = ("HEAD1", "HEAD2", "HEAD3", "HEAD4")
RATE = 100.0


def make_rig() -> Rig:
    """A dome 160 mm wide, sampled on a grid."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-80, 80, 17), np.linspace(-100, 100, 21)))
    neutral = np.column_stack([x, y, 90 - 0.006 * (x**2 + y**2)])
    triangles = Delaunay(neutral[:, :2]).simplices
    turned = np.cross(*(neutral[triangles[:, k]] - neutral[triangles[:, 0]] for k in (1, 2)))[:, 2] < 0
    triangles[turned] = triangles[turned][:, ::-1]
    centres = {"browUp": (0, 50), "mouthSmile_L": (30, -40), "mouthSmile_R": (-30, -40), "jawOpen": (0, -70)}
    ways = {"browUp": (0, 9, 2), "mouthSmile_L": (7, 6, 1), "mouthSmile_R": (-7, 6, 1), "jawOpen": (0, -20, -4)}
    deltas = [
        np.exp(-((x - centres[s][0]) ** 2 + (y - centres[s][1]) ** 2) / 600)[:, None] * np.array(ways[s])
        for s in SHAPES
    ]
    return Rig(neutral, triangles, np.array(deltas), SHAPES)


def marker_vertices(rig: Rig) -> dict[str, int]:
    """Twelve markers on the face, four far from everything that moves."""
    places = [(a, b) for b in (60, 40, -30, -60) for a in (-30, 0, 30)]
    named = {f"M{k:02d}": place for k, place in enumerate(places)}
    named |= dict(zip(HEAD, [(-70, 90), (70, 90), (-80, 10), (80, 10)], strict=True))
    return {
        name: int(np.hypot(rig.neutral[:, 0] - a, rig.neutral[:, 1] - b).argmin()) for name, (a, b) in named.items()
    }


def make_weights(steps: list[tuple[float, dict[str, float]]]) -> np.ndarray:
    """Hold each pose for the given seconds, with 0.3 s from one to the next; the take begins and ends neutral."""
    poses = [{}] + [pose for _, pose in steps] + [{}]
    holds = [0.8] + [seconds for seconds, _ in steps] + [0.8]
    pieces = []
    for k, (pose, hold) in enumerate(zip(poses, holds, strict=True)):
        here = np.array([pose.get(s, 0.0) for s in SHAPES])
        pieces.append(np.repeat(here[None], round(hold * RATE), axis=0))
        if k + 1 < len(poses):
            there = np.array([poses[k + 1].get(s, 0.0) for s in SHAPES])
            t = (np.arange(30) + 0.5)[:, None] / 30
            pieces.append(here + (there - here) * (t * t * (3 - 2 * t)))
    return np.concatenate(pieces)


def write_performance(path: Path, weights: np.ndarray, seed: int = 0, noise: float = 0.05) -> None:
    """Write a take of the small face under head motion, another person's size, with noise and a short gap."""
    rig, rng = make_rig(), np.random.default_rng(seed)
    markers = marker_vertices(rig)
    points = rig.pose(weights, list(markers.values())) * [1.05, 0.97, 1.02]
    t = np.arange(len(points)) / RATE
    turn = Rotation.from_euler("yx", np.column_stack([6 * np.sin(t), 4 * np.cos(0.7 * t)]), degrees=True).as_matrix()
    points = points @ np.swapaxes(turn, 1, 2) + np.column_stack([5 * np.sin(0.5 * t), 3 * t, 800 + 0 * t])[:, None]
    points += rng.normal(0, noise, points.shape)
    points[40:60, 3] = np.nan
    write_take(path, make_take(points, list(markers), RATE))


def write_rig(folder: Path) -> tuple[Path, Path]:
    """Write the rig in centimetres and its marker map; return both paths."""
    rig = make_rig()
    np.savez(
        folder / "rig.npz", vertices=rig.neutral / 10, triangles=rig.triangles, names=rig.shapes, deltas=rig.deltas / 10
    )
    rows = [f"{name},{vertex}" for name, vertex in marker_vertices(rig).items()]
    (folder / "map.csv").write_text("marker,vertex\n" + "\n".join(rows) + "\n")
    return folder / "rig.npz", folder / "map.csv"
