"""Vocabularies that change late: labels are gained, renamed, merged or retired across a whole corpus, in one commit.

A segment keeps what it is: its id, its frames, who said so. Only a segment whose label changes is touched, and its
revision rises by one. A transition follows: where ``A`` becomes ``Ang``, ``NA`` becomes ``NAng``. Where labels are
merged, the transition between them becomes the label that they are now; neighbours that are equal then stay two
segments until :func:`.tier_rules.merge_equal_neighbours` joins them.

``from_label`` and ``to_label`` keep the meaning of a label that was renamed, and take that of the label that others are
merged into.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from ...errors import InputError, NotFoundError
from ..store.transaction import Transaction
from ..store.view import CorpusView
from .label_vocabulary import LabelVocabulary
from .vocabulary import Transition, add_transitions, parse_label

__all__ = [
    "change_labels",
    "change_vocabulary",
    "count_labels",
    "declared_vocabulary",
    "tiers_of_vocabulary",
    "vocabularies_by_tier",
]

_COLUMNS = ["take", "tier", "author", "segments", "changed"]


def declared_vocabulary(corpus: CorpusView, name: str) -> LabelVocabulary:
    """Return a corpus's vocabulary, or the usual one of a tier of this name.

    Raises
    ------
    NotFoundError
        If the corpus declares none of this name, and none is usual.
    """
    if name in corpus.vocabularies():
        return LabelVocabulary.from_stored(corpus.vocabulary(name))
    usual = LabelVocabulary.usual(name)
    if usual is None:
        known = ", ".join(corpus.vocabularies()) or "none"
        raise NotFoundError(f"corpus: no vocabulary {name!r}; it has {known}; add labels to make one")
    return usual


def tiers_of_vocabulary(name: str, vocabulary: LabelVocabulary) -> tuple[str, ...]:
    """Return the names of the tiers that have a vocabulary."""
    return tuple(dict.fromkeys((name, *vocabulary.tiers)))


def vocabularies_by_tier(corpus: CorpusView) -> dict[str, LabelVocabulary]:
    """Return the declared vocabulary of each tier that has one, the first by name where several are for it.

    A vocabulary that was damaged by hand says nothing of its tiers.
    """
    found: dict[str, LabelVocabulary] = {}
    for name in corpus.vocabularies():
        try:
            vocabulary = LabelVocabulary.from_stored(corpus.vocabulary(name))
        except InputError:
            continue
        for tier in tiers_of_vocabulary(name, vocabulary):
            found.setdefault(tier, vocabulary)
    return found


def count_labels(corpus: CorpusView, name: str, vocabulary: LabelVocabulary) -> pd.DataFrame:
    """Return one row a label of a vocabulary's tiers.

    Returns
    -------
    DataFrame
        ``label``, ``state`` (in use, retired, transition, or not declared), ``segments``, ``takes``.
    """
    names = tiers_of_vocabulary(name, vocabulary)
    counts: dict[str, int] = {}
    takes: dict[str, set[str]] = {}
    for take, tier, author in _list_tiers(corpus, names):
        for label in map(vocabulary.canonical, corpus.tier(take, tier, author)["label"]):
            counts[label] = counts.get(label, 0) + 1
            takes.setdefault(label, set()).add(take)
    further = sorted(set(counts) - set(vocabulary.labels) - set(vocabulary.retired))
    rows = [
        (label, _state(label, vocabulary), counts.get(label, 0), len(takes.get(label, ())))
        for label in (*vocabulary.labels, *vocabulary.retired, *further)
    ]
    return pd.DataFrame(rows, columns=["label", "state", "segments", "takes"])


def change_vocabulary(
    edit: Transaction,
    name: str,
    new: LabelVocabulary,
    mapping: Mapping[str, str] | None = None,
    *,
    merged: bool = False,
) -> pd.DataFrame:
    """Put a vocabulary, and relabel the segments of all its tiers, of all takes and authors.

    Parameters
    ----------
    edit
        The transaction that becomes the one commit.
    name, new
        The vocabulary, as it shall be.
    mapping
        Old label to new label.
    merged
        Whether the old labels become another one's meaning, or keep theirs.

    Returns
    -------
    DataFrame
        One row a tier that was looked at: ``take, tier, author, segments, changed``.
    """
    known = name in edit.vocabularies() or LabelVocabulary.usual(name) is not None
    old = declared_vocabulary(edit, name) if known else new
    edit.put_vocabulary(name, new.to_stored())
    rows = []
    for take, tier, author in _list_tiers(edit, tiers_of_vocabulary(name, new)) if mapping else ():
        table = edit.tier(take, tier, author)
        changed, n_changed = change_labels(table, old, mapping or {}, merged=merged)
        if n_changed:
            provenance = edit.provenance(take, "tier", tier, author)
            edit.put_tier(take, tier, changed, author, provenance=provenance)
        rows.append((take, tier, author, len(table), n_changed))
    return pd.DataFrame(rows, columns=_COLUMNS)


def change_labels(
    table: pd.DataFrame, vocabulary: LabelVocabulary, mapping: Mapping[str, str], *, merged: bool = False
) -> tuple[pd.DataFrame, int]:
    """Relabel a tier.

    Parameters
    ----------
    table
        See :mod:`.tier_table`; it is not changed.
    vocabulary
        As it was, which tells transitions.
    mapping, merged
        As for :func:`change_vocabulary`.

    Returns
    -------
    (table, n_changed)
        The same rows in the same order.
    """
    pairs = [_change(label, vocabulary, mapping) for label in table["label"]]
    touched = [row for row, (old, new) in enumerate(zip(table["label"], pairs, strict=True)) if new[0] != old]
    result = table.copy()
    if not touched:
        return result, 0
    needs_meaning = "from_label" in table or any(_means(table["label"].iloc[row]) for row in touched)
    if needs_meaning:
        result = add_transitions(result)
        for column, place in (("from_label", 0), ("to_label", 1)):
            values = result[column].tolist()
            for row in touched:
                was, now = pairs[row][1][place], pairs[row][2][place]
                if was == now:
                    continue
                if merged:
                    values[row] = _meaning_of(now) or now
                elif values[row] == was:
                    values[row] = now
            result[column] = pd.Series(values, index=result.index, dtype="str")
    labels, revisions = result["label"].tolist(), result["revision"].tolist()
    for row in touched:
        labels[row] = pairs[row][0]
        revisions[row] += 1
    result["label"] = pd.Series(labels, index=result.index, dtype="str")
    result["revision"] = pd.Series(revisions, index=result.index, dtype="int64")
    return result, len(touched)


def _change(
    label: str, vocabulary: LabelVocabulary, mapping: Mapping[str, str]
) -> tuple[str, tuple[str, str], tuple[str, str]]:
    """Return the new label, and what the old and the new one lead from and to."""
    pair = vocabulary.split(label)
    if pair is None:
        known = vocabulary.canonical(label)
        new = mapping.get(known, label)
        return new, (known, known), (mapping.get(known, known),) * 2
    first, second = (mapping.get(one, one) for one in pair)
    return (first if first == second else first + second), pair, (first, second)


def _means(label: str) -> bool:
    """Return whether a label means affects, which its columns should go on saying under another name."""
    try:
        parse_label(label)
    except InputError:
        return False
    return True


def _meaning_of(label: str) -> str:
    try:
        meaning = parse_label(label)
    except InputError:
        return ""
    return "" if isinstance(meaning, Transition) else meaning


def _list_tiers(corpus: CorpusView, names: Sequence[str]) -> list[tuple[str, str, str]]:
    return [
        (str(take), str(row.tier), str(row.author))
        for take in corpus.takes()["take"]
        for row in corpus.tiers(take).itertuples()
        if row.tier in names
    ]


def _state(label: str, vocabulary: LabelVocabulary) -> str:
    if label in vocabulary.labels:
        return "in use"
    if label in vocabulary.retired:
        return "retired"
    return "transition" if vocabulary.split(label) else "not declared"
