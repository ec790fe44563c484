"""USD by its own library: what is shown, and what its validators say."""

import sys

import numpy as np
import pytest
from mimique.errors import InputError, RigError
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.avatar import build_avatar, vertex_colours
from mimique.synthesis.usd_writing import write_usd

from .test_gltf_writing import small_rig

NAMES = ["jawOpen", "brow up/é", "brow up é", "3", "Skeleton"]


@pytest.fixture
def pxr():
    return pytest.importorskip("pxr", reason="usd-core is not at hand")


def named(rng, **options):
    rig = small_rig(rng, **options)
    return Rig(rig.neutral, rig.triangles, rig.deltas, NAMES, rig.parts)


def find_issues(path):
    from pxr import Usd, UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    issues = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))
    return [(issue.GetName(), issue.GetMessage()) for issue in issues]


def pose(stage, frame):
    """Return the points of every mesh as UsdSkel deforms them."""
    from pxr import Usd, UsdGeom, UsdSkel, Vt

    cache = UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(stage.GetDefaultPrim()), Usd.PrimDefaultPredicate)
    shown = {}
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        points = Vt.Vec3fArray(UsdGeom.Mesh(prim).GetPointsAttr().Get())
        query = cache.GetSkinningQuery(prim)
        if query.HasBlendShapes():
            skeleton = cache.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath("/Face/Skeleton")))
            weights = query.GetBlendShapeMapper().Remap(skeleton.GetAnimQuery().ComputeBlendShapeWeights(frame))
            shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
            chosen = shapes.ComputeSubShapeWeights(weights)
            indices, offsets = shapes.ComputeBlendShapePointIndices(), shapes.ComputeSubShapePointOffsets()
            assert shapes.ComputeDeformedPoints(*chosen, indices, offsets, points)
        shown[prim.GetName()] = np.array(points)
    return shown


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_usd_shows_the_same_face_and_its_validators_find_nothing(pxr, tmp_path, rng, suffix):
    from pxr import Usd, UsdGeom

    rig = named(rng, parts=[("skin", 10), ("skin", 14)])
    weights = rng.normal(size=(6, 5))
    weights[4, 1] = np.nan
    path = write_usd(tmp_path / f"a{suffix}", rig, weights, 50.0, colours=rng.random((30, 3)))
    assert find_issues(path) == []
    stage = Usd.Stage.Open(str(path))
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (50, 0, 5)
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.001 and UsdGeom.GetStageUpAxis(stage) == "Y"
    loose = np.setdiff1d(np.arange(30), rig.triangles)
    for frame, expected in ((0, weights[0]), (3, weights[3]), (4, np.zeros(5)), (2.5, weights[2:4].mean(axis=0))):
        shown, mesh = pose(stage, frame), rig.pose(expected)
        np.testing.assert_allclose(shown["skin"], mesh[np.union1d(rig.triangles[:10], loose)], atol=1e-4)
        np.testing.assert_allclose(shown["skin_2"], mesh[np.unique(rig.triangles[10:])], atol=1e-4)
    animation = stage.GetPrimAtPath("/Face/Skeleton/Animation")
    assert list(animation.GetAttribute("blendShapes").Get()) == NAMES


def test_a_rig_alone_and_real_rigs(pxr, tmp_path, shared_data):
    from pxr import Usd

    avatar = build_avatar()
    path = write_usd(tmp_path / "avatar.usdc", avatar, colours=vertex_colours())
    assert find_issues(path) == [] and path.stat().st_size < 2.5e6
    makehuman = read_rig(shared_data / "makehuman" / "rig.npz", unit="dm")
    weights = np.random.default_rng(0).random((3, makehuman.n_shapes))
    path = write_usd(tmp_path / "makehuman.usdc", makehuman, weights, 60.0)
    np.testing.assert_allclose(pose(Usd.Stage.Open(str(path)), 2)["face"], makehuman.pose(weights[2]), atol=1e-3)


def test_what_cannot_be_written(pxr, tmp_path, rng):
    rig = named(rng)
    for options, words in (
        ({"weights": np.zeros((2, 4)), "rate": 10.0}, "expected 5 columns"),
        ({"weights": np.full((2, 5), np.inf), "rate": 10.0}, "frame 0, shape 'jawOpen'"),
        ({"rate": 10.0}, "come together"),
        ({"colours": np.full((30, 3), -1.0)}, "from 0 to 1"),
    ):
        with pytest.raises(InputError, match=words):
            write_usd(tmp_path / "a.usda", rig, **options)
    with pytest.raises(InputError, match="there is no folder"):
        write_usd(tmp_path / "x" / "a.usda", rig)
    with pytest.raises(InputError, match=r"ending in \.usd"):
        write_usd(tmp_path / "a.fbx", rig)
    with pytest.raises(RigError, match="no triangles"):
        write_usd(tmp_path / "a.usda", Rig(rig.neutral, rig.triangles[:0], rig.deltas, NAMES))
    assert not list(tmp_path.iterdir())


def test_without_the_library_it_says_what_to_install(tmp_path, rng, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(InputError, match=r"pip install 'mimique\[usd\]'"):
        write_usd(tmp_path / "a.usda", named(rng))
