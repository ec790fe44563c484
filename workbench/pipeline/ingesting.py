"""Recordings and annotation files into the corpus."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ...corpus import Corpus, read_take, read_tiers
from ...corpus.quality import find_coinciding_markers
from ...corpus.recordings import RECORDING_SUFFIXES
from ...corpus.tiers import TIER_SUFFIXES
from ...corpus.transaction import Transaction
from ...errors import ConflictError, InputError, MimiqueError
from ..progress import Reporter

LIST_COLUMNS = ("file", "tiers", "signer", "protocol", "head_markers", "neutral")


@dataclass(frozen=True)
class Recording:
    """A file to ingest, and what the file itself does not say.

    Parameters
    ----------
    path
        A recording (C3D, TRC), or an annotation file (EAF, TextGrid) whose tiers belong to the take of its name.
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
    known = set(RECORDING_SUFFIXES) | set(TIER_SUFFIXES)
    for recording in files:
        if recording.path.suffix.lower() not in known:
            raise InputError(f"{recording.path}: expected one of {', '.join(sorted(known))}; convert the file first")
    takes = [r for r in files if r.path.suffix.lower() in RECORDING_SUFFIXES]
    annotations = [r for r in files if r.path.suffix.lower() in TIER_SUFFIXES]
    doubled = [name for name, count in Counter(r.take for r in takes).items() if count > 1]
    if doubled:
        raise InputError(f"take {doubled[0]!r}: several of the given files have this name; rename one")
    rows = []
    names = ", ".join(r.path.name for r in files[:3]) + (f" and {len(files) - 3} more" if len(files) > 3 else "")
    parameters = {"files": [r.path.name for r in files], "replace": replace}
    with corpus.transaction(f"Ingest {names}", command="ingest", parameters=parameters, author=author) as edit:
        with reporter.stage("Ingesting", len(files)) as finished:
            for recording in takes:
                rows.append(_put_recording(edit, recording, replace=replace))
                finished(recording.take)
            for recording in annotations:
                rows.append(_put_annotations(edit, recording, author=author))
                finished(recording.path.name)
    return pd.DataFrame(rows, columns=["file", "take", "outcome", "detail"])


def _put_recording(edit: Transaction, recording: Recording, *, replace: bool) -> tuple[str, str, str, str]:
    take = read_take(recording.path)
    take.attrs |= _describe(recording)
    _check_head_markers(take, recording)
    _check_neutral(take, recording)
    _check_distinct(take, recording.path.name)
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
    name = recording.take
    if not edit.has_take(name):
        raise InputError(
            f"{recording.path.name}: there is no take {name!r} for it; ingest the recording of that name too"
        )
    tiers = read_tiers(recording.path, rate=float(edit.take(name).attrs["rate"]))
    changed, total = 0, 0
    for tier, table in tiers.items():
        whose = str(table.attrs.get("author") or author or "import")
        try:
            changed += edit.put_tier(name, tier.removesuffix(f"@{whose}"), table, author=whose)
        except MimiqueError as error:
            raise type(error)(f"{recording.path.name}: {error}") from error
        total += len(table)
    outcome = "unchanged" if not changed else "added"
    return recording.path.name, name, outcome, f"{len(tiers)} tiers, {total} segments"


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
