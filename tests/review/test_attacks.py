"""What people, chance and malice do to a review at once: nothing leaks, nothing is lost, nobody waits for ever."""

import gc
import random
import socket
import threading
import time
import uuid

import pytest
from mimique.corpus import Corpus
from mimique.corpus.privacy.forgetting import forget
from mimique.corpus.store.locking import lock_corpus
from mimique.errors import CorpusError, InputError, NotFoundError
from mimique.workbench.review.coding import plan as planning
from mimique.workbench.review.coding.plan import read_plan, save_plan, say_done
from mimique.workbench.review.coding.readings import find_readings
from mimique.workbench.review.context import open_review, review_folder
from mimique.workbench.review.database import Database
from mimique.workbench.review.drafts.records import DraftKey, ForbiddenDraftError, StaleDraftError
from mimique.workbench.review.people import passwords
from mimique.workbench.review.server.app import create_app
from mimique.workbench.review.server.running import Serving, _listen

from .page_client import PageClient
from .review_corpus import MODEL, TAKES, copy_review_corpus

PASSWORDS = {name: f"the password of {name}" for name in ("ann", "bob", "lea")}
FACTS = {"weights": False, "n_frames": 1200}


@pytest.fixture
def folder(tmp_path):
    return copy_review_corpus(tmp_path / "corpus", **FACTS)


@pytest.fixture
def review(folder):
    review = open_review(folder, owner="lea")
    yield review
    review.close()


@pytest.fixture
def named(folder, monkeypatch):
    """A review of people with names, of whom lea is a lead; passwords are hashed cheaply."""
    monkeypatch.setattr(passwords, "_hasher", passwords.PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))
    review = open_review(folder)
    for name, password in PASSWORDS.items():
        review.people.accounts.add(name, password, is_lead=name == "lea")
    yield review
    review.close()


def log_in(review, name, app=None):
    return PageClient(app or create_app(review), login={"person": name, "password": PASSWORDS[name]})


def edit(review, key, **operation):
    version = review.drafts.open(key).version
    return review.drafts.edit(key, {"tier": "affect", **operation}, request=str(uuid.uuid4()), version=version)


def draw(review, share=1.0, **plan):
    facts = {"tier": "affect", "share": share, "coders": ["ann", "bob"], "coders_per_take": 2, "seed": 1, **plan}
    return save_plan(review, **facts)


# Blindness


def test_an_edit_that_began_before_its_take_was_drawn_comes_too_late(review, monkeypatch):
    key = DraftKey("ann", TAKES[0])
    state, start = review.drafts.open(key), review.drafts.starts.start

    def draw_meanwhile(*arguments):
        found = start(*arguments)
        if not read_plan(review).takes:
            draw(review)
        return found

    monkeypatch.setattr(review.drafts.starts, "start", draw_meanwhile)
    operation = {"kind": "accept", "tier": "affect", "segments": [state.tiers["affect"].rows[0]["id"]]}
    with pytest.raises(StaleDraftError, match="who codes it"):
        review.drafts.edit(key, operation, request=str(uuid.uuid4()), version=state.version)
    assert review.drafts.begun() == []
    assert review.drafts.open(key).tiers["affect"].rows == ()


def test_a_reading_holds_all_that_was_saved_before_the_last_coder_was_done(review, monkeypatch):
    draw(review)
    bob = DraftKey("bob", TAKES[0])
    edit(review, bob, kind="add", onset=100, offset=150, label="N")
    say_done(review, "ann", TAKES[0], True)
    read, said = planning._read_tier, []
    late = {"kind": "add", "tier": "affect", "onset": 5, "offset": 50, "label": "A"}
    version = review.drafts.open(bob).version

    def edit_late():
        try:
            review.drafts.edit(bob, late, request=str(uuid.uuid4()), version=version)
            said.append("saved")
        except StaleDraftError:
            said.append("refused")

    editing = threading.Thread(target=edit_late)

    def read_slowly(*arguments):
        rows = read(*arguments)
        if not editing.ident:
            editing.start()
            editing.join(0.5)
            assert said == []  # the edit waits
        return rows

    monkeypatch.setattr(planning, "_read_tier", read_slowly)
    say_done(review, "bob", TAKES[0], True)
    editing.join(10)
    assert said == ["refused"]  # the person is told, and the page sends it again if it still fits
    assert [row["label"] for row in find_readings(review, TAKES[0], "affect")["bob"].rows] == ["N"]


def test_a_coder_who_left_does_not_keep_a_take_closed_for_ever(named):
    draw(named)
    edit(named, DraftKey("ann", TAKES[0]), kind="add", onset=5, offset=50, label="A")
    assert draw(named, share=0.0).takes[0].take == TAKES[0]  # begun stays, as long as both can finish
    named.people.accounts.remove("bob")
    draw(named, share=0.0, coders=["ann", "lea"])
    assert read_plan(named).takes == ()
    assert named.drafts.open(DraftKey("lea", TAKES[0])).tiers["affect"].source == MODEL
    assert len(named.drafts.open(DraftKey("ann", TAKES[0])).tiers["affect"].rows) == 1


def test_a_lead_who_codes_blind_is_not_told_how_much_the_others_found(named):
    draw(named, coders=["ann", "lea"])
    take = read_plan(named).takes[0].take
    edit(named, DraftKey("ann", take), kind="add", onset=5, offset=50, label="A")
    lead = log_in(named, "lea")

    def count():
        work = [one for row in lead.get("/api/overview").json()["takes"] if row["take"] == take for one in row["by"]]
        return {one["person"]: (one["segments"], one["reviewed"], one["unpublished"]) for one in work}

    assert count() == {"ann": (0, 0, 0), "lea": (0, 0, 0)}
    assert sum(one["edits"] for one in lead.get("/api/overview").json()["people"]) == 0
    for coder in ("ann", "lea"):
        say_done(named, coder, take, True)
    assert count()["ann"] == (1, 1, 1)


def test_the_scheme_counts_nothing_of_a_take_that_is_coded_blind(named):
    app = create_app(named)
    ann = log_in(named, "ann", app)

    def count():
        return sum(label["segments"] for label in ann.get("/api/scheme").json()["vocabularies"][0]["labels"])

    assert count() > 0
    draw(named)
    assert count() == 0
    for take in TAKES:
        for coder in ("ann", "bob"):
            say_done(named, coder, take, True)
    assert count() > 0


def test_takes_without_consent_show_no_labels_either_and_keep_their_edits(review, folder):
    key = DraftKey("ann", TAKES[0])
    edit(review, key, kind="add", onset=5, offset=50, label="A")
    with Corpus.open(folder).transaction("Withdraw") as put:
        put.put_signer("ab", {"consent": "none"})
    for refused in (lambda: review.drafts.open(key), lambda: review.drafts.undo(key, request="0" * 9, version=2)):
        with pytest.raises(ForbiddenDraftError, match="consent"):
            refused()
    assert review.drafts.begun() == [key]
    assert PageClient(create_app(review)).get("/api/draft", params={"take": TAKES[0]}).status_code == 403


# People


def test_a_person_gives_themselves_another_password_and_others_are_logged_out(named):
    app = create_app(named)
    here, elsewhere = log_in(named, "ann", app), log_in(named, "ann", app)
    new = "another and a longer one"
    for old, password, status in (("wrong", new, 401), (PASSWORDS["ann"], "short", 422)):
        assert here.put("/api/password", json={"old": old, "new": password}).status_code == status
    assert elsewhere.get("/api/session").status_code == 200
    answer = here.put("/api/password", json={"old": PASSWORDS["ann"], "new": new})
    assert answer.status_code == 200 and answer.json()["person"] == "ann"
    assert elsewhere.get("/api/session").status_code == 401
    assert here.get("/api/session").status_code == 200
    assert here.put("/api/settings", json={}).status_code == 403  # with the CSRF token of before
    here.headers["X-Mimique-CSRF"] = answer.json()["csrf"]
    assert here.put("/api/settings", json={}).status_code == 200
    assert named.people.accounts.check_password("ann", PASSWORDS["ann"]) is None
    assert named.people.accounts.check_password("ann", new) is not None


def test_whoever_finds_an_open_page_cannot_try_passwords_there(named):
    client = log_in(named, "ann")
    tries = [client.put("/api/password", json={"old": f"guess {n}", "new": "x" * 10}).status_code for n in range(7)]
    assert tries == [401] * 5 + [429] * 2


def test_without_names_there_is_no_password_to_change(review):
    answer = PageClient(create_app(review)).put("/api/password", json={"old": "", "new": "x" * 10})
    assert answer.status_code == 409


def test_blanks_around_a_name_give_no_more_tries(named):
    client = PageClient(create_app(named), login={})
    spelled = ["ann", " ann", "ann ", "\tann", "  ann  ", "ann\u00a0", " \nann"]
    tries = [client.post("/api/session", json={"person": name, "password": "wrong"}).status_code for name in spelled]
    assert tries == [401] * 5 + [429] * 2


def test_nobody_is_called_like_a_model_or_the_program(named, folder):
    with Corpus.open(folder).transaction("Learn") as put:
        put.put_model("Grove", {}, {})
    lead = log_in(named, "lea")
    for name in ("grove", "Mimique", "adjudicated"):
        answer = lead.post("/api/accounts", json={"person": name, "password": "x" * 10, "is_lead": False})
        assert answer.status_code == 422, name
        with pytest.raises(InputError, match="choose another"):
            open_review(folder, owner=name)


def test_who_is_logged_in_goes_on_reading_where_nothing_can_be_written(named, monkeypatch):
    client = log_in(named, "ann")
    with named.database.write() as connection:
        connection.execute("UPDATE sessions SET seen = seen - 7200")

    def full(*_):
        raise CorpusError("full")

    monkeypatch.setattr(Database, "write", full)
    assert client.get("/api/session").status_code == 200


def test_a_page_of_another_port_of_this_machine_reads_nothing(review):
    client = PageClient(create_app(review))
    headers = {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "cors"}
    assert client.get("/api/session", headers=headers).status_code == 403
    assert client.get("/api/session", headers={"Sec-Fetch-Site": "same-origin"}).status_code == 200


def test_what_a_tab_of_one_person_sends_is_never_saved_as_anothers(named):
    client = log_in(named, "lea")  # the cookie of the browser by now
    for name, status in (("cia", 401), ("l%65a", 200), ("", 401), ("%FF", 401)):
        headers = {"X-Mimique-Person": name}
        assert client.get("/api/session", headers=headers).status_code == status, name
        assert client.put("/api/settings", json={}, headers=headers).status_code == status, name
    assert client.put("/api/settings", json={}).status_code == 200


def test_who_logs_in_from_elsewhere_is_not_told_where_the_corpus_lies(named, folder, monkeypatch):
    client = log_in(named, "ann")
    with lock_corpus(folder):
        problems = client.get("/api/corpus").json()["problems"]
    assert [one["message"] for one in problems if "locked by" in one["message"]]
    assert [one["command"] for one in problems if one["command"]] == ["mimique solve corpus"]
    scene = client.get("/api/scene", params={"take": TAKES[0]}).json()
    assert scene["problem"]["command"] == "mimique solve corpus"

    def full(*_):
        raise CorpusError(f"{named.database.path}: nothing more can be saved")

    monkeypatch.setattr(Database, "write", full)
    answer = client.put("/api/settings", json={}).json()["error"]
    assert answer["message"] == "corpus.review/edits.sqlite: nothing more can be saved"
    assert str(folder.parent) not in f"{problems}{scene}{answer}"


# The server


def test_the_listening_socket_names_tcp_so_that_small_answers_are_sent_at_once(folder, tmp_path):
    with _listen(Serving(folder, port=0), tmp_path) as listener:
        assert listener.proto == socket.IPPROTO_TCP


def test_a_corpus_that_is_reached_by_a_link_has_one_review(folder, tmp_path):
    (tmp_path / "link").symlink_to(folder, target_is_directory=True)
    assert review_folder(tmp_path / "link") == review_folder(folder)


def test_asking_for_takes_that_never_were_fills_no_memory(review):
    for number in range(50):
        with pytest.raises(NotFoundError):
            review.drafts.open(DraftKey("ann", f"take {number}"))
    gc.collect()
    assert len(review.drafts._locks) == 0


def test_a_running_review_goes_on_when_the_folder_of_its_corpus_was_exchanged(review, folder):
    """As when a signer was forgotten from another computer, whose locks this one does not see."""
    edit(review, DraftKey("ann", TAKES[2]), kind="add", onset=5, offset=50, label="A")
    forget(Corpus.open(folder), "ab", purge_review=lambda data, redactor: None)
    assert review.corpus().takes()["take"].tolist() == [TAKES[2]]
    client = PageClient(create_app(review))
    assert client.get("/api/draft", params={"take": TAKES[2]}).status_code == 200
    assert client.get("/api/draft", params={"take": TAKES[0]}).status_code == 404
    plan = PageClient(create_app(review)).get("/api/publish").json()
    assert plan["held_back"] == []


# All at once


def test_a_label_is_renamed_while_others_edit_and_publish(review, folder, monkeypatch):
    """What is published between the commit of a scheme and its way into the drafts would bring the old label back."""
    key = DraftKey("lea", TAKES[0])
    edit(review, key, kind="add", onset=5, offset=50, label="A")
    client, app = PageClient(create_app(review)), create_app(review)
    change, ended = review.drafts.change_labels, threading.Event()

    def publish():
        other = PageClient(app)
        plan = other.get("/api/publish").json()
        other.post("/api/publish", json={"plan": plan["plan"], "message": "", "choices": {}})
        ended.set()

    def change_slowly(*arguments, **options):
        threading.Thread(target=publish).start()
        assert not ended.wait(0.7)  # it waits for the drafts
        return change(*arguments, **options)

    monkeypatch.setattr(review.drafts, "change_labels", change_slowly)
    scheme = client.get("/api/scheme").json()
    rename = {"kind": "rename", "vocabulary": "affect", "label": "A", "to": "Anger"}
    assert client.post("/api/scheme", json={"snapshot": scheme["snapshot"], "change": rename}).status_code == 200
    assert ended.wait(20)
    assert "Anger" in [row["label"] for row in review.drafts.open(key).tiers["affect"].rows]
    corpus = Corpus.open(folder)
    if ("affect", "lea") in [(one.tier, one.author) for one in review.drafts.starts.stored(corpus, TAKES[0])]:
        assert "A" not in corpus.tier(TAKES[0], "affect", "lea")["label"].tolist()


def do_something(client, lead, rng):
    """Do one thing that a page does, and return the answer."""
    take = rng.choice(TAKES)
    draft = client.get("/api/draft", params={"take": take}).json()
    asked = {"take": take, "purpose": "own", "request": str(uuid.uuid4()), "version": draft.get("version", 0)}
    onset = rng.randrange(1100)
    operation = {"kind": "add", "tier": "affect", "onset": onset, "offset": onset + 40, "label": "J"}
    match rng.randrange(9):
        case 0 | 1 | 2 | 3:
            return client.post("/api/draft/edit", json={**asked, "operation": operation})
        case 4:
            return client.post(f"/api/draft/{rng.choice(['undo', 'redo'])}", json=asked)
        case 5:
            plan = client.get("/api/publish").json()["plan"]
            return client.post("/api/publish", json={"plan": plan, "message": "", "choices": {}})
        case 6:
            change = {"kind": "describe", "vocabulary": "affect", "label": "J", "note": str(onset)}
            snapshot = lead.get("/api/scheme").json()["snapshot"]
            return lead.post("/api/scheme", json={"snapshot": snapshot, "change": change})
        case 7:
            plan = {"tier": "affect", "share": rng.choice([0.0, 0.4]), "coders": ["ann", "bob"]}
            return lead.put("/api/coding", json={**plan, "coders_per_take": 2, "seed": 1})
        case _:
            return client.get(rng.choice(["/api/queue", "/api/corpus", "/api/pace", "/api/scheme"]))


def test_thirty_at_once_lose_nothing_and_wait_for_nobody_for_ever(named, folder):
    app, said, people = create_app(named), [], list(PASSWORDS)
    clients = [(log_in(named, people[number % 3], app), log_in(named, "lea", app)) for number in range(30)]
    until = time.monotonic() + 4.0

    def work(number):
        rng = random.Random(number)
        while time.monotonic() < until:
            answer = do_something(*clients[number], rng)
            said.append((answer.status_code, answer.text[:200] if answer.status_code >= 500 else ""))

    threads = [threading.Thread(target=work, args=(number,), daemon=True) for number in range(30)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
    assert {one for one in said if one[0] >= 500} == set()
    assert sum(status == 200 for status, _ in said) > 30
    assert len(named.drafts.begun()) > 1 and len(Corpus.open(folder).history()) > 3
    with named.database.read() as connection:
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
    shown = {key: named.drafts.look(key.person, key.take).tiers for key in named.drafts.begun()}
    again = open_review(folder)
    assert {key: again.drafts.look(key.person, key.take).tiers for key in again.drafts.begun()} == shown
    again.close()
