"""The command line as a user meets it: the whole path, then everything that can go wrong."""

import io
import json
import signal
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from mimique.corpus import Corpus, read_take, write_take, write_tiers
from mimique.corpus.store.locking import lock_corpus
from mimique.corpus.take import make_take
from mimique.workbench.cli import run
from mimique.workbench.pipeline.labelled_takes import choose_author
from mimique.workbench.pipeline.session_solver import SessionSolver

from .small_face import HEAD, SHAPES, make_rig, make_weights, marker_vertices, write_performance, write_rig

JOY, SURPRISE = {"mouthSmile_L": 0.9, "mouthSmile_R": 0.8}, {"browUp": 0.9, "jawOpen": 0.7}
AFFECTS = {"joy": JOY, "surprise": SURPRISE}
HEAD_LIST = ",".join(HEAD)


def write_annotated(folder, name, seed, *, order):
    weights = make_weights([(1.0, AFFECTS[a]) for a in order])
    write_performance(folder / f"{name}.c3d", weights, seed=seed)
    rows, onset = [], 0
    labels = ["neutral", *order, "neutral"]
    for k, label in enumerate(labels):
        hold = 80 if k in (0, len(labels) - 1) else 100
        rows.append((onset, onset + hold, label))
        onset += hold + 30
    tier = pd.DataFrame(rows, columns=["onset", "offset", "label"])
    write_tiers(folder / f"{name}.eaf", {"affect@cr": tier}, rate=100, author="cr")
    return weights


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A corpus taken through the whole path by the command line alone."""
    folder = tmp_path_factory.mktemp("session")
    rig, table = write_rig(folder)
    truth = {
        "s_IE_joy": write_annotated(folder, "s_IE_joy", 1, order=["joy", "joy"]),
        "s_IE_surprise": write_annotated(folder, "s_IE_surprise", 2, order=["surprise", "surprise"]),
        "s_EU_01": write_annotated(folder, "s_EU_01", 3, order=["surprise", "joy"]),
    }
    corpus = folder / "corpus"
    for line in (
        ["init", corpus],
        ["rig", "add", corpus, "dome", rig, "--unit", "cm", "--markers", table],
        [
            "ingest",
            corpus,
            *sorted(folder.glob("s_IE*")),
            "--signer",
            "s",
            "--protocol",
            "IE",
            "--head-markers",
            HEAD_LIST,
        ],
        [
            "ingest",
            corpus,
            *sorted(folder.glob("s_EU*")),
            "--signer",
            "s",
            "--protocol",
            "EU",
            "--head-markers",
            HEAD_LIST,
        ],
        ["solve", corpus, "--method", "lsts"],
        ["solve", corpus],
        ["segment", corpus],
        ["train", corpus, "--classifier", "1-nn", "--protocols", "IE"],
        ["label", corpus],
        ["tag", corpus, "v1"],
    ):
        assert run([str(word) for word in line]) == 0, line
    return folder, corpus, truth


def test_solved_weights_follow_the_true_ones(session):
    _, path, truth = session
    corpus = Corpus.open(path)
    for take, weights in truth.items():
        solved = corpus.weights(take)["weights"]
        assert list(solved["shape"].values) == list(SHAPES)
        assert np.sqrt(np.mean((solved.values - weights) ** 2)) < 0.06


def test_labels_of_the_model_match_the_performance(session):
    _, path, _ = session
    tier = Corpus.open(path).tier("s_EU_01", "affect", author="s-1-nn")
    held = tier.loc[tier["from_label"] == tier["to_label"], "label"].tolist()
    assert held == ["neutral", "surprise", "joy", "neutral"]
    assert tier.loc[tier["from_label"] != tier["to_label"], "label"].tolist() == ["NSu", "SuJ", "JN"]
    assert set(tier["origin"]) == {"model"}
    assert set(tier["status"]) == {"proposed"}


def test_a_second_run_changes_nothing(session, capsys):
    folder, path, _ = session
    before = Corpus.open(path).snapshot
    files = [str(f) for f in sorted(folder.glob("s_EU*"))]
    again = ["ingest", str(path), *files, "--signer", "s", "--protocol", "EU", "--head-markers", HEAD_LIST, "--json"]
    assert run(again) == 0
    assert {row["outcome"] for row in json.loads(capsys.readouterr().out)} == {"unchanged"}
    for command in (["solve"], ["segment"], ["train", "--classifier", "1-nn", "--protocols", "IE"], ["label"]):
        assert run([command[0], str(path), *command[1:], "--json"]) == 0
        assert {row["outcome"] for row in json.loads(capsys.readouterr().out)} == {"unchanged"}
    assert Corpus.open(path).snapshot == before


def test_evaluate_report_show_log_and_export(session, tmp_path, capsys):
    _, path, _ = session
    assert run(["evaluate", str(path), "--train", "IE", "--classifiers", "1-nn", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["simulated"] is False
    manual = next(r for r in result["results"] if r["signer"] == "s" and r["segmentation"] == "manual")
    assert manual["n_segments"] == 4
    assert manual["accuracy"] == 1.0
    assert run(["report", str(path), str(tmp_path / "r.html")]) == 0
    page = (tmp_path / "r.html").read_text()
    assert "s_EU_01" in page
    assert "simulated" not in page.lower()
    assert run(["export", str(path), "s_EU_01", str(tmp_path / "w.csv"), "--at", "v1"]) == 0
    exported = pd.read_csv(tmp_path / "w.csv")
    assert list(exported.columns) == ["time", *SHAPES]
    np.testing.assert_allclose(exported[list(SHAPES)], Corpus.open(path).weights("s_EU_01")["weights"], atol=1e-6)
    assert run(["export", str(path), "s_EU_01", str(tmp_path / "t.eaf")]) == 0
    assert run(["export", str(path), "s_EU_01", str(tmp_path / "t.c3d")]) == 0
    np.testing.assert_allclose(
        read_take(tmp_path / "t.c3d")["position"], Corpus.open(path).take("s_EU_01")["position"], atol=1e-3
    )
    capsys.readouterr()
    assert run(["show", str(path), "s_EU_01", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["current solve"] == "dome-map"
    assert run(["log", str(path), "--json"]) == 0
    log = json.loads(capsys.readouterr().out)
    assert [row["command"] for row in log] == [
        "label",
        "train",
        "segment",
        "solve",
        "solve",
        "ingest",
        "ingest",
        "rig add",
        "create",
    ]
    assert log[0]["tags"] == "v1"


def test_labels_of_a_model_that_come_back_as_a_file_are_no_reference(session, tmp_path, capsys):
    _, path, _ = session
    for name in ("s_EU_01", "s_IE_joy", "s_IE_surprise"):
        for suffix in ("c3d", "eaf"):
            assert run(["export", str(path), name, str(tmp_path / f"{name}.{suffix}")]) == 0
    again = tmp_path / "again"
    assert run(["init", str(again)]) == 0
    assert run(["ingest", str(again), *map(str, sorted(tmp_path.glob("s_*")))]) == 0
    assert choose_author(Corpus.open(again)) == "cr"
    came_back = Corpus.open(again).tier("s_EU_01", "affect", author="s-1-nn")
    sent = Corpus.open(path).tier("s_EU_01", "affect", author="s-1-nn")
    columns = ["id", "onset", "offset", "label", "from_label", "to_label", "origin"]
    pd.testing.assert_frame_equal(came_back[columns], sent[columns])


def test_stabilised_head_stays_and_the_motion_is_kept(session):
    _, path, _ = session
    corpus = Corpus.open(path)
    calm = corpus.processed("s_EU_01", "stabilised")
    head = calm["position"].sel(marker=list(HEAD)).values
    assert np.nanstd(head, axis=0).max() < 0.15
    back = np.einsum("tij,tmj->tmi", calm["head_rotation"].values, calm["position"].values)
    back += calm["head_translation"].values[:, None]
    np.testing.assert_allclose(back, corpus.take("s_EU_01")["position"].values, atol=1e-2)


# What goes wrong: one line, exit code 2, the corpus as it was.


@pytest.fixture
def corpus(tmp_path):
    """A corpus with the small rig and one take, ready to be solved."""
    rig, table = write_rig(tmp_path)
    write_performance(tmp_path / "good.c3d", make_weights([(0.6, JOY)]))
    path = tmp_path / "corpus"
    run(["init", str(path)])
    run(["rig", "add", str(path), "dome", str(rig), "--unit", "cm", "--markers", str(table)])
    run(["ingest", str(path), str(tmp_path / "good.c3d"), "--signer", "s", "--head-markers", HEAD_LIST])
    return path


def assert_refused(capsys, corpus, words, *parts):
    """One line on standard error that says all of ``parts``, exit code 2, and no new snapshot."""
    before = Corpus.open(corpus).snapshot
    capsys.readouterr()
    assert run([str(word) for word in words]) == 2
    error = capsys.readouterr().err.strip()
    lines = [line for line in error.splitlines() if line.strip()]
    assert lines[-1].startswith("mimique: ")
    assert sum(line.startswith("mimique: ") for line in lines) == 1
    for part in parts:
        assert str(part) in lines[-1]
    assert Corpus.open(corpus).snapshot == before


def take_of(points, names, **attributes):
    return make_take(points, names, 100.0, **attributes)


def test_files_that_are_no_recordings(corpus, tmp_path, capsys):
    (tmp_path / "text.c3d").write_text("not a recording")
    assert_refused(capsys, corpus, ["ingest", corpus, tmp_path / "text.c3d"], "text.c3d")
    whole = (tmp_path / "good.c3d").read_bytes()
    (tmp_path / "short.c3d").write_bytes(whole[: len(whole) // 2])
    assert_refused(capsys, corpus, ["ingest", corpus, tmp_path / "short.c3d"], "short.c3d")
    assert_refused(capsys, corpus, ["ingest", corpus, tmp_path / "absent.c3d"], "absent.c3d")
    assert_refused(capsys, corpus, ["ingest", corpus, tmp_path / "map.csv"], "map.csv", ".c3d")
    assert_refused(capsys, corpus, ["ingest", corpus], "nothing to ingest")


def trc(names, rows, unit="mm", n_markers=None):
    n = len(names) if n_markers is None else n_markers
    out = io.StringIO()
    out.write("PathFileType\t4\t(X/Y/Z)\tx.trc\n")
    out.write("DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n")
    out.write(f"100\t100\t{len(rows)}\t{n}\t{unit}\t100\t1\t{len(rows)}\n")
    out.write("Frame#\tTime\t" + "\t\t\t".join(names) + "\n\t\t")
    out.write("\t".join(f"{axis}{k + 1}" for k in range(len(names)) for axis in "XYZ") + "\n\n")
    for k, row in enumerate(rows):
        out.write(f"{k + 1}\t{k / 100:.3f}\t" + "\t".join(row) + "\n")
    return out.getvalue()


@pytest.mark.parametrize(
    ("text", "part"),
    [
        (trc(["A", "B"], [["1", "2", "3", "4", "5", "6"]], unit="furlong"), "furlong"),
        (trc(["A", "A"], [["1", "2", "3", "4", "5", "6"]]), "A"),
        (trc(["A", ""], [["1", "2", "3", "4", "5", "6"]]), "marker"),
        (trc([], []), "marker"),
        (trc(["A", "B"], [[""] * 6, [""] * 6]), "missing"),
        (trc(["A", "B"], [["1", "2", "3"] * 2, ["4", "5", "6"] * 2]), "coincide"),
    ],
    ids=["unit", "repeated", "unnamed", "no-markers", "all-gaps", "coincide"],
)
def test_recordings_that_cannot_be_used(corpus, tmp_path, capsys, text, part):
    (tmp_path / "bad.trc").write_text(text)
    assert_refused(capsys, corpus, ["ingest", corpus, tmp_path / "bad.trc"], "bad.trc", part)


def test_one_bad_file_among_good_ones_changes_nothing(corpus, tmp_path, capsys):
    write_performance(tmp_path / "other.c3d", make_weights([(0.4, JOY)]), seed=4)
    (tmp_path / "zbad.c3d").write_bytes(b"\x02\x50" + b"\0" * 510)
    assert_refused(capsys, corpus, ["ingest", corpus, tmp_path / "other.c3d", tmp_path / "zbad.c3d"], "zbad.c3d")
    assert Corpus.open(corpus).takes()["take"].tolist() == ["good"]


def test_another_recording_under_the_same_name(corpus, tmp_path, capsys):
    (tmp_path / "elsewhere").mkdir()
    other = tmp_path / "elsewhere" / "good.c3d"
    write_performance(other, make_weights([(0.9, SURPRISE)]), seed=9)
    words = ["ingest", corpus, other, "--signer", "s", "--head-markers", HEAD_LIST]
    assert_refused(capsys, corpus, words, "'good'", "--replace")
    assert run([str(w) for w in [*words, "--replace"]]) == 0
    again = ["ingest", corpus, other, "--signer", "t", "--head-markers", HEAD_LIST]
    assert_refused(capsys, corpus, again, "signer was s", "--replace")


def test_head_markers_that_fix_no_pose(corpus, tmp_path, capsys):
    good = tmp_path / "good.c3d"
    words = ["ingest", corpus, good, "--replace", "--head-markers"]
    assert_refused(capsys, corpus, [*words, "HEAD1,HEAD2,NOSE"], "NOSE")
    assert_refused(capsys, corpus, [*words, "HEAD1,HEAD2"], "three")
    points = np.random.default_rng(0).normal(0, 30, (50, 6, 3))
    points[:, 2:4] = np.nan
    points[0, 2], points[1, 3] = 1.0, 2.0
    write_take(tmp_path / "few.c3d", take_of(points, list("ABCDEF")))
    few = ["ingest", corpus, tmp_path / "few.c3d", "--head-markers", "A,C,D"]
    assert_refused(capsys, corpus, few, "three")
    take = read_take(good)
    heads = take["position"].sel(marker=list(HEAD[:3])).values
    take["position"].loc[{"marker": HEAD[1]}] = (heads[:, 0] + 2 * heads[:, 2]) / 3
    write_take(tmp_path / "line.c3d", take)
    on_a_line = ["ingest", corpus, tmp_path / "line.c3d", "--head-markers", ",".join(HEAD[:3])]
    assert run([str(word) for word in on_a_line]) == 0  # where they are only shows once the head is followed
    assert_refused(capsys, corpus, ["solve", corpus, "--take", "line"], "line", "HEAD2")


def test_maps_and_rigs_that_do_not_fit(corpus, tmp_path, capsys):
    rig = tmp_path / "rig.npz"
    add = ["rig", "add", corpus, "second", rig, "--unit", "cm", "--markers"]
    (tmp_path / "vertex.csv").write_text("marker,vertex\nM00,99999\n")
    assert_refused(capsys, corpus, [*add, tmp_path / "vertex.csv"], "vertex.csv", "99999")
    (tmp_path / "twice.csv").write_text("marker,vertex\nM00,5\nM01,5\n")
    assert_refused(capsys, corpus, [*add, tmp_path / "twice.csv"], "twice.csv", "5")
    (tmp_path / "columns.csv").write_text("name,index\nM00,5\n")
    assert_refused(capsys, corpus, [*add, tmp_path / "columns.csv"], "marker,vertex")
    assert_refused(capsys, corpus, ["rig", "add", corpus, "second", rig], "unit")
    assert_refused(capsys, corpus, ["rig", "add", corpus, "second", rig, "--unit", "furlong"], "furlong")
    assert_refused(capsys, corpus, ["rig", "add", corpus, "second", tmp_path / "no.npz", "--unit", "cm"], "no.npz")
    rows = [f"{n},{v}" for n, v in marker_vertices(make_rig()).items()]
    (tmp_path / "unknown.csv").write_text("marker,vertex\n" + "\n".join([*rows, "NOSUCH,7"]) + "\n")
    assert run([str(w) for w in [*add, tmp_path / "unknown.csv"]]) == 0
    assert_refused(capsys, corpus, ["solve", corpus, "--rig", "second"], "NOSUCH")


def test_a_rig_whose_shapes_differ_in_topology(corpus, tmp_path, capsys):
    folder = tmp_path / "objs"
    folder.mkdir()
    (folder / "neutral.obj").write_text("v 0 0 0\nv 10 0 0\nv 0 10 0\nv 10 10 2\nf 1 2 3\nf 2 4 3\n")
    (folder / "smile.obj").write_text("v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\n")
    assert_refused(capsys, corpus, ["rig", "add", corpus, "objs", folder, "--unit", "mm"], "smile")


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["solve", "CORPUS", "--method", "magic"], "magic"),
        (["solve", "CORPUS", "--alpha", "1.5"], "alpha"),
        (["solve", "CORPUS", "--take", "absent"], "absent"),
        (["solve", "CORPUS", "--rig", "absent"], "absent"),
        (["solve", "CORPUS", "--kernel", "magic"], "kernel"),
        (["segment", "CORPUS"], "mimique solve"),
        (["label", "CORPUS"], "mimique segment"),
        (["train", "CORPUS"], "annotat"),
        (["evaluate", "CORPUS"], "annotat"),
        (["play", "CORPUS", "good", "--movie", "x.mp4"], "solve"),
        (["export", "CORPUS", "good", "x.docx"], ".csv"),
        (["export", "CORPUS", "good", "x.csv"], "solve"),
        (["show", "CORPUS", "--at", "nowhere"], "nowhere"),
        (["init", "CORPUS"], "corpus"),
        (["frobnicate"], "frobnicate"),
        (["ingest"], "CORPUS"),
    ],
    ids=lambda value: " ".join(value).replace("CORPUS", "") if isinstance(value, list) else "",
)
def test_wishes_that_cannot_be_met(corpus, capsys, words, part):
    assert_refused(capsys, corpus, [corpus if w == "CORPUS" else w for w in words], part)


def test_a_folder_that_is_no_corpus(tmp_path, capsys):
    assert run(["show", str(tmp_path)]) == 2
    assert str(tmp_path) in capsys.readouterr().err


def test_a_take_in_the_wrong_unit_is_refused_by_name(corpus, tmp_path, capsys):
    take = read_take(tmp_path / "good.c3d")
    names = [str(n) for n in take["marker"].values]
    write_take(tmp_path / "tiny.c3d", take_of(take["position"].values / 1000, names))
    run(["ingest", str(corpus), str(tmp_path / "tiny.c3d"), "--head-markers", HEAD_LIST])
    assert_refused(capsys, corpus, ["solve", corpus, "--take", "tiny"], "tiny", "metres")


def test_a_take_too_short_to_learn_a_prior_from_is_solved_without_one(corpus, tmp_path):
    write_performance(tmp_path / "short.c3d", make_weights([(0.4, JOY)])[:40], seed=8)
    words = ["ingest", corpus, tmp_path / "short.c3d", "--signer", "other", "--head-markers", HEAD_LIST]
    assert run([str(word) for word in words]) == 0
    assert run(["solve", str(corpus)]) == 0
    opened = Corpus.open(corpus)
    short, good = (opened.weights(name).attrs for name in ("short", "good"))
    assert (short["method"], short["prior"]) == ("bounded", "none")
    assert (good["method"], good["prior"]) == ("map", "good")


def test_interrupted_solve_leaves_the_corpus_and_goes_on(corpus, tmp_path, monkeypatch):
    for k in range(6):
        write_performance(tmp_path / f"t{k}.c3d", make_weights([(0.4, JOY)]), seed=20 + k)
        words = ["ingest", corpus, tmp_path / f"t{k}.c3d", "--signer", f"s{k}", "--head-markers", HEAD_LIST]
        assert run([str(w) for w in words]) == 0
    before = Corpus.open(corpus).snapshot
    code = (
        # What is started in the background of a shell inherits that Ctrl-C is ignored.
        "import signal, sys, time\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from mimique.workbench.pipeline.session_solver import SessionSolver\n"
        "slow = SessionSolver.solve_take\n"
        "def solve_take(self, name):\n"
        "    print(name, flush=True); time.sleep(0.3); return slow(self, name)\n"
        "SessionSolver.solve_take = solve_take\n"
        "from mimique.workbench.cli import run\n"
        f"sys.exit(run(['solve', {str(corpus)!r}]))\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for _ in range(3):
        process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 2
    assert error.strip().splitlines()[-1].startswith("mimique: interrupted")
    assert "Traceback" not in error
    assert Corpus.open(corpus).snapshot == before
    kept = len(list((corpus.parent / "corpus.scratch").glob("*.npz")))
    assert 2 <= kept < 7
    solved = []
    again = SessionSolver.solve_take
    monkeypatch.setattr(SessionSolver, "solve_take", lambda self, name: solved.append(name) or again(self, name))
    assert run(["solve", str(corpus)]) == 0
    assert len(solved) == 7 - kept
    assert not (corpus.parent / "corpus.scratch").exists()
    assert (Corpus.open(corpus).takes()["solve"] == "dome-map").all()


def test_a_corpus_that_another_process_holds(corpus, capsys, monkeypatch):
    opened = Corpus.open
    monkeypatch.setattr(Corpus, "open", lambda path, at=None: opened(path, at, lock_timeout=0.2))
    with lock_corpus(corpus, timeout=5, purpose="a long commit"):
        assert_refused(capsys, corpus, ["solve", corpus], "lock")
    assert run(["solve", str(corpus)]) == 0


def test_places_that_cannot_be_written(corpus, tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    assert run(["init", str(tmp_path / "file" / "corpus")]) == 2
    assert "file" in capsys.readouterr().err
    assert run(["solve", str(corpus)]) == 0
    assert_refused(capsys, corpus, ["export", corpus, "good", tmp_path / "file" / "w.csv"], "w.csv")
    assert_refused(capsys, corpus, ["report", corpus, tmp_path / "file" / "r.html"], "r.html")
    assert_refused(capsys, corpus, ["play", corpus, "good", "--movie", tmp_path / "no" / "f.mp4"], "no")
    assert run(["simulate", str(tmp_path / "file"), "--seconds", "60"]) == 2
    assert run(["demo", str(tmp_path)]) == 2
