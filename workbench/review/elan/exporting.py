"""A draft as an ELAN document: the person's tiers as the page shows them, and others' where they may be seen."""

from __future__ import annotations

import hashlib
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pandas as pd

from ....corpus import Corpus, write_tiers
from ....corpus.annotations.media import locate
from ....corpus.versions.segment_rows import join_table
from ....errors import CorpusError
from ...pipeline.exporting import read_all_tiers
from ...pipeline.segmenting import SEGMENT_TIER
from ...pipeline.tier_files import offered_labels, write_take_tiers
from ..drafts.records import TierState
from .told_warnings import told_warnings

__all__ = ["ElanFile", "disposition", "write_draft"]

LONGEST_NAME = 120


@dataclass(frozen=True)
class ElanFile:
    """The document, and what could not be kept in it."""

    data: bytes
    warnings: list[str]


def write_draft(
    corpus: Corpus, take: str, author: str, tiers: Mapping[str, TierState], *, with_others: bool, folder: Path | None
) -> ElanFile:
    """Write a draft as an ELAN document.

    Parameters
    ----------
    corpus
        At a snapshot that has the take.
    take
        Name.
    author
        Whose tiers these are.
    tiers
        Of the draft, by name; empty ones too, so that ELAN offers them with their labels.
    with_others
        Whether others' tiers follow, named ``tier@author``, and whether all goes into the document that was ingested
        with the take, which holds what people made of it. Neither may be where the take is coded blind.
    folder
        Of the corpus, to which the paths of linked videos are relative.

    Raises
    ------
    InputError
        If ELAN's format cannot hold it.
    CorpusError
        If there is no room to write it.
    """
    tables = {name: join_table(state.columns, state.rows) for name, state in tiers.items()}
    for table in tables.values():
        table.attrs["author"] = author
    if with_others:
        _add_others(tables, corpus, take, author)
    try:
        with tempfile.TemporaryDirectory(prefix="mimique-") as place:
            path = Path(place) / "draft.eaf"
            with told_warnings() as lines:
                if with_others:
                    write_take_tiers(corpus, take, path, tables, folder=folder)
                else:
                    _write_alone(corpus, take, path, tables, folder)
            return ElanFile(path.read_bytes(), lines)
    except OSError as error:
        if isinstance(error, CorpusError):
            raise
        raise CorpusError(f"the ELAN file cannot be written ({error.strerror or error}); free space") from error


def disposition(take: str, author: str) -> str:
    """Return the header by which a browser saves the file under the take's name, whatever characters that has.

    RFC 6266: a plain name for old programs, and the true one percent-encoded as RFC 8187 has it. What no file name may
    hold is replaced.
    """
    name = re.sub(r'[\x00-\x1f\x7f<>:"/\\|?*]+', "_", f"{take}-{author}").strip(" .")[:LONGEST_NAME] or "take"
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", name)
    encoded = quote(name.encode("utf-8", "replace"), safe="")
    return f"attachment; filename=\"{plain}.eaf\"; filename*=UTF-8''{encoded}.eaf"


def _write_alone(
    corpus: Corpus, take: str, path: Path, tables: Mapping[str, pd.DataFrame], folder: Path | None
) -> None:
    """Write the tiers into a document of their own: that of the take may hold what others coded."""
    facts = corpus.take_attributes(take)
    links = list(facts.get("video") or ())
    write_tiers(
        path,
        tables,
        float(facts["rate"]),
        media=[{**link, "path": str(locate(link, folder))} for link in links],
        vocabularies=offered_labels(corpus, tables),
    )


def _add_others(tables: dict[str, pd.DataFrame], corpus: Corpus, take: str, author: str) -> None:
    """Add the tiers of others; a segment whose id another one has already gets one of its own.

    Tiers that start from the machine's proposals keep the ids of these, and an ELAN document holds each id once.
    """
    used = {int(number) for table in tables.values() for number in table["id"]}
    for listed, table in read_all_tiers(corpus, take).items():
        whose = str(table.attrs["author"])
        tier = listed.removesuffix(f"@{whose}")
        if whose == author or tier == SEGMENT_TIER:
            continue
        name = f"{tier}@{whose}"
        while name in tables:
            name += "'"
        numbers = [_find_free(int(number), f"{tier}|{whose}", used) for number in table["id"]]
        others = table.assign(id=np.array(numbers, dtype=np.uint64))
        others.attrs["author"] = whose
        tables[name] = others


def _find_free(number: int, whose: str, used: set[int]) -> int:
    """Return an id that is not used yet: the segment's own, else one that is always the same for it."""
    while number in used:
        number = int.from_bytes(hashlib.blake2b(f"{whose}|{number}".encode(), digest_size=8).digest(), "big") or 1
    used.add(number)
    return number
