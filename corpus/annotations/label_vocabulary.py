"""The labels that a corpus declares for its tiers, those that are retired, and the transitions between them.

A vocabulary is declared under the name of the tier that it is for, and may name further tiers. It is stored as a list
of labels, or as a mapping with ``labels`` and, where they matter, ``retired``, ``transitions``, ``tiers``, ``aliases``;
for people who code, ``descriptions`` (colour, key and meaning of a label) and ``manual`` (how the tier is coded).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import permutations
from typing import Any

from ...errors import InputError
from .vocabulary import AFFECTS, INTENSITIES, INTENSITY_TIERS, Transition

__all__ = ["LabelDescription", "LabelVocabulary"]

AFFECT_TIER = "affect"
_COLOUR = re.compile(r"#[0-9a-f]{6}")
_LONGEST = {"key": 20, "note": 20_000, "manual": 200_000}


@dataclass(frozen=True)
class LabelDescription:
    """What people who code see of a label; an empty text is not said.

    Parameters
    ----------
    colour
        ``#rrggbb``.
    key
        What to press for it.
    note
        What it means: its entry in the coding manual.
    """

    colour: str = ""
    key: str = ""
    note: str = ""


@dataclass(frozen=True)
class LabelVocabulary:
    """Labels in their order.

    Parameters
    ----------
    labels
        In use.
    retired
        No longer to be used; segments that have them keep them.
    transitions
        Whether two labels in a row name the transition from the first to the second.
    tiers
        Further tiers, besides the one that the vocabulary is named after.
    aliases
        Pairs of another spelling and the label that it stands for: "anger" is the affect A.
    descriptions
        Pairs of a label and what people see of it; a label without is left out.
    manual
        How the tier is coded, in Markdown.
    """

    labels: tuple[str, ...]
    retired: tuple[str, ...] = ()
    transitions: bool = False
    tiers: tuple[str, ...] = ()
    aliases: tuple[tuple[str, str], ...] = ()
    descriptions: tuple[tuple[str, LabelDescription], ...] = ()
    manual: str = ""

    @staticmethod
    def usual(name: str) -> LabelVocabulary | None:
        """Return the vocabulary of a tier of this name where the corpus declares none: affects and intensities."""
        if name == AFFECT_TIER:
            codes = tuple(affect.code for affect in AFFECTS)
            return LabelVocabulary(codes, transitions=True, aliases=_names_of(codes))
        return LabelVocabulary(INTENSITIES) if name in INTENSITY_TIERS else None

    @staticmethod
    def from_stored(value: Any) -> LabelVocabulary:
        """Return the vocabulary that is stored as a list or mapping.

        Raises
        ------
        InputError
            If it is neither, or a label is not a text.
        """
        record = value if isinstance(value, Mapping) and "labels" in value else {"labels": value}
        labels = _texts(record["labels"])
        codes = {code for affect in AFFECTS for code in (affect.code, affect.french_code)}
        retired = _texts(record.get("retired", ()))
        are_affects = bool(labels) and set(labels) <= codes
        aliases = record.get("aliases")
        return LabelVocabulary(
            labels,
            retired,
            bool(record.get("transitions", are_affects)),
            _texts(record.get("tiers", ())),
            _names_of((*labels, *retired)) if aliases is None and are_affects else tuple(dict(aliases or {}).items()),
            _read_descriptions(record.get("descriptions") or {}),
            _check_text(record.get("manual") or "", "manual"),
        )

    def to_stored(self) -> dict[str, Any]:
        """Return the vocabulary as it is stored."""
        record: dict[str, Any] = {"labels": list(self.labels), "transitions": self.transitions}
        record |= {"retired": list(self.retired)} if self.retired else {}
        record |= {"aliases": dict(self.aliases)} if self.aliases else {}
        if self.descriptions:
            record["descriptions"] = {
                label: {name: text for name, text in asdict(one).items() if text} for label, one in self.descriptions
            }
        record |= {"manual": self.manual} if self.manual else {}
        return record | ({"tiers": list(self.tiers)} if self.tiers else {})

    def canonical(self, label: str) -> str:
        """Return the label that a spelling stands for; what is no alias stays as it is."""
        return label if label in (*self.labels, *self.retired) else dict(self.aliases).get(label, label)

    def names(self) -> tuple[str, ...]:
        """Return every label that may be used: the labels and, where there are such, the names of all transitions."""
        pairs = permutations(self.labels, 2) if self.transitions else ()
        return (*self.labels, *(first + second for first, second in pairs))

    def split(self, label: str) -> Transition | None:
        """Return what a transition leads from and to; None where the label is none."""
        known = (*self.labels, *self.retired)
        if not self.transitions or label in known:
            return None
        pairs = [(one, label.removeprefix(one)) for one in known if label.startswith(one)]
        found = [Transition(*pair) for pair in pairs if pair[1] in known and pair[0] != pair[1]]
        return found[0] if len(found) == 1 else None

    def description(self, label: str) -> LabelDescription:
        """Return what people see of a label."""
        return dict(self.descriptions).get(label, LabelDescription())

    def describe(self, label: str, **texts: str) -> LabelVocabulary:
        """Return the vocabulary with another ``colour``, ``key`` or ``note`` for a label.

        Raises
        ------
        InputError
            If there is no such label, a colour is not ``#rrggbb``, a text is too long, or another label has the key.
        """
        self._require(label, retired=True)
        described = dict(self.descriptions) | {
            label: _check_description(label, {**asdict(self.description(label)), **texts})
        }
        key = described[label].key
        same = [other for other, one in described.items() if key and one.key == key and other != label]
        if same and same[0] in self.labels:
            raise InputError(f"label {label!r}: the key {key!r} is that of {same[0]!r}; choose another one")
        return replace(
            self, descriptions=tuple((one, text) for one, text in described.items() if text != LabelDescription())
        )

    def reorder(self, *labels: str) -> LabelVocabulary:
        """Return the vocabulary with its labels in another order.

        Raises
        ------
        InputError
            If these are not just its labels.
        """
        if sorted(labels) != sorted(self.labels):
            raise InputError(f"labels: expected {', '.join(self.labels)} in another order, but got {', '.join(labels)}")
        return replace(self, labels=labels)

    def write_manual(self, text: str) -> LabelVocabulary:
        """Return the vocabulary with another manual, in Markdown.

        Raises
        ------
        InputError
            If it is longer than 200 000 characters.
        """
        return replace(self, manual=_check_text(text, "manual"))

    def add(self, *labels: str) -> LabelVocabulary:
        """Return the vocabulary with more labels; a retired one comes back.

        Raises
        ------
        InputError
            If one is there already, is empty, or could be taken for a transition.
        """
        for label in labels:
            self._refuse_known(label)
        retired = tuple(one for one in self.retired if one not in labels)
        return replace(self, labels=(*self.labels, *labels), retired=retired)._checked()

    def rename(self, old: str, new: str) -> LabelVocabulary:
        """Return the vocabulary with another name for a label, retired or not; raises as :meth:`add`."""
        self._require(old, retired=True)
        self._refuse_known(new, retired=True)
        labels, retired = (tuple(new if one == old else one for one in names) for names in (self.labels, self.retired))
        described = tuple((new if one == old else one, text) for one, text in self.descriptions)
        renamed = replace(
            self, labels=labels, retired=retired, aliases=self._aliases({old: new}), descriptions=described
        )
        return renamed._checked()

    def merge(self, *labels: str, into: str) -> LabelVocabulary:
        """Return the vocabulary without labels that become another one.

        Raises
        ------
        InputError
            If one is not there, or is the one that they become.
        """
        self._require(into)
        for label in labels:
            self._require(label, retired=True)
            if label == into:
                raise InputError(f"label {label!r}: it cannot be merged into itself")
        kept, retired = (tuple(one for one in names if one not in labels) for names in (self.labels, self.retired))
        described = tuple((one, text) for one, text in self.descriptions if one not in labels)
        aliases = self._aliases(dict.fromkeys(labels, into))
        return replace(self, labels=kept, retired=retired, aliases=aliases, descriptions=described)

    def retire(self, *labels: str) -> LabelVocabulary:
        """Return the vocabulary with labels that are no longer to be used.

        Raises
        ------
        InputError
            If one is not in use.
        """
        for label in labels:
            self._require(label)
        kept = tuple(one for one in self.labels if one not in labels)
        return replace(self, labels=kept, retired=(*self.retired, *labels))

    def _aliases(self, mapping: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
        """Return the aliases where labels became others."""
        return tuple((spelling, mapping.get(label, label)) for spelling, label in self.aliases)

    def _require(self, label: str, *, retired: bool = False) -> None:
        if label not in self.labels and not (retired and label in self.retired):
            raise InputError(f"label: expected one of {', '.join(self.labels) or 'none'}, but got {label!r}")

    def _refuse_known(self, label: str, *, retired: bool = False) -> None:
        if not label.strip() or label != label.strip():
            raise InputError(f"label: expected a text without blanks around it, but got {label!r}")
        if label in self.labels or (retired and label in self.retired):
            raise InputError(f"label {label!r}: the vocabulary has it already; merge into it, or choose another name")

    def _checked(self) -> LabelVocabulary:
        """Refuse labels whose transitions could not be told apart."""
        if not self.transitions:
            return self
        known = (*self.labels, *self.retired)
        taken: dict[str, str] = {label: f"the label {label!r}" for label in known}
        for first, second in permutations(known, 2):
            name, meaning = first + second, f"the transition from {first!r} to {second!r}"
            if name in taken:
                raise InputError(f"label: {name!r} would mean both {taken[name]} and {meaning}; choose another name")
            taken[name] = meaning
        return self


def _names_of(codes: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Return the English and French names of affects with their codes."""
    known = [affect for affect in AFFECTS if affect.code in codes]
    return tuple({name: affect.code for affect in known for name in (affect.name, affect.french_name)}.items())


def _read_descriptions(record: Any) -> tuple[tuple[str, LabelDescription], ...]:
    if not isinstance(record, Mapping):
        raise InputError(f"vocabulary: expected descriptions by label, but got {record!r}")
    return tuple((str(label), _check_description(str(label), texts)) for label, texts in record.items())


def _check_description(label: str, texts: Any) -> LabelDescription:
    known = tuple(asdict(LabelDescription()))
    if not isinstance(texts, Mapping) or not set(texts) <= set(known):
        raise InputError(f"label {label!r}: expected {', '.join(known)} as its description, but got {texts!r}")
    described = LabelDescription(**{name: _check_text(text, name) for name, text in texts.items()})
    if described.colour and not _COLOUR.fullmatch(described.colour):
        raise InputError(
            f"label {label!r}: expected a colour as #rrggbb in small letters, but got {described.colour!r}"
        )
    return described


def _check_text(text: Any, name: str) -> str:
    if not isinstance(text, str) or len(text) > _LONGEST.get(name, 100):
        raise InputError(f"vocabulary: expected {name} as a text of at most {_LONGEST.get(name, 100)} characters")
    return text


def _texts(values: Any) -> tuple[str, ...]:
    if isinstance(values, str) or not hasattr(values, "__iter__"):
        raise InputError(f"vocabulary: expected a list of labels, but got {values!r}")
    texts = []
    for value in values:
        text = (value.get("label") or value.get("code")) if isinstance(value, Mapping) else value
        if not isinstance(text, str):
            raise InputError(f"vocabulary: expected labels as texts, but got {value!r}")
        texts.append(text)
    return tuple(dict.fromkeys(texts))
