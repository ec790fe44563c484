"""Marker layouts of a corpus: who acts, what the command writes, and that the corpus can solve with what it stored."""

import json

import numpy as np
import pandas as pd
import pytest
import typer
from mimique.corpus import Corpus, read_take
from mimique.corpus.take import make_bare_take, make_take
from mimique.errors import InputError, MimiqueError, NotFoundError
from mimique.synthesis import Rig, read_marker_map
from mimique.workbench.commands import layouts as command
from mimique.workbench.pipeline.layout_actors import gather_cast
from mimique.workbench.pipeline.session_solver import SolveOptions
from mimique.workbench.pipeline.solving import solve
from mimique.workbench.pipeline.studying_layouts import LayoutOptions, describe_markers, store_layout, study_layouts

from .small_face import make_rig

SHAPES = make_rig().shapes
PLAN = {
    "sizes": (6, 8),
    "n_seeds": 2,
    "n_frames": 8,
    "n_loss_frames": 2,
    "n_rom_frames": 40,
    "n_cluster_frames": 10,
    "n_checked": 60,
    "n_pairs": 3,
    "n_candidates": 100,
    "budget": 20,
    "noises": (0.2,),
    "offs": (2.0,),
    "min_distance": 5.0,
    "reconstructions": ("solver",),
    "methods": ("k-means median", "greedy + swaps", "greedy, mirrored"),
}


def perform(n, seed):
    t = np.linspace(0, 6, n)[:, None]
    return np.clip(np.sin(t * [1.0, 1.7, 2.3, 3.1] + np.random.default_rng(seed).uniform(0, 6, 4)), 0, 1)


def add_take(edit, name, weights, **facts):
    edit.put_take(name, make_bare_take(len(weights), 30.0, **facts))
    edit.put_weights(name, weights, shapes=SHAPES, solve="imported")


@pytest.fixture
def corpus(tmp_path):
    """One signer, three faces of one mesh, one rig of another."""
    corpus = Corpus.create(tmp_path / "corpus")
    base = make_rig()
    with corpus.transaction("Make") as edit:
        for number, name in enumerate(("base", "A", "B", "C")):
            face = Rig(base.neutral * [1 + 0.02 * number, 1, 1], base.triangles, base.deltas, base.shapes)
            edit.put_rig(name, face.to_dataset())
        other = Rig(base.neutral, base.triangles[:-3], base.deltas, base.shapes)
        edit.put_rig("other", other.to_dataset())
        add_take(edit, "rom", perform(80, 1), signer="s1", protocol="ROM")
        talk = perform(30, 2)
        talk[3:6] = np.nan
        add_take(edit, "talk", talk, signer="s1", protocol="IE")
    return corpus


def run(*arguments):
    app = typer.Typer()
    app.callback()(lambda: None)
    command.register(app)
    return app(args=["layout", *map(str, arguments)], standalone_mode=False)


def test_one_signer_on_several_faces(corpus):
    cast = gather_cast(corpus, rig="base")
    assert [a.name for a in cast.training] == ["A", "B"] and [a.name for a in cast.unseen] == ["C"]
    assert cast.training[0].range_of_motion.shape == (80, 4)
    assert {t: len(w) for t, w in cast.unseen[0].tests.items()} == {"talk": 27}
    notes = " ".join(cast.notes)
    assert "face 'other'" in notes and "3 frames without weights" in notes
    apart = gather_cast(corpus, rig="base", unseen=["A"], range_of_motion=["talk"])
    assert [a.name for a in apart.unseen] == ["A"] and list(apart.unseen[0].tests) == ["rom"]


def test_several_signers(corpus):
    with corpus.transaction("More") as edit:
        add_take(edit, "s2_long", perform(60, 3), signer="s2", protocol="IE")
        add_take(edit, "s2_short", perform(20, 4), signer="s2", protocol="IE")
    cast = gather_cast(corpus, rig="base", faces=["base"])
    assert [a.name for a in (*cast.training, *cast.unseen)] == ["s1", "s2"]
    assert len(cast.unseen[0].range_of_motion) == 60
    assert "the longest, s2_long" in " ".join(cast.notes)
    dealt = gather_cast(corpus, rig="base", faces=["A", "B"])
    assert [a.name for a in (*dealt.training, *dealt.unseen)] == ["s1 on A", "s2 on B"]


def test_bad_casts(corpus, tmp_path):
    with pytest.raises(InputError, match="face 'other': its mesh"):
        gather_cast(corpus, rig="base", faces=["A", "other"])
    with pytest.raises(NotFoundError, match="no rig 'nobody'"):
        gather_cast(corpus, rig="nobody")
    with pytest.raises(InputError, match="no take 'rum'"):
        gather_cast(corpus, rig="base", range_of_motion=["rum"])
    with pytest.raises(InputError, match="unseen: expected some of A, B, C"):
        gather_cast(corpus, rig="base", unseen=["D"])
    with pytest.raises(InputError, match="left to learn from"):
        gather_cast(corpus, rig="base", unseen=["s1"])
    bare = Corpus.create(tmp_path / "bare")
    with pytest.raises(NotFoundError, match="no rig yet"):
        gather_cast(bare)
    with bare.transaction("Rig") as edit:
        edit.put_rig("base", make_rig().to_dataset())
    with pytest.raises(InputError, match="no take with weights"):
        gather_cast(bare)
    with bare.transaction("One take") as edit:
        add_take(edit, "rom", perform(50, 1), signer="s1", protocol="ROM")
    alone = gather_cast(bare)
    assert len(alone.training[0].range_of_motion) == 30 and list(alone.training[0].tests) == ["rom, end"]
    assert not alone.unseen and "stand for the range of motion" in " ".join(alone.notes)


def test_study_store_and_solve(corpus, tmp_path):
    options = LayoutOptions(rig="base", markers=8, plan=PLAN)
    snapshot = corpus.snapshot
    study = study_layouts(corpus, options=options)
    assert corpus.snapshot == snapshot and not (tmp_path / "corpus.scratch").exists()
    assert study.recommended.endswith(" 8")
    again = study_layouts(corpus, options=options)
    assert again.tables["errors"].equals(study.tables["errors"])
    said = store_layout(corpus, study, "eight", author="me")
    assert "8 markers" in said and "unchanged" in store_layout(corpus, study, "eight", author="me")
    table = corpus.marker_map("base", "eight")
    assert table["vertex"].tolist() == describe_markers(study)["vertex"].tolist()
    assert corpus.history().iloc[0]["message"].startswith("Keep the layout")

    base = make_rig()
    weights = perform(60, 5)
    weights[:10] = 0
    points = base.pose(weights, table["vertex"].to_numpy())
    head = base.pose(weights, [0, 16, 340, 356])
    names = [*table["marker"], "H1", "H2", "H3", "H4"]
    take = make_take(np.concatenate([points, head], axis=1), names, 30.0, signer="s3", protocol="ROM")
    with corpus.transaction("Markers") as edit:
        edit.put_take("marked", take)
    outcome = solve(
        corpus,
        SolveOptions(rig="base", marker_map="eight", head_markers=("H1", "H2", "H3", "H4")),
        takes=["marked"],
    )
    assert outcome["residual"].iloc[0] < 1.0


def test_an_interrupted_study_leaves_its_pieces(corpus, tmp_path, monkeypatch):
    from mimique.models.layouts import study as inner

    def stop(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(inner, "tabulate_robustness", stop)
        with pytest.raises(KeyboardInterrupt):
            study_layouts(corpus, options=LayoutOptions(rig="base", plan=PLAN))
    kept = list((tmp_path / "corpus.scratch").glob("*.npz"))
    assert len(kept) > 10
    with monkeypatch.context() as patched:
        patched.setattr(inner.Trials, "score_layout", stop)  # all layouts were scored before
        study_layouts(corpus, options=LayoutOptions(rig="base", plan=PLAN))
    assert not (tmp_path / "corpus.scratch").exists()


def test_command_writes_what_is_asked_for(corpus, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(LayoutOptions, "make_plan", lambda self, make=LayoutOptions.make_plan: make(replace_plan(self)))
    out = tmp_path / "out"
    out.mkdir()
    run(
        *(corpus.path, "--rig", "base", "--markers", 8, "--tables", out / "tables", "--map", out / "map.csv"),
        *("--labels", out / "labels.c3d", "--store", "eight", "--json"),
    )
    found = json.loads(capsys.readouterr().out)
    assert found["recommended"].endswith(" 8") and found["tested_on"] == "unseen"
    table = read_marker_map(out / "map.csv")
    assert table["marker"].tolist() == [row["marker"] for row in found["markers"]]
    labels = read_take(out / "labels.c3d")
    assert labels["marker"].values.tolist() == table["marker"].tolist()
    np.testing.assert_allclose(labels["position"].values[0], make_rig().neutral[table["vertex"]], atol=1e-3)
    errors = pd.read_csv(out / "tables" / "errors.csv")
    assert {"layout", "mean_mm", "rmse_printed"} <= set(errors)
    assert Corpus.open(corpus.path).marker_map("base", "eight")["marker"].tolist() == table["marker"].tolist()
    run(corpus.path, "--rig", "base")
    shown = capsys.readouterr().out
    assert "recommended: " in shown and "note: " in shown


def replace_plan(options):
    from dataclasses import replace

    return replace(options, plan=PLAN)


def test_command_refuses(corpus, tmp_path):
    for arguments, message in (
        (["--labels", "x.csv"], "ends in .c3d"),
        (["--report", tmp_path / "no" / "x.html"], "its folder does not exist"),
        (["--at", "main", "--store", "x"], "--at reads an older version"),
        (["--markers", "3"], "expected 4 or more"),
        (["--set", "Vicon 9"], "expected some of"),
        (["--rig", "base", "--set", "MAN 15"], "MAN 15"),
        (["--rig", "base", "--markers", "4000"], "only"),
    ):
        with pytest.raises(MimiqueError, match=message):
            run(corpus.path, *arguments)


def test_labels_lose_where_markers_say_little(corpus):
    tier = pd.DataFrame({"onset": [0, 40, 80], "offset": [40, 80, 120], "label": ["neutral", "joy", "anger"]})
    with corpus.transaction("Label") as edit:
        for number in range(4):
            poses = np.repeat(np.array([[0, 0, 0, 0], [0, 0.9, 0.9, 0], [0.9, 0, 0, 0.2]]), 40, axis=0)
            weights = np.clip(poses + np.random.default_rng(number).normal(0, 0.05, poses.shape), 0, 1)
            add_take(edit, f"l{number}", weights, signer=f"p{number % 2}", protocol="IE")
            edit.put_tier(f"l{number}", "affect", tier, author="A1")
    study = study_layouts(corpus, options=LayoutOptions(rig="base", faces=("base",), plan=PLAN))
    labels = study.tables["labels"].set_index("layout")
    assert labels.loc["all weights", "accuracy"] > 0.95
    assert (labels["accuracy"] > 0.6).all() and len(labels) == 1 + 2 * 3
    assert any("labels are those of A1" in note for note in study.notes)
