"""A simulated signer: a face, a skin and a style, all drawn from a seed and a number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..avatar import Part, base_head, build_avatar, default_markers, random_morphology
from ..rig import Rig
from .parameters import Parameters, random_stream
from .poses import Style, draw_style, shape_regions
from .skin import Skin, build_skin, personal_rig


@dataclass(frozen=True)
class Signer:
    """One simulated person.

    Parameters
    ----------
    code
        s1, s2, …
    number
        From 0.
    rig
        Their own face with their own shapes, gains and turns included.
    marker_names, marker_vertices
        What is glued on, and where.
    marker_kinds
        head, face, lips or lids: how easily cameras lose it.
    regions
        (n_shapes,) region of each shape.
    facing
        Degrees about the vertical, in the room.
    """

    code: str
    number: int
    rig: Rig
    skin: Skin
    style: Style
    marker_names: tuple[str, ...]
    marker_vertices: NDArray[np.int64]
    marker_kinds: list[str]
    regions: NDArray[np.int64]
    facing: float

    @property
    def head_markers(self) -> list[str]:
        """Names of the markers on the skull."""
        return [n for n, kind in zip(self.marker_names, self.marker_kinds, strict=True) if kind == "head"]


def create_signer(number: int, parameters: Parameters, *, seed: int) -> Signer:
    """Return signer ``number`` (from 0) of the corpus with this seed, whoever else is in it."""
    rng = random_stream(seed, "signer", number)
    morphology = random_morphology(rng)
    face = build_avatar(morphology)
    markers = default_markers()
    names = tuple(markers)
    meant = np.array([markers[name] for name in names], dtype=np.int64)
    vertices = glue_markers(face, meant, parameters.skin["misplaced"], rng=rng)
    kinds = marker_kinds(face, names, vertices)
    head = np.array([kind == "head" for kind in kinds])
    soft = ~np.isin(
        base_head().part, [Part.EYEBALL, Part.MOUTH_INSIDE, Part.UPPER_TEETH, Part.LOWER_TEETH, Part.TONGUE]
    )
    rig = personal_rig(face, face.neutral[vertices[~head]], soft, parameters, rng=rng)
    setting = parameters.head
    return Signer(
        code=f"s{number + 1}",
        number=number,
        rig=rig,
        skin=build_skin(rig, vertices, head, parameters, rng=rng),
        style=draw_style(parameters, rig.shapes, rng=rng),
        marker_names=names,
        marker_vertices=vertices,
        marker_kinds=kinds,
        regions=shape_regions(rig.shapes, parameters.regions),
        facing=float(setting["facing"] + setting["facing_spread"] * rng.standard_normal()),
    )


def glue_markers(rig: Rig, vertices: NDArray[np.int64], share: float, *, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return where markers end up: a share of them on a random neighbour of the vertex that was meant."""
    glued = vertices.copy()
    for i, vertex in enumerate(vertices):
        neighbours = np.setdiff1d(rig.triangles[(rig.triangles == vertex).any(axis=1)], vertex)
        if rng.random() < share:
            glued[i] = rng.choice(neighbours)
    return glued


def marker_kinds(rig: Rig, names: tuple[str, ...], vertices: NDArray[np.int64]) -> list[str]:
    """Return head, face, lips or lids for each marker.

    Head markers are told by their name; lids and lips by what moves them: a blink by more than 3 mm, a pucker by more
    than 45 % of the most that it moves any marker.
    """
    size = np.linalg.norm(rig.deltas[:, vertices], axis=-1)
    blink = np.max([size[rig.index(f"eyeBlink{side}")] for side in ("Left", "Right")], axis=0)
    pucker = size[rig.index("mouthPucker")]
    kinds = []
    for i, name in enumerate(names):
        if name.startswith("head"):
            kinds.append("head")
        elif blink[i] > 3.0:
            kinds.append("lids")
        else:
            kinds.append("lips" if pucker[i] > 0.45 * pucker.max() else "face")
    return kinds
