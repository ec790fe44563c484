"""One colour for every affect, the same in films, in the window and in reports.

The palette is built on the eight colours that Okabe and Ito chose so that people with any common kind of colour
blindness tell them apart (*Color Universal Design*, 2008); joy's yellow is darkened so that it also shows on
white, and neutral is a light grey because a middle one is fear's colour to a person without green cones.
"""

from __future__ import annotations

import re
import zlib

AFFECT_COLOURS = {
    "neutral": "#bfc4c9",
    "anger": "#d55e00",
    "disgust": "#009e73",
    "fear": "#cc79a7",
    "joy": "#e6c229",
    "sadness": "#0072b2",
    "surprise": "#56b4e9",
}
"""Colour of each affect, ``#rrggbb``; the order is the one in which legends list them."""

_CODES = {
    "neutral": ("N",),
    "anger": ("A", "C"),  # the second letter of a pair is the French one: colère, peur, tristesse …
    "disgust": ("D",),
    "fear": ("F", "P"),
    "joy": ("J",),
    "sadness": ("Sa", "T"),
    "surprise": ("Su", "S"),
}
_AFFECT_OF = {code: affect for affect, codes in _CODES.items() for code in codes} | {a: a for a in AFFECT_COLOURS}
_CODE = "|".join(sorted((code for codes in _CODES.values() for code in codes), key=len, reverse=True))
_TRANSITION = re.compile(rf"({_CODE})({_CODE})")
_SEPARATED = re.compile(r"\s*(?:→|->|–|/| to )\s*")
_OTHER = ("#aa4499", "#44aa99", "#999933", "#882255", "#7a6ff0")


def find_affects(label: str) -> tuple[str, ...]:
    """Return the affects that a label names: one for an affect, two for a transition, none for anything else.

    English names in any case, the codes N A D F J Sa Su, the French C P T S, and transitions written as two codes
    (``NA``) or as two names with an arrow are understood.
    """
    label = label.strip()
    if single := _AFFECT_OF.get(label) or _AFFECT_OF.get(label.lower()):
        return (single,)
    pair = _TRANSITION.fullmatch(label)
    parts = list(pair.groups()) if pair else _SEPARATED.split(label)
    found = [_AFFECT_OF.get(part) or _AFFECT_OF.get(part.lower()) for part in parts]
    return (found[0], found[1]) if len(found) == 2 and found[0] and found[1] else ()


def find_label_colours(label: str) -> tuple[str, ...]:
    """Return the colours that stand for a label, ``#rrggbb``: two for a transition (from, to), else one.

    A label that names no affect gets one of a few other colours, always the same for the same text.
    """
    affects = find_affects(label)
    if affects:
        return tuple(AFFECT_COLOURS[affect] for affect in affects)
    return (_OTHER[zlib.crc32(label.strip().encode()) % len(_OTHER)],)


def find_text_colour(background: str) -> str:
    """Return black or white, whichever is read more easily on ``background`` (WCAG 2 relative luminance)."""
    channels = [int(background[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return "#000000" if (luminance + 0.05) ** 2 > 1.05 * 0.05 else "#ffffff"
