import base64
import gzip
import json
import re
import struct

import numpy as np
import pytest
from mimique.errors import FileFormatError, InputError, RigError
from mimique.synthesis import read_rig

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1.0]])
FANS = np.array([[0, 1, 2], [0, 2, 3], [3, 4, 0]])
DELTAS = np.zeros((2, 5, 3))
DELTAS[0, 4] = [0, 0.25, 0.5]
DELTAS[1, 1] = [0.125, 0, 0]
NAMES = ["jawOpen", "mouthSmile_L"]


def obj_text(vertices, faces="f 1/1/1 2/2/1 3//1 4\nf -2 -1 -5\n", newline="\n"):
    rows = ["# a comment", "mtllib x.mtl", "vt 0 0", "vn 0 0 1", "o face"]
    rows += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    return newline.join(rows) + newline + faces


def write_folder(folder, **texts):
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        if name.endswith("_gz"):
            (folder / f"{name[:-3]}.obj.gz").write_bytes(gzip.compress(text.encode()))
        else:
            (folder / f"{name}.obj").write_text(text)
    return folder


def write_npz(path, **changes):
    arrays = {"vertices": SQUARE, "triangles": FANS, "names": np.array(NAMES), "deltas": DELTAS, **changes}
    np.savez(path, **{k: v for k, v in arrays.items() if v is not None})
    return path


class Gltf:
    """A small independent writer of glTF, dense and sparse, GLB and JSON with data URIs."""

    def __init__(self):
        self.data = b""
        self.views, self.accessors = [], []

    def view(self, array, stride=None):
        raw = array.tobytes()
        if stride:
            raw = b"".join(row.tobytes().ljust(stride, b"\xff") for row in array)
        self.data += b"\0" * (-len(self.data) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw)})
        if stride:
            self.views[-1]["byteStride"] = stride
        self.data += raw
        return len(self.views) - 1

    def dense(self, array, kind, component, stride=None):
        self.accessors.append(
            {"bufferView": self.view(array, stride), "componentType": component, "count": len(array), "type": kind}
        )
        return len(self.accessors) - 1

    def sparse(self, array):
        rows = np.flatnonzero(np.abs(array).any(1))
        self.accessors.append(
            {
                "componentType": 5126,
                "count": len(array),
                "type": "VEC3",
                "sparse": {
                    "count": len(rows),
                    "indices": {"bufferView": self.view(rows.astype("<u2")), "componentType": 5123},
                    "values": {"bufferView": self.view(array[rows].astype("<f4"))},
                },
            }
        )
        return len(self.accessors) - 1

    def face(self, sparse=False, stride=None, names=NAMES):
        position = self.dense(SQUARE.astype("<f4"), "VEC3", 5126, stride)
        indices = self.dense(FANS.astype("<u2").ravel()[:, None], "SCALAR", 5123)
        targets = [
            {"POSITION": self.sparse(d) if sparse else self.dense(d.astype("<f4"), "VEC3", 5126)} for d in DELTAS
        ]
        mesh = {"primitives": [{"attributes": {"POSITION": position}, "indices": indices, "targets": targets}]}
        if names:
            mesh["extras"] = {"targetNames": list(names)}
        return mesh

    def document(self, mesh, **more):
        return {
            "asset": {"version": "2.0"},
            "meshes": [{"primitives": []}, mesh],
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.data)}],
            **more,
        }

    def glb(self, document):
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        data = self.data + b"\0" * (-len(self.data) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1), ("cm", 10), ("dm", 100), ("m", 1000), ("in", 25.4)])
def test_npz_is_converted_to_millimetres(tmp_path, unit, factor):
    rig = read_rig(write_npz(tmp_path / "rig.npz"), unit=unit)
    np.testing.assert_allclose(rig.neutral, SQUARE * factor)
    np.testing.assert_allclose(rig.deltas, DELTAS * factor)
    np.testing.assert_array_equal(rig.triangles, FANS)
    assert rig.shapes == tuple(NAMES)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_obj_folder_with_polygons_gzip_and_negative_indices(tmp_path, newline):
    folder = write_folder(
        tmp_path / "face",
        my_Neutral=obj_text(SQUARE, newline=newline),
        mouthSmile_L_gz=obj_text(SQUARE + DELTAS[1]),
        jawOpen=obj_text(SQUARE + DELTAS[0], faces=""),
        identity003=obj_text(SQUARE * 2),
    )
    rig = read_rig(folder, unit="cm")
    np.testing.assert_array_equal(rig.triangles, FANS)
    assert rig.shapes == ("jawOpen", "mouthSmile_L")
    np.testing.assert_allclose(rig.deltas, DELTAS * 10, atol=1e-4)


def test_real_obj_files_agree_with_the_arrays_of_the_same_rig(shared_data):
    folder = read_rig(shared_data / "ict_facekit" / "obj", unit="cm")
    arrays = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    assert folder.n_vertices == 26719 and folder.n_shapes == 5
    kept = arrays.n_vertices
    np.testing.assert_allclose(folder.neutral[:kept], arrays.neutral, atol=1e-3)
    for shape in folder.shapes:
        np.testing.assert_allclose(
            folder.deltas[folder.index(shape), :kept], arrays.deltas[arrays.index(shape)], atol=2e-3
        )


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("stride", [None, 20])
def test_glb_dense_and_sparse_targets(tmp_path, sparse, stride):
    gltf = Gltf()
    path = tmp_path / "face.glb"
    path.write_bytes(gltf.glb(gltf.document(gltf.face(sparse, stride))))
    rig = read_rig(path)
    np.testing.assert_allclose(rig.neutral, SQUARE * 1000, rtol=1e-6)
    np.testing.assert_allclose(rig.deltas, DELTAS * 1000, rtol=1e-6)
    np.testing.assert_array_equal(rig.triangles, FANS)
    assert rig.shapes == tuple(NAMES)
    np.testing.assert_allclose(read_rig(path, unit="mm").neutral, SQUARE, rtol=1e-6)


def test_gltf_with_data_uri_and_placed_node(tmp_path):
    gltf = Gltf()
    turn = {"mesh": 1, "rotation": [0, 0, np.sqrt(0.5), np.sqrt(0.5)]}  # A quarter turn about z.
    parent = {"children": [0], "translation": [1, 2, 3], "scale": [2, 2, 2]}
    document = gltf.document(gltf.face(names=None), nodes=[turn, parent])
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(gltf.data).decode()
    path = tmp_path / "face.gltf"
    path.write_text(json.dumps(document))
    rig = read_rig(path)
    turned = SQUARE @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).T
    np.testing.assert_allclose(rig.neutral, (2 * turned + [1, 2, 3]) * 1000, rtol=1e-6, atol=1e-3)
    assert rig.shapes == ("target0", "target1")


def test_parts_of_a_mesh_are_joined_and_shared_vertices_kept_once(tmp_path):
    gltf = Gltf()
    mesh = gltf.face()
    other = gltf.face()["primitives"][0]
    mesh["primitives"] += [dict(mesh["primitives"][0]), other]
    path = tmp_path / "face.glb"
    path.write_bytes(gltf.glb(gltf.document(mesh)))
    rig = read_rig(path)
    assert rig.n_vertices == 10 and len(rig.triangles) == 9
    np.testing.assert_array_equal(rig.triangles[6:], FANS + 5)


def test_a_missing_unit_is_refused_with_a_likely_one(tmp_path):
    path = write_npz(tmp_path / "rig.npz", vertices=SQUARE * 25)
    with pytest.raises(RigError, match=r"rig\.npz: its unit is not known.*suggests cm"):
        read_rig(path)
    with pytest.raises(RigError, match="expected a unit out of mm, cm, dm, m, in, but got 'ft'"):
        read_rig(path, unit="ft")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"deltas": None}, "deltas is missing"),
        ({"deltas": DELTAS[:, :4]}, "2 shapes × 5 vertices, but got 2 × 4"),
        ({"deltas": DELTAS[:0], "names": np.array([], dtype=str)}, "no shapes"),
        ({"names": np.array(["a", "a"])}, "shape names repeat: a"),
        ({"names": np.array([1, 2])}, "list of texts"),
        ({"vertices": np.where(SQUARE == 0.5, np.nan, SQUARE)}, "finite"),
        ({"triangles": FANS + 3}, "vertex 7"),
        ({"triangles": FANS * 1.0}, "numbers in 'triangles'"),
        ({"vertices": np.array([object()])}, "not a readable"),
    ],
)
def test_npz_that_is_no_rig(tmp_path, changes, words):
    with pytest.raises(InputError, match=words):
        read_rig(write_npz(tmp_path / "rig.npz", **changes), unit="cm")


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        ({"jawOpen": obj_text(SQUARE), "smile": obj_text(SQUARE)}, "which file is the neutral.*none has it"),
        ({"neutral": obj_text(SQUARE), "neutral2": obj_text(SQUARE)}, "several have it: neutral, neutral2"),
        ({"neutral": obj_text(SQUARE)}, "at least one shape"),
        ({"neutral": obj_text(SQUARE), "jawOpen": obj_text(SQUARE[:4], "f 1 2 3\n")}, "4 vertices, but the neutral"),
        ({"neutral": obj_text(SQUARE), "jawOpen": obj_text(SQUARE, "f 1 2 4\n")}, "other faces than the neutral"),
        ({"neutral": obj_text(SQUARE, "f 1 2 9\n"), "jawOpen": obj_text(SQUARE)}, "a face names vertex 9"),
        ({"neutral": obj_text(SQUARE, "f 1 2\n"), "jawOpen": obj_text(SQUARE)}, "line 11.*three or more corners"),
        ({"neutral": obj_text(SQUARE, "v 1 x 2\n"), "jawOpen": obj_text(SQUARE)}, "line 11: not an OBJ mesh"),
        ({"neutral": "hello\n", "jawOpen": obj_text(SQUARE)}, "v x y z"),
        ({"neutral": obj_text(SQUARE), "jawOpen": obj_text(SQUARE), "jawOpen_gz": "v 1 2 3"}, "jawOpen is there both"),
        ({}, "holds none"),
    ],
)
def test_folders_that_are_no_rig(tmp_path, texts, words):
    with pytest.raises(InputError, match=words):
        read_rig(write_folder(tmp_path / "face", **texts), unit="cm")


def test_damaged_and_foreign_files_get_one_line(tmp_path):
    gltf = Gltf()
    good = gltf.glb(gltf.document(gltf.face()))
    plain = Gltf()
    mesh = plain.face()
    del mesh["primitives"][0]["targets"]
    cases = {
        "short.glb": (good[:-40], "bytes"),
        "text.glb": (b"hello", "not a readable glTF"),
        "draco.glb": (
            gltf.glb(gltf.document(gltf.face(), extensionsRequired=["KHR_draco_mesh_compression"])),
            "compressed",
        ),
        "plain.glb": (plain.glb(plain.document(mesh)), "morph targets"),
        "short.npz": (write_npz(tmp_path / "a.npz").read_bytes()[:300], "not a readable .npz"),
        "rig.fbx": (b"", r"expected a folder of OBJ files, .npz, .glb or .gltf, but got '.fbx'"),
    }
    for name, (data, words) in cases.items():
        path = tmp_path / name
        path.write_bytes(data)
        with pytest.raises(InputError) as error:
            read_rig(path, unit="cm")
        assert re.search(words, str(error.value)) and name in str(error.value) and "\n" not in str(error.value)
    with pytest.raises(InputError, match="no such file"):
        read_rig(tmp_path / "absent.npz", unit="cm")
    (folder := tmp_path / "gz").mkdir()
    (folder / "neutral.obj.gz").write_bytes(b"not gzip")
    (folder / "jawOpen.obj").write_text(obj_text(SQUARE))
    with pytest.raises(FileFormatError, match=r"neutral\.obj\.gz: cannot be read"):
        read_rig(folder, unit="cm")
