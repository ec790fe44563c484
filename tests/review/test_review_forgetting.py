"""``mimique forget`` reaches the review: nothing of the signer's stays, nothing of others' is lost."""

import uuid

import pytest
import typer
from mimique.corpus import Corpus
from mimique.corpus.privacy.forgetting import forget
from mimique.errors import CorpusError
from mimique.workbench.commands import ancestry
from mimique.workbench.review.context import open_review, review_folder
from mimique.workbench.review.drafts.records import DraftKey
from mimique.workbench.review.server.server_lock import lock_server

from .review_corpus import MODEL, copy_review_corpus

SECRET, OTHER = "ab_IE_1", "cd_IE_1"


@pytest.fixture
def folder(tmp_path):
    path = copy_review_corpus(tmp_path / "corpus", weights=False, n_frames=1200)
    with Corpus.open(path).transaction("Learn", author="test") as edit:  # so that the model goes with the signer
        edit.put_model(MODEL, {}, {"learned_from": [SECRET]})
    return path


def run_forget(folder):
    app = typer.Typer()
    ancestry.register(app)
    return app(["forget", str(folder), "ab", "--yes"], standalone_mode=False)


def relabel(review, person, take, label):
    key = DraftKey(person, take)
    state = review.drafts.open(key)
    operation = {"kind": "relabel", "tier": "affect", "label": label}
    operation["segments"] = [state.tiers["affect"].rows[0]["id"]]
    return review.drafts.edit(key, operation, request=str(uuid.uuid4()), version=state.version)


def rows_of(folder, person, take):
    review = open_review(folder, owner=person)
    try:
        return review.drafts.open(DraftKey(person, take)).tiers["affect"].rows
    finally:
        review.close()


def work(folder):
    """Let two people edit both signers' takes, one of them called like the signer; return what is on the other's."""
    review = open_review(folder, owner="ab")
    for person in ("ab", "ann"):
        relabel(review, person, SECRET, "A secret finding")
        relabel(review, person, OTHER, "Su")
    review.people.put_settings("ann", {"last": SECRET, "keys": {"label:ab": ["1"]}})
    with review.database.write() as connection:
        for take in (SECRET, OTHER):
            connection.execute("INSERT INTO coding_readings VALUES (?, 'ann', 'affect', '[]')", (take,))
            connection.execute(
                "INSERT INTO activity (person, take, seconds, turn, moment) VALUES ('ann', ?, 1, 1, '')", (take,)
            )
    (review.folder / "shown").mkdir()
    (review.folder / "shown" / "face.npy").write_bytes(b"a face")
    kept = review.drafts.open(DraftKey("ann", OTHER)).tiers["affect"].rows
    review.close()
    return kept


def test_forgetting_leaves_nothing_of_a_signer_in_the_review_and_all_of_others(folder, capsys):
    kept = work(folder)
    run_forget(folder)
    said = capsys.readouterr().out
    assert "2 drafts" in said and "reviewer 'ab'" in said
    place = review_folder(folder)
    assert not (place / "shown").exists()
    everything = b"".join(path.read_bytes() for path in place.rglob("*") if path.is_file())
    assert b"secret finding" not in everything
    assert SECRET.encode() not in everything
    assert rows_of(folder, "ann", OTHER) == kept
    assert rows_of(folder, "ab", OTHER)[0]["label"] == "Su"
    review = open_review(folder, owner="ann")
    state = review.drafts.open(DraftKey("ann", OTHER))
    assert state.tiers["affect"].source != MODEL
    assert review.people.settings("ann")["keys"] == {"label:ab": ["1"]}
    undone = review.drafts.undo(DraftKey("ann", OTHER), request=str(uuid.uuid4()), version=state.version)
    assert undone.undo is None
    with review.database.read() as connection:
        assert [row[0] for row in connection.execute("SELECT take FROM coding_readings")] == [OTHER]
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
    review.close()


def test_a_review_that_runs_must_be_ended_before_somebody_is_forgotten(folder):
    work(folder)
    before = Corpus.open(folder).snapshot
    with lock_server(review_folder(folder)), pytest.raises(CorpusError, match="already reviewed"):
        run_forget(folder)
    assert Corpus.open(folder).snapshot == before
    assert len(rows_of(folder, "ann", SECRET)) > 0


def test_who_forgets_from_python_is_told_of_the_review(folder):
    work(folder)
    with pytest.raises(CorpusError, match="mimique forget"):
        forget(Corpus.open(folder), "ab")
    assert SECRET in Corpus.open(folder).takes()["take"].tolist()


def test_where_the_edits_cannot_be_purged_nothing_is_forgotten(folder, monkeypatch):
    from mimique.workbench.review import forgetting

    def fail(*_):
        raise CorpusError("no")

    work(folder)
    monkeypatch.setattr(forgetting, "purge_review", fail)
    with pytest.raises(CorpusError, match="no"):
        run_forget(folder)
    assert SECRET in Corpus.open(folder).takes()["take"].tolist()
