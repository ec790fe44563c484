"""A take's animation out of a corpus: on its own rig, on others, and on real ones."""

import json

import numpy as np
import pytest
import typer
from mimique.corpus import Corpus
from mimique.corpus.formats.weights_files import read_weights
from mimique.corpus.take import make_take
from mimique.errors import InputError, NotFoundError
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.gltf_animation import read_gltf_weights
from mimique.synthesis.rig_obj import read_obj
from mimique.workbench.commands import rigs
from mimique.workbench.pipeline.exporting import export
from mimique.workbench.pipeline.ingesting import Recording, ingest
from typer.testing import CliRunner

from .small_face import SHAPES as DOME
from .small_face import make_rig, make_weights


@pytest.fixture(scope="module")
def faces(tmp_path_factory):
    """A corpus with two rigs and the weights of three signers on the first of them."""
    made = Corpus.create(tmp_path_factory.mktemp("faces") / "corpus")
    rig = make_rig()
    other = Rig(rig.neutral, rig.triangles, rig.deltas, ("Brow", *DOME[1:3], "Jaw"), [("skin", 100), ("teeth", 540)])
    weights = make_weights([(0.5, {"jawOpen": 1.0}), (0.5, {"browUp": 0.5, "mouthSmile_L": 1.0})]).astype(np.float32)
    weights[7:9] = np.nan
    with made.transaction("Fill", author="cr") as edit:
        edit.put_rig("dome", rig.to_dataset())
        edit.put_rig("other", other.to_dataset())
        for signer, scope in (("ab", "public"), ("cd", "none"), ("ef", "project")):
            edit.put_take(
                f"{signer}_IE", make_take(np.zeros((len(weights), 3, 3)), ["A", "B", "C"], 100, signer=signer)
            )
            edit.put_weights(f"{signer}_IE", weights, shapes=DOME, solve="dome-map", rig="dome")
            edit.put_signer(signer, {"consent": scope})
    return made


def test_animations(faces, tmp_path):
    weights = faces.weights("ab_IE")["weights"].values.astype(float)
    line = export(faces, "ab_IE", tmp_path / "a.glb")
    assert f"{len(weights)} frames at 100 Hz, 4 shapes of rig dome\n  2 frames without weights show the neutral" in line
    np.testing.assert_allclose(read_rig(tmp_path / "a.glb").deltas, make_rig().deltas, rtol=1e-6)
    read = read_gltf_weights(tmp_path / "a.glb")
    np.testing.assert_array_equal(read["weights"].values, weights)
    line = export(faces, "ab_IE", tmp_path / "seq", rate=5.0)
    files = sorted((tmp_path / "seq").iterdir())
    assert len(files) == -(-len(weights) // 20) and files[0].name == "ab_IE.000000.obj"
    vertices, triangles = read_obj(files[9])
    np.testing.assert_allclose(vertices, make_rig().pose(weights[180]), atol=1e-4)
    np.testing.assert_array_equal(triangles, make_rig().triangles)


def test_animations_on_another_rig(faces, tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("from,to,gain\njawOpen,Jaw,0.5\nbrowUp,Brow,1\n")
    line = export(faces, "ab_IE", tmp_path / "a.glb", rig="other", shapes=str(table), rate=50.0)
    assert "at 50 Hz, 4 shapes of rig other" in line
    weights = faces.weights("ab_IE")["weights"].values
    read = read_gltf_weights(tmp_path / "a.glb")
    jaw = read["weights"].sel(shape="Jaw").values
    np.testing.assert_allclose(jaw, weights[::2, DOME.index("jawOpen")] * 0.5, atol=1e-6)
    rig = read_rig(tmp_path / "a.glb")
    assert rig.parts == (("skin", 100), ("teeth", 540))
    export(faces, "ab_IE", tmp_path / "a.csv", rig="other", shapes=str(table), rate=50.0)
    again = read_weights(tmp_path / "a.csv")
    assert again["shape"].values.tolist() == list(rig.shapes) and again.attrs["rate"] == 50
    np.testing.assert_allclose(again["weights"].sel(shape="Jaw"), jaw, atol=1e-6)
    line = export(faces, "ab_IE", tmp_path / "b.glb", rig="other")
    assert "move nothing on this rig: browUp, jawOpen" in line and "at rest: Brow, Jaw" in line


def test_usd_is_written_or_names_its_package(faces, tmp_path):
    try:
        import pxr  # noqa: F401
    except ImportError:
        with pytest.raises(InputError, match=r"mimique\[usd\]"):
            export(faces, "ab_IE", tmp_path / "a.usda")
    else:
        assert "4 shapes of rig dome" in export(faces, "ab_IE", tmp_path / "a.usda")


@pytest.mark.parametrize(
    ("file", "options", "error", "message"),
    [
        ("a.glb", {"rig": "none"}, NotFoundError, "no rig 'none'"),
        ("a.glb", {"shapes": "none.csv"}, InputError, r"no such table of shapes.*arkit-to-makehuman"),
        ("a.glb", {"shapes": "arkit-to-makehuman"}, InputError, "none of its shapes is one of take"),
        ("a.glb", {"rate": -1.0}, InputError, "rate: expected a positive"),
        ("a.glb", {"step": "stabilised"}, InputError, "markers are written to"),
        ("a.c3d", {"rate": 5.0}, InputError, "rate chooses among weights"),
        ("a.glb", {"content": "weights"}, InputError, r"weights are written to .csv, .parquet, not to .glb"),
        ("none/a.glb", {}, InputError, "there is no folder"),
        ("none/seq", {}, InputError, "there is no folder"),
        ("a.fbx", {}, InputError, "a name without an ending for a folder of OBJ files"),
    ],
)
def test_animations_that_cannot_be(faces, tmp_path, file, options, error, message):
    with pytest.raises(error, match=message):
        export(faces, "ab_IE", tmp_path / file, **options)
    assert not list(tmp_path.iterdir())


def test_consent_holds_for_animations(faces, tmp_path):
    for file in ("a.glb", "a.usda", "seq"):
        with pytest.raises(InputError, match="the consent of signer 'cd' is 'none'"):
            export(faces, "cd_IE", tmp_path / file)
        with pytest.raises(InputError, match="does not cover files for public"):
            export(faces, "ef_IE", tmp_path / file, purpose="public")
    assert not list(tmp_path.iterdir())


def test_arkit_performances_on_real_rigs(tmp_path, shared_data):
    made = Corpus.create(tmp_path / "corpus")
    recording = shared_data / "arkit_recordings" / "livelinkface" / "apfel.csv"
    performance = read_weights(recording)
    with made.transaction("Fill", author="cr") as edit:
        for name, unit in (("ict_facekit", "cm"), ("makehuman", "dm")):
            edit.put_rig(name, read_rig(shared_data / name / "rig.npz", unit=unit).to_dataset())
    ingest(made, [Recording(recording)])
    jaw = performance["weights"].sel(shape=[s for s in performance["shape"].values if s.lower() == "jawopen"]).values
    for rig, shapes, shape in (
        ("ict_facekit", None, "jawOpen"),
        ("makehuman", "arkit-to-makehuman", "mouth-open"),
    ):
        line = export(made, "apfel", tmp_path / f"{rig}.glb", rig=rig, shapes=shapes)
        assert f"of rig {rig}" in line
        read = read_gltf_weights(tmp_path / f"{rig}.glb")
        np.testing.assert_allclose(read["weights"].sel(shape=shape).values, jaw[:, 0], atol=1e-6)
        stored = Rig.from_dataset(made.rig(rig))
        np.testing.assert_allclose(read_rig(tmp_path / f"{rig}.glb").deltas, stored.deltas, rtol=1e-6, atol=1e-12)


def test_rig_show(faces, capsys):
    app = typer.Typer()
    rigs.register(app)
    app.command("other")(lambda: None)
    result = CliRunner().invoke(app, ["show", str(faces.path), "other"])
    assert result.exit_code == 0, result.output
    assert "without                 Brow, Jaw" in result.output
    (teeth,) = [line.split() for line in result.output.splitlines() if "teeth" in line]
    assert teeth[2] == "540" and int(teeth[1]) == len(np.unique(make_rig().triangles[100:]))
    result = CliRunner().invoke(app, ["show", str(faces.path), "dome", "--json"])
    found = json.loads(result.output)
    assert found["shapes"] == 4 and found["parts"] == 1
    assert [row["arkit"] for row in found["shape_names"]] == ["", "mouthSmileLeft", "mouthSmileRight", "jawOpen"]
    assert found["shape_names"][0]["most"] == pytest.approx(
        np.linalg.norm(make_rig().deltas[0], axis=1).max(), abs=0.01
    )
