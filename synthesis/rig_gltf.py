"""Rigs in glTF 2.0 files (``.glb`` and ``.gltf``), after the Khronos glTF 2.0 specification.

Every mesh of the scene that has morph targets is a part of the rig, and so is one without that lies within their
bounds (teeth, eyes); others (a body, clothes, a lamp) are left out with a warning. Targets of several meshes are one
shape where they have one name. Each mesh stands where its node puts it, a skinned one as its skeleton's rest pose
bends it; animations are for :func:`.read_gltf_weights`. Vertices keep the file's numbers, mesh after mesh (exporters
split them at texture seams). glTF's axes are mimique's: +Y up, +Z out of the face, +X the subject's left.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RigError
from .gltf_document import Accessors, damage_in_one_line, open_gltf, world_matrices

TRIANGLES, STRIP, FAN = 4, 5, 6
AROUND = 0.05  # part of the face's size by which a mesh without shapes may stand out of the meshes with shapes

Floats = NDArray[np.float64]
GltfRig = tuple[Floats, NDArray[np.int64], Floats, list[str], list[tuple[str, int]]]


@dataclass
class _Mesh:
    """One mesh, placed in the scene."""

    name: str
    points: Floats
    triangles: NDArray[np.int64]
    deltas: dict[str, Floats]
    numbers: NDArray[np.int64] | None


def read_gltf(path: Path) -> GltfRig:
    """Read neutral (V, 3), triangles (T, 3), deltas (N, V, 3) in the file's unit, N names, and the rig's parts.

    Targets without a name in ``extras.targetNames`` are called ``target0`` and so on.

    Raises
    ------
    RigError
        If no mesh has morph targets, or the primitives of a mesh do not have the same number of them.
    FileFormatError
        If the file is damaged, compressed, or not glTF 2.0.
    """
    with damage_in_one_line(path):
        document, accessors = open_gltf(path)
        shapes = _own_shapes(document)
        meshes = _read_meshes(path, document, accessors)
        moving = [mesh for mesh in meshes if mesh.deltas]
        if not moving:
            raise RigError(f"{path.name}: expected a mesh with morph targets (blendshapes), but found none")
        kept = meshes if shapes else _leave_out_surroundings(path, meshes, moving)
        return _join(kept, shapes)


def name_targets(document: dict[str, Any]) -> dict[int, list[str]]:
    """Return the names of the morph targets of each mesh of the scene.

    Programs keep them on the mesh or on its first primitive. A target without one is called by its number and, where
    several meshes have targets, by its mesh: a number alone does not say which shapes belong together.
    """
    counts = {
        index: max((len(p.get("targets", [])) for p in document["meshes"][index]["primitives"]), default=0)
        for index in shown_meshes(document)
    }
    several = sum(count > 0 for count in counts.values()) > 1
    names = {}
    for index, count in counts.items():
        mesh = document["meshes"][index]
        extras = mesh.get("extras") or {}
        if "targetNames" not in extras and mesh["primitives"]:
            extras = mesh["primitives"][0].get("extras") or extras
        named = [str(name) for name in extras.get("targetNames", [])][:count]
        prefix = f"{mesh.get('name') or f'mesh {index}'}." if several else ""
        names[index] = named + [f"{prefix}target{i}" for i in range(len(named), count)]
    return names


def shown_meshes(document: dict[str, Any]) -> dict[int, int | None]:
    """Return the node that shows each mesh of the scene; every mesh, without a node, where no node shows any."""
    nodes, scenes = document.get("nodes", []), document.get("scenes", [])
    reached: list[int] = []
    todo = list(scenes[document.get("scene", 0)].get("nodes", [])) if scenes else list(range(len(nodes)))
    while todo:
        node = todo.pop(0)
        if node not in reached:
            reached.append(node)
            todo[:0] = nodes[node].get("children", [])
    shown: dict[int, int | None] = {}
    for node in reached:
        if "mesh" in nodes[node]:
            shown.setdefault(nodes[node]["mesh"], node)
    return shown or dict.fromkeys(range(len(document.get("meshes", []))))


def _own_shapes(document: dict[str, Any]) -> list[str]:
    """Return the names and order of all shapes where mimique wrote the file."""
    scenes = document.get("scenes", [])
    notes = (scenes[document.get("scene", 0)].get("extras") or {}) if scenes else {}
    own = notes.get("mimique") if isinstance(notes, dict) else None
    return [str(name) for name in own.get("shapes", [])] if isinstance(own, dict) else []


def _read_meshes(path: Path, document: dict[str, Any], accessors: Accessors) -> list[_Mesh]:
    shown = shown_meshes(document)
    placed = world_matrices(document)
    named = name_targets(document)
    result = []
    for index, node in shown.items():
        mesh = document["meshes"][index]
        if not mesh["primitives"]:
            continue
        called = mesh.get("name") or (None if node is None else document["nodes"][node].get("name"))
        name = str(called or f"mesh {index}")
        read = _read_primitives(path, mesh, name, named[index], accessors)
        if read is None:
            continue
        skin = None if node is None else document["nodes"][node].get("skin")
        if skin is not None:
            matrices = _skin_matrices(document["skins"][skin], placed, accessors, read)
        else:
            matrices = np.eye(4)[None] if node is None else placed[node][None]
        result.append(_place(read, matrices))
    return result


@dataclass
class _Read:
    """A mesh as the file holds it; joints and their weights (n, 4·k) of a skinned one."""

    mesh: _Mesh
    joints: NDArray[np.int64]
    shares: Floats


def _read_primitives(
    path: Path, mesh: dict[str, Any], name: str, names: Sequence[str], accessors: Accessors
) -> _Read | None:
    """Join the primitives of a mesh; those that differ only in material share their vertices. None: no surface."""
    points, faces, numbers, joints, shares = [], [], [], [], []
    deltas: dict[str, list[Floats]] = {shape: [] for shape in names}
    starts: dict[tuple[int | None, ...], int] = {}
    n_vertices = 0
    for primitive in mesh["primitives"]:
        targets, mode = primitive.get("targets", []), primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN) and not targets:
            continue  # lines and points
        if len(targets) != len(names) or mode not in (TRIANGLES, STRIP, FAN):
            raise RigError(
                f"{path.name}: expected triangles with {len(names)} morph targets in every part of mesh "
                f"{name!r}, but one has {len(targets)} targets and mode {mode}"
            )
        attributes = primitive["attributes"]
        key = (attributes["POSITION"], *(t.get("POSITION") for t in targets))
        vertices = accessors.read(attributes["POSITION"])
        if key not in starts:
            starts[key] = n_vertices
            n_vertices += len(vertices)
            points.append(vertices)
            for shape, target in zip(names, targets, strict=True):
                none = np.zeros_like(vertices)
                deltas[shape].append(accessors.read(target["POSITION"]) if "POSITION" in target else none)
            numbers.append(accessors.read(attributes["_VERTEX"]) if "_VERTEX" in attributes else None)
            sets = [i for i in range(8) if f"JOINTS_{i}" in attributes and f"WEIGHTS_{i}" in attributes]
            if sets:
                joints.append(np.hstack([accessors.read(attributes[f"JOINTS_{i}"]) for i in sets]).astype(np.int64))
                shares.append(np.hstack([accessors.read(attributes[f"WEIGHTS_{i}"]) for i in sets]))
        indices = accessors.read(primitive["indices"]) if "indices" in primitive else np.arange(len(vertices))
        faces.append(_triangles(indices.astype(np.int64), mode) + starts[key])
    if not points:
        return None
    if len(set(names)) < len(names):
        repeated = sorted({n for n in names if list(names).count(n) > 1})
        raise RigError(f"{path.name}: shape names repeat in mesh {name!r}: {', '.join(repeated)}; rename them")
    known = [array.astype(np.int64) for array in numbers if array is not None]
    all_skinned = len(joints) == len(points) and len({array.shape[1] for array in joints}) == 1
    joined = _Mesh(
        name,
        np.concatenate(points),
        np.concatenate(faces),
        {shape: np.concatenate(moves) for shape, moves in deltas.items()},
        np.concatenate(known) if len(known) == len(points) else None,
    )
    return _Read(
        joined,
        np.concatenate(joints) if all_skinned else np.empty((0, 0), dtype=np.int64),
        np.concatenate(shares) if all_skinned else np.empty((0, 0)),
    )


def _triangles(indices: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Return the (n, 3) triangles of a list, a strip or a fan (specification, 3.7.2.1)."""
    if mode == TRIANGLES:
        return indices.reshape(-1, 3)
    place = np.arange(len(indices) - 2)
    if mode == STRIP:
        odd = place % 2
        return np.stack([indices[place], indices[place + 1 + odd], indices[place + 2 - odd]], axis=1)
    return np.stack([indices[place + 1], indices[place + 2], np.full(len(place), indices[0])], axis=1)


def _skin_matrices(skin: dict[str, Any], placed: list[Floats], accessors: Accessors, read: _Read) -> Floats:
    """Return each vertex's matrix, as its joints hold it at rest; a skinned mesh's own node does not count (3.7.3)."""
    if not read.joints.size:
        return np.eye(4)[None]
    joints = skin["joints"]
    back = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in skin:
        back = accessors.read(skin["inverseBindMatrices"])[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
    held = np.stack([placed[joint] for joint in joints]) @ back
    total = read.shares.sum(axis=1, keepdims=True)
    shares = np.divide(read.shares, total, out=np.zeros_like(read.shares), where=total > 0)
    matrices = np.einsum("vj,vjab->vab", shares, held[read.joints])
    matrices[total[:, 0] <= 0] = np.eye(4)
    return np.asarray(matrices)


def _place(read: _Read, matrices: Floats) -> _Mesh:
    """Apply one matrix (1, 4, 4), or one for each vertex, to points and displacements."""
    mesh, linear, shift = read.mesh, matrices[:, :3, :3], matrices[:, :3, 3]
    triangles = mesh.triangles
    if np.linalg.det(linear[0]) < 0:  # mirrored: keep the outside outside
        triangles = triangles[:, ::-1]
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused when the rig is made
        if len(linear) == 1:
            points = mesh.points @ linear[0].T + shift[0]
            deltas = {name: moves @ linear[0].T for name, moves in mesh.deltas.items()}
        else:
            points = np.einsum("vab,vb->va", linear, mesh.points) + shift
            deltas = {name: np.einsum("vab,vb->va", linear, moves) for name, moves in mesh.deltas.items()}
    return _Mesh(mesh.name, points, triangles, deltas, mesh.numbers)


def _leave_out_surroundings(path: Path, meshes: list[_Mesh], moving: list[_Mesh]) -> list[_Mesh]:
    """Return the meshes with shapes and those within their bounds; warn of the others."""
    low = np.min([mesh.points.min(axis=0) for mesh in moving if len(mesh.points)], axis=0)
    high = np.max([mesh.points.max(axis=0) for mesh in moving if len(mesh.points)], axis=0)
    margin = AROUND * float(np.linalg.norm(high - low))
    kept: list[_Mesh] = []
    outside: list[_Mesh] = []
    for mesh in meshes:
        within = bool((mesh.points >= low - margin).all() and (mesh.points <= high + margin).all())
        (kept if mesh.deltas or within else outside).append(mesh)
    if outside:
        listed = ", ".join(ascii(mesh.name) for mesh in outside[:6]) + (" …" if len(outside) > 6 else "")
        warnings.warn(
            f"{path.name}: left out, because they have no shapes and lie outside of the face: {listed}", stacklevel=5
        )
    return kept


def _join(meshes: list[_Mesh], shapes: list[str]) -> GltfRig:
    """Join meshes to one rig; the shapes in the given order, or as they come."""
    names = list(dict.fromkeys([*shapes, *(name for mesh in meshes for name in mesh.deltas)]))
    points = np.concatenate([mesh.points for mesh in meshes])
    numbers = _own_numbers(meshes, len(points)) if shapes else None
    if numbers is None:
        numbers = np.arange(len(points))
    n_vertices = int(numbers.max()) + 1 if len(numbers) else 0
    neutral, deltas = np.zeros((n_vertices, 3)), np.zeros((len(names), n_vertices, 3))
    neutral[numbers] = points
    place = {name: i for i, name in enumerate(names)}
    triangles, parts, first = [], [], 0
    for mesh in meshes:
        own = numbers[first : first + len(mesh.points)]
        for name, moves in mesh.deltas.items():
            deltas[place[name], own] = moves
        if mesh.triangles.size and (mesh.triangles.min() < 0 or mesh.triangles.max() >= len(own)):
            raise ValueError(f"a triangle of mesh {mesh.name!r} names a vertex that is not there")
        triangles.append(own[mesh.triangles])
        parts.append((mesh.name, len(mesh.triangles)))
        first += len(mesh.points)
    return neutral, np.concatenate(triangles), deltas, names, parts if len(parts) > 1 else []


def _own_numbers(meshes: list[_Mesh], total: int) -> NDArray[np.int64] | None:
    """Return the vertices' numbers that mimique noted when it wrote the file, if they are whole."""
    known = [mesh.numbers for mesh in meshes if mesh.numbers is not None]
    if len(known) != len(meshes):
        return None
    numbers = np.concatenate(known)
    used = np.unique(numbers)
    whole = len(numbers) == total and len(used) and used[0] == 0 and used[-1] == len(used) - 1
    return numbers if whole else None
