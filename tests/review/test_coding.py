"""Double coding: drawn, coded blind, compared when all are done, and settled."""

import shutil
import threading
from contextlib import suppress

import numpy as np
import pandas as pd
import pytest
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.errors import ConflictError, InputError, NotFoundError
from mimique.workbench.review.coding.adjudication import compare_readings, start_adjudication
from mimique.workbench.review.coding.agreement import score_pair
from mimique.workbench.review.coding.messages import Adjudication, CodingPlan, Overview
from mimique.workbench.review.coding.modes import mode_of, modes_of
from mimique.workbench.review.coding.overview import summarise
from mimique.workbench.review.coding.plan import read_plan, save_plan, say_done
from mimique.workbench.review.coding.readings import list_readings
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts.records import DraftKey, ForbiddenDraftError, StaleDraftError
from mimique.workbench.review.people.person import Person
from mimique.workbench.review.queueing.pace import record_activity
from mimique.workbench.review.queueing.queue import list_queue
from mimique.workbench.review.server.app import create_app
from mimique.workbench.review.server.dependencies import get_person

from .page_client import PageClient
from .review_corpus import make_proposals

RATE, N_FRAMES = 200.0, 1600
TAKES = [f"{signer}_{number}" for signer in ("s1", "s2") for number in range(5)]


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    folder, rng = tmp_path_factory.mktemp("coding") / "corpus", np.random.default_rng(5)
    made = Corpus.create(folder)
    with made.transaction("Make", author="lead") as edit:
        for name in TAKES:
            take = make_take(np.zeros((N_FRAMES, 1, 3)), ["M"], RATE, signer=name[:2], protocol="IE")
            edit.put_take(name, take)
            proposals = make_proposals(N_FRAMES, rng)
            edit.put_tier(name, "affect", proposals, author="old", provenance={"step": "label"})
    return folder


@pytest.fixture
def review(template, tmp_path):
    opened = open_review(shutil.copytree(template, tmp_path / "corpus"), owner="lead")
    yield opened
    opened.close()


_count = iter(range(1, 10**6))


def add(review, person, take, *segments, purpose="own", kind="add"):
    key = DraftKey(person, take, purpose)
    for onset, offset, label in segments:
        version = review.drafts.open(key).version
        edit = {"kind": kind, "tier": "affect", "onset": onset, "offset": offset, "label": label}
        review.drafts.edit(key, edit, request=f"{next(_count):032d}", version=version)


def plan(review, share=0.4, coders=("ab", "cd"), coders_per_take=2, seed=7, tier="affect"):
    return save_plan(review, tier=tier, share=share, coders=coders, coders_per_take=coders_per_take, seed=seed)


def code_all(review, take):
    """Two readings: the same but for 4 frames of a border, one other label, and one that only ab has."""
    add(review, "ab", take, (0, 200, "N"), (200, 500, "A"), (500, 900, "J"), (1000, 1100, "Su"))
    add(review, "cd", take, (0, 204, "N"), (204, 500, "A"), (500, 900, "F"))
    say_done(review, "ab", take, True)
    say_done(review, "cd", take, True)


def test_a_drawn_take_is_blind_to_its_coders_and_closed_to_others_until_all_are_done(review):
    assert mode_of(review, "ab", TAKES[0]) == "review" and read_plan(review).takes == ()
    drawn = plan(review).takes
    assert len(drawn) == 4 and sum(one.take.startswith("s1") for one in drawn) == 2
    take = drawn[0].take
    for person, mode in (("ab", "blind"), ("cd", "blind"), ("lead", "none"), ("", "none")):
        assert mode_of(review, person, take) == mode
        assert modes_of(review, person) == {one.take: mode for one in drawn}
        assert not {item["take"] for item in list_queue(review, person)["items"]} & {one.take for one in drawn}
    assert review.drafts.look("ab", take).tiers["affect"] == ()
    with pytest.raises(ConflictError, match="still coded blind: ab, cd are not done"):
        start_adjudication(review, take, "affect")
    with pytest.raises(ForbiddenDraftError):
        review.drafts.open(DraftKey("lead", take))
    add(review, "ab", take, (0, 200, "N"))
    assert say_done(review, "ab", take, True).done == ("ab",)
    assert mode_of(review, "ab", take) == "blind" and mode_of(review, "cd", take) == "blind"
    assert (take, "affect") not in list_readings(review)
    say_done(review, "ab", take, False)
    say_done(review, "cd", take, True)
    assert mode_of(review, "lead", take) == "none"
    assert say_done(review, "ab", take, True).is_finished
    assert {mode_of(review, person, take) for person in ("ab", "cd", "lead")} == {"review"}
    with pytest.raises(ConflictError, match="all its coders were done"):
        say_done(review, "ab", take, False)
    assert say_done(review, "ab", take, True).is_finished
    for person, name in (("lead", take), ("ab", "nothing"), ("ab", TAKES[0] + "x")):
        with pytest.raises(NotFoundError, match="not among those"):
            say_done(review, person, name, True)


def test_readings_are_those_when_all_were_done_whatever_is_edited_later(review):
    take = plan(review).takes[0].take
    code_all(review, take)
    before = compare_readings(review, take, "affect", "ab", "cd")
    add(review, "ab", take, (500, 900, "F"))
    after = compare_readings(review, take, "affect", "ab", "cd")
    assert before == after
    assert [(one.onset, one.offset, one.first, one.second) for one, _ in before.differences] == [
        (500, 900, "J", "F"),
        (1000, 1100, "Su", None),
    ]


def test_what_both_say_is_where_the_settled_tier_starts(review):
    take = plan(review).takes[0].take
    code_all(review, take)
    table = start_adjudication(review, take, "affect")
    assert table[["onset", "offset", "label", "status", "origin"]].values.tolist() == [
        [0, 202, "N", "adjudicated", "human"],
        [202, 500, "A", "adjudicated", "human"],
    ]
    pd.testing.assert_frame_equal(table, start_adjudication(review, take, "affect"))
    assert start_adjudication(review, take, "another tier").empty
    assert start_adjudication(review, TAKES[0] if take != TAKES[0] else TAKES[1], "affect").empty
    with pytest.raises(NotFoundError):
        start_adjudication(review, "nothing", "affect")


def test_disagreements_are_settled_one_by_one_also_by_nothing(review):
    take = plan(review).takes[0].take
    code_all(review, take)
    assert [settled for _, settled in compare_readings(review, take, "affect", "ab", "cd").differences] == [False] * 2
    add(review, "lead", take, (500, 900, "F"), purpose="adjudication", kind="settle")
    assert [settled for _, settled in compare_readings(review, take, "affect", "cd", "ab").differences] == [True, False]
    add(review, "lead", take, (1000, 1100, None), purpose="adjudication", kind="settle")
    assert [settled for _, settled in compare_readings(review, take, "affect", "ab", "cd").differences] == [True, True]
    unsettled = next(one for one in summarise(review).to_settle if one.take == take)
    assert (unsettled.disagreements, unsettled.settled) == (2, 2)
    assert unsettled.seconds == pytest.approx(500 / RATE)
    key = DraftKey("lead", take, "adjudication")
    review.drafts.undo(key, request="0" * 32, version=review.drafts.open(key).version)
    assert [settled for _, settled in compare_readings(review, take, "affect", "ab", "cd").differences] == [True, False]


def test_takes_on_which_somebody_works_are_not_drawn(review):
    item = list_queue(review, "ab")["items"][0]
    key = DraftKey("ab", item["take"])
    accept = {"kind": "accept", "tier": "affect", "segments": [int(item["id"])]}
    review.drafts.edit(key, accept, request="1" * 32, version=review.drafts.open(key).version)
    own = Corpus.open(review.location)
    with own.transaction("Publish", author="cd") as edit:
        table = pd.DataFrame({"onset": [0], "offset": [50], "label": ["N"], "status": ["reviewed"]})
        edit.put_tier(TAKES[9], "affect", table, author="cd")
    with pytest.raises(InputError, match=r"1 of 10 takes are 10, but only 8 can be drawn"):
        plan(review, share=1.0)
    drawn = {one.take for one in plan(review, share=0.8).takes}
    assert drawn == set(TAKES) - {item["take"], TAKES[9]}


def test_a_take_that_a_coder_has_looked_at_is_not_drawn(review):
    record_activity(review, "ab", TAKES[3], 20.0)
    record_activity(review, "somebody else", TAKES[4], 20.0)
    drawn = {one.take for one in plan(review, share=0.9).takes}
    assert drawn == set(TAKES) - {TAKES[3]}
    record_activity(review, "ab", TAKES[0], 20.0)  # blind: that is how it should be
    assert {one.take for one in plan(review, share=0.9).takes} == drawn


def test_a_plan_that_changes_keeps_what_is_begun_and_what_still_fits(review):
    before = plan(review)
    begun = before.takes[1].take
    add(review, "ab", begun, (0, 100, "N"))
    assert plan(review) == before
    wider = plan(review, share=0.6)
    assert {one.take for one in before.takes} < {one.take for one in wider.takes}
    own = Corpus.open(review.location)
    with own.transaction("More", author="x") as edit:
        for number in range(5):
            edit.put_take(f"s3_{number}", make_take(np.zeros((10, 1, 3)), ["M"], RATE, signer="s3"))
    more = plan(review, share=0.6)
    assert set(wider.takes) < set(more.takes) and len(more.takes) == 9
    others = plan(review, share=0.2, coders=("ef", "gh"), seed=8)
    assert len(others.takes) == 3
    assert {one.take: one.coders for one in others.takes}[begun] == ("ab", "cd")
    assert all(one.coders == ("ef", "gh") for one in others.takes if one.take != begun)
    assert [one.take for one in plan(review, share=0.0, coders=()).takes] == [begun]


def test_plans_and_edits_at_the_same_time_wait_for_nobody_forever(review):
    def work(person, takes):
        for take in takes:
            with suppress(ForbiddenDraftError, StaleDraftError):
                add(review, person, take, (0, 100, "N"))

    threads = [
        threading.Thread(target=work, args=(person, TAKES[number::2]), daemon=True)
        for number, person in enumerate(("x", "y"))
    ]
    for thread in threads:
        thread.start()
    for seed in range(5):
        with suppress(ConflictError, InputError):  # somebody began just now; too few are left
            plan(review, share=0.2, seed=seed)
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)


def test_plans_that_cannot_be_are_refused(review):
    with pytest.raises(InputError, match="each person once"):
        plan(review, coders=("ab", "ab", "cd"))
    with pytest.raises(InputError, match="at least 3 different people"):
        plan(review, coders_per_take=3)
    with pytest.raises(InputError, match="adjudicated"):
        plan(review, coders=("adjudicated", "ab"))
    with pytest.raises(InputError, match="automatic cuts"):
        plan(review, tier="segments")
    assert read_plan(review).takes == ()


def test_coders_must_have_accounts_where_people_log_in(review):
    named = open_review(review.location)
    named.people.accounts.add("ab", "a long enough password")
    with pytest.raises(InputError, match="there is no account 'cd'; there are ab"):
        plan(named)
    named.close()


def test_agreement_of_pairs_by_hand():
    def rows(*segments):
        return [{"onset": on, "offset": off, "label": label} for on, off, label in segments]

    one, other = rows((0, 50, "A"), (50, 100, "B")), rows((0, 50, "A"), (50, 80, "B"), (80, 100, "A"), (100, 120, "A"))
    seconds, kappa, alpha, agreement, f1 = score_pair([(one, other, 10.0)])
    assert (seconds, agreement) == (pytest.approx(12.0), pytest.approx(80 / 120))
    # 100 frames have both: 80 alike; A 50 and 70, B 50 and 30.
    chance = (50 * 70 + 50 * 30) / 100**2
    assert kappa == pytest.approx((0.8 - chance) / (1 - chance))
    observed, expected = 20 * 2 / 200, 2 * 120 * 80 / (200 * 199)
    assert alpha == pytest.approx(1 - observed / expected)
    assert f1 == pytest.approx(2 * (2 + 2) / ((2 + 3) + (3 + 2)))
    assert score_pair([(other, one, 10.0)]) == pytest.approx((seconds, kappa, alpha, agreement, f1))
    assert score_pair([(one, one, 10.0)])[1:] == (1.0, 1.0, 1.0, 1.0)
    assert score_pair([([], [], 10.0)]) == (0.0, None, None, None, None)
    assert score_pair([(rows((0, 9, "A")), rows((0, 9, "A")), 10.0)])[1:] == (None, None, 1.0, 1.0)
    twice = score_pair([(one, other, 10.0), (one, other, 10.0)])
    assert twice[1] == pytest.approx(kappa) and twice[0] == pytest.approx(24.0)


def test_the_overview_counts_people_takes_and_agreement(review):
    drawn = plan(review).takes
    code_all(review, drawn[0].take)
    item = list_queue(review, "lead")["items"][0]
    key = DraftKey("lead", item["take"])
    accept = {"kind": "accept", "tier": "affect", "segments": [int(item["id"])]}
    review.drafts.edit(key, accept, request="2" * 32, version=review.drafts.open(key).version)
    # What two people published after they had seen proposals is compared, but is no agreement of their own.
    own, take = Corpus.open(review.location), next(one for one in TAKES if one not in {d.take for d in drawn})
    with own.transaction("Publish", author="x") as edit:
        for person, label in (("xx", "N"), ("yy", "J")):
            table = pd.DataFrame({"onset": [0], "offset": [50], "label": [label], "status": ["reviewed"]})
            table = table.assign(origin="model")
            edit.put_tier(take, "affect", table, author=person, provenance={"step": "review"})
    found = summarise(review)
    people = {one.person: one for one in found.people}
    assert set(people) == {"ab", "cd", "lead"} and people["lead"].is_lead and not people["ab"].is_lead
    assert (people["ab"].takes, people["ab"].reviewed, people["ab"].edits) == (1, 4, 4)
    assert people["lead"].reviewed == 1 and people["lead"].unpublished == 1
    assert people["ab"].seconds_per_minute is None and people["ab"].last_active is None
    by = {one.take: {work.person: work for work in one.by} for one in found.takes}
    assert set(by[drawn[0].take]) == {"ab", "cd"} and by[drawn[0].take]["ab"].done
    assert by[drawn[1].take]["cd"].mode == "blind" and by[drawn[1].take]["cd"].segments == 0
    assert [(one.first, one.second, one.takes) for one in found.agreement] == [("ab", "cd", 1)]
    agreement = found.agreement[0]
    assert agreement.seconds == pytest.approx(1000 / RATE)
    assert agreement.agreement == pytest.approx((500 - 4) / 1000)
    assert {(one.take, one.first, one.second) for one in found.to_settle} == {
        (drawn[0].take, "ab", "cd"),
        (take, "xx", "yy"),
    }
    assert summarise(review) == found


def test_time_of_work_is_told_per_minute_of_recording(review):
    take = plan(review).takes[0].take
    add(review, "ab", take, (0, 1200, "N"))
    record_activity(review, "ab", take, 30.0)
    found = {one.person: one for one in summarise(review).people}["ab"]
    assert found.active_seconds == 30.0
    assert found.seconds_per_minute == pytest.approx(30.0 / (6.0 / 60.0))
    assert found.last_active is not None and found.last_active.endswith("+00:00")


def test_the_routes(review):
    app = create_app(review)
    lead = PageClient(app)
    empty = lead.get("/api/coding").json()
    assert empty == {"tier": "affect", "share": 0.0, "coders": [], "coders_per_take": 2, "seed": 0, "takes": []}
    wanted = {**empty, "share": 0.4, "coders": ["ab", "cd"], "seed": 7}
    answer = lead.put("/api/coding", json=wanted)
    assert answer.status_code == 200, answer.text
    CodingPlan.model_validate(answer.json())
    take = answer.json()["takes"][0]["take"]
    where = {"take": take, "tier": "affect", "first": "ab", "second": "cd"}
    assert lead.get("/api/adjudication", params=where).status_code == 409
    coder = PageClient(app)
    for person in ("ab", "cd"):
        app.dependency_overrides[get_person] = lambda person=person: Person(person, False)
        add(review, person, take, (0, 100, "N"), (100, 300, "A" if person == "ab" else "J"))
        for path in ("/api/coding", "/api/overview", "/api/adjudication?take=a&tier=b&first=c&second=d"):
            assert coder.get(path).status_code == 403, path
        assert coder.put("/api/coding", json=wanted).status_code == 403
        assert coder.post("/api/coding/done", json={"take": take, "done": True}).json() == {"take": take, "done": True}
    assert coder.post("/api/coding/done", json={"take": take, "done": False}).status_code == 409
    assert coder.post("/api/coding/done", json={"take": "../..", "done": True}).status_code == 404
    app.dependency_overrides.clear()
    found = Adjudication.model_validate(lead.get("/api/adjudication", params=where).json())
    assert [(one.onset, one.offset, one.first, one.second) for one in found.disagreements] == [(100, 300, "A", "J")]
    assert [one.label for one in found.first.segments] == ["N", "A"]
    Overview.model_validate(lead.get("/api/overview").json())
    for name in ("", "/", "..", "%", "a\nb", "\0", "🙂", "x" * 10_000):
        for field in where:
            assert lead.get("/api/adjudication", params={**where, field: name}).status_code in (404, 422), (field, name)
    for wrong in (
        {"share": 1.5},
        {"share": "NaN"},
        {"coders_per_take": 1},
        {"seed": -1},
        {"seed": 2**60},
        {"tier": ""},
    ):
        assert lead.put("/api/coding", json={**wanted, **wrong}).status_code == 422, wrong
    assert lead.put("/api/coding", json={**wanted, "share": 1.0, "coders": ["a\0", "ab"]}).status_code == 422
