"""A rig and its weights over time as USD with blendshapes (``.usda``, ``.usdc``), by OpenUSD's UsdSkel schemas.

The library is ``usd-core`` (extra ``usd``), whose licence is the TOST 1.0, a form of the Apache licence. Lengths are
millimetres (``metersPerUnit`` 0.001), one time code is one frame, +Y is up. Each part of the rig is a mesh with the
blendshapes that touch it; one ``SkelAnimation`` holds the weights, under the rig's own names. A skeleton of one joint
that never moves is there because programs look for the animation there.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .animation import Frames, check_weights, fill_missing, find_missing, weight_blocks
from .linear_colours import linearise_colours
from .moving_mesh import find_normals
from .partial_files import partial_file
from .rig import Rig
from .rig_parts import RigPart, split_parts

USD_SUFFIXES = (".usd", ".usda", ".usdc")
ROOT = "/Face"


def write_usd(
    path: str | PathLike[str],
    rig: Rig,
    weights: Frames | None = None,
    rate: float | None = None,
    *,
    colours: ArrayLike | None = None,
) -> Path:
    """Write a rig as USD, with its animation where there are weights.

    Parameters
    ----------
    path
        ``.usda`` (text), ``.usdc`` or ``.usd`` (binary); complete or not there.
    rig
        The face.
    weights
        (n_frames, n_shapes), read a part at a time; a frame with a weight that is not known shows the neutral.
    rate
        Of the weights, Hz.
    colours
        (n_vertices, 3) red, green, blue from 0 to 1, sRGB.

    Returns
    -------
    The file's path.

    Raises
    ------
    RigError, InputError
        If usd-core is not installed, rig, weights, rate or colours cannot be used, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in USD_SUFFIXES:
        raise InputError(f"{path.name}: expected a file name ending in {', '.join(USD_SUFFIXES)}")
    if (weights is None) != (rate is None):
        raise InputError("weights and their rate come together; only one of them was given")
    try:
        from pxr import Tf, Usd, UsdGeom
    except ImportError as error:
        raise InputError(f"{path.name}: USD needs the package usd-core; run: pip install 'mimique[usd]'") from error
    parts = split_parts(rig)
    if weights is not None and rate is not None:
        check_weights(rig, weights, rate)
    with partial_file(path) as part:
        try:
            stage = Usd.Stage.CreateNew(str(part))
            UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
            UsdGeom.SetStageMetersPerUnit(stage, 0.001)
            _fill_stage(stage, rig, parts, colours)
            if weights is not None and rate is not None:
                _add_animation(stage, rig, weights, rate)
            saved = stage.GetRootLayer().Save()
        except Tf.ErrorException as error:
            gist = " ".join(str(error).split())[:160]
            raise InputError(f"{path}: it cannot be written ({gist}); nothing was left there") from error
        if not saved:
            raise InputError(f"{path}: it cannot be written; nothing was left there")
    return path


def _fill_stage(stage: Any, rig: Rig, parts: list[RigPart], colours: ArrayLike | None) -> None:
    """Write everything that does not move."""
    from pxr import Gf, Sdf, UsdSkel, Vt

    root = UsdSkel.Root.Define(stage, ROOT)
    stage.SetDefaultPrim(root.GetPrim())
    skeleton = UsdSkel.Skeleton.Define(stage, f"{ROOT}/Skeleton")
    rest = Vt.Matrix4dArray([Gf.Matrix4d(1.0)])
    skeleton.CreateJointsAttr(["root"])
    skeleton.CreateBindTransformsAttr(rest)
    skeleton.CreateRestTransformsAttr(rest)
    normals = find_normals(rig.neutral - rig.neutral.mean(axis=0), rig.triangles)
    tints = None if colours is None else linearise_colours(rig, colours).astype(np.float32)
    labels = _identifiers([part.name for part in parts])
    called = _identifiers(list(rig.shapes))
    for part, label in zip(parts, labels, strict=True):
        _add_mesh(stage, f"{ROOT}/{label}", part, rig, normals, tints, called)
    extent = np.stack([rig.neutral.min(axis=0), rig.neutral.max(axis=0)]).astype(np.float32)
    root.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(extent))
    root.GetPrim().CreateAttribute("mimique:shapes", Sdf.ValueTypeNames.TokenArray, custom=True).Set(list(rig.shapes))


def _add_mesh(
    stage: Any,
    path: str,
    part: RigPart,
    rig: Rig,
    normals: NDArray[np.float32],
    tints: NDArray[np.float32] | None,
    called: list[str],
) -> None:
    """Write one part with its blendshapes: only the vertices that each of them moves."""
    from pxr import Sdf, UsdGeom, UsdSkel, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    points = np.ascontiguousarray(rig.neutral[part.vertices], dtype=np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(part.triangles), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(part.triangles.ravel().astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(normals[part.vertices])))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])))
    if tints is not None:
        shown = mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex)
        shown.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(tints[part.vertices])))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([Sdf.Path(f"{ROOT}/Skeleton")])
    binding.CreateJointIndicesPrimvar(True, 1).Set([0])
    binding.CreateJointWeightsPrimvar(True, 1).Set([1.0])
    targets = []
    for shape in part.shapes:
        moves = rig.deltas[shape, part.vertices].astype(np.float32)
        rows = np.flatnonzero(moves.any(axis=1))
        blend = UsdSkel.BlendShape.Define(stage, f"{path}/{called[shape]}")
        blend.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(moves[rows])))
        blend.CreatePointIndicesAttr(Vt.IntArray.FromNumpy(rows.astype(np.int32)))
        targets.append(blend.GetPath())
    if targets:
        binding.CreateBlendShapesAttr([rig.shapes[shape] for shape in part.shapes])
        binding.CreateBlendShapeTargetsRel().SetTargets(targets)


def _add_animation(stage: Any, rig: Rig, weights: Frames, rate: float) -> None:
    """Write the weights, one sample a frame."""
    from pxr import Sdf, UsdSkel, Vt

    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(weights) - 1)
    animation = UsdSkel.Animation.Define(stage, f"{ROOT}/Skeleton/Animation")
    animation.CreateBlendShapesAttr(list(rig.shapes))
    sampled = animation.CreateBlendShapeWeightsAttr()
    lost, never = find_missing(weights)
    with Sdf.ChangeBlock():
        for first, values in weight_blocks(weights):
            values[:, never] = 0
            for frame, row in enumerate(fill_missing(values).astype(np.float32), start=first):
                sampled.Set(Vt.FloatArray.FromNumpy(row), frame)
    if len(lost):  # the format cannot say that a weight is not known
        animation.GetPrim().SetCustomDataByKey("mimique:missing", Vt.IntArray(lost.ravel().tolist()))
    binding = UsdSkel.BindingAPI.Apply(stage.GetPrimAtPath(f"{ROOT}/Skeleton"))
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])


def _identifiers(names: list[str]) -> list[str]:
    """Return names that USD accepts for prims: letters, digits, underscores, none twice."""
    from pxr import Tf

    taken = {"Skeleton"}
    result = []
    for name in names:
        plain = Tf.MakeValidIdentifier(name)
        number, found = 2, plain
        while found in taken:
            found, number = f"{plain}_{number}", number + 1
        taken.add(found)
        result.append(found)
    return result
