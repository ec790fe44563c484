"""glTF as other programs write it: several meshes, quantised numbers, skins, strips, dropped keys."""

import numpy as np
import pytest
from mimique.errors import FileFormatError, InputError, NotFoundError, RigError
from mimique.synthesis import ARKIT_NAMES, read_rig
from mimique.synthesis.gltf_animation import read_gltf_weights
from mimique.synthesis.shape_names import describe_shape_names, find_absent_shapes

from .test_rig_files import DELTAS, FANS, SQUARE, Gltf


def save(tmp_path, gltf, document):
    path = tmp_path / "face.glb"
    document.setdefault("extensionsUsed", [])
    path.write_bytes(gltf.glb(document))
    return path


def mesh_of(gltf, points, names=None, deltas=DELTAS, **more):
    position = gltf.dense(np.asarray(points, "<f4"), "VEC3", 5126)
    indices = gltf.dense(FANS.astype("<u2").ravel()[:, None], "SCALAR", 5123)
    primitive = {"attributes": {"POSITION": position}, "indices": indices}
    mesh = {"primitives": [primitive], **more}
    if names:
        primitive["targets"] = [{"POSITION": gltf.sparse(d)} for d in deltas[: len(names)]]
        mesh["extras"] = {"targetNames": names}
    return mesh


def scene_of(gltf, *meshes, **more):
    document = gltf.document(meshes[0], **more)
    document["meshes"] = list(meshes)
    document.setdefault("nodes", [{"mesh": i} for i in range(len(meshes))])
    document["scenes"] = [{"nodes": list(range(len(document["nodes"])))}]
    return document


def test_meshes_with_different_shapes_become_one_rig(tmp_path):
    gltf = Gltf()
    face = mesh_of(gltf, SQUARE, ["jawOpen", "eyeBlink_L"], name="Face")
    teeth = mesh_of(gltf, SQUARE * 0.5 + 0.2, ["jawOpen", "tongueOut"], name="Teeth")
    eyes = mesh_of(gltf, SQUARE * 0.1 + 0.4, name="Eyes")
    body = mesh_of(gltf, SQUARE * 9 - [0, 20, 0], name="Body")
    with pytest.warns(UserWarning, match=r"left out.*'Body'"):
        rig = read_rig(save(tmp_path, gltf, scene_of(gltf, face, body, teeth, eyes)))
    assert rig.shapes == ("jawOpen", "eyeBlink_L", "tongueOut")
    assert rig.parts == (("Face", 3), ("Teeth", 3), ("Eyes", 3))
    assert rig.n_vertices == 15
    np.testing.assert_array_equal(rig.triangles, np.vstack([FANS, FANS + 5, FANS + 10]))
    np.testing.assert_allclose(rig.deltas[0, :10], np.vstack([DELTAS[0], DELTAS[0]]) * 1000, rtol=1e-6)
    np.testing.assert_allclose(rig.deltas[1, :5], DELTAS[1] * 1000)
    np.testing.assert_allclose(rig.deltas[2, 5:10], DELTAS[1] * 1000)
    assert not rig.deltas[1:, 10:].any() and not rig.deltas[1, 5:].any() and not rig.deltas[2, :5].any()


def test_meshes_outside_of_the_scene_do_not_count(tmp_path):
    gltf = Gltf()
    face, other = mesh_of(gltf, SQUARE, ["jawOpen"]), mesh_of(gltf, SQUARE, ["jawOpen", "spare"])
    document = scene_of(gltf, face, other)
    document["scenes"] = [{"nodes": [0]}]
    assert read_rig(save(tmp_path, gltf, document)).shapes == ("jawOpen",)


def test_quantised_numbers_and_their_node(tmp_path):
    """KHR_mesh_quantization: positions as normalised 16-bit numbers, and the node's transform puts them right."""
    gltf = Gltf()
    stored = np.round(SQUARE / 2 * 32767).astype("<i2")
    moves = np.round(DELTAS / 2 * 32767).astype("<i2")
    position = gltf.dense(stored, "VEC3", 5122, stride=8)
    targets = [gltf.dense(m, "VEC3", 5122, stride=8) for m in moves]
    for accessor in gltf.accessors:
        accessor["normalized"] = True
    indices = gltf.dense(FANS.astype("<u1").ravel()[:, None], "SCALAR", 5121)
    primitive = {
        "attributes": {"POSITION": position},
        "indices": indices,
        "targets": [{"POSITION": t} for t in targets],
        "extras": {"targetNames": ["a", "b"]},
    }
    document = scene_of(
        gltf,
        {"primitives": [primitive]},
        nodes=[{"mesh": 0, "scale": [2, 2, 2], "translation": [0, 0, 1]}],
        extensionsRequired=["KHR_mesh_quantization"],
    )
    rig = read_rig(save(tmp_path, gltf, document))
    np.testing.assert_allclose(rig.neutral, (SQUARE + [0, 0, 1]) * 1000, atol=0.05)
    np.testing.assert_allclose(rig.deltas, DELTAS * 1000, atol=0.05)
    assert rig.shapes == ("a", "b")


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [(5, [0, 1, 2, 3, 4], [[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]])],
)
def test_strips_and_fans(tmp_path, mode, indices, expected):
    gltf = Gltf()
    mesh = mesh_of(gltf, SQUARE, ["jawOpen"])
    mesh["primitives"][0] |= {
        "mode": mode, "indices": gltf.dense(np.array(indices, "<u2")[:, None], "SCALAR", 5123)
    }  # fmt: skip
    np.testing.assert_array_equal(read_rig(save(tmp_path, gltf, scene_of(gltf, mesh))).triangles, expected)


def test_a_skinned_mesh_stands_as_its_skeleton_rests(tmp_path):
    """Two joints: one at scale 0.01 as many exporters have it, one turned; the mesh's own node does not count."""
    gltf = Gltf()
    mesh = mesh_of(gltf, SQUARE * 100, ["jawOpen", "b"], deltas=DELTAS * 100)
    joints = np.zeros((5, 4), "<u1")
    joints[4] = 1
    shares = np.zeros((5, 4), "<f4")
    shares[:, 0] = 1
    attributes = mesh["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = gltf.dense(joints, "VEC4", 5121)
    attributes["WEIGHTS_0"] = gltf.dense(shares, "VEC4", 5126)
    back = np.tile(np.eye(4, dtype="<f4"), (2, 1, 1))
    back[0, :3, 3] = [1, 2, 3]
    inverse = gltf.dense(np.ascontiguousarray(back.transpose(0, 2, 1).reshape(2, 16)), "MAT4", 5126)
    nodes = [
        {"mesh": 0, "skin": 0, "translation": [9, 9, 9]},
        {"scale": [0.01, 0.01, 0.01], "children": [2]},
        {"rotation": [0, 0, np.sqrt(0.5), np.sqrt(0.5)]},
    ]
    document = scene_of(gltf, mesh, nodes=nodes, skins=[{"joints": [1, 2], "inverseBindMatrices": inverse}])
    document["scenes"] = [{"nodes": [0, 1]}]
    rig = read_rig(save(tmp_path, gltf, document))
    expected = SQUARE + np.array([1, 2, 3]) * 0.01
    expected[4] = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]) @ SQUARE[4]
    np.testing.assert_allclose(rig.neutral, expected * 1000, rtol=1e-5, atol=1e-3)
    moved = DELTAS.copy()
    moved[0, 4] = [-0.25, 0, 0.5]
    np.testing.assert_allclose(rig.deltas, moved * 1000, rtol=1e-5, atol=1e-3)


def test_targets_without_names_of_several_meshes_stay_apart(tmp_path):
    gltf = Gltf()
    meshes = [mesh_of(gltf, SQUARE, ["x"], name=name) for name in ("Face", "Brows")]
    for mesh in meshes:
        del mesh["extras"]
    assert read_rig(save(tmp_path, gltf, scene_of(gltf, *meshes))).shapes == ("Face.target0", "Brows.target0")


def test_what_cannot_be_read_is_one_line(tmp_path):
    gltf = Gltf()
    mesh = mesh_of(gltf, SQUARE, ["jawOpen"])
    mesh["primitives"][0]["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}
    assert read_rig(save(tmp_path, gltf, scene_of(gltf, mesh))).n_shapes == 1  # it has a copy that is not packed
    del gltf.accessors[0]["bufferView"]
    with pytest.raises(FileFormatError, match=r"compressed .KHR_draco_mesh_compression.; export it uncompressed"):
        read_rig(save(tmp_path, gltf, scene_of(gltf, mesh)))
    gltf = Gltf()
    twice = mesh_of(gltf, SQUARE, ["a", "a"], name="Face")
    with pytest.raises(RigError, match="shape names repeat in mesh 'Face': a"):
        read_rig(save(tmp_path, gltf, scene_of(gltf, twice)))
    gltf = Gltf()
    document = scene_of(gltf, mesh_of(gltf, SQUARE, ["a"]), nodes=[{"children": [1]}, {"mesh": 0, "children": [0]}])
    assert read_rig(save(tmp_path, gltf, document)).n_vertices == 5  # a circle of nodes ends
    gltf = Gltf()
    wrong = mesh_of(gltf, SQUARE, ["a"])
    wrong["primitives"][0]["indices"] = gltf.dense(np.array([[0], [1], [9]], "<u2"), "SCALAR", 5123)
    with pytest.raises(FileFormatError, match="names a vertex that is not there"):
        read_rig(save(tmp_path, gltf, scene_of(gltf, wrong)))


def animated(gltf, keys, values, kind="LINEAR", names=("a", "b")):
    mesh = mesh_of(gltf, SQUARE, list(names))
    times = gltf.dense(np.asarray(keys, "<f4")[:, None], "SCALAR", 5126)
    output = gltf.dense(np.asarray(values, "<f4").ravel()[:, None], "SCALAR", 5126)
    animation = {
        "name": "talk",
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
        "samplers": [{"input": times, "output": output, "interpolation": kind}],
    }
    return scene_of(gltf, mesh, animations=[animation])


def test_even_keys_are_the_frames(tmp_path):
    gltf = Gltf()
    values = np.random.default_rng(0).random((50, 2)).astype(np.float32)
    read = read_gltf_weights(save(tmp_path, gltf, animated(gltf, 2 + np.arange(50) / 30, values)))
    np.testing.assert_array_equal(read["weights"], values)
    assert read.attrs == {"rate": 30.0, "source_file": "face.glb"} and read["shape"].values.tolist() == ["a", "b"]
    np.testing.assert_allclose(read["time"], 2 + np.arange(50) / 30, atol=1e-6)


def test_dropped_keys_are_sampled(tmp_path):
    gltf = Gltf()
    keys = np.array([0, 1, 4, 6]) / 24
    values = np.array([[0, 1], [0.5, 1], [0.2, 0], [0, 0]])
    path = save(tmp_path, gltf, animated(gltf, keys, values))
    read = read_gltf_weights(path)
    assert read.attrs["rate"] == pytest.approx(24, abs=1e-3)
    expected = np.stack([np.interp(np.arange(7) / 24, keys, column) for column in values.T], axis=1)
    np.testing.assert_allclose(read["weights"], expected, atol=1e-4)
    assert read_gltf_weights(path, rate=48.0).sizes["time"] == 13
    gltf = Gltf()
    stepped = read_gltf_weights(save(tmp_path, gltf, animated(gltf, keys, values, "STEP")))
    np.testing.assert_allclose(stepped["weights"][:, 0], [0, 0.5, 0.5, 0.5, 0.2, 0.2, 0], atol=1e-6)


def test_cubic_curves(tmp_path):
    """A cubic through its own values and slopes is itself: t³ and 1 − t²."""
    gltf = Gltf()
    keys = np.array([0.0, 1.0, 1.5])
    point = np.stack([keys**3, 1 - keys**2], axis=1)
    slope = np.stack([3 * keys**2, -2 * keys], axis=1)
    path = save(tmp_path, gltf, animated(gltf, keys, np.stack([slope, point, slope], axis=1), "CUBICSPLINE"))
    read = read_gltf_weights(path, rate=20.0)
    t = np.arange(31) / 20
    np.testing.assert_allclose(read["weights"], np.stack([t**3, 1 - t**2], axis=1), atol=1e-6)


def test_animations_that_cannot_be_read(tmp_path):
    gltf = Gltf()
    document = animated(gltf, [0, 1], np.zeros((2, 2)))
    two = {**document, "animations": [document["animations"][0], {**document["animations"][0], "name": "blink"}]}
    path = save(tmp_path, gltf, two)
    with pytest.raises(InputError, match="several animations move weights; choose one of talk, blink"):
        read_gltf_weights(path)
    assert read_gltf_weights(path, animation="blink").sizes["time"] == 2
    with pytest.raises(NotFoundError, match="no animation 'walk'"):
        read_gltf_weights(path, animation="walk")
    with pytest.raises(FileFormatError, match="found none"):
        read_gltf_weights(save(tmp_path, gltf, {**document, "animations": []}))
    with pytest.raises(InputError, match="no such file"):
        read_gltf_weights(tmp_path / "absent.glb")
    with pytest.raises(InputError, match="rate"):
        read_gltf_weights(path, rate=-1.0)
    gltf = Gltf()
    with pytest.raises(FileFormatError, match="do not ascend"):
        read_gltf_weights(save(tmp_path, gltf, animated(gltf, [1, 0], np.zeros((2, 2)))))
    gltf = Gltf()
    with pytest.raises(FileFormatError, match="not a readable glTF"):
        read_gltf_weights(save(tmp_path, gltf, animated(gltf, [0, 1], np.zeros((2, 3)))))
    gltf = Gltf()
    with pytest.raises(FileFormatError, match="one key"):
        read_gltf_weights(save(tmp_path, gltf, animated(gltf, [0], np.zeros((1, 2)))))


def test_names_and_what_did_not_map(shared_data):
    names = ["jawOpen", "mouth_smile_left", "Head.eyeBlinkRight", "browInnerUp_L", "CheekPuff", "Fcl_ALL_Joy"]
    table = describe_shape_names(names)
    assert table["arkit"].tolist() == ["jawOpen", "mouthSmileLeft", "eyeBlinkRight", "browInnerUp", "cheekPuff", ""]
    expected = ["same name", "spelled otherwise", "spelled otherwise", "one side of it", "spelled otherwise"]
    assert table["how"].tolist() == [*expected, "no ARKit shape"]
    assert len(find_absent_shapes(names)) == len(ARKIT_NAMES) - 5
    ict = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    assert find_absent_shapes(ict) == ["tongueOut"]
    assert (describe_shape_names(ict)["how"] == "one side of it").sum() == 4
