"""Drafts: started, edited, undone, redone and found again, whatever happens to the process in between."""

import random
import sqlite3
import time
import uuid
from concurrent.futures import ThreadPoolExecutor

import pandas as pd
import pytest
from mimique.corpus import Corpus
from mimique.corpus.annotations.label_vocabulary import LabelVocabulary
from mimique.corpus.annotations.vocabulary_change import change_vocabulary
from mimique.corpus.versions.segment_rows import key_of_row
from mimique.errors import ConflictError, CorpusError, InputError, NotFoundError
from mimique.workbench.review.context import open_review
from mimique.workbench.review.database import Database
from mimique.workbench.review.drafts.operations import apply_operation
from mimique.workbench.review.drafts.records import DraftKey, ForbiddenDraftError, StaleDraftError, TakeGoneError
from mimique.workbench.review.drafts.tier_labels import TierLabels

from .review_corpus import MODEL, TAKES, copy_review_corpus

KEY = DraftKey("ab", TAKES[0])


@pytest.fixture
def folder(tmp_path):
    return copy_review_corpus(tmp_path / "corpus", weights=False, n_frames=1200)


@pytest.fixture
def review(folder):
    review = open_review(folder, owner="ab")
    yield review
    review.close()


def request():
    return str(uuid.uuid4())


def rows_of(review, key=KEY, tier="affect"):
    return review.drafts.open(key).tiers[tier].rows


def edit(review, operation, key=KEY, version=None):
    version = review.drafts.open(key).version if version is None else version
    return review.drafts.edit(key, {"tier": "affect", **operation}, request=request(), version=version)


def step(review, word, key=KEY):
    return getattr(review.drafts, word)(key, request=request(), version=review.drafts.open(key).version)


def accept_first(review, key=KEY):
    return edit(review, {"kind": "accept", "segments": [rows_of(review, key)[0]["id"]]}, key)


def code_blind(review, take, **done):
    with review.database.write() as connection:
        for person, finished in done.items():
            connection.execute(
                "INSERT OR REPLACE INTO coding (take, person, tier, done) VALUES (?, ?, 'affect', ?)",
                (take, person, finished),
            )


def test_a_draft_starts_from_the_proposals_and_writes_nothing_before_it_is_opened(review):
    proposed = review.corpus().tier(TAKES[0], "affect", MODEL)
    look = review.drafts.look("ab", TAKES[0])
    assert [row["id"] for row in look.tiers["affect"]] == proposed["id"].tolist()
    assert (look.version, look.begun, look.edits, look.unpublished) == (0, False, 0, 0)
    assert review.database.path.exists()
    with review.database.read() as connection:
        assert connection.execute("SELECT COUNT(*) FROM drafts").fetchone()[0] == 0
    state = review.drafts.open(KEY)
    assert state.tiers["affect"].source == MODEL
    assert state.version == review.drafts.open(KEY).version
    assert {row["status"] for row in state.tiers["affect"].rows} == {"proposed"}
    assert review.drafts.begun() == []


def test_own_tiers_come_first_then_models_then_imports_then_nothing(review, folder):
    corpus = Corpus.open(folder)
    one = pd.DataFrame({"onset": [0], "offset": [9], "label": ["A"]})
    with corpus.transaction("More", author="x") as put:
        put.put_tier(TAKES[0], "affect", one.assign(label="Z", origin="import"), author="aaa")
        put.put_vocabulary("gaze", ["left", "right"])
        put.put_tier(TAKES[0], "gaze", one.assign(label="left", origin="import"), author="zz")
        put.put_tier(TAKES[0], "segments", one.assign(label="stable", origin="model"), author="mimique")
        put.put_tier(TAKES[1], "affect", one.assign(status="reviewed"), author="ab")
    tiers = review.drafts.open(KEY).tiers
    assert list(tiers) == ["affect", "gaze"]
    assert tiers["affect"].source == MODEL
    assert (tiers["gaze"].source, tiers["gaze"].rows[0]["label"]) == ("zz", "left")
    own = review.drafts.open(DraftKey("ab", TAKES[1])).tiers
    assert (own["affect"].source, own["affect"].rows[0]["status"]) == (None, "reviewed")
    assert own["gaze"].rows == ()


def test_edits_are_found_again_after_a_restart(review, folder):
    first, second = rows_of(review)[:2]
    edit(review, {"kind": "relabel", "segments": [first["id"]], "label": "J"})
    edit(review, {"kind": "split", "segment": second["id"], "frame": second["onset"] + 3})
    step(review, "undo")
    before = review.drafts.open(KEY)
    review.close()
    again = open_review(folder, owner="ab")
    after = again.drafts.open(KEY)
    assert after == before
    assert (after.undo, after.redo, after.unpublished, after.edits) == ("relabel", "split", 1, 2)
    step(again, "redo")
    assert len(rows_of(again)) == len(before.tiers["affect"].rows) + 1
    again.close()


def test_a_request_that_comes_twice_counts_once(review):
    version, name = review.drafts.open(KEY).version, request()
    operation = {"kind": "delete", "tier": "affect", "segments": [rows_of(review)[0]["id"]]}
    first = review.drafts.edit(KEY, operation, request=name, version=version)
    assert review.drafts.edit(KEY, operation, request=name, version=version) == first
    undone = review.drafts.undo(KEY, request="undo-1234", version=first.version)
    assert review.drafts.undo(KEY, request="undo-1234", version=first.version) == undone
    assert [row["id"] for row in undone.changes[0].added] == [row["id"] for row in first.changes[0].removed]
    with pytest.raises(ConflictError, match="another draft"):
        review.drafts.edit(DraftKey("ab", TAKES[1]), operation, request=name, version=0)


def test_two_windows_of_one_person_do_not_overwrite_each_other(review):
    seen = review.drafts.open(KEY).version
    row = rows_of(review)[0]
    edit(review, {"kind": "relabel", "segments": [row["id"]], "label": "J"}, version=seen)
    with pytest.raises(StaleDraftError) as refused:
        edit(review, {"kind": "relabel", "segments": [row["id"]], "label": "A"}, version=seen)
    assert refused.value.kind == "stale"
    assert rows_of(review)[0]["label"] == "J"


def test_an_edit_of_proposals_that_are_others_by_now_is_refused(review, folder):
    state = review.drafts.open(KEY)
    corpus = Corpus.open(folder)
    with corpus.transaction("Label again", author="x") as put:
        table = corpus.tier(TAKES[0], "affect", MODEL).iloc[::2]
        put.put_tier(TAKES[0], "affect", table, author=MODEL, provenance={"step": "label"})
    operation = {"kind": "accept", "tier": "affect", "segments": [state.tiers["affect"].rows[0]["id"]]}
    with pytest.raises(StaleDraftError, match="other proposals"):
        review.drafts.edit(KEY, operation, request=request(), version=state.version)
    newer = review.drafts.open(KEY)
    assert newer.version > state.version
    assert len(newer.tiers["affect"].rows) == len(table)


def test_accepting_again_is_no_edit(review):
    first = accept_first(review)
    again = accept_first(review)
    assert (again.version, again.changes) == (first.version, ())
    assert review.drafts.open(KEY).edits == 1


def test_there_is_an_end_to_undo_and_redo(review):
    with pytest.raises(InputError, match="nothing to undo"):
        step(review, "undo")
    accept_first(review)
    with pytest.raises(InputError, match="nothing to redo"):
        step(review, "redo")


AFFECTS = TierLabels(LabelVocabulary.usual("affect"))


def random_operation(rows, chance):
    """An operation that can be done, more or less."""
    kind = chance.choice(["accept", "relabel", "move", "split", "merge", "add", "delete"])
    onset = chance.randrange(1199)
    if not rows or kind == "add":
        return {"kind": "add", "onset": onset, "offset": min(onset + chance.randrange(1, 60), 1200), "label": "J"}
    place = chance.randrange(len(rows))
    row = rows[place]
    if kind == "move":
        return {"kind": kind, "segment": row["id"], "offset": row["offset"] + chance.randrange(-20, 20)}
    if kind == "split":
        return {"kind": kind, "segment": row["id"], "frame": chance.randrange(row["onset"], row["offset"])}
    names = [one["id"] for one in rows[place : place + 2]]
    return {"kind": kind, "segments": names} | ({"label": chance.choice("NAJ")} if kind == "relabel" else {})


def test_hundreds_of_edits_with_undo_redo_and_restarts_are_as_a_list_of_states_has_it(review, folder):
    chance = random.Random(8)
    states, place = [rows_of(review)], 0
    for number in range(480):
        word = chance.choices(["edit", "undo", "redo"], [7, 2, 2])[0]
        if word == "edit":
            operation = random_operation(states[place], chance)
            try:
                outcome = edit(review, operation)
            except InputError:
                continue
            if not outcome.changes:
                continue
            states = [*states[: place + 1], rows_of(review)]
            change = apply_operation(states[place], operation, 1200, lambda: 1, labels=AFFECTS)
            assert [{**row, "id": 0, "parents": ""} for row in outcome.changes[0].removed] == [
                {**row, "id": 0, "parents": ""} for row in change.removed
            ]
            place += 1
        elif (word == "undo" and place > 0) or (word == "redo" and place + 1 < len(states)):
            step(review, word)
            place += 1 if word == "redo" else -1
        state = review.drafts.open(KEY)
        assert state.tiers["affect"].rows == states[place]
        assert (state.undo is None, state.redo is None) == (place == 0, place + 1 == len(states))
        assert state.unpublished == place
        if number % 40 == 17:
            review.close()
            review = open_review(folder, owner="ab")
            assert review.drafts.open(KEY) == state
    assert review.drafts.open(KEY).edits >= 200
    while place:
        step(review, "undo")
        place -= 1
    assert list(map(key_of_row, rows_of(review))) == list(map(key_of_row, states[0]))
    review.close()


def test_a_clock_that_is_set_back_disturbs_nothing(review, monkeypatch, folder):
    import datetime as module

    class Past(module.datetime):
        year_shown = 2030

        @classmethod
        def now(cls, tz=None):
            cls.year_shown -= 7
            return module.datetime(cls.year_shown, 1, 1, tzinfo=tz)

    monkeypatch.setattr("mimique.workbench.review.drafts.storage.datetime", Past)
    monkeypatch.setattr(time, "time", lambda: 0.0)
    for label in "JAN":
        edit(review, {"kind": "relabel", "segments": [rows_of(review)[0]["id"]], "label": label})
    step(review, "undo")
    review.close()
    again = open_review(folder, owner="ab")
    assert rows_of(again)[0]["label"] == "A"
    step(again, "undo")
    assert rows_of(again)[0]["label"] == "J"
    again.close()


def test_a_blind_take_starts_empty_and_is_closed_to_others(review):
    code_blind(review, TAKES[0], ab=False, cd=False)
    assert rows_of(review) == ()
    edit(review, {"kind": "add", "onset": 3, "offset": 9, "label": "J"})
    with pytest.raises(ForbiddenDraftError, match="blind"):
        edit(review, {"kind": "take-over", "author": MODEL})
    with pytest.raises(ForbiddenDraftError, match="others code it blind"):
        review.drafts.open(DraftKey("ef", TAKES[0]))
    assert review.drafts.look("ef", TAKES[0]).tiers == {}
    with pytest.raises(ForbiddenDraftError, match="not all done"):
        review.drafts.open(DraftKey("ab", TAKES[0], "adjudication"))
    code_blind(review, TAKES[0], ab=True, cd=True)
    assert [row["label"] for row in rows_of(review)] == ["J"]
    assert rows_of(review, DraftKey("ef", TAKES[0]))


def test_settling_belongs_to_adjudication_and_is_told(review):
    with pytest.raises(InputError, match="only an adjudication"):
        edit(review, {"kind": "settle", "onset": 0, "offset": 5, "label": "J"})
    key = DraftKey("ab", TAKES[0], "adjudication")
    assert rows_of(review, key) == ()
    edit(review, {"kind": "settle", "onset": 0, "offset": 5, "label": "J"}, key)
    edit(review, {"kind": "settle", "onset": 4, "offset": 9, "label": None}, key)
    edit(review, {"kind": "settle", "onset": 9, "offset": 12, "label": "A"}, key)
    step(review, "undo", key)
    assert review.drafts.settled(TAKES[0]) == [("affect", 0, 5, "J"), ("affect", 4, 9, None)]
    assert [(row["label"], row["status"]) for row in rows_of(review, key)] == [("J", "adjudicated")]


def test_taking_over_another_tier_proposes_it(review, folder):
    corpus = Corpus.open(folder)
    table = pd.DataFrame({"onset": [0, 50], "offset": [20, 80], "label": ["A", "J"]})
    with corpus.transaction("Theirs", author="cd") as put:
        put.put_tier(TAKES[0], "affect", table.assign(status="reviewed"), author="cd")
    edit(review, {"kind": "take-over", "author": "cd"})
    assert [(row["label"], row["status"]) for row in rows_of(review)] == [("A", "proposed"), ("J", "proposed")]
    with pytest.raises(NotFoundError, match="by 'nobody'"):
        edit(review, {"kind": "take-over", "author": "nobody"})


def test_several_tiers_are_replaced_as_one_edit(review, folder):
    with Corpus.open(folder).transaction("Scheme", author="x") as put:
        put.put_vocabulary("gaze", ["left", "right"])
    before = review.drafts.open(KEY)
    new = {
        "affect": [{"onset": 0, "offset": 5, "label": "J"}],
        "gaze": [{"onset": 0, "offset": 5, "label": "left", "id": 2**64 - 1}],
    }
    outcome = review.drafts.replace_tiers(KEY, new, request=request(), version=before.version)
    assert {change.tier for change in outcome.changes} == {"affect", "gaze"}
    assert outcome.undo == "import"
    assert rows_of(review, tier="gaze")[0]["id"] == 2**64 - 1
    step(review, "undo")
    assert review.drafts.open(KEY).tiers["affect"].rows == before.tiers["affect"].rows
    with pytest.raises(InputError, match="tier 'none'"):
        review.drafts.replace_tiers(KEY, {"none": []}, request=request(), version=review.drafts.open(KEY).version)


def test_a_deleted_take_keeps_its_edits_and_says_so(review, folder):
    accept_first(review)
    corpus = Corpus.open(folder)
    with corpus.transaction("Delete", author="x") as put:
        put.delete_take(TAKES[0])
    state = review.drafts.open(KEY)
    assert "deleted" in state.gone
    assert state.tiers["affect"].rows[0]["status"] == "reviewed"
    with pytest.raises(TakeGoneError) as refused:
        step(review, "undo")
    assert refused.value.kind == "take-gone"
    with pytest.raises(NotFoundError):
        review.drafts.open(DraftKey("ef", TAKES[0]))


def test_labels_that_the_scheme_renames_are_renamed_in_drafts_and_their_history(review, folder):
    first = rows_of(review)[0]
    edit(review, {"kind": "relabel", "segments": [first["id"]], "label": "J"})
    edit(review, {"kind": "relabel", "segments": [first["id"]], "label": "A"})
    step(review, "undo")
    old = LabelVocabulary.usual("affect")
    corpus = Corpus.open(folder)
    with corpus.transaction("Rename", author="x") as put:
        change_vocabulary(put, "affect", old.rename("J", "Joy"), {"J": "Joy"})
    before = review.drafts.open(KEY)
    assert review.drafts.change_labels(["affect"], old, {"J": "Joy"}) == 1
    state = review.drafts.open(KEY)
    assert state.version > before.version
    assert state.tiers["affect"].rows[0]["label"] == "Joy"
    assert not any("J" in row["label"].replace("Joy", "") for row in state.tiers["affect"].rows)
    assert [row["onset"] for row in state.tiers["affect"].rows] == [row["onset"] for row in before.tiers["affect"].rows]
    step(review, "redo")
    assert rows_of(review)[0]["label"] == "A"
    step(review, "undo")
    step(review, "undo")
    assert rows_of(review)[0]["label"] == first["label"].replace("J", "Joy")


def test_eight_annotators_at_once_lose_nothing(review):
    """Also told: how long an edit takes, of which most is the disk."""
    people = [f"p{number}" for number in range(8)]

    def work(person):
        chance = random.Random(person)
        key, times, done = DraftKey(person, TAKES[int(person[1:]) % 3]), [], 0
        state = review.drafts.open(key)
        rows, version = state.tiers["affect"].rows, state.version
        while done < 100:
            operation = {"tier": "affect", **random_operation(rows, chance)}
            began = time.perf_counter()
            try:
                outcome = review.drafts.edit(key, operation, request=request(), version=version)
            except InputError:
                continue
            if outcome.changes:
                times.append(time.perf_counter() - began)
                done += 1
                gone = {row["id"] for row in outcome.changes[0].removed}
                rows = [row for row in rows if row["id"] not in gone]
                rows = tuple(sorted([*rows, *outcome.changes[0].added], key=lambda row: row["onset"]))
                version = outcome.version
        return key, rows, times

    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(work, people))
    times = sorted(time for _, _, several in found for time in several)
    print(f"median {1000 * times[400]:.1f} ms, p99 {1000 * times[792]:.1f} ms")
    for key, rows, _ in found:
        review.drafts.forget(key)
        assert rows_of(review, key) == rows
    with review.database.read() as connection:
        assert connection.execute("SELECT COUNT(*) FROM edits WHERE cut = 0").fetchone()[0] == 800


def test_blocks_within_a_write_belong_to_it_and_errors_take_all_back(tmp_path):
    database = Database(tmp_path / "x.sqlite", ["CREATE TABLE IF NOT EXISTS t (a); CREATE TABLE IF NOT EXISTS u (b)"])
    with pytest.raises(ZeroDivisionError), database.write() as outer:
        outer.execute("INSERT INTO t VALUES (1)")
        with database.write() as inner, database.read() as reading:
            inner.execute("INSERT INTO t VALUES (2)")
            assert reading.execute("SELECT COUNT(*) FROM t").fetchone()[0] == 2
        raise ZeroDivisionError
    with database.read() as connection:
        assert connection.execute("SELECT COUNT(*) FROM t").fetchone()[0] == 0
    with database.write() as connection:
        assert connection.execute("PRAGMA synchronous").fetchone()[0] == 2
        assert connection.execute("PRAGMA journal_mode").fetchone()[0] == "wal"
    database.close()


def test_a_file_that_is_none_or_newer_is_told_in_one_line(tmp_path):
    (tmp_path / "bad.sqlite").write_bytes(b"no database" * 1000)
    with pytest.raises(CorpusError, match="damaged"):
        Database(tmp_path / "bad.sqlite")
    connection = sqlite3.connect(tmp_path / "new.sqlite")
    connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(CorpusError, match="newer mimique"):
        Database(tmp_path / "new.sqlite")
