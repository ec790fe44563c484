"""Write tiers as an EAF 3.0 document for ELAN.

Every tier is written as an independent, time-alignable one. A segment's id becomes the annotation's id (``a`` and
the number), which ELAN keeps. Columns that EAF has no place for (confidence, status, origin, revision, kind) are kept
in a property of the document, which ELAN keeps too; :mod:`.eaf` reads them back unless the segment was edited since.
"""

from __future__ import annotations

import json
import math
import mimetypes
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import pandas as pd

from ..errors import InputError
from .eaf import POINT_TYPE, RECORD_PROPERTY, fingerprint
from .tier_table import make_tier

__all__ = ["format_eaf"]

_DATE = "2000-01-01T00:00:00+00:00"  # required by the format; fixed, so that equal tiers give equal files
_CONSTRAINTS = {
    "Time_Subdivision": "Children divide the time of their parent without gaps",
    "Symbolic_Subdivision": "Children divide their parent, in order, without times of their own",
    "Symbolic_Association": "One child for one parent",
    "Included_In": "Children lie within the time of their parent; gaps are allowed",
}
_RECORDED = {"confidence": None, "status": "reviewed", "origin": "import", "revision": 0, "kind": "interval"}


def format_eaf(
    tiers: Mapping[str, pd.DataFrame],
    rate: float,
    *,
    media: Sequence[Path] = (),
    author: str = "",
) -> str:
    """Return tiers as the text of an EAF 3.0 document.

    Parameters
    ----------
    tiers
        Tier name to table. A table's ``attrs["author"]`` becomes its ANNOTATOR, ``attrs["participant"]`` its
        PARTICIPANT.
    rate
        Frames per second, at most 1000: EAF counts whole milliseconds.
    media
        Sound and film files to show with it.
    author
        Author of the document, and of tiers that name none.

    Raises
    ------
    InputError
        If the rate is above 1000 Hz, a tier is not valid, or a name or label has a character that XML cannot hold.
    """
    if rate > 1000:
        raise InputError(f"expected at most 1000 Hz for an EAF file, which counts milliseconds, but got {rate:g} Hz")
    complete = {name: make_tier(table, name=f"tier {name!r}") for name, table in tiers.items()}
    times = sorted({frame for table in complete.values() for column in ("onset", "offset") for frame in table[column]})
    slots = {int(frame): f"ts{number}" for number, frame in enumerate(times, start=1)}
    records: dict[str, list] = {}
    body: list[str] = []
    used: set[str] = set()
    for name, table in complete.items():
        body += _format_tier(name, table, slots, author, used, records)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<ANNOTATION_DOCUMENT AUTHOR={_attribute(author)} DATE="{_DATE}" FORMAT="3.0" VERSION="3.0"'
        ' xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
        ' xsi:noNamespaceSchemaLocation="http://www.mpi.nl/tools/elan/EAFv3.0.xsd">',
        '<HEADER MEDIA_FILE="" TIME_UNITS="milliseconds">',
        *(_format_media(Path(path)) for path in media),
        f'<PROPERTY NAME="lastUsedAnnotationId">{len(used)}</PROPERTY>',
    ]
    if records:
        text = json.dumps(records, separators=(",", ":"), allow_nan=False)
        lines.append(f'<PROPERTY NAME="{RECORD_PROPERTY}">{_text(text)}</PROPERTY>')
    lines += ["</HEADER>", "<TIME_ORDER>"]
    lines += [
        f'<TIME_SLOT TIME_SLOT_ID="{slot}" TIME_VALUE="{_milliseconds(frame, rate)}"/>' for frame, slot in slots.items()
    ]
    lines += ["</TIME_ORDER>", *body]
    lines += [
        f'<LINGUISTIC_TYPE GRAPHIC_REFERENCES="false" LINGUISTIC_TYPE_ID="{kind}" TIME_ALIGNABLE="true"/>'
        for kind in ("default-lt", POINT_TYPE)
    ]
    lines.append('<LOCALE COUNTRY_CODE="US" LANGUAGE_CODE="en"/>')
    lines += [
        f'<CONSTRAINT DESCRIPTION={_attribute(description)} STEREOTYPE="{stereotype}"/>'
        for stereotype, description in _CONSTRAINTS.items()
    ]
    return "\n".join([*lines, "</ANNOTATION_DOCUMENT>", ""])


def _format_tier(
    name: str, table: pd.DataFrame, slots: dict[int, str], author: str, used: set[str], records: dict[str, list]
) -> list[str]:
    """Return the lines of one TIER; note the ids it used, and the columns to keep beside it."""
    ahead = table["offset"].cummax().shift(fill_value=0)
    n_overlapping = int((table["onset"] < ahead).sum())
    if n_overlapping:
        warnings.warn(
            f"tier {name!r}: {n_overlapping} segments begin before an earlier one ends; ELAN shows one over the other",
            stacklevel=4,
        )
    annotator = str(table.attrs.get("author") or author)
    participant = str(table.attrs.get("participant") or "")
    all_points = bool(len(table)) and bool((table["kind"] == "point").all())
    lines = [
        f'<TIER{_optional("ANNOTATOR", annotator)} DEFAULT_LOCALE="en"'
        f' LINGUISTIC_TYPE_REF="{POINT_TYPE if all_points else "default-lt"}"'
        f"{_optional('PARTICIPANT', participant)} TIER_ID={_attribute(name)}>"
    ]
    further = [column for column in ("from_label", "to_label") if column in table]
    for row in table.to_dict("records"):
        key = f"a{int(row['id'])}"
        if key in used:
            warnings.warn(f"tier {name!r}: segment {row['id']} is in another tier too and gets a new id", stacklevel=4)
            key = f"b{len(used)}"
        used.add(key)
        columns = {column: row[column] for column, usual in _RECORDED.items() if row[column] != usual}
        columns |= {column: row[column] for column in further if isinstance(row[column], str)}
        if all_points:
            columns.pop("kind", None)
        if math.isnan(row["confidence"]):
            columns.pop("confidence")
        if columns:
            records[key] = [fingerprint(row["onset"], row["offset"], row["label"]), columns]
        lines.append(
            f'<ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="{key}" TIME_SLOT_REF1="{slots[row["onset"]]}"'
            f' TIME_SLOT_REF2="{slots[row["offset"]]}"><ANNOTATION_VALUE>{_text(row["label"])}</ANNOTATION_VALUE>'
            "</ALIGNABLE_ANNOTATION></ANNOTATION>"
        )
    return [*lines, "</TIER>"]


def _milliseconds(frame: int, rate: float) -> int:
    """Return the whole millisecond nearest to a frame boundary; a tie goes to the later one."""
    return math.floor(frame * 1000.0 / rate + 0.5)


def _format_media(path: Path) -> str:
    kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    url = path.resolve().as_uri()
    relative = _attribute(f"./{path.name}")
    return f'<MEDIA_DESCRIPTOR MEDIA_URL={_attribute(url)} MIME_TYPE="{kind}" RELATIVE_MEDIA_URL={relative}/>'


def _optional(name: str, value: str) -> str:
    return f" {name}={_attribute(value)}" if value else ""


def _attribute(text: str) -> str:
    return quoteattr(_checked(text))


def _text(text: str) -> str:
    return escape(_checked(text), {"\r": "&#13;"})


def _checked(text: str) -> str:
    """Return the text, or refuse a character that XML 1.0 cannot hold."""
    for letter in text:
        code = ord(letter)
        if (code < 32 and letter not in "\t\n\r") or 0xD800 <= code <= 0xDFFF or code in (0xFFFE, 0xFFFF):
            raise InputError(f"expected text that XML can hold, but {text[:40]!r} has the character U+{code:04X}")
    return text
