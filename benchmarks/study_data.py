"""What the study of weight solving runs on: rigs, actors, performances, virtual markers."""

from __future__ import annotations

import csv
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from mimique.models.layouts import find_moving_vertices, kmeans_layout
from mimique.synthesis import Rig, arkit_name, read_rig
from mimique.synthesis.avatar import build_avatar, default_markers, random_morphology

TESTS = ("facial", "apfel", "S88-001")
RANGE_OF_MOTION = "alex_rom_3"
NOISE = 0.2  # mm
RATE = 30.0

MAKEHUMAN = {
    **{f"eye-{s}-closure": [f"eyeBlink{s.title()}"] for s in ("left", "right")},
    **{f"eye-{s}-opened-up": [f"eyeWide{s.title()}"] for s in ("left", "right")},
    **{f"eye-{s}-slit": [f"eyeSquint{s.title()}"] for s in ("left", "right")},
    **{f"eyebrows-{s}-down": [f"browDown{s.title()}"] for s in ("left", "right")},
    **{f"eyebrows-{s}-extern-up": [f"browOuterUp{s.title()}"] for s in ("left", "right")},
    **{f"eyebrows-{s}-inner-up": ["browInnerUp"] for s in ("left", "right")},
    **{f"nose-{s}-elevation": [f"noseSneer{s.title()}"] for s in ("left", "right")},
    "mouth-compression": ["mouthPressLeft", "mouthPressRight"],
    "mouth-corner-puller": ["mouthSmileLeft", "mouthSmileRight"],
    "mouth-depression": ["mouthFrownLeft", "mouthFrownRight"],
    "mouth-depression-retraction": ["mouthStretchLeft", "mouthStretchRight"],
    "mouth-elevation": ["mouthShrugLower"],
    "mouth-eversion": ["mouthFunnel"],
    "mouth-open": ["jawOpen"],
    "mouth-parling": ["mouthLowerDownLeft", "mouthLowerDownRight"],
    "mouth-part-later": ["mouthUpperUpLeft", "mouthUpperUpRight"],
    "mouth-pursing": ["mouthPucker"],
    "mouth-retraction": ["mouthDimpleLeft", "mouthDimpleRight"],
    "mouth-upward-retraction": ["cheekSquintLeft", "cheekSquintRight"],
}
"""Which ARKit shapes drive a MakeHuman unit (their mean); units that are not named stay at 0."""

FACEGOOD = {
    "jawOpen": ["mouth_stretch_c"],
    "mouthFunnel": ["mouth_funnel_dl", "mouth_funnel_dr", "mouth_funnel_ul", "mouth_funnel_ur"],
    "mouthPucker": ["mouth_oh_c", "mouth_oo_c"],
    "mouthRollLower": ["mouth_suck_dl", "mouth_suck_dr"],
    "mouthRollUpper": ["mouth_suck_ul", "mouth_suck_ur"],
    "mouthSmileLeft": ["mouth_lipCornerPull_l"],
    "mouthSmileRight": ["mouth_lipCornerPull_r"],
    "mouthLowerDownLeft": ["mouth_lowerLipDepress_l"],
    "mouthLowerDownRight": ["mouth_lowerLipDepress_r"],
    "mouthUpperUpLeft": ["mouth_upperLipRaise_l"],
    "mouthUpperUpRight": ["mouth_upperLipRaise_r"],
}
"""Which curves of the other tracker stand for an ARKit shape (their mean; its other shapes never move)."""


@dataclass(frozen=True)
class Scene:
    """One mesh with its actors and performances, all on the rig's shapes.

    ``range_of_motion`` and the values of ``tests`` and ``elsewhere`` (the other tracker) are weights (F, n_shapes);
    ``checked`` are the vertices at which errors are measured, ``held_out`` markers that no solve sees.
    """

    name: str
    rig: Rig
    actors: list[Rig]
    range_of_motion: np.ndarray
    tests: dict[str, np.ndarray]
    elsewhere: dict[str, np.ndarray]
    vertices: np.ndarray
    checked: np.ndarray
    held_out: np.ndarray
    actor_vertices: np.ndarray | None = None  # Where the markers sit on actors of another mesh.
    to_actor: np.ndarray | None = None  # (n_shapes, actor's shapes), for actors with other shapes.

    def marked(self) -> np.ndarray:
        """Marker vertices on the actors' mesh."""
        return self.vertices if self.actor_vertices is None else self.actor_vertices

    def perform(self, weights: np.ndarray) -> np.ndarray:
        """The actors' own weights for weights of the rig."""
        return weights if self.to_actor is None else weights @ self.to_actor

    def with_markers(self, count: int) -> Scene:
        return replace(self, vertices=layout(self.rig, self.range_of_motion, count))


def layout(rig: Rig, weights: np.ndarray, count: int) -> np.ndarray:
    return kmeans_layout(rig, weights[::20], count, rng=np.random.default_rng(3))


def read_performance(path: Path) -> dict[str, np.ndarray]:
    """ARKit weights of a Live Link Face recording; rows in which the face was lost are left out."""
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    values = np.clip([[float(v) for v in row[2:54]] for row in rows if len(row) > 53], 0, 1)
    return {str(arkit_name(name)): values[:, i] for i, name in enumerate(head[2:54])}


def read_facegood(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """ARKit weights of the curves that another tracker and its animators made."""
    takes = {}
    for number in (15, 16):
        curves = _load(folder / f"bs_value_1114_3_{number}.npy")
        names = [str(n) for n in _load(folder / "shirley_1119_bs_name316.npy")]
        takes[f"facegood_{number}"] = {
            shape: np.clip(curves[:, [names.index(p) for p in parts]].mean(1), 0, 1)
            for shape, parts in FACEGOOD.items()
        }
    return takes


def _load(path: Path) -> np.ndarray:
    with warnings.catch_warnings():  # The files were written by Python 2; NumPy says so.
        warnings.simplefilter("ignore")
        return np.load(path)


def on_rig(performance: dict[str, np.ndarray], rig: Rig, table: dict[str, list[str]] | None = None) -> np.ndarray:
    """Weights (F, n_shapes) of the rig's own shapes."""
    n_frames = len(next(iter(performance.values())))
    out = np.zeros((n_frames, rig.n_shapes))
    for k, shape in enumerate(rig.shapes):
        parts = [arkit_name(shape) or ""] if table is None else table.get(shape, [])
        found = [performance[p] for p in parts if p in performance]
        if found:
            out[:, k] = np.mean(found, axis=0)
    return out


def ict_scene(data: Path, n_actors: int, seed: int = 20) -> Scene:
    """ICT FaceKit; actors are sums of standard-normal weights times identity modes, with the rig's own shapes."""
    rig = read_rig(data / "ict_facekit" / "rig.npz", unit="cm")
    with np.load(data / "ict_facekit" / "identities.npz") as file:
        modes = file["deltas"].astype(float) * 10.0
    draws = np.random.default_rng(seed).normal(size=(n_actors, len(modes)))
    faces = [rig.neutral + np.tensordot(w, modes, axes=1) for w in draws]
    actors = [Rig(face, rig.triangles, rig.deltas, rig.shapes) for face in faces]
    return _scene("ICT", rig, actors, data)


def makehuman_scene(data: Path, n_actors: int) -> Scene:
    """MakeHuman; actors mix six faces, and their shapes are sculpted for three groups of people in turn."""
    rig = read_rig(data / "makehuman" / "rig.npz", unit="dm")
    with np.load(data / "makehuman" / "identities.npz") as file:
        faces = file["deltas"].astype(float) * 100.0
    with np.load(data / "makehuman" / "rig.npz") as file:
        sculpted = [file[name].astype(float) * 100.0 for name in ("deltas_asian", "deltas_african", "deltas")]
    faces -= faces.mean(1, keepdims=True)  # They also change the body's height.
    mixes = np.random.default_rng(21).dirichlet(np.ones(len(faces)), n_actors)
    actors = [
        Rig(rig.neutral + np.tensordot(mix, faces, axes=1), rig.triangles, sculpted[i % 3], rig.shapes)
        for i, mix in enumerate(mixes)
    ]
    return _scene("MakeHuman", rig, actors, data, MAKEHUMAN)


def avatar_scene(data: Path, n_actors: int) -> Scene:
    """The embedded avatar; actors have other proportions, and their shapes follow these."""
    rng = np.random.default_rng(22)
    actors = [build_avatar(random_morphology(rng)) for _ in range(n_actors)]
    scene = _scene("avatar", build_avatar(), actors, data)
    face = [vertex for name, vertex in default_markers().items() if not name.startswith("head_")]
    return replace(scene, vertices=np.array(face))


def _scene(name: str, rig: Rig, actors: list[Rig], data: Path, table: dict[str, list[str]] | None = None) -> Scene:
    folder = data / "arkit_recordings"
    takes = {
        take: on_rig(read_performance(folder / "livelinkface" / f"{take}.csv"), rig, table)
        for take in (*TESTS, RANGE_OF_MOTION)
    }
    rom = takes.pop(RANGE_OF_MOTION)
    elsewhere = {take: on_rig(p, rig, table) for take, p in read_facegood(folder / "facegood").items()}
    vertices = layout(rig, rom, 40)
    moving = find_moving_vertices(rig)
    checked = moving[:: max(1, len(moving) // 2000)]
    free = np.setdiff1d(moving, vertices)
    held_out = np.random.default_rng(5).choice(free, 20, replace=False)
    return Scene(name, rig, actors, rom, takes, elsewhere, vertices, checked, held_out)


def vary_shapes(actor: Rig, rng: np.random.Generator, regions: int = 5) -> Rig:
    """The actor with every shape 0.7 to 1.3 times as strong, other in each of some softly bounded regions."""
    moving = find_moving_vertices(actor)
    centres = actor.neutral[rng.choice(moving, regions, replace=False)]
    away = np.linalg.norm(actor.neutral[:, None] - centres, axis=2)
    near = np.exp(-((away - away.min(1, keepdims=True)) / 20.0))
    gains = rng.uniform(0.7, 1.3, (actor.n_shapes, regions)) @ (near / near.sum(1, keepdims=True)).T
    return Rig(actor.neutral, actor.triangles, actor.deltas * gains[:, :, None], actor.shapes)


@dataclass(frozen=True)
class Sites:
    """Where virtual markers sit: in triangles with the given ``corners`` (P, 3) and ``shares`` (P, 3) of them."""

    corners: np.ndarray
    shares: np.ndarray

    def on(self, rig: Rig, weights: np.ndarray) -> np.ndarray:
        """Marker positions (F, P, 3) on a face that makes these weights, mm."""
        posed = rig.pose(weights, self.corners.ravel()).reshape(len(weights), *self.corners.shape, 3)
        return np.einsum("fpcd,pc->fpd", posed, self.shares)


def place(rig: Rig, vertices: np.ndarray, off: float = 0.0, rng: np.random.Generator | None = None) -> Sites:
    """Markers on vertices, or ``off`` mm beside them on the skin (at most to the far side of the next triangle)."""
    corners, shares = np.repeat(vertices[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(vertices), 1))
    if off and rng is not None:
        for p, vertex in enumerate(vertices):
            triangles = rig.triangles[(rig.triangles == vertex).any(1)]
            triangle = triangles[rng.integers(len(triangles))]
            others = triangle[triangle != vertex]
            turn = rng.uniform()
            edges = rig.neutral[others] - rig.neutral[vertex]
            reach = min(1.0, off / np.linalg.norm(turn * edges[0] + (1 - turn) * edges[1]))
            corners[p] = [vertex, *others]
            shares[p] = [1 - reach, reach * turn, reach * (1 - turn)]
    return Sites(corners, shares)


def lose(positions: np.ndarray, rng: np.random.Generator, share: float = 0.08, seconds: float = 0.7) -> np.ndarray:
    """Positions in which each marker is missing for ``share`` of the time, in stretches of some ``seconds``."""
    out = positions.copy()
    length = max(1, round(seconds * RATE))
    for p in range(out.shape[1]):
        for start in rng.choice(len(out), rng.poisson(share * len(out) / length)):
            out[start : start + 1 + rng.integers(2 * length), p] = np.nan
    return out
