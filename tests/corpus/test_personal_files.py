"""Databases and other files beside a repository."""

import sqlite3
from contextlib import closing

from mimique.corpus.privacy.personal_files import clean_beside, copy_extra_files, is_database, purge_database
from mimique.corpus.privacy.redaction import Redactor

REDACTOR = Redactor(["zqx", "zqx_IE_joy"], "X")


def make_database(path):
    with closing(sqlite3.connect(path)) as database:
        database.execute('CREATE TABLE "edits of" (person TEXT, "the take" TEXT, what BLOB)')
        rows = [("cr", "zqx_IE_joy", b"1"), ("cr", "cd_IE_joy", b"2"), ("cr", "cd_IE", b'{"signer": "zqx"}')]
        database.executemany('INSERT INTO "edits of" VALUES (?, ?, ?)', rows)
        database.commit()


def rows_of(path):
    with closing(sqlite3.connect(path)) as database:
        return database.execute('SELECT "the take" FROM "edits of"').fetchall()


def test_rows_that_name_somebody_go_and_leave_no_bytes(tmp_path):
    path = tmp_path / "edits.sqlite"
    make_database(path)
    assert b"zqx" in path.read_bytes()
    assert purge_database(path, REDACTOR) == 2
    assert rows_of(path) == [("cd_IE_joy",)]
    assert b"zqx" not in path.read_bytes()


def test_beside_a_corpus_only_what_is_named_after_it_is_touched(tmp_path):
    corpus = tmp_path / "cor[pus"
    (tmp_path / "cor[pus.scratch").mkdir()
    (tmp_path / "cor[pus.notes").mkdir()
    (tmp_path / "cor[pus.review").mkdir()
    mine, other = tmp_path / "cor[pus.notes" / "cr.sqlite", tmp_path / "other.sqlite"
    review = tmp_path / "cor[pus.review" / "edits.sqlite"
    for path in (mine, other, review):
        make_database(path)
    clean_beside(corpus, REDACTOR)
    assert not (tmp_path / "cor[pus.scratch").exists()
    assert len(rows_of(mine)) == 1
    assert len(rows_of(other)) == 3
    assert len(rows_of(review)) == 3, "the review purges its own, whole drafts at a time"


def test_what_else_lies_in_the_folder_comes_along(tmp_path):
    source, target = tmp_path / "source", tmp_path / "target"
    (source / "notes").mkdir(parents=True)
    (source / "chunks").mkdir()
    target.mkdir()
    (source / "notes" / "a.txt").write_text("a")
    (source / "README").write_text("r")
    make_database(source / "edits.db")
    make_database(source / "notes" / "edits.db")
    assert is_database(source / "edits.db")
    assert copy_extra_files(source, target, REDACTOR, leave=frozenset(["chunks"])) == ["README", "notes"]
    assert (target / "notes" / "a.txt").read_text() == "a"
    assert not (target / "chunks").exists()
    assert len(rows_of(target / "edits.db")) == len(rows_of(target / "notes" / "edits.db")) == 1
    assert len(rows_of(source / "edits.db")) == 3
