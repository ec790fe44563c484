"""The reference videos of a take: only files that the corpus links, unchanged in size, of a kind that browsers play."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ....corpus.annotations.media import check_link, locate
from ....corpus.store.view import CorpusView
from ....errors import InputError, NotFoundError
from .messages import Video

__all__ = ["MEDIA_TYPES", "LinkedVideo", "find_video", "list_videos", "parse_range", "read_part"]

MEDIA_TYPES = {
    ".m4v": "video/mp4",
    ".mov": "video/quicktime",
    ".mp4": "video/mp4",
    ".ogv": "video/ogg",
    ".webm": "video/webm",
}
"""Suffixes of the files that are sent, and what they are sent as."""

PIECE = 1 << 18


@dataclass(frozen=True)
class LinkedVideo:
    """A file that can be sent: where it is, its bytes, its SHA-256 when it was linked, its media type."""

    path: Path
    size: int
    digest: str
    media_type: str


def list_videos(corpus: CorpusView, take: str, folder: Path | None) -> list[Video]:
    """Return the linked videos of a take, each with what keeps it from being shown.

    Parameters
    ----------
    corpus, take
        Where the links are.
    folder
        Of the corpus, to which they may be relative; None where it is in S3.
    """
    found = []
    for index, link in enumerate(_links(corpus, take)):
        path = locate(link, folder)
        rate = link.get("rate")
        found.append(
            Video(
                index=index,
                name=path.name,
                rate=None if rate is None else float(rate),
                offset=float(link.get("offset") or 0.0),
                problem=_find_problem(link, path, folder),
            )
        )
    return found


def find_video(corpus: CorpusView, take: str, index: int, folder: Path | None) -> LinkedVideo:
    """Return a linked video of a take, by its place among the links.

    Raises
    ------
    NotFoundError
        If the take has no such link.
    InputError
        If the file is not there, is not the one that was linked, or is of another kind.
    """
    links = _links(corpus, take)
    if not 0 <= index < len(links):
        raise NotFoundError(f"take {take!r}: no video {index}; it has {len(links)}")
    path = locate(links[index], folder)
    problem = _find_problem(links[index], path, folder)
    if problem is not None:
        raise InputError(problem)
    link = links[index]
    return LinkedVideo(path, int(link["bytes"]), str(link["sha256"]), MEDIA_TYPES[path.suffix.lower()])


def parse_range(header: str | None, size: int) -> tuple[int, int] | None:
    """Return the bytes [begin, end) that a Range header asks for; None where all of the file is to be sent.

    A header of another form, or one that asks for several parts, is left aside, as RFC 9110 (14.2) allows.

    Raises
    ------
    InputError
        If the part lies beyond the file.
    """
    unit, _, wanted = (header or "").strip().partition("=")
    first, dash, last = (part.strip() for part in wanted.partition("-"))
    numbers = [part for part in (first, last) if part]
    # Twenty digits are more than any file has; int() of thousands would refuse or take its time.
    well_formed = dash and numbers and all(part.isascii() and part.isdigit() and len(part) <= 20 for part in numbers)
    if unit.strip().lower() != "bytes" or not well_formed:
        return None
    if not first:
        begin, end = max(size - int(last), 0), size
    else:
        begin, end = int(first), min(int(last) + 1, size) if last else size
        if last and int(last) < begin:
            return None
    if begin >= size:
        raise InputError(f"bytes from {begin} on were asked for, but the video has {size}")
    return begin, end


def read_part(path: Path, begin: int, end: int) -> Iterator[bytes]:
    """Return the bytes [begin, end) of a file in pieces."""
    with path.open("rb") as file:
        file.seek(begin)
        left = end - begin
        while left > 0 and (piece := file.read(min(PIECE, left))):
            left -= len(piece)
            yield piece


def _links(corpus: CorpusView, take: str) -> list[dict[str, Any]]:
    return list(corpus.take_attributes(take).get("video") or ())


def _find_problem(link: dict[str, Any], path: Path, folder: Path | None) -> str | None:
    if path.suffix.lower() not in MEDIA_TYPES:
        return f"{path.name}: browsers do not play this kind of file; convert it to .mp4 or .webm and link that"
    problem = check_link(link, folder, contents=False)
    # Where files lie on the server is nothing for a reviewer at another computer.
    return None if problem is None else problem.replace(str(path), path.name)
