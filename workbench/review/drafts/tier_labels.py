"""What the labels of a tier mean: spellings of the same label, and transitions that follow what they lie between.

A tier may spell labels otherwise than the vocabulary does ("joy" for J). The same label in another spelling is no other
label, and what is labelled anew is spelled as the tier spells it. A transition that names a neighbour is renamed with
it: where N NF F FN N has its F relabelled to J, it becomes N NJ J JN N.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from ....corpus.annotations.label_vocabulary import LabelVocabulary
from ....corpus.annotations.vocabulary_change import vocabularies_by_tier
from ....corpus.store.view import CorpusView
from ....corpus.versions.segment_rows import Row

__all__ = ["TierLabels", "read_tier_labels"]


@dataclass(frozen=True)
class TierLabels:
    """The labels of one tier.

    Parameters
    ----------
    vocabulary
        None for a tier whose labels are free.
    """

    vocabulary: LabelVocabulary | None = None

    def canonical(self, label: str) -> str:
        """Return what a spelling stands for."""
        return label if self.vocabulary is None else self.vocabulary.canonical(label)

    def spell(self, label: str, rows: Sequence[Row]) -> str:
        """Return a label as the rows of its tier spell it; as it is where they do not say."""
        if self.vocabulary is None:
            return label
        wanted = self.vocabulary.canonical(label)
        if wanted not in (*self.vocabulary.labels, *self.vocabulary.retired):
            return label
        used = Counter(str(row["label"]) for row in rows)
        same = [spelling for spelling, _ in used.most_common() if self.vocabulary.canonical(spelling) == wanted]
        if same:
            return same[0]
        # No segment has it yet: as the others are spelled, the vocabulary's codes or its aliases of the same place.
        aliases = self._aliases(wanted)
        for spelling, _ in used.most_common():
            other = self.vocabulary.canonical(spelling)
            if spelling == other and other in self.vocabulary.labels:
                return wanted
            if spelling != other and spelling in self._aliases(other):
                place = self._aliases(other).index(spelling)
                return aliases[place] if place < len(aliases) else wanted
        return label

    def follow(self, before: Sequence[Row], after: Sequence[Row]) -> dict[int, str | None]:
        """Return new names of transitions, by id, that named a neighbour before which has another label after.

        None for a transition that leads nowhere any more, because both its sides say the same.

        Parameters
        ----------
        before, after
            The rows of the tier, in order of onset, before and after an edit.
        """
        vocabulary = self.vocabulary
        if vocabulary is None or not vocabulary.transitions:
            return {}
        old = {row["id"]: (row, self._sides(before, place)) for place, row in enumerate(before)}
        renamed: dict[int, str | None] = {}
        for place, row in enumerate(after):
            pair = vocabulary.split(str(row["label"]))
            if pair is None or row["id"] not in old:
                continue
            was_row, was_sides = old[row["id"]]
            if row["label"] != was_row["label"] or _length(row) > _length(was_row):
                continue  # it was edited itself
            sides = []
            for named, was, now in zip(pair, was_sides, self._sides(after, place), strict=True):
                sides.append(now if was == named and now is not None else named)
            if tuple(sides) != tuple(pair):
                first, second = sides
                renamed[int(row["id"])] = first + second if first != second else None
        return renamed

    def _sides(self, rows: Sequence[Row], place: int) -> tuple[str | None, str | None]:
        """Return the labels that a segment touches before and after it; None for none, and for transitions."""
        row = rows[place]
        before = rows[place - 1] if place and rows[place - 1]["offset"] == row["onset"] else None
        after = rows[place + 1] if place + 1 < len(rows) and rows[place + 1]["onset"] == row["offset"] else None
        return self._held(before), self._held(after)

    def _held(self, row: Row | None) -> str | None:
        if row is None or self.vocabulary is None or self.vocabulary.split(str(row["label"])) is not None:
            return None
        label = self.vocabulary.canonical(str(row["label"]))
        return label if label in (*self.vocabulary.labels, *self.vocabulary.retired) else None

    def _aliases(self, label: str) -> list[str]:
        aliases = () if self.vocabulary is None else self.vocabulary.aliases
        return [spelling for spelling, of in aliases if of == label]


def _length(row: Row) -> int:
    return int(row["offset"] - row["onset"])


def read_tier_labels(corpus: CorpusView) -> dict[str, TierLabels]:
    """Return the labels of every tier that a vocabulary of the corpus is for.

    A tier that is not among them has its usual labels (:meth:`.LabelVocabulary.usual`), or free ones.
    """
    return {tier: TierLabels(vocabulary) for tier, vocabulary in vocabularies_by_tier(corpus).items()}
