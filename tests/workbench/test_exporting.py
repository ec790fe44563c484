"""What goes out of a corpus, by the functions and by the command, and what a signer's consent keeps in."""

import numpy as np
import pandas as pd
import pytest
import typer
import xarray as xr
from mimique.corpus import Corpus, read_take, read_tiers
from mimique.corpus.formats.weights_files import read_weights
from mimique.corpus.take import make_take
from mimique.errors import InputError, MimiqueError, NotFoundError
from mimique.workbench.commands import exporting
from mimique.workbench.pipeline.exporting import export, export_bids
from typer.testing import CliRunner

SHAPES = ["jawOpen", "mouthSmileLeft"]
CONSENT = {"ab": "public", "cd": "none", "ef": "project"}


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    rng = np.random.default_rng(4)
    made = Corpus.create(tmp_path_factory.mktemp("exports") / "corpus")
    tier = pd.DataFrame({"onset": [0, 10], "offset": [10, 30], "label": ["neutral", "joy"]})
    with made.transaction("Fill", author="cr") as edit:
        for signer in ("ab", "cd", "ef", "gh"):
            name = f"{signer}_IE"
            position = rng.normal(size=(40, 3, 3)).astype(np.float32) * 50
            take = make_take(position, ["A", "B", "C"], 200, signer=signer, protocol="IE")
            edit.put_take(name, take)
            edit.put_weights(name, rng.random((40, 2)).astype(np.float32), shapes=SHAPES, solve="dome-map")
            edit.put_tier(name, "affect", tier, author="cr")
            edit.put_tier(name, "affect", tier.assign(label="fear"), author="mk")
            edit.put_tier(name, "intensity", tier, author="mk")
            moved = take[["position"]] + 1000.0
            edit.put_processed(name, "stabilised", moved)
            edit.put_processed(name, "pose", xr.Dataset({"angle": ("time", np.zeros(40))}, {"time": take["time"]}))
        for code, scope in CONSENT.items():
            edit.put_signer(code, {"consent": scope})
    return made


@pytest.fixture
def command(corpus):
    app = typer.Typer()
    app.command("export")(exporting.export)
    app.command("other")(lambda: None)
    folder = str(corpus.path)

    def run(*arguments):
        result = CliRunner().invoke(app, ["export", folder, *map(str, arguments)])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == 0, result.output
        return result.output

    return run


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_weights(corpus, tmp_path, suffix):
    line = export(corpus, "ab_IE", tmp_path / f"w{suffix}")
    assert line.endswith("40 frames, 2 shapes")
    again = read_weights(tmp_path / f"w{suffix}")
    np.testing.assert_array_equal(again["weights"].astype(np.float32), corpus.weights("ab_IE")["weights"])
    assert again["shape"].values.tolist() == SHAPES and again.attrs["rate"] == 200
    if suffix == ".csv":
        assert (tmp_path / "w.csv").read_text().splitlines()[0] == "time,jawOpen,mouthSmileLeft"


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".nc"])
@pytest.mark.parametrize("step", [None, "stabilised"])
def test_markers_as_recorded_and_of_a_step(corpus, tmp_path, suffix, step):
    export(corpus, "ab_IE", tmp_path / f"m{suffix}", step=step)
    expected = corpus.take("ab_IE")["position"].values + (1000 if step else 0)
    np.testing.assert_allclose(read_take(tmp_path / f"m{suffix}")["position"], expected, atol=1e-4)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_markers_as_tables(corpus, tmp_path, suffix):
    export(corpus, "ab_IE", tmp_path / f"m{suffix}", content="markers")
    np.testing.assert_allclose(
        read_take(tmp_path / f"m{suffix}")["position"], corpus.take("ab_IE")["position"], atol=1e-4
    )
    export(corpus, "ab_IE", tmp_path / f"s{suffix}", step="stabilised")
    assert read_take(tmp_path / f"s{suffix}")["position"].values.min() > 500


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ({}, {"affect@cr", "affect@mk", "intensity"}),
        ({"tiers": ["affect"]}, {"affect@cr", "affect@mk"}),
        ({"tiers": ["affect@mk"]}, {"affect@mk"}),
        ({"authors": ["mk"]}, {"affect@mk", "intensity"}),
        ({"authors": ["mk"], "tiers": ["intensity"]}, {"intensity"}),
    ],
)
def test_tiers_of_these_names_and_authors(corpus, tmp_path, options, names):
    export(corpus, "ab_IE", tmp_path / "t.TextGrid", **options)
    assert set(read_tiers(tmp_path / "t.TextGrid", rate=200)) == names


@pytest.mark.parametrize(
    ("file", "options", "error", "message"),
    [
        ("a.mp4", {}, InputError, "ends in one of .csv"),
        ("a.c3d", {"content": "weights"}, InputError, "weights are written to .csv, .parquet, not to .c3d"),
        ("a.c3d", {"solve": "x"}, InputError, "solve chooses among weights"),
        ("a.csv", {"content": "film"}, InputError, "expected one of weights"),
        ("a.csv", {"content": "markers", "format": "livelink"}, InputError, "format chooses among weights"),
        ("a.eaf", {"step": "stabilised"}, InputError, "markers are written to"),
        ("a.c3d", {"step": "nothing"}, NotFoundError, "'nothing'"),
        ("a.c3d", {"step": "pose"}, InputError, "holds no marker positions"),
        ("a.eaf", {"tiers": ["gloss"]}, NotFoundError, "no tier 'gloss'; it has affect@cr"),
        ("a.eaf", {"authors": ["zz"]}, NotFoundError, "no tier of author 'zz'"),
        ("a.eaf", {"authors": ["cr"], "tiers": ["intensity"]}, NotFoundError, "of that name and author"),
        ("a.csv", {"solve": "other"}, NotFoundError, "'other'"),
        ("a.c3d", {"purpose": "fun"}, InputError, "purposes"),
    ],
)
def test_what_is_asked_wrongly_is_named_and_nothing_is_written(corpus, tmp_path, file, options, error, message):
    with pytest.raises(error, match=message):
        export(corpus, "ab_IE", tmp_path / file, **options)
    assert not list(tmp_path.iterdir())


def test_consent_holds_for_every_kind_of_file(corpus, tmp_path):
    for file in ("a.csv", "a.parquet", "a.eaf", "a.TextGrid", "a.c3d", "a.trc", "a.nc"):
        with pytest.raises(
            InputError, match=r"'cd_IE' does not leave the corpus: the consent of signer 'cd' is 'none'"
        ):
            export(corpus, "cd_IE", tmp_path / file)
        export(corpus, "ef_IE", tmp_path / f"project_{file}")
        with pytest.raises(InputError, match="'project', which does not cover files for research"):
            export(corpus, "ef_IE", tmp_path / file, purpose="research")
    assert all(path.name.startswith("project_") for path in tmp_path.iterdir())


def test_bids_leaves_out_who_did_not_consent(corpus, tmp_path):
    table, refusals = export_bids(corpus, tmp_path / "bids")
    assert table["take"].tolist() == ["ab_IE", "ef_IE", "gh_IE"]
    assert len(refusals) == 1 and refusals[0].startswith("cd_IE: left out: the consent of signer 'cd'")
    everything = "".join(p.name + p.read_text() for p in (tmp_path / "bids").rglob("*") if p.is_file())
    assert "cd" not in everything.replace("recorded", "")
    table, refusals = export_bids(corpus, tmp_path / "public", purpose="public")
    assert table["take"].tolist() == ["ab_IE"] and len(refusals) == 3
    with pytest.raises(MimiqueError, match="cd_IE: left out"):
        export_bids(corpus, tmp_path / "none", takes=["cd_IE"])
    with pytest.raises(NotFoundError, match="'zz'"):
        export_bids(corpus, tmp_path / "none", takes=["zz"])
    assert not (tmp_path / "none").exists()


def test_the_command(command, tmp_path):
    assert "40 frames, 2 shapes" in command("ab_IE", tmp_path / "w.csv")
    assert "2 tiers" in command("ab_IE", tmp_path / "t.eaf", "--author", "mk")
    assert "3 markers" in command("ab_IE", tmp_path / "m.csv", "--markers", "--step", "stabilised")
    command("ab_IE", tmp_path / "l.csv", "--livelink")
    assert read_weights(tmp_path / "l.csv").attrs["timecode_rate"] == 60
    out = command("--bids", tmp_path / "bids")
    assert "cd_IE: left out" in out and "3 takes, 1 left out" in out
    for wrong in (["ab_IE"], [], ["ab_IE", tmp_path / "x.csv", "--bids", tmp_path / "b"]):
        with pytest.raises(InputError):
            command(*wrong)
