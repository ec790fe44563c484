"""An ELAN document as tiers of a draft: what it holds, which tier is which, what stands in the way."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ....corpus.annotations.eaf import read_eaf
from ....corpus.annotations.eaf_document import decode_xml
from ....corpus.annotations.label_vocabulary import LabelVocabulary
from ....corpus.annotations.vocabulary import add_transitions
from ....corpus.annotations.vocabulary_change import vocabularies_by_tier
from ....corpus.formats.short_messages import shorten_message
from ....corpus.store.view import CorpusView
from ....corpus.versions.segment_rows import Row, split_table
from ....errors import FileFormatError, InputError, MimiqueError
from ...pipeline.tier_files import document_start
from ..drafts.records import DraftState
from .messages import ElanPreview, ElanTier
from .told_warnings import told_warnings

__all__ = ["FileTier", "find_tiers", "make_rows", "parse_choice", "preview_tiers", "read_upload"]

SHOWN = 5

MOST_TIERS = 2000
"""Real documents have dozens. A file may hold hundreds of thousands of empty ones, over which a server would brood."""


@dataclass(frozen=True)
class FileTier:
    """A tier of the file, within the take.

    Parameters
    ----------
    table
        Segments within the take, sorted.
    author
        ELAN's annotator, "" where nobody is named.
    problems
        What to know before it is imported.
    refusal
        Why it cannot be; None where it can.
    """

    table: pd.DataFrame
    author: str
    problems: list[str]
    refusal: str | None


def read_upload(corpus: CorpusView, take: str, data: bytes, n_frames: int) -> tuple[dict[str, FileTier], list[str]]:
    """Read the tiers of an ELAN document in frames of a take.

    Parameters
    ----------
    corpus, take
        What it annotates. Where the document's video is linked to the take, that tells how their times go together.
    data
        The whole file.
    n_frames
        Of the take.

    Returns
    -------
    (tiers, warnings)
        By name, in the file's order; and lines on what was left out.

    Raises
    ------
    FileFormatError
        If it is no ELAN document, or a damaged or hostile one.
    """
    facts = corpus.take_attributes(take)
    rate = float(facts["rate"])
    if not data:
        raise FileFormatError("the file is empty")
    try:
        n_tiers = decode_xml(data)[0].count("<TIER")
        if n_tiers > MOST_TIERS:
            raise FileFormatError(f"expected at most {MOST_TIERS} tiers, but got {n_tiers}; import a part of them")
        with told_warnings() as lines:
            start = document_start(data, list(facts.get("video") or ()))
            # Named after the take: what ids ELAN's own annotations get must not depend on how the file is called.
            tables = read_eaf(data, rate, source=f"{take}.eaf", start=start)
    except MimiqueError as error:
        raise type(error)(shorten_message(str(error))) from error
    except (RecursionError, OverflowError, ValueError) as error:
        raise FileFormatError(shorten_message(f"not an EAF file that can be read ({error})")) from error
    return {name: _fit(table, n_frames) for name, table in tables.items()}, lines


def find_tiers(tiers: Mapping[str, FileTier], draft: DraftState, authors: Sequence[str]) -> dict[str, str]:
    """Return which tier of the draft each tier of the file is, where one seems to be.

    A name means the same with another case, and without an ``@author``. Where several tiers of the file have it, the
    person's own comes first, then the one that shares most segments with the draft's. One that names another author
    of the take's is that one's and not the person's.

    Parameters
    ----------
    tiers
        Of the file.
    draft
        Where they would go.
    authors
        Who has tiers of the take.
    """
    found: dict[str, str] = {}
    by_name = {name.casefold(): name for name in reversed(list(draft.tiers))}
    candidates: dict[str, list[tuple[bool, int, int, str]]] = {}
    for place, (name, tier) in enumerate(tiers.items()):
        base, _, suffix = name.rpartition("@")
        whose = tier.author or (suffix if base and suffix in (*authors, draft.key.author) else "")
        if tier.refusal is not None or (whose != draft.key.author and whose in authors):
            continue
        spelled = name.removesuffix(f"@{whose}") if whose else name
        target = by_name.get(name.casefold()) or by_name.get(spelled.casefold())
        if target is None:
            continue
        ids = {int(number) for number in tier.table["id"]}
        shared = sum(int(row["id"]) in ids for row in draft.tiers[target].rows)
        candidates.setdefault(target, []).append((whose == draft.key.author, shared, -place, name))
    for target, several in candidates.items():
        found[max(several)[-1]] = target
    return found


def preview_tiers(corpus: CorpusView, take: str, data: bytes, draft: DraftState, *, with_others: bool) -> ElanPreview:
    """Say what importing an ELAN document would bring.

    Parameters
    ----------
    corpus, take, data
        As for :func:`read_upload`, which says what is raised too.
    draft
        Where it would go.
    with_others
        Whether the person may know who else has tiers of the take.
    """
    tiers, lines = read_upload(corpus, take, data, draft.n_frames)
    authors = corpus.tiers(take)["author"].unique().tolist() if with_others else []
    found = find_tiers(tiers, draft, authors)
    shown = []
    for name, tier in tiers.items():
        target = found.get(name)
        problems = [*([tier.refusal] if tier.refusal else []), *tier.problems]
        if target is not None:
            problems += _find_label_problems(corpus, target, tier.table)
            if tier.table.empty and draft.tiers[target].rows:
                problems.append(f"it has no annotations: importing it empties the tier {target!r}")
                target = None
        shown.append(ElanTier(name=name, tier=target, segments=len(tier.table), problems=problems))
    return ElanPreview(tiers=shown, warnings=lines)


def parse_choice(text: str) -> dict[str, str]:
    """Return which tier of the file goes to which tier of the draft, from JSON; those that go nowhere are left out.

    Raises
    ------
    InputError
        If it is no such JSON, nothing is chosen, or two go to the same tier.
    """
    try:
        choice = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError("tiers: expected JSON, a mapping of the file's tiers to the draft's") from error
    if not isinstance(choice, dict) or not all(value is None or isinstance(value, str) for value in choice.values()):
        raise InputError("tiers: expected a mapping of the file's tiers to the draft's, or to null")
    chosen = {name: tier for name, tier in choice.items() if tier is not None}
    if not chosen:
        raise InputError("tiers: no tier of the file is chosen; choose at least one")
    if len(set(chosen.values())) < len(chosen):
        raise InputError("tiers: two tiers of the file are to become the same tier; choose one of them")
    return chosen


def make_rows(
    corpus: CorpusView, tiers: Mapping[str, FileTier], choice: Mapping[str, str], draft: DraftState
) -> dict[str, list[Row]]:
    """Return the rows of the chosen tiers, by the draft's tier.

    Parameters
    ----------
    corpus
        Where the vocabularies are.
    tiers
        Of the file.
    choice
        Of :func:`parse_choice`.
    draft
        Where they go.

    Raises
    ------
    InputError
        If a tier is not in the file or the draft, or cannot be imported.
    """
    made = {}
    for name, target in choice.items():
        if name not in tiers:
            raise InputError(f"tiers: the file has no tier {name!r}; it has {_enumerate(tiers)}")
        if target not in draft.tiers:
            raise InputError(f"tiers: the draft has no tier {target!r}; it has {_enumerate(draft.tiers)}")
        if tiers[name].refusal is not None:
            raise InputError(f"tier {name!r} of the file: {tiers[name].refusal}")
        table = tiers[name].table
        vocabulary = vocabularies_by_tier(corpus).get(target) or LabelVocabulary.usual(target)
        columns = {column for column, _ in draft.tiers[target].columns}
        if (vocabulary is not None and vocabulary.transitions) or {"from_label", "to_label"} <= columns:
            table = add_transitions(table)
        made[target] = list(split_table(table)[1])
    return made


def _fit(table: pd.DataFrame, n_frames: int) -> FileTier:
    """Return a tier cut to the take, and what is wrong with it."""
    problems = []
    onset, offset = table["onset"].to_numpy(), table["offset"].to_numpy()
    outside = onset >= n_frames
    if outside.any():
        problems.append(f"{int(outside.sum())} annotations lie after the end of the take and are left out")
    over = ~outside & (offset > n_frames)
    if over.any():
        problems.append(f"{int(over.sum())} annotations end after the take and are cut there")
        table = table.assign(offset=np.minimum(offset, n_frames))
    author = str(table.attrs.get("author") or "")
    kept = table[~outside].reset_index(drop=True) if outside.any() else table
    onset, offset = kept["onset"].to_numpy(), kept["offset"].to_numpy()
    overlaps = np.flatnonzero(offset[:-1] > onset[1:])
    refusal = None
    if len(overlaps):
        labels = kept["label"].tolist()
        places = ", ".join(f"{_shorten(labels[n])} [{onset[n]}, {offset[n]})" for n in overlaps[:SHOWN])
        more = f" and {len(overlaps) - SHOWN} more" if len(overlaps) > SHOWN else ""
        refusal = (
            f"{len(overlaps)} annotations overlap the one after them ({places}{more}); a tier of the take holds one "
            "label at a time: correct them in ELAN"
        )
    return FileTier(kept, author, problems, refusal)


def _find_label_problems(corpus: CorpusView, tier: str, table: pd.DataFrame) -> list[str]:
    vocabulary = vocabularies_by_tier(corpus).get(tier) or LabelVocabulary.usual(tier)
    if vocabulary is None:
        return []
    known = {*vocabulary.names(), *vocabulary.retired, *dict(vocabulary.aliases)}
    odd = [label for label in dict.fromkeys(table["label"].tolist()) if label not in known]
    if not odd:
        return []
    names = ", ".join(_shorten(label) for label in odd[:SHOWN]) + (" …" if len(odd) > SHOWN else "")
    return [f"{len(odd)} labels are not in the scheme: {names}"]


def _enumerate(names: Mapping[str, object]) -> str:
    return ", ".join(repr(name) for name in list(names)[:SHOWN]) or "none"


def _shorten(label: str) -> str:
    return label if len(label) <= 30 else f"{label[:30]}…"
