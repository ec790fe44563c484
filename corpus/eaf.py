"""EAF files: ELAN's annotation documents (XML). This file reads them; :mod:`.eaf_writing` writes them.

An EAF document places annotations on tiers. A time-alignable annotation refers to two time slots, which may lack a
value; any other annotation refers to an annotation of its parent tier, and shares that one's time with its siblings.
ELAN's format is described in "EAF Annotation Format", Max Planck Institute for Psycholinguistics, Nijmegen,
https://www.mpi.nl/tools/elan/EAF_Annotation_Format_3.0_and_ELAN.pdf.

How time becomes whole frames is told in :mod:`.eaf_times`.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import xml.etree.ElementTree as ET
import zlib
from typing import Any

import pandas as pd

from ..errors import FileFormatError
from .eaf_times import annotations_of, read_slots, resolve_times
from .tier_table import make_tier, number_names

__all__ = ["RECORD_PROPERTY", "fingerprint", "read_eaf"]

RECORD_PROPERTY = "mimique:segments"
"""Name of the document property that keeps a segment's columns for which EAF has no place of its own."""

POINT_TYPE = "point"
"""Linguistic type of a tier whose segments are all points."""

_OWN_ID = re.compile(r"a(\d{10,20})")  # ELAN numbers annotations from 1, so ten digits and more are a mimique id


class _NoDoctype(ET.TreeBuilder):
    """Refuses document type declarations: EAF has none, and they are how entity bombs and file inclusion begin."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise FileFormatError("the file declares a document type; an EAF file has none")


def read_eaf(data: bytes, rate: float, *, source: str) -> dict[str, pd.DataFrame]:
    """Read an EAF file's bytes as tiers.

    Parameters
    ----------
    data
        The whole file.
    rate
        Frames per second of the take that the tiers belong to.
    source
        Name of the file. Annotations that do not carry an id of mimique's get one computed from the document's own
        identifier (its URN, else this name), the tier and ELAN's annotation id, so that they keep it when the file is
        read again.

    Returns
    -------
    dict
        Tier name to table; ``table.attrs`` holds ``author`` (ANNOTATOR), ``participant``, ``parent`` and
        ``linguistic_type`` where the file names them. Segments of a file that mimique did not write have origin
        "import" and status "reviewed": people made them.

    Raises
    ------
    FileFormatError
        If the file is not XML or not EAF, or references lead nowhere or round in a circle.
    """
    root = _parse(data)
    properties = {p.get("NAME", ""): p.text or "" for p in root.iterfind("HEADER/PROPERTY")}
    document = properties.get("URN") or source
    records = _read_records(properties.get(RECORD_PROPERTY))
    tiers = root.findall("TIER")
    spans = resolve_times(tiers, read_slots(root), rate)
    names = number_names([tier.get("TIER_ID", "") for tier in tiers])
    tables = {}
    for name, tier in zip(names, tiers, strict=True):
        rows = []
        for annotation in annotations_of(tier):
            key = annotation.get("ANNOTATION_ID", "")
            label = annotation.findtext("ANNOTATION_VALUE") or ""
            onset, offset = spans[id(annotation)]
            is_point = tier.get("LINGUISTIC_TYPE_REF") == POINT_TYPE and offset == onset + 1
            row = {
                "id": _segment_id(key, f"{document}|{name}|{key}"),
                "onset": onset,
                "offset": offset,
                "label": label,
                "confidence": math.nan,
                "status": "reviewed",
                "origin": "import",
                "revision": 0,
                "kind": "point" if is_point else "interval",
            }
            record = records.get(key)
            if record is not None:
                row |= (
                    record["columns"] if record["fingerprint"] == fingerprint(onset, offset, label) else _edited(record)
                )
            rows.append(row)
        columns = None if rows else ["onset", "offset", "label"]
        table = pd.DataFrame(rows, columns=columns)
        further = [column for column in ("from_label", "to_label") if column in table]
        table[further] = table[further].fillna("")
        table["id"] = pd.Series(_make_distinct(table["id"]) if rows else [], dtype="uint64")
        tables[name] = make_tier(table, name=f"tier {name!r}")
        keys = {"author": "ANNOTATOR", "participant": "PARTICIPANT", "parent": "PARENT_REF"}
        keys["linguistic_type"] = "LINGUISTIC_TYPE_REF"
        tables[name].attrs |= {key: tier.get(attribute) for key, attribute in keys.items() if tier.get(attribute)}
    return tables


def fingerprint(onset: int, offset: int, label: str) -> int:
    """Return a checksum by which a segment that was edited elsewhere is recognised."""
    return zlib.crc32(f"{onset} {offset} {label}".encode("utf-8", "surrogatepass"))


def _parse(data: bytes) -> ET.Element:
    parser = ET.XMLParser(target=_NoDoctype())
    try:
        parser.feed(data)
        root = parser.close()
    except (ET.ParseError, ValueError, LookupError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(f"not an EAF file: it is not well-formed XML ({error})") from error
    if root.tag != "ANNOTATION_DOCUMENT":
        raise FileFormatError(f"not an EAF file: expected ANNOTATION_DOCUMENT, but got {root.tag[:80]!r}")
    header = root.find("HEADER")
    unit = header.get("TIME_UNITS", "milliseconds") if header is not None else "milliseconds"
    if unit != "milliseconds":
        raise FileFormatError(f"expected TIME_UNITS milliseconds, but got {unit!r}")
    return root


def _segment_id(key: str, text: str) -> int:
    """Return the id that an annotation carries, or one computed from what identifies it."""
    own = _OWN_ID.fullmatch(key)
    if own and 0 < int(own[1]) < 2**64:
        return int(own[1])
    return int.from_bytes(hashlib.blake2b(text.encode("utf-8", "replace"), digest_size=8).digest(), "big") or 1


def _make_distinct(ids: pd.Series) -> list[int]:
    """Return the ids of one tier, with another one for each that repeats an earlier one (a broken file)."""
    seen: set[int] = set()
    result = []
    for value in ids:
        number = int(value)
        while number in seen:
            number = _segment_id("", f"{number} again")
        seen.add(number)
        result.append(number)
    return result


def _read_records(text: str | None) -> dict[str, dict[str, Any]]:
    """Return the further columns that mimique kept in the document, by annotation id; nothing if damaged."""
    if not text:
        return {}
    known = {"confidence": float, "status": str, "origin": str, "revision": int, "kind": str}
    known |= {"from_label": str, "to_label": str}
    try:
        return {
            key: {
                "fingerprint": int(mark),
                "columns": {name: known[name](value) for name, value in columns.items() if name in known},
            }
            for key, (mark, columns) in json.loads(text).items()
        }
    except (ValueError, TypeError, AttributeError, OverflowError, RecursionError):
        return {}


def _edited(record: dict[str, Any]) -> dict[str, Any]:
    """Return the columns of a segment that somebody changed in ELAN since: a person's, one revision on."""
    return {"origin": "human", "status": "reviewed", "revision": record["columns"].get("revision", 0) + 1}
