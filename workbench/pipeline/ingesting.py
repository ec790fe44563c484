"""Recordings, weights and annotation files into the corpus.

What a file holds is told by its suffix or, where several kinds share one (``.csv``, ``.tsv``, ``.txt``,
``.parquet``), by its content. An ELAN document is kept beside its take, so that what mimique does not use comes back
when it goes out.
"""

from __future__ import annotations

import csv
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd
import xarray as xr

from ...corpus import Corpus, read_take
from ...corpus.annotations.segment_tables import is_segment_table
from ...corpus.annotations.tiers import TIER_SUFFIXES, parse_tiers
from ...corpus.checks.quality import find_coinciding_markers
from ...corpus.formats.recordings import RECORDING_SUFFIXES, detect_content
from ...corpus.formats.weights_files import read_weights
from ...corpus.store.transaction import Transaction
from ...corpus.take import make_bare_take
from ...errors import ConflictError, InputError, MimiqueError
from ..progress import Reporter
from .tier_files import document_start

EAF_MEDIA_TYPE = "text/x-eaf+xml"
"""Media type of the ELAN documents that are kept."""


_AHEAD = 2  # recordings that are read while an earlier one is written

T = TypeVar("T")
R = TypeVar("R")

LIST_COLUMNS = ("file", "tiers", "signer", "protocol", "head_markers", "neutral")


@dataclass(frozen=True)
class Recording:
    """A file to ingest, and what the file itself does not say.

    Parameters
    ----------
    path
        A recording, or weights or annotations, which belong to the take of the file's name. Weights whose take has no
        markers make a take of their own.
    signer, protocol
        Codes, such as ``ab`` and ``IE``.
    head_markers
        Names of the markers that sit on the skull; at least three for what is to be solved.
    neutral
        A frame in which the face is neutral, if known.
    """

    path: Path
    signer: str | None = None
    protocol: str | None = None
    head_markers: tuple[str, ...] = ()
    neutral: int | None = None

    @property
    def take(self) -> str:
        """Name of the take: the file's name without its suffix."""
        return self.path.stem


def split_names(text: str | None) -> tuple[str, ...]:
    """Return the names in a list that is separated by commas."""
    return tuple(part.strip() for part in (text or "").split(",") if part.strip())


def read_recording_list(path: Path) -> list[Recording]:
    """Read a CSV that lists recordings: ``file,tiers,signer,protocol,head_markers,neutral``, all but ``file`` optional.

    Files are relative to the list; ``tiers`` is an annotation file of the same take; head markers are separated by
    commas. Other columns are ignored.

    Raises
    ------
    InputError
        With the line, for a row without a file or with a neutral that is no frame number.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: the list of recordings cannot be read ({error})") from error
    recordings = []
    for line, row in enumerate(rows, start=2):
        if not row.get("file"):
            raise InputError(f"{path.name}, line {line}: expected a file name in the column 'file'")
        neutral = row.get("neutral") or None
        if neutral is not None and not neutral.isdigit():
            raise InputError(f"{path.name}, line {line}: expected a frame number in 'neutral', but got {neutral!r}")
        recordings.append(
            Recording(
                path=path.parent / row["file"],
                signer=row.get("signer") or None,
                protocol=row.get("protocol") or None,
                head_markers=split_names(row.get("head_markers")),
                neutral=None if neutral is None else int(neutral),
            )
        )
        if row.get("tiers"):
            recordings.append(Recording(path.parent / row["tiers"]))
    if not recordings:
        raise InputError(f"{path.name}: the list of recordings is empty; its columns are {', '.join(LIST_COLUMNS)}")
    return recordings


def ingest(
    corpus: Corpus,
    recordings: Iterable[Recording],
    *,
    replace: bool = False,
    author: str | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Read recordings and annotation files into the corpus, all of them in one commit or none.

    Parameters
    ----------
    corpus
        Where to.
    recordings
        What to read. Annotations may come with their recording, or later.
    replace
        Whether a take of the same name gives way to another recording.
    author
        Whose tiers they are where the annotation file does not say.

    Returns
    -------
    DataFrame
        One row a file: ``file, take, outcome`` (added, replaced, unchanged), ``detail``.

    Raises
    ------
    MimiqueError
        If a file cannot be read or used, or another recording has the take's name; nothing is changed then.
    """
    reporter = reporter or Reporter()
    files = list(recordings)
    kinds = [detect_kind(recording.path) for recording in files]
    takes, weights, annotations = (
        [recording for recording, kind in zip(files, kinds, strict=True) if kind == wanted]
        for wanted in ("recording", "weights", "tiers")
    )
    doubled = [name for name, count in Counter(r.take for r in takes).items() if count > 1]
    if doubled:
        raise InputError(f"take {doubled[0]!r}: several of the given files have this name; rename one")
    rows = []
    names = ", ".join(r.path.name for r in files[:3]) + (f" and {len(files) - 3} more" if len(files) > 3 else "")
    parameters = {"files": [r.path.name for r in files], "replace": replace}
    with corpus.transaction(f"Ingest {names}", command="ingest", parameters=parameters, author=author) as edit:
        for recording in annotations:
            _check_has_take(edit, recording, [*takes, *weights])
        with reporter.stage("Ingesting", len(files)) as finished:
            for recording, take in read_ahead(_read_recording, takes):
                rows.append(_put_recording(edit, recording, take, replace=replace))
                finished(recording.take)
            for recording in weights:
                rows.append(_put_weights(edit, recording))
                finished(recording.path.name)
            for recording in annotations:
                rows.append(_put_annotations(edit, recording, author=author))
                finished(recording.path.name)
    return pd.DataFrame(rows, columns=["file", "take", "outcome", "detail"])


def detect_kind(path: Path) -> str:
    """Return what a file holds: "recording", "weights" or "tiers".

    Raises
    ------
    InputError
        If it is none of them, or cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in RECORDING_SUFFIXES and suffix not in TIER_SUFFIXES:
        known = sorted({*RECORDING_SUFFIXES, *TIER_SUFFIXES})
        raise InputError(f"{path}: expected one of {', '.join(known)}; convert the file first")
    if suffix not in RECORDING_SUFFIXES:
        return "tiers"
    content = detect_content(path)
    if content is not None:
        return content
    if suffix in TIER_SUFFIXES and (suffix == ".parquet" or is_segment_table(_read(path, 4096))):
        return "tiers"
    raise InputError(
        f"{path}: neither markers, nor weights, nor segments (columns onset, offset, label) are in it; expected what "
        "the motion-capture program exports, such as a .c3d"
    )


def _read(path: Path, size: int = -1) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(size)
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror or error})") from error


def _check_has_take(edit: Transaction, recording: Recording, takes: Sequence[Recording]) -> None:
    """Refuse annotations that belong to no take before anything is read."""
    name = recording.take
    if not any(one.take == name for one in takes) and not edit.has_take(name):
        raise InputError(
            f"{recording.path.name}: there is no take {name!r} for it; ingest the recording of that name too"
        )


def _put_performance(edit: Transaction, recording: Recording, weights: xr.Dataset) -> None:
    """Make the take of weights that came without markers, as face trackers record them."""
    rate = weights.attrs.get("rate")
    if rate is None:
        raise InputError(f"{recording.path.name}: its rate is not known, and there is no take {recording.take!r}")
    facts = {key: weights.attrs[key] for key in ("source_file", "source_sha256") if key in weights.attrs}
    take = make_bare_take(weights.sizes["time"], float(rate), **facts, **_describe(recording))
    edit.put_take(recording.take, take)


def _put_weights(edit: Transaction, recording: Recording) -> tuple[str, str, str, str]:
    name = recording.take
    weights = read_weights(recording.path)
    if not edit.has_take(name):
        _put_performance(edit, recording, weights)
    facts = edit.take_attributes(name)
    rate = float(weights.attrs.get("rate", facts["rate"]))
    if abs(rate - float(facts["rate"])) > 1e-3 * float(facts["rate"]):
        raise InputError(
            f"{recording.path.name}: its weights are at {rate:g} Hz, but take {name!r} has {facts['rate']:g} Hz; "
            "export both at one rate"
        )
    provenance = {"source_file": recording.path.name, "source_sha256": weights.attrs.get("source_sha256")}
    try:
        changed = edit.put_weights(name, weights, solve="imported", method="imported", provenance=provenance)
    except MimiqueError as error:
        raise type(error)(f"{recording.path.name}: {error}") from error
    size = f"{weights.sizes['time']} frames, {weights.sizes['shape']} shapes"
    return recording.path.name, name, "added" if changed else "unchanged", size


def read_ahead(read: Callable[[T], R], items: Sequence[T]) -> Iterator[tuple[T, R]]:
    """Yield each item and what ``read`` makes of it, while the next one is being read."""
    with ThreadPoolExecutor(max_workers=1) as reader:
        coming = deque(reader.submit(read, item) for item in items[:_AHEAD])
        for place, item in enumerate(items):
            result = coming.popleft().result()
            if place + _AHEAD < len(items):
                coming.append(reader.submit(read, items[place + _AHEAD]))
            yield item, result


def _read_recording(recording: Recording) -> xr.Dataset:
    take = read_take(recording.path)
    take.attrs |= _describe(recording)
    _check_head_markers(take, recording)
    _check_neutral(take, recording)
    _check_distinct(take, recording.path.name)
    return take


def _put_recording(
    edit: Transaction, recording: Recording, take: xr.Dataset, *, replace: bool
) -> tuple[str, str, str, str]:
    name = recording.take
    existed = edit.has_take(name)
    if existed and not replace:
        _explain_difference(edit.take(name), take, name)
    changed = edit.put_take(name, take, replace=replace)
    outcome = "unchanged" if not changed else "replaced" if existed else "added"
    missing = float(np.isnan(take["position"].values[:, :, 0]).mean())
    size = f"{take.sizes['time']} frames at {take.attrs['rate']:g} Hz, {take.sizes['marker']} markers"
    detail = f"{size}, {missing:.1%} missing"
    return recording.path.name, name, outcome, detail


def _describe(recording: Recording) -> dict[str, Any]:
    facts: dict[str, Any] = {
        "signer": recording.signer,
        "protocol": recording.protocol,
        "head_markers": list(recording.head_markers) or None,
        "neutral_frame": recording.neutral,
    }
    return {key: value for key, value in facts.items() if value is not None}


def _explain_difference(old: xr.Dataset, new: xr.Dataset, name: str) -> None:
    """Say in what another take of the same name differs, if it does."""
    if old.attrs.get("source_sha256") != new.attrs["source_sha256"]:
        raise ConflictError(
            f"take {name!r}: another recording ({old.attrs.get('source_file', 'unknown source')}) has this name; "
            "give --replace to put this one in its place, or rename the file"
        )
    keys = ("signer", "protocol", "head_markers", "neutral_frame")
    differing = [key for key in keys if old.attrs.get(key) != new.attrs.get(key)]
    if differing:
        was = ", ".join(f"{key} was {old.attrs.get(key)}, is {new.attrs.get(key)}" for key in differing)
        raise ConflictError(f"take {name!r}: the same recording, but {was}; give --replace to change it")


def _check_head_markers(take: xr.Dataset, recording: Recording) -> None:
    if not recording.head_markers:
        return
    file = recording.path.name
    known = [str(name) for name in take["marker"].values]
    unknown = [name for name in recording.head_markers if name not in known]
    if unknown:
        raise InputError(f"{file}: no head marker {', '.join(unknown)}; the markers are {', '.join(known)}")
    visible = np.isfinite(take["position"].sel(marker=list(recording.head_markers)).values).all(axis=2)
    if len(set(recording.head_markers)) < 3 or not (visible.sum(axis=1) >= 3).any():
        raise InputError(
            f"{file}: expected three head markers that are visible together in some frame, but at most "
            f"{visible.sum(axis=1).max()} of {', '.join(recording.head_markers)} are; name others"
        )


def _check_neutral(take: xr.Dataset, recording: Recording) -> None:
    if recording.neutral is not None and not 0 <= recording.neutral < take.sizes["time"]:
        raise InputError(
            f"{recording.path.name}: expected a neutral frame from 0 to {take.sizes['time'] - 1}, "
            f"but got {recording.neutral}"
        )


def _check_distinct(take: xr.Dataset, file: str) -> None:
    """Refuse two markers at one place: one is a copy, and no map can tell them apart."""
    pairs = find_coinciding_markers(take)
    if pairs:
        raise InputError(
            f"{file}: the markers {' and '.join(pairs[0])} coincide wherever both are seen; "
            "export the recording again without the copy"
        )


def _put_annotations(edit: Transaction, recording: Recording, *, author: str | None) -> tuple[str, str, str, str]:
    name, file = recording.take, recording.path.name
    facts = edit.take_attributes(name)
    data = _read(recording.path)
    is_elan = recording.path.suffix.lower() == ".eaf"
    start = document_start(data, facts.get("video") or ()) if is_elan and data else 0.0
    tiers = parse_tiers(data, file, float(facts["rate"]), start=start)
    changed, total = 0, 0
    try:
        for tier, table in tiers.items():
            whose = str(table.attrs.get("author") or author or "import")
            changed += edit.put_tier(name, tier.removesuffix(f"@{whose}"), table, author=whose)
            total += len(table)
        if is_elan:
            changed += edit.put_document(name, file, data, media_type=EAF_MEDIA_TYPE)
    except MimiqueError as error:
        raise type(error)(f"{file}: {error}") from error
    return file, name, "added" if changed else "unchanged", f"{len(tiers)} tiers, {total} segments"


def plan_recordings(
    files: Sequence[Path],
    *,
    signer: str | None,
    protocol: str | None,
    head_markers: Sequence[str],
    neutral: int | None = None,
) -> list[Recording]:
    """Return recordings that share what a command line says of them."""
    return [Recording(Path(f), signer, protocol, tuple(head_markers), neutral) for f in files]
