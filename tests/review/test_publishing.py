"""Publishing: one commit of what the screen showed, merged with what others published, and nothing lost in between."""

import uuid

import numpy as np
import pandas as pd
import pytest
from mimique.corpus import Corpus
from mimique.corpus.annotations.label_vocabulary import LabelVocabulary
from mimique.corpus.annotations.vocabulary_change import change_vocabulary
from mimique.corpus.store.locking import lock_corpus
from mimique.corpus.versions.segment_rows import key_of_row, split_table
from mimique.errors import CorpusError, InputError
from mimique.workbench.pipeline.labelled_takes import count_annotators
from mimique.workbench.pipeline.tier_makers import is_machine_made
from mimique.workbench.review.context import open_review
from mimique.workbench.review.drafts import publishing
from mimique.workbench.review.drafts.publishing import plan_publishing, publish
from mimique.workbench.review.drafts.records import DraftKey, StaleDraftError

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


def rows_of(review, key=KEY, tier="affect"):
    return review.drafts.open(key).tiers[tier].rows


def edit(review, operation, key=KEY):
    version = review.drafts.open(key).version
    return review.drafts.edit(key, {"tier": "affect", **operation}, request=str(uuid.uuid4()), version=version)


def relabel(review, place, label, key=KEY):
    return edit(review, {"kind": "relabel", "segments": [rows_of(review, key)[place]["id"]], "label": label}, key)


def step(review, word, key=KEY):
    version = review.drafts.open(key).version
    return getattr(review.drafts, word)(key, request=str(uuid.uuid4()), version=version)


def plan_of(review, person="ab"):
    return plan_publishing(review.drafts, person, is_lead=True, corpus=review.corpus())


def publish_all(review, person="ab", choices=None, corpus=None, plan=None):
    return publish(
        review.drafts,
        person,
        is_lead=True,
        corpus=corpus or Corpus.open(review.location),
        plan=plan or plan_of(review, person).plan,
        message="Review",
        choices=choices or {},
    )


def stored(folder, take=TAKES[0], author="ab", tier="affect"):
    return split_table(Corpus.open(folder).tier(take, tier, author))[1]


def same(first, second):
    return sorted(map(key_of_row, first)) == sorted(map(key_of_row, second))


def put_theirs(folder, change, take=TAKES[0], author="ab"):
    """Somebody else changes a person's tier in the corpus."""
    corpus = Corpus.open(folder)
    table = corpus.tier(take, "affect", author)
    with corpus.transaction("By another hand", author="cd") as put:
        put.put_tier(take, "affect", change(table.copy()), author=author, provenance={"step": "review"})


def label_row(place, label):
    def change(table):
        table.loc[place, "label"] = label
        table.loc[place, "revision"] += 1
        return table

    return change


def test_publishing_is_one_commit_of_what_was_shown(review, folder):
    before = len(Corpus.open(folder).history())
    first, second = rows_of(review)[:2]
    relabel(review, 0, "J")
    edit(review, {"kind": "accept", "segments": [second["id"]]})
    other = DraftKey("ab", TAKES[1])
    edit(review, {"kind": "add", "onset": 5, "offset": 15, "label": "😀 ../\n"}, other)
    plan = plan_of(review)
    assert (plan.tiers[0].key.take, len(plan.tiers[0].changes)) == (TAKES[0], 2)
    words = [publishing.describe_words(change) for tier in plan.tiers for change in tier.changes]
    assert words[0] == f"{first['label']} [{first['onset']}, {first['offset']}) relabelled {first['label']} to J"
    named = f"J{second['label'].removeprefix(first['label'])}"
    assert words[1].startswith(f"{second['label']} [{second['onset']}, {second['offset']}) relabelled")
    assert words[1].endswith(f" to {named}"), "the transition is named after its neighbour, and accepted"
    shown = rows_of(review), rows_of(review, other)
    done = publish_all(review)
    corpus = Corpus.open(folder)
    assert done.snapshot == corpus.snapshot
    assert (done.takes, len(corpus.history())) == (2, before + 1)
    assert done.changes == sum(len(tier.changes) for tier in plan.tiers)
    facts = corpus.describe()
    assert (facts["command"], facts["author"], facts["message"]) == ("review", "ab", "Review")
    assert same(stored(folder), shown[0])
    assert same(stored(folder, TAKES[1]), shown[1])
    assert (rows_of(review), rows_of(review, other)) == shown
    state = review.drafts.open(KEY)
    assert (state.unpublished, state.base, state.undo) == (0, done.snapshot, "accept")
    assert plan_of(review).tiers == ()
    assert {row["status"] for row in stored(folder, author=MODEL)} == {"proposed"}


def test_what_is_undone_after_publishing_is_a_change_again(review, folder):
    first = rows_of(review)[0]
    relabel(review, 0, "J")
    relabel(review, 1, "J")
    publish_all(review)
    step(review, "undo")
    step(review, "undo")
    assert review.drafts.open(KEY).unpublished == 2
    publish_all(review)
    assert stored(folder)[0]["label"] == first["label"]
    step(review, "redo")
    assert review.drafts.open(KEY).unpublished == 1
    relabel(review, 0, "A")
    publish_all(review)
    assert stored(folder)[0]["label"] == "A"


def test_a_reviewed_tier_is_a_persons_though_every_proposal_was_right(review, folder):
    edit(review, {"kind": "accept", "segments": [row["id"] for row in rows_of(review)]})
    publish_all(review)
    corpus = Corpus.open(folder)
    assert {row["origin"] for row in stored(folder)} == {"model"}
    assert count_annotators(corpus) == {"ab": 1}
    others = review.drafts.starts.stored(review.corpus(), TAKES[0])
    assert {one.author: one.made_by for one in others} == {"ab": "person", MODEL: "model"}


def test_untouched_proposals_are_nobodys_tier(review, folder):
    with Corpus.open(folder).transaction("Scheme", author="x") as put:
        put.put_vocabulary("gaze", ["left"])
        table = pd.DataFrame({"onset": [0], "offset": [9], "label": ["left"], "origin": ["model"]})
        put.put_tier(TAKES[0], "gaze", table, author="net", provenance={"step": "label"})
    relabel(review, 0, "J")
    publish_all(review)
    table = Corpus.open(folder).tiers(TAKES[0])
    assert set(zip(table["tier"], table["author"], strict=True)) == {
        ("affect", "ab"), ("affect", MODEL), ("gaze", "net"),
    }  # fmt: skip


def test_what_others_published_meanwhile_is_merged_and_enters_the_draft(review, folder):
    relabel(review, 0, "J")
    publish_all(review)
    relabel(review, 3, "Joy")
    put_theirs(folder, label_row(6, "Theirs"))
    plan = plan_of(review)
    assert [len(tier.changes) for tier in plan.tiers] == [1]
    assert not plan.tiers[0].conflicts
    publish_all(review)
    found = stored(folder)
    assert (found[0]["label"], found[3]["label"], found[6]["label"]) == ("J", "Joy", "Theirs")
    state = review.drafts.open(KEY)
    assert same(state.tiers["affect"].rows, found)
    assert (state.undo, state.unpublished) == ("merge-in", 0)
    step(review, "undo")
    assert rows_of(review)[6]["label"] != "Theirs"


@pytest.mark.parametrize(("choice", "label"), [("ours", "Ours"), ("theirs", "Theirs")])
def test_a_conflict_is_shown_and_settled_by_choice(review, folder, choice, label):
    relabel(review, 0, "J")
    publish_all(review)
    relabel(review, 3, "Ours")
    put_theirs(folder, label_row(3, "Theirs"))
    plan = plan_of(review)
    ((key, conflict),) = plan.tiers[0].conflicts.items()
    assert [row["label"] for row in conflict.ours] == ["Ours"]
    assert [row["label"] for row in conflict.theirs] == ["Theirs"]
    assert publishing.find_commit(review.corpus(), KEY, "affect") == ("cd", "By another hand")
    with pytest.raises(InputError, match="expected ours, theirs, base"):
        publish_all(review)
    publish_all(review, choices={key: choice})
    assert stored(folder)[3]["label"] == rows_of(review)[3]["label"] == label
    assert review.drafts.open(KEY).unpublished == 0
    assert plan_of(review).tiers == ()


def test_a_plan_that_is_not_what_would_happen_now_is_refused(review, folder):
    relabel(review, 0, "J")
    plan = plan_of(review).plan
    relabel(review, 1, "J")
    with pytest.raises(StaleDraftError, match="something else"):
        publish_all(review, plan=plan)
    plan = plan_of(review).plan
    # Others' takes do not matter.
    with Corpus.open(folder).transaction("Else", author="cd") as put:
        put.put_tier(TAKES[2], "affect", pd.DataFrame({"onset": [0], "offset": [9], "label": ["A"]}), author="cd")
    publish_all(review, plan=plan)


def test_ended_between_commit_and_mark_the_next_plan_finds_it_published(review, folder, monkeypatch):
    relabel(review, 0, "J")
    publish_all(review)
    relabel(review, 1, "A")
    put_theirs(folder, label_row(6, "Theirs"))

    def die(*arguments):
        raise SystemExit

    with monkeypatch.context() as context:
        context.setattr(publishing, "_mark", die)
        with pytest.raises(SystemExit):
            publish_all(review)
    review.close()
    again = open_review(folder, owner="ab")
    assert again.drafts.open(KEY).unpublished == 1
    commits = len(Corpus.open(folder).history())
    assert plan_of(again).tiers == ()
    state = again.drafts.open(KEY)
    assert state.unpublished == 0
    assert same(state.tiers["affect"].rows, stored(folder))
    assert len(Corpus.open(folder).history()) == commits
    again.close()


@pytest.mark.parametrize(("choice", "label"), [("ours", "D"), ("theirs", "F")])
def test_ended_before_the_mark_a_settled_conflict_is_not_asked_about_again(review, folder, monkeypatch, choice, label):
    relabel(review, 0, "J")
    publish_all(review)
    relabel(review, 0, "D")
    put_theirs(folder, label_row(0, "F"))
    plan = plan_of(review)
    (conflict,) = plan.tiers[0].conflicts

    def die(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as context:
        context.setattr(publishing, "_mark", die)
        with pytest.raises(KeyboardInterrupt):
            publish_all(review, choices={conflict: choice}, plan=plan.plan)
    assert stored(folder)[0]["label"] == label
    again = open_review(folder, owner="ab")
    relabel(again, 1, "Su")  # and work went on before anybody looked at the plan
    (tier,) = plan_of(again).tiers
    assert not tier.conflicts and [change.after[0]["label"] for change in tier.changes] == ["Su"]
    publish_all(again)
    assert [row["label"] for row in stored(folder)[:2]] == [label, "Su"]
    assert same(rows_of(again), stored(folder)) and not plan_of(again).tiers
    with again.database.read() as connection:
        assert connection.execute("SELECT COUNT(*) FROM publications").fetchone()[0] == 0
    again.close()


def test_a_first_edit_elsewhere_while_one_publishes_waits_for_the_next_time(review, folder, monkeypatch):
    relabel(review, 0, "J")
    other = DraftKey("ab", TAKES[1])
    plan, begun = plan_of(review), review.drafts.begun

    def begin_another(**which):
        keys = begun(**which)
        if not begun(take=other.take):
            relabel(review, 0, "Su", other)
        return keys

    monkeypatch.setattr(review.drafts, "begun", begin_another)
    done = publish_all(review, plan=plan.plan)
    assert done.takes == 1
    (tier,) = plan_of(review).tiers
    assert tier.key == other


def test_a_locked_corpus_is_said_and_the_edits_stay(review, folder):
    relabel(review, 0, "J")
    plan = plan_of(review).plan
    with lock_corpus(folder, purpose="solve"), pytest.raises(CorpusError, match="locked by"):
        publish_all(review, corpus=Corpus.open(folder, lock_timeout=0.05), plan=plan)
    assert review.drafts.open(KEY).unpublished == 1
    publish_all(review, plan=plan)
    assert stored(folder)[0]["label"] == "J"


def test_a_deleted_take_and_another_recording_are_held_back(review, folder):
    relabel(review, 0, "J")
    relabel(review, 0, "J", DraftKey("ab", TAKES[1]))
    relabel(review, 0, "J", DraftKey("ab", TAKES[2]))
    corpus = Corpus.open(folder)
    with corpus.transaction("Change", author="x") as put:
        put.delete_take(TAKES[0])
        take = corpus.take(TAKES[1]).load()
        put.put_take(TAKES[1], take.assign(position=take["position"] + np.float64(1)), replace=True)
    plan = plan_of(review)
    assert [take for take, _ in plan.held_back] == sorted(TAKES[:2])
    assert ["deleted" in why or "another one" in why for _, why in plan.held_back] == [True, True]
    publish_all(review)
    assert stored(folder, TAKES[2])[0]["label"] == "J"
    assert review.drafts.open(KEY).unpublished == 1


def test_a_tier_that_was_deleted_meanwhile_is_put_again(review, folder):
    relabel(review, 0, "J")
    publish_all(review)
    relabel(review, 1, "J")
    with Corpus.open(folder).transaction("Delete", author="cd") as put:
        put.delete_tier(TAKES[0], "affect", "ab")
    publish_all(review)
    assert same(stored(folder), rows_of(review))


def test_a_draft_without_edits_to_publish_follows_the_corpus(review, folder):
    relabel(review, 0, "J")
    publish_all(review)
    put_theirs(folder, label_row(6, "Theirs"))
    state = review.drafts.open(KEY)
    assert state.tiers["affect"].rows[6]["label"] == "Theirs"
    assert (state.unpublished, state.undo) == (0, "merge-in")
    assert review.drafts.open(KEY) == state


def test_only_leads_publish_what_settles(review, folder):
    key = DraftKey("ab", TAKES[0], "adjudication")
    edit(review, {"kind": "settle", "onset": 0, "offset": 9, "label": "J"}, key)
    assert plan_publishing(review.drafts, "ab", is_lead=False, corpus=review.corpus()).tiers == ()
    publish_all(review)
    assert [(row["label"], row["status"]) for row in stored(folder, author="adjudicated")] == [("J", "adjudicated")]


def test_many_at_once_publish_one_commit_each(review, folder):
    from concurrent.futures import ThreadPoolExecutor

    def work(person):
        relabel(review, 0, "J", DraftKey(person, TAKES[0]))
        return publish_all(review, person)

    before = len(Corpus.open(folder).history())
    with ThreadPoolExecutor(4) as pool:
        done = list(pool.map(work, ["p1", "p2", "p3", "p4"]))
    assert len({one.snapshot for one in done}) == 4
    assert len(Corpus.open(folder).history()) == before + 4
    for person in ("p1", "p2", "p3", "p4"):
        assert same(stored(folder, author=person), rows_of(review, DraftKey(person, TAKES[0])))


def test_a_label_that_the_scheme_renamed_is_no_edit_of_a_persons(review, folder):
    relabel(review, 0, "J")
    publish_all(review)
    relabel(review, 1, "J")
    old = LabelVocabulary.usual("affect")
    with Corpus.open(folder).transaction("Rename", author="x") as put:
        change_vocabulary(put, "affect", old.rename("J", "Joy"), {"J": "Joy"})
    review.drafts.change_labels(["affect"], old, {"J": "Joy"})
    (tier,) = plan_of(review).tiers
    assert not tier.conflicts
    assert [[row["label"] for row in change.after] for change in tier.changes] == [["Joy"]]
    publish_all(review)
    assert {"J"}.isdisjoint(row["label"] for row in stored(folder))
    assert same(stored(folder), rows_of(review))
    step(review, "undo")
    assert [len(tier.changes) for tier in plan_of(review).tiers] == [1]


def test_whose_a_tier_is_follows_from_how_it_came_about():
    table = pd.DataFrame({"status": ["proposed", "reviewed"], "origin": ["model", "model"]})
    review, label = {"step": "review"}, {"step": "label"}
    assert not is_machine_made(review, table)
    assert is_machine_made(review, table.head(1))
    assert is_machine_made(label, table)
    assert is_machine_made({}, table)
    assert not is_machine_made({"merged": [review, label]}, table)
    assert is_machine_made({"merged": [label, label]}, table)
    assert not is_machine_made({}, table.assign(origin=["human", "model"]))
