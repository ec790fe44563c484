"""The coding scheme: what people see of it, and changing it late."""

import pytest
from mimique.corpus import Corpus
from mimique.corpus.annotations.label_vocabulary import LabelDescription, LabelVocabulary
from mimique.errors import InputError, NotFoundError
from mimique.workbench.review.scheme.messages import SchemeRequest
from mimique.workbench.review.scheme.scheme import change_scheme, read_scheme

from .review_corpus import MODEL, copy_review_corpus


@pytest.fixture
def corpus(tmp_path):
    return Corpus.open(copy_review_corpus(tmp_path / "corpus", takes=("ab_IE_1",), n_frames=800, weights=False))


def apply(corpus, **change):
    request = SchemeRequest.model_validate({"snapshot": corpus.snapshot, "change": change})
    return change_scheme(corpus, request.change, author="lead")


def labels_of(corpus, name="affect"):
    found = next(one for one in read_scheme(corpus).vocabularies if one.name == name)
    return {label.label: label for label in found.labels}


def test_affects_have_colours_keys_and_counts_without_a_declaration(corpus):
    labels = labels_of(corpus)
    assert [one.key for one in labels.values()] == list("1234567")
    assert len({one.colour for one in labels.values()}) == len(labels)
    assert labels["A"].aliases == ["anger", "colère"]
    held = corpus.tier("ab_IE_1", "affect", MODEL)["label"]
    assert {name: one.segments for name, one in labels.items()} == {n: int((held == n).sum()) for n in labels}


def test_a_description_is_kept_and_follows_a_rename(corpus):
    apply(corpus, kind="describe", vocabulary="affect", label="A", colour="#123456", key="a", note="brows down")
    apply(corpus, kind="rename", vocabulary="affect", label="A", to="Ang")
    stored = LabelVocabulary.from_stored(Corpus.open(corpus.path).vocabulary("affect"))
    assert stored.description("Ang") == LabelDescription("#123456", "a", "brows down")
    assert stored.description("A") == LabelDescription()
    assert LabelVocabulary.from_stored(stored.to_stored()) == stored
    tier = corpus.tier("ab_IE_1", "affect", MODEL)
    assert not tier["label"].isin(["A", "NA"]).any()
    assert list(corpus.history()["message"])[:2] == ["Scheme affect: rename A to Ang", "Scheme affect: describe A"]


def test_a_new_label_gets_a_colour_that_no_other_has(corpus):
    apply(corpus, kind="add", vocabulary="affect", label="contempt", note="one corner up")
    apply(corpus, kind="add", vocabulary="affect", label="pain")
    labels = labels_of(corpus)
    assert len({one.colour for one in labels.values()}) == len(labels) == 9
    assert labels["contempt"].key == "8"


def test_merge_retire_restore_and_order(corpus):
    apply(corpus, kind="merge", vocabulary="affect", labels=["D"], into="A")
    apply(corpus, kind="retire", vocabulary="affect", label="F")
    assert labels_of(corpus)["F"].retired and "D" not in labels_of(corpus)
    apply(corpus, kind="restore", vocabulary="affect", label="F")
    order = list(labels_of(corpus))[::-1]
    apply(corpus, kind="order", vocabulary="affect", labels=order)
    assert list(labels_of(corpus)) == order


def test_tiers_are_added_with_labels_of_their_own_or_of_others(corpus):
    apply(corpus, kind="add-tier", tier="mouthing", vocabulary=None)
    apply(corpus, kind="add", vocabulary="mouthing", label="pah")
    apply(corpus, kind="add-tier", tier="affect seen", vocabulary="affect")
    tiers = {one.name: one.tiers for one in read_scheme(corpus).vocabularies}
    assert tiers == {"affect": ["affect", "affect seen"], "mouthing": ["mouthing"]}
    apply(corpus, kind="remove-tier", tier="affect seen", vocabulary="affect")
    apply(corpus, kind="manual", vocabulary="mouthing", text="# Mouthing\n")
    shown = {one.name: one for one in read_scheme(corpus).vocabularies}
    assert shown["affect"].tiers == ["affect"] and shown["mouthing"].manual == "# Mouthing\n"


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"kind": "add", "vocabulary": "affect", "label": "A"}, InputError),
        ({"kind": "add", "vocabulary": "affect", "label": "NA"}, InputError),
        ({"kind": "add", "vocabulary": "affect", "label": " "}, InputError),
        ({"kind": "rename", "vocabulary": "affect", "label": "Q", "to": "R"}, InputError),
        ({"kind": "describe", "vocabulary": "affect", "label": "A", "colour": "red"}, InputError),
        ({"kind": "describe", "vocabulary": "affect", "label": "A", "note": "x" * 30_000}, InputError),
        ({"kind": "add", "vocabulary": "nothing", "label": "A"}, NotFoundError),
        ({"kind": "add-tier", "tier": "affect", "vocabulary": None}, InputError),
        ({"kind": "add-tier", "tier": "x", "vocabulary": "nothing"}, NotFoundError),
        ({"kind": "order", "vocabulary": "affect", "labels": ["A"]}, InputError),
        ({"kind": "restore", "vocabulary": "affect", "label": "A"}, InputError),
    ],
)
def test_what_cannot_be_changes_nothing(corpus, change, error):
    before = corpus.snapshot
    with pytest.raises(error):
        apply(corpus, **change)
    assert Corpus.open(corpus.path).snapshot == before


def test_two_labels_cannot_have_one_key(corpus):
    apply(corpus, kind="describe", vocabulary="affect", label="A", key="x")
    with pytest.raises(InputError, match="is that of 'A'"):
        apply(corpus, kind="describe", vocabulary="affect", label="N", key="x")
