"""A signer's own skin: no rig with the same shapes can follow it exactly.

Displacement of a marker for weights ``w``::

    d(w) = Σ_i w_i·D_i  +  Σ_(i,j) w_i·w_j·C_ij  +  Σ_k tanh(q_k·w²)·T_k  +  drift,   late by a lag of the tissue

``D`` are the shapes of the signer's own morphology with gains and turns that vary over the face, ``C`` correctives of
pairs of shapes, ``T`` fields of skin that slides along the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ..rig import Rig
from .noise import smooth_noise
from .parameters import Parameters
from .poses import shape_regions

FACE_RADIUS = 85.0  # mm from the middle of the face markers, over which the sliding fades out


@dataclass(frozen=True)
class Skin:
    """What moves the markers of one signer.

    Parameters
    ----------
    neutral
        (n_markers, 3) mm.
    deltas
        (n_shapes, n_markers, 3) mm at weight 1.
    pairs, correctives
        (n_pairs, 2) shape numbers, and (n_pairs, n_markers, 3) mm with both at 1.
    drive, slides
        (n_slides, n_shapes) and (n_slides, n_markers, 3) mm when fully driven.
    lag
        (n_markers,) time constant, s.
    drift
        mm, standard deviation of each slide by itself.
    """

    neutral: NDArray[np.float64]
    deltas: NDArray[np.float64]
    pairs: NDArray[np.int64]
    correctives: NDArray[np.float64]
    drive: NDArray[np.float64]
    slides: NDArray[np.float64]
    lag: NDArray[np.float64]
    drift: float

    def move_markers(
        self, weights: NDArray[np.float64], rate: float, *, rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return (n_frames, n_markers, 3) markers on the unmoved head, mm, for (n_frames, n_shapes) weights."""
        n_frames = len(weights)
        sliding = np.tanh(weights**2 @ self.drive.T)
        wander = smooth_noise(n_frames, rate, 1.5, len(self.slides), rng=rng)
        amplitudes = np.hstack(
            [weights, weights[:, self.pairs[:, 0]] * weights[:, self.pairs[:, 1]], sliding + self.drift * wander]
        )
        fields = np.concatenate([self.deltas, self.correctives, self.slides])
        moved = (amplitudes @ fields.reshape(len(fields), -1)).reshape(n_frames, -1, 3)
        for marker, lag in enumerate(self.lag):
            # First-order lag: y[n] = y[n−1] + (1 − a)·(x[n] − y[n−1]), started at rest on the first frame.
            a = np.exp(-1.0 / (lag * rate))
            start = a * moved[:1, marker]
            moved[:, marker] = lfilter([1.0 - a], [1.0, -a], moved[:, marker], axis=0, zi=start)[0]
        return self.neutral + moved


def personal_rig(
    rig: Rig,
    centres: NDArray[np.float64],
    soft: NDArray[np.bool_],
    parameters: Parameters,
    *,
    rng: np.random.Generator,
) -> Rig:
    """Return a rig whose shapes move like one person's: gains and turns that vary over the face.

    Every region of shapes has its own gain field (``skin.gain``) and its own field of turns about the z axis.

    Parameters
    ----------
    rig
        The signer's morphology.
    centres
        (n, 3) points on the face, mm, around which the fields vary.
    soft
        (n_vertices,) what is skin; eyeballs and teeth keep their movement.
    """
    setting = parameters.skin
    low, high = setting["gain"]
    deltas = rig.deltas.copy()
    regions = shape_regions(rig.shapes, parameters.regions)
    for region in range(len(parameters.regions)):
        fields = smooth_fields(rig.neutral, centres, setting["field_width"], 2, rng=rng)
        gain = 0.5 * (low + high) + 0.5 * (high - low) * np.tanh(fields[:, 0])
        angle = np.radians(setting["turn"]) * np.tanh(fields[:, 1])
        x, y, z = np.moveaxis(deltas[regions == region], -1, 0)
        turned = [np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z]
        personal = gain[:, None] * np.stack(turned, axis=-1)
        deltas[regions == region] = np.where(soft[:, None], personal, deltas[regions == region])
    return Rig(rig.neutral, rig.triangles, deltas, rig.shapes)


def build_skin(
    rig: Rig, vertices: NDArray[np.int64], head: NDArray[np.bool_], parameters: Parameters, *, rng: np.random.Generator
) -> Skin:
    """Return the skin under a signer's markers.

    Parameters
    ----------
    rig
        As :func:`personal_rig` returns it.
    vertices
        (n_markers,) where the markers sit.
    head
        (n_markers,) which of them are on the skull.
    """
    setting = parameters.skin
    neutral, deltas = rig.neutral[vertices], rig.deltas[:, vertices]
    pairs = _named_pairs(rig.shapes, setting["pairs"])
    centres = neutral[~head]
    width = setting["field_width"]
    correctives = np.array([_corrective(neutral, deltas[i], deltas[j], centres, width, rng) for i, j in pairs])
    lids = np.array([i for i, shape in enumerate(rig.shapes) if shape.startswith("eyeBlink")])
    sideways = [np.linalg.norm(deltas[i], axis=-1)[:, None] * [np.sign(rng.uniform(-1, 1)), 0.0, 0.0] for i in lids]
    correctives = np.concatenate([setting["corrective"] * correctives, setting["lid_slide"] * _unit_largest(sideways)])
    pairs = np.concatenate([pairs, np.column_stack([lids, lids])])
    normals = vertex_normals(rig)[vertices]
    slides = np.stack([smooth_fields(neutral, centres, width, 3, rng=rng) for _ in range(setting["slides"])])
    slides -= np.sum(slides * normals, axis=-1, keepdims=True) * normals
    fading = np.exp(-((np.linalg.norm(neutral - centres.mean(axis=0), axis=1) / FACE_RADIUS) ** 2))
    slides *= setting["slide"] * (fading * ~head)[:, None]
    drive = rng.standard_normal((setting["slides"], len(rig.shapes)))
    # The scalp follows the brows a little, all of it upwards.
    brows = np.array(
        [1.0 if shape in ("browInnerUp", "browOuterUpLeft", "browOuterUpRight") else 0.0 for shape in rig.shapes]
    )
    scalp = np.zeros((1, len(vertices), 3))
    scalp[0, head, 1] = setting["scalp"] * rng.uniform(0.5, 1.0, head.sum())
    lag = rng.uniform(setting["lag"][0], setting["lag"][1], len(vertices))
    lag[head] = setting["lag"][0]
    return Skin(
        neutral,
        np.where(head[:, None], 0.0, deltas),
        pairs,
        np.where(head[:, None], 0.0, correctives),
        np.vstack([drive, brows]),
        np.concatenate([slides, scalp]),
        lag,
        setting["slide_drift"] / setting["slide"],
    )


def smooth_fields(
    points: NDArray[np.float64],
    centres: NDArray[np.float64],
    width: float,
    columns: int,
    *,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return (n_points, columns) random fields, mean 0 and deviation 1 at the centres, smooth over ``width`` mm."""
    distance = np.linalg.norm(points[:, None] - centres, axis=-1)
    amplitude = rng.standard_normal((len(centres), columns))
    among = np.exp(-0.5 * (np.linalg.norm(centres[:, None] - centres, axis=-1) / width) ** 2) @ amplitude
    field = np.exp(-0.5 * (distance / width) ** 2) @ amplitude
    return (field - among.mean(axis=0)) / among.std(axis=0)


def vertex_normals(rig: Rig) -> NDArray[np.float64]:
    """Return (n_vertices, 3) unit normals of the neutral, weighted by triangle area."""
    corners = rig.neutral[rig.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(rig.neutral)
    for corner in range(3):
        np.add.at(total, rig.triangles[:, corner], normals)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(length > 0.0, length, 1.0)


def _named_pairs(shapes: Sequence[str], names: Sequence[Sequence[str]]) -> NDArray[np.int64]:
    """Return shape numbers of pairs, for each side on which a pair exists."""
    pairs = []
    for first, second in names:
        for side in ("Left", "Right"):
            found = [next((n for n in (f"{name}{side}", name) if n in shapes), None) for name in (first, second)]
            if None not in found:
                pairs.append([list(shapes).index(str(name)) for name in found])
    return np.unique(np.array(pairs), axis=0)


def _corrective(
    neutral: NDArray[np.float64],
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    centres: NDArray[np.float64],
    width: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return a field that is largest (1) where both shapes move the skin: a part backwards, a part of its own."""
    overlap = np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
    back = -(first + second) / max(np.linalg.norm(first + second, axis=-1).max(), 1e-9)
    own = smooth_fields(neutral, centres, width, 3, rng=rng)
    field = overlap[:, None] / max(overlap.max(), 1e-9) * (0.7 * back + 0.7 * own)
    return _unit_largest([field])[0]


def _unit_largest(fields: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return fields scaled so that each one's largest displacement is 1."""
    stacked = np.array(fields)
    return stacked / np.maximum(np.linalg.norm(stacked, axis=-1).max(axis=1), 1e-9)[:, None, None]
