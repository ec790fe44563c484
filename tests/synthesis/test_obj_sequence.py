import subprocess
import sys
from collections import namedtuple

import numpy as np
import pytest
from mimique.errors import InputError, RigError
from mimique.synthesis import Rig
from mimique.synthesis import obj_sequence as module
from mimique.synthesis.obj_sequence import write_obj_sequence
from mimique.synthesis.rig_obj import read_obj

CUBE = np.array([[0, 0, 0], [90, 0, 0], [90, 90, 0], [0, 90, 30.5]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def make_rig(parts=()):
    return Rig(CUBE, FACES, np.random.default_rng(0).normal(size=(2, 4, 3)) * 9, ["a", "b"], parts)


def test_every_frame_is_the_pose(tmp_path, rng):
    rig, weights = make_rig([("skin", 1), ("upper teeth", 1)]), rng.random((12, 2))
    weights[3] = np.nan
    told = []
    folder = write_obj_sequence(
        tmp_path / "out", rig, weights, 25.0, name="ab/IE é", progress=lambda done, of: told.append((done, of))
    )
    files = sorted(folder.iterdir())
    assert [files[0].name, files[-1].name] == ["ab_IE é.000000.obj", "ab_IE é.000011.obj"]
    expected = rig.pose(np.where(np.isnan(weights), 0, weights))
    for path, mesh in zip(files, expected, strict=True):
        vertices, triangles = read_obj(path)
        np.testing.assert_allclose(vertices, mesh, atol=1e-4)
        np.testing.assert_array_equal(triangles, FACES)
    text = files[3].read_text()
    assert text.startswith("# mimique, millimetres, frame 3 of 12, 0.120000 s\n")
    assert "g skin\nf 1 2 3\n" in text and "g upper_teeth\nf 1 3 4\n" in text
    assert told[0] == (1, 12) and told[-1] == (12, 12)


def test_vtk_reads_it(tmp_path, rng):
    pyvista = pytest.importorskip("pyvista")
    weights = rng.random((1, 2))
    folder = write_obj_sequence(tmp_path / "out", make_rig(), weights, 25.0)
    mesh = pyvista.read(next(folder.iterdir()))
    np.testing.assert_allclose(mesh.points, make_rig().pose(weights)[0], atol=1e-3)


def test_folders_that_cannot_be_used(tmp_path):
    weights = np.zeros((2, 2))
    with pytest.raises(InputError, match="there is no folder"):
        write_obj_sequence(tmp_path / "a" / "b", make_rig(), weights, 25.0)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").write_text("kept")
    with pytest.raises(InputError, match="new or an empty folder"):
        write_obj_sequence(tmp_path / "full", make_rig(), weights, 25.0)
    with pytest.raises(RigError, match="no triangles"):
        write_obj_sequence(tmp_path / "new", Rig(CUBE, FACES[:0], np.zeros((1, 4, 3)), ["a"]), weights[:, :1], 25.0)
    (tmp_path / "empty").mkdir()
    write_obj_sequence(tmp_path / "empty", make_rig(), weights, 25.0)
    assert {p.name for p in tmp_path.iterdir()} == {"full", "empty"} and len(list((tmp_path / "full").iterdir())) == 1


def test_a_disk_that_is_too_small_is_said_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(module.shutil, "disk_usage", lambda path: namedtuple("Use", "free")(300))
    with pytest.raises(InputError, match=r"do not fit.*give a lower rate"):
        write_obj_sequence(tmp_path / "out", make_rig(), np.zeros((50, 2)), 25.0)
    assert not list(tmp_path.iterdir())


def test_a_disk_that_fills_up_leaves_nothing(tmp_path):
    code = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))\n"
        "import numpy as np; from mimique.synthesis import Rig\n"
        "from mimique.synthesis.obj_sequence import write_obj_sequence\n"
        "rig = Rig(np.random.rand(900, 3), [[0, 1, 2]], np.zeros((1, 900, 3)), ['a'])\n"
        "try: write_obj_sequence(sys.argv[1], rig, np.zeros((3, 1)), 25.0)\n"
        "except ValueError as error: print(type(error).__name__, error)"
    )
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "out"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("InputError") and "cannot be written" in done.stdout
    assert not list(tmp_path.iterdir())
