"""Reading and changing the coding scheme of a corpus: each change is one commit, and old segments follow it.

A vocabulary that the corpus does not declare is the usual one of its tier
(:mod:`mimique.corpus.annotations.label_vocabulary`) and is declared with its first change. A label that has no colour
of its own gets the usual one of an affect, or one of a few that people with any common kind of colour blindness tell
apart; the first nine labels without a key get 1 to 9.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from ....corpus import Corpus
from ....corpus.annotations.label_vocabulary import LabelVocabulary
from ....corpus.annotations.vocabulary_change import change_vocabulary, declared_vocabulary, tiers_of_vocabulary
from ....corpus.store.view import CorpusView
from ....errors import InputError
from ....synthesis.affect_colours import find_affects, find_label_colours
from .messages import (
    AddLabel,
    AddTier,
    Change,
    DescribeLabel,
    MergeLabels,
    OrderLabels,
    RemoveTier,
    RenameLabel,
    RestoreLabel,
    RetireLabel,
    Scheme,
    SchemeLabel,
    Vocabulary,
    WriteManual,
)

__all__ = ["ChangedLabels", "change_scheme", "list_vocabularies", "read_scheme"]

AFFECT_TIER = "affect"
KEYS = tuple("123456789")
# Tol's "muted" colours (Paul Tol, Introduction to colour schemes, 2021), made for qualitative data.
COLOURS = ("#332288", "#88ccee", "#44aa99", "#117733", "#999933", "#ddcc77", "#cc6677", "#882255", "#aa4499")


@dataclass(frozen=True)
class ChangedLabels:
    """Labels that became others in some tiers: what drafts must follow.

    Parameters
    ----------
    tiers
        Names.
    vocabulary
        As it was, which tells transitions.
    mapping
        Old label to new label; empty where none changed.
    merged
        Whether the old ones took the meaning of others.
    """

    tiers: tuple[str, ...]
    vocabulary: LabelVocabulary
    mapping: Mapping[str, str]
    merged: bool


def list_vocabularies(corpus: CorpusView) -> dict[str, LabelVocabulary]:
    """Return the vocabularies by name: those declared, and the affects' where none is for the tier ``affect``."""
    known = {name: declared_vocabulary(corpus, name) for name in corpus.vocabularies()}
    covered = {tier for name, one in known.items() for tier in tiers_of_vocabulary(name, one)}
    usual = LabelVocabulary.usual(AFFECT_TIER)
    if AFFECT_TIER not in covered and usual is not None:
        known = {AFFECT_TIER: usual, **known}
    return known


def read_scheme(corpus: Corpus, *, hidden: Collection[str] = ()) -> Scheme:
    """Return the scheme as people see it; segments of ``hidden`` takes are not counted."""
    segments = corpus.segments()
    segments = segments[~segments["take"].isin(list(hidden))]
    counted: dict[str, Counter[str]] = {
        str(tier): Counter(str(label) for label in part["label"]) for tier, part in segments.groupby("tier")
    }
    return Scheme(
        snapshot=corpus.snapshot,
        vocabularies=[_show(name, one, counted) for name, one in list_vocabularies(corpus).items()],
    )


def change_scheme(corpus: Corpus, change: Change, *, author: str) -> ChangedLabels:
    """Change the scheme in one commit.

    Raises
    ------
    InputError
        If a label is unknown, there already, could be taken for a transition, or a text is not what it should be.
    NotFoundError
        If there is no such vocabulary.
    """
    if isinstance(change, AddTier):
        return _add_tier(corpus, change, author)
    name = change.vocabulary
    known = list_vocabularies(corpus)
    old = known.get(name) or declared_vocabulary(corpus, name)
    new, mapping = _apply(change, name, old)
    message = f"Scheme {name}: {_tell(change)}"
    parameters = {"change": change.model_dump(exclude_none=True)}
    with corpus.transaction(message, command="review", parameters=parameters, author=author) as edit:
        change_vocabulary(edit, name, new, mapping, merged=isinstance(change, MergeLabels))
    return ChangedLabels(tiers_of_vocabulary(name, new), old, mapping, isinstance(change, MergeLabels))


def _apply(change: Change, name: str, old: LabelVocabulary) -> tuple[LabelVocabulary, dict[str, str]]:
    """Return the vocabulary after a change, and which labels became others."""
    match change:
        case AddLabel():
            texts = {"colour": change.colour, "key": change.key, "note": change.note}
            return old.add(change.label).describe(change.label, **texts), {}
        case RenameLabel():
            return old.rename(change.label, change.to), {change.label: change.to}
        case MergeLabels():
            return old.merge(*change.labels, into=change.into), dict.fromkeys(change.labels, change.into)
        case _:
            return _apply_in_place(change, name, old), {}


def _apply_in_place(change: Change, name: str, old: LabelVocabulary) -> LabelVocabulary:
    """Return the vocabulary after a change that no segment has to follow."""
    match change:
        case RetireLabel():
            return old.retire(change.label)
        case RestoreLabel():
            if change.label not in old.retired:
                raise InputError(f"label {change.label!r}: it is not retired; add it, or choose a retired one")
            return old.add(change.label)
        case DescribeLabel():
            return old.describe(change.label, **change.model_dump(include={"colour", "key", "note"}, exclude_none=True))
        case OrderLabels():
            return old.reorder(*change.labels)
        case RemoveTier():
            if change.tier not in old.tiers:
                raise InputError(f"tier {change.tier!r}: expected one of {', '.join(old.tiers) or 'none'} to remove")
            return replace(old, tiers=tuple(tier for tier in old.tiers if tier != change.tier))
        case WriteManual():
            return old.write_manual(change.text)
        case _:
            raise InputError(f"scheme: expected another change of {name!r}")


def _add_tier(corpus: Corpus, change: AddTier, author: str) -> ChangedLabels:
    tier = change.tier
    if tier != tier.strip():
        raise InputError(f"tier: expected a name without blanks around it, but got {tier!r}")
    known = list_vocabularies(corpus)
    for name, one in known.items():
        if tier in tiers_of_vocabulary(name, one):
            raise InputError(f"tier {tier!r}: it has the labels of {name!r} already")
    name = change.vocabulary or tier
    if change.vocabulary is not None and name not in known:
        declared_vocabulary(corpus, name)  # says which there are
    old = known.get(name) or LabelVocabulary.usual(name) or LabelVocabulary(())
    new = old if name == tier else replace(old, tiers=(*old.tiers, tier))
    message = f"Scheme {name}: tier {tier}"
    parameters = {"change": change.model_dump(exclude_none=True)}
    with corpus.transaction(message, command="review", parameters=parameters, author=author) as edit:
        edit.put_vocabulary(name, new.to_stored())
    return ChangedLabels((tier,), old, {}, False)


def _tell(change: Change) -> str:
    match change:
        case RenameLabel():
            return f"rename {change.label} to {change.to}"
        case MergeLabels():
            return f"merge {', '.join(change.labels)} into {change.into}"
        case OrderLabels():
            return f"order {', '.join(change.labels)}"
        case AddTier() | RemoveTier():
            return f"{change.kind.replace('-', ' ')} {change.tier}"
        case WriteManual():
            return "manual"
        case _:
            return f"{change.kind} {change.label}"


def _show(name: str, vocabulary: LabelVocabulary, counted: Mapping[str, Counter[str]]) -> Vocabulary:
    tiers = tiers_of_vocabulary(name, vocabulary)
    counts: Counter[str] = Counter()
    for tier in tiers:
        for label, number in counted.get(tier, Counter()).items():
            counts[vocabulary.canonical(label)] += number
    labels = (*vocabulary.labels, *vocabulary.retired)
    keys, colours = _choose_keys(vocabulary), _choose_colours(vocabulary)
    shown = []
    for label in labels:
        shown.append(
            SchemeLabel(
                label=label,
                colour=colours[label],
                key=keys.get(label, ""),
                note=vocabulary.description(label).note,
                aliases=[spelling for spelling, of in vocabulary.aliases if of == label],
                retired=label in vocabulary.retired,
                segments=counts[label],
            )
        )
    return Vocabulary(
        name=name, tiers=list(tiers), labels=shown, transitions=vocabulary.transitions, manual=vocabulary.manual
    )


def _choose_keys(vocabulary: LabelVocabulary) -> dict[str, str]:
    own = {label: vocabulary.description(label).key for label in vocabulary.labels}
    free = iter([key for key in KEYS if key not in own.values()])
    return {label: key or next(free, "") for label, key in own.items()}


def _choose_colours(vocabulary: LabelVocabulary) -> dict[str, str]:
    labels = (*vocabulary.labels, *vocabulary.retired)
    chosen = {label: vocabulary.description(label).colour for label in labels}
    for label in labels:
        if not chosen[label] and find_affects(label):
            chosen[label] = find_label_colours(label)[0]
    free = [colour for colour in COLOURS if colour not in chosen.values()] or list(COLOURS)
    bare = [label for label in labels if not chosen[label]]
    return chosen | {label: free[place % len(free)] for place, label in enumerate(bare)}
