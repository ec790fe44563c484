"""Takes without markers: performances of which only the weights are known."""

import json

import numpy as np
import pandas as pd
import pytest
from mimique.corpus import Corpus
from mimique.corpus.take import check_take, make_bare_take
from mimique.errors import InputError, NotFoundError
from mimique.workbench.cli import run
from mimique.workbench.pipeline.ingesting import Recording, ingest
from mimique.workbench.pipeline.rig_weights import read_rig_weights, read_shape_table
from mimique.workbench.pipeline.rigging import AVATAR, add_rig


@pytest.fixture
def corpus(tmp_path, rng):
    time = np.arange(90) / 30
    frames = pd.DataFrame({"time": time, "JawOpen": np.abs(np.sin(time)), "BrowInnerUp": 0.25, "own": rng.random(90)})
    frames.to_csv(tmp_path / "rom.csv", index=False)
    corpus = Corpus.create(tmp_path / "corpus")
    ingest(corpus, [Recording(tmp_path / "rom.csv", signer="ab", protocol="ROM")])
    return corpus


def test_weights_alone_make_a_take(corpus):
    row = corpus.takes().iloc[0]
    assert (row["take"], row["signer"], row["protocol"], row["markers"], row["frames"]) == ("rom", "ab", "ROM", 0, 90)
    assert corpus.take("rom").sizes == {"time": 90, "marker": 0, "space": 3}
    assert corpus.current_solve("rom") == "imported"
    check_take(corpus.take("rom"), without_markers=True)
    with pytest.raises(InputError, match="there are no markers"):
        check_take(corpus.take("rom"))


def test_the_same_file_again_changes_nothing(corpus, tmp_path):
    snapshot = corpus.snapshot
    assert ingest(corpus, [Recording(tmp_path / "rom.csv", signer="ab", protocol="ROM")])["outcome"].tolist() == [
        "unchanged"
    ]
    assert corpus.snapshot == snapshot


def test_no_frames_are_refused():
    with pytest.raises(InputError, match="there are no frames"):
        make_bare_take(0, 30.0)


def test_they_move_any_rig_that_shares_shapes(corpus):
    with pytest.raises(InputError, match="has no rig yet"):
        read_rig_weights(corpus, "rom")
    add_rig(corpus, "avatar", AVATAR)
    found = read_rig_weights(corpus, "rom")
    truth = corpus.weights("rom")["weights"].values
    np.testing.assert_array_equal(found.weights[:, found.rig.index("jawOpen")], truth[:, 0])
    assert found.mapping.unused == ("own",)
    table = pd.DataFrame({"from": ["own"], "to": ["mouthLeft"], "gain": [0.5]})
    by_hand = read_rig_weights(corpus, "rom", table=table)
    np.testing.assert_allclose(by_hand.weights[:, found.rig.index("mouthLeft")], truth[:, 2] / 2)
    add_rig(corpus, "second", AVATAR)
    with pytest.raises(InputError, match="choose a rig of avatar, second with --rig"):
        read_rig_weights(corpus, "rom")
    with pytest.raises(NotFoundError):
        read_rig_weights(corpus, "rom", rig="third")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["check"], 0, ""),
        (["verify"], 0, ""),
        (["segment"], 0, ""),
        (["report", "OUT.html"], 0, ""),
        (["export", "rom", "OUT.csv"], 0, ""),
        (["export", "rom", "OUT.c3d"], 2, "there are no markers"),
        (["solve"], 2, "no takes with markers"),
        (["repair", "fill", "rom"], 2, "take 'rom': it has no markers to repair"),
    ],
)
def test_every_command_knows_them(corpus, tmp_path, capsys, arguments, code, message):
    add_rig(corpus, "avatar", AVATAR)
    command = arguments[:2] if arguments[0] == "repair" else arguments[:1]
    rest = [str(tmp_path / word) if word.startswith("OUT") else word for word in arguments[len(command) :]]
    assert run([*command, str(tmp_path / "corpus"), *rest]) == code
    assert message in capsys.readouterr().err


def test_solve_leaves_them_alone(corpus, tmp_path, capsys):
    add_rig(corpus, "avatar", AVATAR)
    assert run(["solve", str(tmp_path / "corpus"), "--take", "rom"]) == 2
    assert "the corpus has no takes with markers" in capsys.readouterr().err
    assert run(["show", str(tmp_path / "corpus"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["markers"] == 0


def test_a_shape_table_is_read(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("# brows\nfrom,to,gain\nbrowInnerUp,eyebrows-left-inner-up,0.8\n")
    assert read_shape_table(path).to_dict("records") == [
        {"from": "browInnerUp", "to": "eyebrows-left-inner-up", "gain": 0.8}
    ]
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="expected the columns from,to,gain"):
        read_shape_table(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_shape_table(tmp_path / "nothing.csv")
