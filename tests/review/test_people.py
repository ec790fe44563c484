"""Accounts, passwords, sessions, settings: the people of a review."""

import json
import threading

import pytest
from mimique.errors import ConflictError, InputError, NotFoundError
from mimique.workbench.review.database import Database
from mimique.workbench.review.people import SCHEMA, passwords
from mimique.workbench.review.people.accounts import Accounts
from mimique.workbench.review.people.login_limits import PER_ADDRESS, PER_PERSON_AND_ADDRESS, WINDOW, LoginLimits
from mimique.workbench.review.people.people import LONGEST_SETTINGS, People
from mimique.workbench.review.people.person import Person
from mimique.workbench.review.people.sessions import LIFETIME, Sessions
from mimique.workbench.review.server.errors import Refusal

PASSWORD = "a long password"


class Clock:
    def __init__(self, now=1e9):
        self.now = now

    def __call__(self):
        return self.now


@pytest.fixture
def database(tmp_path):
    opened = Database(tmp_path / "edits.sqlite", [SCHEMA])
    yield opened
    opened.close()


@pytest.fixture(autouse=True)
def quick_hashes(monkeypatch):
    """Argon2 with little work: the same code, and tests that end."""
    monkeypatch.setattr(passwords, "_hasher", passwords.PasswordHasher(time_cost=1, memory_cost=64, parallelism=1))


def everything_stored(database):
    with database.read() as connection:
        tables = [row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        return repr([tuple(row) for name in tables for row in connection.execute(f"SELECT * FROM {name}")])


# Passwords


def test_the_hasher_of_a_real_run_is_argon2id_with_much_memory():
    hasher = passwords.PasswordHasher()
    assert hasher.type.name == "ID"
    assert hasher.memory_cost >= 19 * 1024  # kB; what OWASP asks for at least


def test_a_password_is_known_again_and_no_other():
    kept = passwords.hash_password(PASSWORD)
    assert kept.startswith("$argon2id$")
    assert passwords.verify_password(kept, PASSWORD)
    assert not passwords.verify_password(kept, PASSWORD + "x")
    assert not passwords.verify_password(None, PASSWORD)
    assert not passwords.verify_password("no hash", PASSWORD)
    assert passwords.hash_password(PASSWORD) != kept  # salted


def test_an_accent_typed_in_another_way_is_the_same():
    assert passwords.verify_password(passwords.hash_password("dix caract\u00e8res"), "dix caracte\u0300res")


@pytest.mark.parametrize("password", ["", "short", "x" * 1025])
def test_a_password_of_another_length_is_refused(password):
    with pytest.raises(InputError, match="10 to 1024 characters"):
        passwords.hash_password(password)


# Accounts


def test_accounts_come_change_and_go(database):
    accounts = Accounts(database)
    accounts.add("lea", PASSWORD, is_lead=True)
    accounts.add("Zoé O'Neil 😀", PASSWORD)
    assert [(one.person, one.is_lead, one.is_active) for one in accounts.list()] == [
        ("Zoé O'Neil 😀", False, True),
        ("lea", True, True),
    ]
    assert accounts.check_password("lea", PASSWORD) == Person("lea", True)
    assert accounts.check_password(" Zoe\u0301 O'Neil 😀", PASSWORD) == Person("Zoé O'Neil 😀", False)
    assert accounts.check_password("lea", "another password") is None
    assert accounts.check_password("nobody", PASSWORD) is None
    accounts.change("lea", password="another password")
    assert accounts.check_password("lea", PASSWORD) is None
    assert accounts.check_password("lea", "another password") == Person("lea", True)
    accounts.remove("Zoé O'Neil 😀")
    assert accounts.check_password("Zoé O'Neil 😀", PASSWORD) is None
    accounts.add("Zoé O'Neil 😀", "a third password")  # back again
    assert accounts.check_password("Zoé O'Neil 😀", "a third password") is not None
    assert PASSWORD not in everything_stored(database)


@pytest.mark.parametrize("name", ["", "  ", "x" * 101, "a\nb", "a\0b", "a\u202eb", "\ud800", "Adjudicated"])
def test_a_name_that_cannot_be_one_is_refused(database, name):
    with pytest.raises(InputError, match="name: "):
        Accounts(database).add(name, PASSWORD)


def test_two_names_that_look_alike_are_refused(database):
    accounts = Accounts(database)
    accounts.add("Lea", PASSWORD)
    for name in ("Lea", "lea", "LEA"):
        with pytest.raises(ConflictError, match="'Lea' already"):
            accounts.add(name, PASSWORD)
    with pytest.raises(NotFoundError, match="accounts: Lea"):
        accounts.change("lea", password=PASSWORD)


def test_somebody_stays_lead(database):
    accounts = Accounts(database)
    accounts.add("lea", PASSWORD, is_lead=True)
    accounts.add("bob", PASSWORD)
    for change in (lambda: accounts.remove("lea"), lambda: accounts.change("lea", is_lead=False)):
        with pytest.raises(ConflictError, match="only lead"):
            change()
    accounts.change("bob", is_lead=True)
    accounts.remove("lea")
    accounts.remove("bob")  # nobody is left who would need a lead
    assert not any(one.is_active for one in accounts.list())


def test_an_outdated_hash_is_made_anew(database, monkeypatch):
    accounts = Accounts(database)
    accounts.add("lea", PASSWORD)
    before = everything_stored(database)
    monkeypatch.setattr(passwords, "_hasher", passwords.PasswordHasher(time_cost=2, memory_cost=64, parallelism=1))
    assert accounts.check_password("lea", PASSWORD) is not None
    assert "t=2" in everything_stored(database) != before
    assert accounts.check_password("lea", PASSWORD) is not None


# Sessions


def test_a_session_outlives_the_process_and_its_secret_is_not_stored(database):
    owner = Person("ab", True)
    secret = Sessions(database, owner).begin("ab")
    found = Sessions(database, owner).find(secret)
    assert found.person == owner
    assert (
        len(found.csrf) == 64
        and found.csrf != Sessions(database, owner).find(Sessions(database, owner).begin("ab")).csrf
    )
    stored = everything_stored(database)
    assert secret not in stored and found.csrf not in stored
    for other in ("", "x", secret[:-1], secret + "x", "\ud800"):
        assert Sessions(database, owner).find(other) is None


def test_a_session_ends_by_logging_out_and_by_staying_away(database):
    clock = Clock()
    sessions = Sessions(database, Person("ab", True), clock)
    left, kept = sessions.begin("ab"), sessions.begin("ab")
    sessions.end(left)
    assert sessions.find(left) is None
    for _ in range(3):  # who comes back stays
        clock.now += LIFETIME - 1
        assert sessions.find(kept) is not None
    clock.now -= 100 * LIFETIME  # a clock set back locks nobody out
    assert sessions.find(kept) is not None
    clock.now += 200 * LIFETIME
    assert sessions.find(kept) is None
    sessions.begin("ab")
    with database.read() as connection:
        assert connection.execute("SELECT count(*) FROM sessions").fetchone()[0] == 1  # old ones are swept away


def test_sessions_by_token_and_by_name_do_not_mix(database):
    Accounts(database).add("ab", PASSWORD)
    by_token = Sessions(database, Person("ab", True)).begin("ab")
    by_name = Sessions(database, None).begin("ab")
    assert Sessions(database, None).find(by_token) is None
    assert Sessions(database, Person("ab", True)).find(by_name) is None
    assert Sessions(database, Person("cd", True)).find(by_token) is None  # another owner today
    assert Sessions(database, None).find(by_name).person == Person("ab", False)


def test_rights_and_removal_hold_at_once(database):
    accounts, sessions = Accounts(database), Sessions(database, None)
    accounts.add("lea", PASSWORD, is_lead=True)
    accounts.add("bob", PASSWORD)
    bob = sessions.begin("bob")
    accounts.change("bob", is_lead=True)
    assert sessions.find(bob).person.is_lead
    accounts.change("bob", is_lead=False)
    assert not sessions.find(bob).person.is_lead
    accounts.change("bob", password="another password")
    assert sessions.find(bob) is None
    bob = sessions.begin("bob")
    accounts.remove("bob")
    assert sessions.find(bob) is None
    accounts.add("bob", PASSWORD)
    assert sessions.find(bob) is None  # coming back does not bring old sessions back


# Logging in


def test_a_token_lets_the_owner_in_and_nobody_by_name(database):
    people = People(database, owner=Person("ab", True))
    assert people.find_session(people.log_in_by_token(people.token)).person == Person("ab", True)
    for token in ("", "x", people.token[:-1], "\ud800"):
        with pytest.raises(Refusal) as refused:
            people.log_in_by_token(token)
        assert (refused.value.status, refused.value.kind) == (401, "no-session")
    people.accounts.add("ab", PASSWORD)
    with pytest.raises(Refusal, match="by name here"):
        people.log_in_by_name("ab", PASSWORD, "1.2.3.4")
    with pytest.raises(Refusal, match="log in by name"):
        People(database).log_in_by_token(people.token)


def test_wrong_passwords_are_counted(database):
    people = People(database)
    people.accounts.add("ab", PASSWORD)
    for _ in range(PER_PERSON_AND_ADDRESS):
        with pytest.raises(Refusal) as refused:
            people.log_in_by_name("ab", "a wrong password", "1.2.3.4")
        assert refused.value.status == 401
    with pytest.raises(Refusal) as refused:
        people.log_in_by_name("ab", PASSWORD, "1.2.3.4")  # right, and too late
    assert refused.value.status == 429
    assert 0 < int(refused.value.headers["Retry-After"]) <= WINDOW
    assert people.log_in_by_name("ab", PASSWORD, "5.6.7.8")  # a stranger does not lock the person out


def test_limits_forget_and_right_passwords_do_not_count():
    clock = Clock()
    limits = LoginLimits(clock)
    for _ in range(10 * PER_ADDRESS):
        assert limits.begin("ab", "here") == 0
        limits.succeed("ab", "here")
    for number in range(PER_ADDRESS):
        assert limits.begin(f"name {number}", "here") == 0
    assert limits.begin("ab", "here") == pytest.approx(WINDOW)  # by trying many names
    assert limits.begin("ab", "there") == 0
    clock.now += WINDOW + 1
    assert limits.begin("ab", "here") == 0
    assert len(limits._wrong) <= 3  # nothing is kept for ever


def test_many_tries_at_once_count_too():
    limits, allowed = LoginLimits(Clock()), []
    threads = [threading.Thread(target=lambda: allowed.append(limits.begin("ab", "here") == 0)) for _ in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(allowed) == PER_PERSON_AND_ADDRESS


# Settings


def test_settings_come_back_as_they_were(database):
    people = People(database)
    assert people.settings("ab") == {}
    chosen = {"language": "fr", "keys": {"edit.accept": ["Enter", "é"]}, "split": 0.25, "😀": None}
    people.put_settings("ab", chosen)
    people.put_settings("cd", {"language": "en"})
    assert People(database).settings("ab") == chosen
    people.put_settings("ab", {})
    assert (people.settings("ab"), people.settings("cd")) == ({}, {"language": "en"})


@pytest.mark.parametrize(
    "settings", [{"a": float("nan")}, {"a": "\ud800"}, {"a": "x" * LONGEST_SETTINGS}, {"a": {"b": float("inf")}}]
)
def test_settings_that_cannot_be_kept_are_refused(database, settings):
    people = People(database)
    people.put_settings("ab", {"language": "fr"})
    with pytest.raises(InputError, match="settings: expected"):
        people.put_settings("ab", settings)
    assert people.settings("ab") == {"language": "fr"}


def test_settings_of_exactly_the_limit_are_kept(database):
    people = People(database)
    chosen = {"a": "x" * (LONGEST_SETTINGS - len(json.dumps({"a": ""})))}
    people.put_settings("ab", chosen)
    assert people.settings("ab") == chosen
