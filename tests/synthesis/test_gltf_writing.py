import json
import struct
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import InputError, RigError
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.avatar import build_avatar, vertex_colours
from mimique.synthesis.gltf_animation import read_gltf_weights
from mimique.synthesis.gltf_writing import write_gltf

from .gltf_programs import Foreign, play, validate

SINGLE = 2.0**-23  # relative step of single precision


def small_rig(rng, n_vertices=30, n_shapes=5, parts=()):
    """A bag of triangles; the third shape moves nothing, the last vertex belongs to no triangle."""
    triangles = np.array([rng.choice(n_vertices - 1, 3, replace=False) for _ in range(24)])
    deltas = rng.normal(size=(n_shapes, n_vertices, 3)) * (rng.random((n_shapes, n_vertices, 1)) < 0.2)
    deltas[2] = 0
    return Rig(rng.normal(size=(n_vertices, 3)) * 80, triangles, deltas, [f"s{i}" for i in range(n_shapes)], parts)


def chunks(path):
    data = path.read_bytes()
    magic, version, total = struct.unpack_from("<4sII", data)
    assert (magic, version, total) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON" and size % 4 == 0
    rest, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert kind == b"BIN\0" and rest % 4 == 0 and 28 + size + rest == total
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def assert_same(rig, again):
    assert again.shapes == rig.shapes
    np.testing.assert_allclose(again.neutral, rig.neutral, rtol=2 * SINGLE, atol=1e-30)
    np.testing.assert_allclose(again.deltas, rig.deltas, rtol=2 * SINGLE, atol=1e-30)
    np.testing.assert_array_equal(again.triangles, rig.triangles)


@given(
    seed=st.integers(0, 2**32 - 1),
    cut=st.integers(0, 24),
    names=st.lists(st.text(st.characters(exclude_categories=["Cs", "Cc"])), min_size=5, max_size=5, unique=True),
    n_frames=st.integers(1, 9),
    rate=st.floats(0.5, 1000),
)
@settings(max_examples=40)
def test_rig_names_and_weights_survive_within_single_precision(tmp_path_factory, seed, cut, names, n_frames, rate):
    rng = np.random.default_rng(seed)
    plain = small_rig(rng, parts=[("skin", cut), ("teeth", 24 - cut)])
    rig = Rig(plain.neutral, plain.triangles, plain.deltas, names, plain.parts)
    weights = rng.normal(size=(n_frames, 5))
    weights[rng.random(n_frames) < 0.2] = np.nan
    given = weights.copy()
    path = write_gltf(tmp_path_factory.mktemp("gltf") / "a.glb", rig, weights, rate)
    np.testing.assert_array_equal(weights, given)
    again = read_rig(path)
    assert_same(rig, again)
    assert again.parts == (() if cut in (0, 24) else rig.parts)
    read = read_gltf_weights(path)
    order = [list(read["shape"].values).index(name) for name in names]
    known = np.where(np.isnan(weights).any(axis=1, keepdims=True), np.nan, weights)
    np.testing.assert_allclose(read["weights"].values[:, order], known, rtol=SINGLE)
    assert read.attrs["rate"] == rate
    np.testing.assert_allclose(read["time"], np.arange(n_frames) / rate)


@pytest.mark.parametrize("colours", [False, True])
@pytest.mark.parametrize("shape_normals", [False, True])
def test_pygltflib_reads_what_was_meant(tmp_path, rng, colours, shape_normals):
    rig = small_rig(rng, parts=[("skin", 10), ("teeth", 14)])
    weights = rng.random((7, 5))
    tints = rng.random((30, 3)) if colours else None
    path = write_gltf(
        tmp_path / "a.glb", rig, weights, 50.0, colours=tints, shape_normals=shape_normals, interpolation="STEP"
    )
    foreign = Foreign(path)
    foreign.check()
    gltf = foreign.gltf
    assert [mesh.name for mesh in gltf.meshes] == ["skin", "teeth"]
    assert len(gltf.buffers) == 1 and gltf.buffers[0].uri is None
    moved = np.full((5, 30, 3), np.nan)
    for mesh in gltf.meshes:
        primitive = mesh.primitives[0]
        numbers = foreign.read(primitive.attributes._VERTEX)[:, 0].astype(int)
        np.testing.assert_allclose(foreign.read(primitive.attributes.POSITION) * 1000, rig.neutral[numbers], rtol=1e-6)
        moved[:, numbers] = 0
        for name, target in zip(mesh.extras["targetNames"], primitive.targets, strict=True):
            moved[rig.index(name), numbers] = foreign.read(target["POSITION"]) * 1000
            assert ("NORMAL" in target) == shape_normals
        if colours:
            values = foreign.read(primitive.attributes.COLOR_0) / 65535
            np.testing.assert_allclose(values[:, :3], ((tints[numbers] + 0.055) / 1.055) ** 2.4, atol=0.01)
            assert (values[:, 3] == 1).all()
    np.testing.assert_allclose(moved, rig.deltas, rtol=1e-6, atol=1e-9)
    (animation,) = gltf.animations
    for channel, mesh in zip(animation.channels, gltf.meshes, strict=True):
        sampler = animation.samplers[channel.sampler]
        columns = [rig.index(name) for name in mesh.extras["targetNames"]]
        assert sampler.interpolation == "STEP" and channel.target.path == "weights"
        np.testing.assert_allclose(foreign.read(sampler.input)[:, 0], np.arange(7) / 50, rtol=1e-6)
        np.testing.assert_allclose(foreign.read(sampler.output).reshape(7, -1), weights[:, columns], rtol=1e-6)


def test_each_target_is_stored_in_its_smallest_form(tmp_path):
    deltas = np.zeros((3, 300, 3))
    deltas[1, :3] = 1.0
    deltas[2] = 1.0
    rig = Rig(np.random.default_rng(1).normal(size=(300, 3)), [[0, 1, 2]], deltas, ["none", "few", "all"])
    document, _ = chunks(write_gltf(tmp_path / "a.glb", rig))
    targets = document["meshes"][0]["primitives"][0]["targets"]
    none, few, everything = (document["accessors"][t["POSITION"]] for t in targets)
    assert none["sparse"]["count"] == 1 and none["min"] == none["max"] == [0, 0, 0] and "bufferView" not in none
    assert few["sparse"]["count"] == 3 and few["sparse"]["indices"]["componentType"] == 5123
    assert "sparse" not in everything and "bufferView" in everything
    assert "animations" not in document


def test_parts_have_only_the_shapes_that_touch_them(tmp_path):
    deltas = np.zeros((3, 6, 3))
    deltas[0, :3], deltas[1, 3:] = 1.0, 2.0
    rig = Rig(np.eye(6)[:, :3] * 9 + 1, [[0, 1, 2], [3, 4, 5]], deltas, ["a", "b", "none"], [("eye", 1), ("eye", 1)])
    document, _ = chunks(write_gltf(tmp_path / "a.glb", rig, np.ones((2, 3)), 10.0))
    assert [mesh["name"] for mesh in document["meshes"]] == ["eye", "eye 2"]
    assert [mesh["extras"]["targetNames"] for mesh in document["meshes"]] == [["a", "none"], ["b"]]
    assert len(document["animations"][0]["channels"]) == 2
    still = Rig(rig.neutral, rig.triangles, deltas[:1], ["a"], [("skin", 1), ("teeth", 1)])
    document, _ = chunks(write_gltf(tmp_path / "b.glb", still, np.ones((2, 1)), 10.0))
    assert "targets" not in document["meshes"][1]["primitives"][0]
    assert len(document["animations"][0]["channels"]) == 1
    assert_same(still, read_rig(tmp_path / "b.glb"))


def test_tolerance_leaves_out_what_is_smaller(tmp_path, rng):
    rig = small_rig(rng)
    again = read_rig(write_gltf(tmp_path / "a.glb", rig, tolerance=1.0))
    size = np.linalg.norm(rig.deltas, axis=2)
    assert (again.deltas[size <= 1.0] == 0).all() and (np.linalg.norm(again.deltas, axis=2)[size > 1.0] > 0.99).all()


@pytest.mark.parametrize("kind", ["face", "parts", "normals", "colours"])
def test_the_khronos_validator_finds_nothing(tmp_path, rng, kind):
    parts = [("skin", 10), ("teeth", 14)] if kind == "parts" else ()
    rig = small_rig(rng, parts=parts)
    path = write_gltf(
        tmp_path / f"{kind}.glb",
        rig,
        rng.random((20, 5)),
        60.0,
        colours=rng.random((30, 3)) if kind == "colours" else None,
        shape_normals=kind == "normals",
    )
    (issues,) = validate(path)
    assert (issues["numErrors"], issues["numWarnings"], issues["numInfos"]) == (0, 0, 0), issues["messages"]


def test_three_js_shows_the_same_face(tmp_path, rng):
    rig = small_rig(rng, parts=[("skin", 10), ("teeth", 14)])
    weights = rng.normal(size=(9, 5))
    path = write_gltf(tmp_path / "a.glb", rig, weights, 8.0)
    found = play(path, 0.0, 0.5, 0.8125)
    assert found["duration"] == [1.0]
    expected = rig.pose(np.stack([weights[0], weights[4], (weights[6] + weights[7]) / 2]))
    for shown, mesh in zip(found["shown"], expected, strict=True):
        for part, triangles in zip(shown, (rig.triangles[:10], rig.triangles[10:]), strict=True):
            vertices = np.unique(triangles) if part["name"] == "teeth" else np.union1d(triangles, _loose(rig))
            np.testing.assert_allclose(np.reshape(part["points"], (-1, 3)) * 1000, mesh[vertices], atol=1e-3)


def test_vtk_reads_it(tmp_path, rng):
    """In a process of its own: VTK ends the program where it does not understand a file."""
    rig = small_rig(rng, parts=[("skin", 10), ("teeth", 14)])
    path = write_gltf(tmp_path / "a.glb", rig, rng.random((9, 5)), 8.0, colours=rng.random((30, 3)))
    code = (
        "import sys; from vtkmodules.vtkIOGeometry import vtkGLTFReader\n"
        "reader = vtkGLTFReader(); reader.SetFileName(sys.argv[1]); reader.UpdateInformation(); reader.Update()\n"
        "print(reader.GetOutput().GetNumberOfPoints(), reader.GetNumberOfAnimations(), reader.GetAnimationDuration(0))"
    )
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=False)
    shared = np.intersect1d(rig.triangles[:10], rig.triangles[10:])
    assert (done.returncode, done.stdout.split()) == (0, [str(30 + len(shared)), "1", "1.0"]), done.stderr


def _loose(rig):
    return np.setdiff1d(np.arange(rig.n_vertices), rig.triangles)


def test_real_rigs_survive_validate_and_stay_small(tmp_path, shared_data):
    rigs = {
        "avatar": (build_avatar(), vertex_colours()),
        "ict": (read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm"), None),
        "makehuman": (read_rig(shared_data / "makehuman" / "rig.npz", unit="dm"), None),
    }
    for name, (rig, colours) in rigs.items():
        path = write_gltf(tmp_path / f"{name}.glb", rig, colours=colours)
        assert_same(rig, read_rig(path))
        dense = rig.deltas.size * 4
        assert path.stat().st_size < {"avatar": 2.5e6, "ict": 0.9 * dense, "makehuman": 0.2 * dense}[name]
    reports = validate(*(tmp_path / f"{name}.glb" for name in rigs))
    assert [r["numErrors"] + r["numWarnings"] for r in reports] == [0, 0, 0]


class OneByOne:
    """Weights that can only be read in small parts."""

    def __init__(self, n_frames, n_shapes):
        self.shape, self.largest = (n_frames, n_shapes), 0

    def __len__(self):
        return self.shape[0]

    def __getitem__(self, part):
        frames = np.arange(*part.indices(len(self)))
        self.largest = max(self.largest, len(frames))
        return np.outer(frames, np.ones(self.shape[1])) / len(self)


def test_long_takes_are_read_a_part_at_a_time(tmp_path, rng):
    rig, weights = small_rig(rng), OneByOne(50_000, 5)
    path = write_gltf(tmp_path / "a.glb", rig, weights, 200.0)
    assert weights.largest < 10_000
    read = read_gltf_weights(path)
    np.testing.assert_allclose(read["weights"][:, 0], np.arange(50_000) / 50_000, rtol=SINGLE)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"weights": np.zeros((0, 5)), "rate": 10.0}, "at least one frame"),
        ({"weights": np.zeros((3, 4)), "rate": 10.0}, "expected 5 columns"),
        ({"weights": np.zeros(5), "rate": 10.0}, "expected 5 columns"),
        ({"weights": np.full((3, 5), np.inf), "rate": 10.0}, "frame 0, shape 's0'.*inf"),
        ({"weights": np.full((3, 5), 1e39), "rate": 10.0}, "single precision"),
        ({"weights": np.zeros((3, 5)), "rate": 0.0}, "rate: expected a positive"),
        ({"weights": np.zeros((3, 5)), "rate": np.nan}, "rate: expected a positive"),
        ({"weights": np.zeros((3, 5)), "rate": 1e-40}, "cannot be told apart"),
        ({"weights": np.zeros((3, 5))}, "come together"),
        ({"interpolation": "CUBIC"}, "LINEAR, STEP"),
        ({"colours": np.zeros((29, 3))}, "colours: expected shape"),
        ({"colours": np.full((30, 3), 2.0)}, "from 0 to 1"),
    ],
)
def test_what_cannot_be_written_is_said_and_nothing_is_left(tmp_path, rng, options, words):
    with pytest.raises(InputError, match=words):
        write_gltf(tmp_path / "a.glb", small_rig(rng), **options)
    assert not list(tmp_path.iterdir())


def test_frames_that_single_precision_cannot_tell_apart_are_refused(tmp_path, rng):
    with pytest.raises(InputError, match="give another rate"):  # after 4096 s they are half a millisecond apart
        write_gltf(tmp_path / "a.glb", small_rig(rng), OneByOne(9_000_000, 5), 2_100.0)
    with pytest.raises(RigError, match="no triangles"):
        write_gltf(tmp_path / "a.glb", Rig(np.eye(3), np.empty((0, 3), int), np.zeros((1, 3, 3)), ["a"]))
    with pytest.raises(RigError, match="single precision"):
        write_gltf(tmp_path / "a.glb", Rig(np.eye(3) * 1e50, [[0, 1, 2]], np.zeros((1, 3, 3)), ["a"]))
    with pytest.raises(RigError, match="half a character"):
        write_gltf(tmp_path / "a.glb", Rig(np.eye(3), [[0, 1, 2]], np.zeros((1, 3, 3)), ["a\ud800"]))
    assert not list(tmp_path.iterdir())


def test_an_unusable_place_and_a_full_disk_leave_nothing(tmp_path, rng):
    rig = small_rig(rng)
    with pytest.raises(InputError, match="there is no folder"):
        write_gltf(tmp_path / "nowhere" / "a.glb", rig)
    with pytest.raises(InputError, match=r"ending in \.glb"):
        write_gltf(tmp_path / "a.gltf", rig)
    (tmp_path / "b.glb").mkdir()
    with pytest.raises(InputError, match="there is a folder of that name"):
        write_gltf(tmp_path / "b.glb", rig)
    (tmp_path / "b.glb").rmdir()
    (tmp_path / "a.glb").write_bytes(b"older")
    code = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))\n"
        "import numpy as np; from mimique.synthesis import Rig; from mimique.synthesis.gltf_writing import write_gltf\n"
        "rig = Rig(np.random.rand(9000, 3), [[0, 1, 2]], np.zeros((1, 9000, 3)), ['a'])\n"
        "try: write_gltf(sys.argv[1], rig)\n"
        "except ValueError as error: print(type(error).__name__, error)"
    )
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "a.glb"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("InputError") and "cannot be written" in done.stdout
    assert [p.name for p in tmp_path.iterdir()] == ["a.glb"] and (tmp_path / "a.glb").read_bytes() == b"older"
