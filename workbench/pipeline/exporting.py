"""What goes out of a corpus: weights, tiers, markers, animation of a take as files, or all takes as a BIDS dataset.

Nothing goes out against a signer's consent (:mod:`mimique.corpus.privacy.consent`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ...corpus import Corpus, write_take, write_tiers
from ...corpus.annotations.tiers import TIER_SUFFIXES
from ...corpus.formats.motion_bids import BidsTake, write_motion_bids
from ...corpus.formats.recordings import WRITTEN_SUFFIXES
from ...corpus.formats.weights_files import WEIGHTS_SUFFIXES, write_weights
from ...corpus.privacy.consent import check_consent, explain_refusal
from ...corpus.store.view import CorpusView
from ...corpus.take import make_take
from ...errors import InputError, NotFoundError
from ..progress import Reporter
from .animating import ANIMATION_SUFFIXES, choose_weights, make_weights, write_animation
from .tier_files import write_take_tiers

CONTENTS = ("weights", "tiers", "markers", "animation")
"""What of a take a file can hold."""

_BY_SUFFIX = {
    ".csv": CONTENTS, ".parquet": CONTENTS, ".tsv": ("tiers",), ".eaf": ("tiers",), ".textgrid": ("tiers",),
    ".c3d": ("markers",), ".trc": ("markers",), ".nc": ("markers",),
    **dict.fromkeys(ANIMATION_SUFFIXES, ("animation",)),
}  # fmt: skip

_BELONGS: dict[str, tuple[str, ...]] = {
    "format": ("weights",), "step": ("markers",), "tiers": ("tiers",), "authors": ("tiers",),
    **dict.fromkeys(("solve", "rig", "shapes", "rate"), ("weights", "animation")),
}  # fmt: skip
"""Which contents each option chooses among."""


def export(
    corpus: CorpusView,
    take: str,
    path: Path,
    *,
    content: str | None = None,
    solve: str | None = None,
    step: str | None = None,
    tiers: Sequence[str] | None = None,
    authors: Sequence[str] | None = None,
    format: str | None = None,
    rig: str | None = None,
    shapes: str | None = None,
    rate: float | None = None,
    purpose: str = "project",
    reporter: Reporter | None = None,
) -> str:
    """Write one take's weights, tiers, markers or animation; the suffix of the file says which.

    Parameters
    ----------
    corpus, take
        What to write.
    path
        ``.csv`` or ``.parquet`` for weights (``time`` in s and one column a shape), ``.eaf`` or ``.TextGrid`` for
        tiers, ``.c3d``, ``.trc`` or ``.nc`` (netCDF of ``movement``) for the markers; ``.glb``, ``.usda`` or ``.usdc``
        for the face's animation, which a folder gets as a sequence of OBJ files.
    content
        One of :data:`CONTENTS`, for a suffix that several of them have. Unless given, ``.csv`` and ``.parquet`` are
        weights, or markers if ``step`` is given, or tiers if ``tiers`` or ``authors`` are.
    solve
        Which weights; the take's current ones if left out.
    step
        Which processing step's markers; those recorded if left out.
    tiers, authors
        Which tiers, and whose; all if left out.
    format
        "livelink" writes a weights CSV as Live Link Face does.
    rig, shapes, rate
        For weights and animations: the rig that shall move, the table of shapes that drive it, and the frames per
        second of the file; see :func:`.animating.write_animation`.
    purpose
        Whom the file is for, one of :data:`mimique.corpus.privacy.consent.PURPOSES`; the signer's consent must cover
        it.
    reporter
        Told how far a long sequence is.

    Returns
    -------
    A line that says what was written, with more where something is lost.

    Raises
    ------
    MimiqueError
        If the signer's consent does not cover it, the take or what is asked of it is not there, the suffix is another,
        or the file cannot be written.
    """
    options = {"solve": solve, "step": step, "tiers": tiers, "authors": authors, "format": format}
    chosen = _choose_content(path, content, **options, rig=rig, shapes=shapes, rate=rate)
    check_consent(corpus, take, purpose)
    if chosen == "animation":
        return write_animation(corpus, take, path, solve=solve, rig=rig, shapes=shapes, rate=rate, reporter=reporter)
    if chosen == "weights":
        weights = corpus.weights(take, solve)
        if rig is not None or shapes is not None or rate is not None:
            weights = make_weights(choose_weights(corpus, take, solve=solve, rig=rig, shapes=shapes), rate, weights)
        write_weights(path, weights, format=format)
        return f"{path}: {weights.sizes['time']} frames, {weights.sizes['shape']} shapes"
    if chosen == "tiers":
        tables = select_tiers(read_all_tiers(corpus, take), tiers, authors, take=take)
        if tiers or authors:  # these alone: not the document that all tiers came in
            write_tiers(path, tables, rate=float(corpus.take_attributes(take)["rate"]))
        else:
            write_take_tiers(corpus, take, path, tables, folder=getattr(corpus, "path", None))
        return f"{path}: {len(tables)} tiers, {sum(map(len, tables.values()))} segments"
    dataset = corpus.take(take) if step is None else read_step(corpus, take, step)
    write_take(path, dataset)
    return f"{path}: {dataset.sizes['time']} frames, {dataset.sizes['marker']} markers"


def export_bids(
    corpus: Corpus, folder: Path, *, takes: Sequence[str] | None = None, purpose: str = "project"
) -> tuple[pd.DataFrame, list[str]]:
    """Write takes as a Motion-BIDS dataset; those that their signer's consent does not cover are left out.

    Parameters
    ----------
    corpus
        What to write.
    folder
        New or empty.
    takes
        Names; all if left out.
    purpose
        As for :func:`export`.

    Returns
    -------
    (table, refusals)
        One row a take that was written: ``take, file, frames, markers``; a line for each that was left out.

    Raises
    ------
    MimiqueError
        If a take is not there, none may go out, or the folder cannot be written.
    """
    listed = corpus.takes()
    missing = sorted(set(takes or ()) - set(listed["take"]))
    if missing:
        raise NotFoundError(f"there is no take {missing[0]!r}")
    chosen, refusals = [], []
    for row in listed.itertuples():
        if takes is not None and row.take not in takes:
            continue
        name, signer, protocol = str(row.take), _code(row.signer), _code(row.protocol)
        reason = explain_refusal(corpus, signer, purpose)
        if reason is not None:
            refusals.append(f"{name}: left out: {reason}")
            continue
        read = partial(corpus.take, name)
        chosen.append(BidsTake(name, signer, protocol, read, partial(read_all_tiers, corpus, name)))
    if not chosen:
        raise InputError(refusals[0] if refusals else "the corpus has no takes to write")
    records = corpus.signers()
    signers: Mapping[str, Mapping[str, Any]] = {
        str(record["signer"]): record for record in records.to_dict(orient="records")
    }
    return write_motion_bids(folder, chosen, name=corpus.name, signers=signers), refusals


def read_all_tiers(corpus: CorpusView, take: str) -> dict[str, pd.DataFrame]:
    """Return every tier of a take; where several authors have a tier of one name, the name says whose it is."""
    listed = corpus.tiers(take)
    shared = listed["tier"].duplicated(keep=False)
    tiers = {}
    for row, several in zip(listed.itertuples(), shared, strict=True):
        name = f"{row.tier}@{row.author}" if several else str(row.tier)
        table = corpus.tier(take, str(row.tier), author=str(row.author))
        table.attrs["author"] = str(row.author)
        tiers[name] = table
    return tiers


def select_tiers(
    tables: dict[str, pd.DataFrame], tiers: Sequence[str] | None, authors: Sequence[str] | None, *, take: str
) -> dict[str, pd.DataFrame]:
    """Return the tiers of these names (``TIER`` or ``TIER@AUTHOR``) and authors; all unless given.

    Raises
    ------
    NotFoundError
        If a name or an author has none.
    """
    keys = {name: (name.removesuffix(f"@{t.attrs['author']}"), str(t.attrs["author"])) for name, t in tables.items()}
    known = ", ".join(f"{tier}@{author}" for tier, author in keys.values()) or "none"
    for wanted in tiers or ():
        if not any(wanted in (tier, f"{tier}@{author}") for tier, author in keys.values()):
            raise NotFoundError(f"take {take!r}: no tier {wanted!r}; it has {known}")
    for wanted in authors or ():
        if not any(author == wanted for _, author in keys.values()):
            raise NotFoundError(f"take {take!r}: no tier of author {wanted!r}; it has {known}")
    chosen = {}
    for name, (tier, author) in keys.items():
        of_name = not tiers or tier in tiers or f"{tier}@{author}" in tiers
        if of_name and (not authors or author in authors):
            chosen[name] = tables[name]
    if not chosen and tables:
        raise NotFoundError(f"take {take!r}: no tier is of that name and author; it has {known}")
    return chosen


def read_step(corpus: CorpusView, take: str, step: str) -> xr.Dataset:
    """Return the markers of a processing step as a take.

    Raises
    ------
    NotFoundError
        If there is no such step.
    InputError
        If it holds no marker positions.
    """
    dataset = corpus.processed(take, step)
    if "position" not in dataset or set(dataset["position"].dims) != {"time", "marker", "space"}:
        raise InputError(f"take {take!r}: the step {step!r} holds no marker positions")
    known = corpus.take_attributes(take)
    kept = {key: known[key] for key in ("signer", "protocol", "simulated") if known.get(key)}
    position = dataset["position"].transpose("time", "marker", "space")
    result = make_take(
        position.values,
        [str(name) for name in dataset["marker"].values],
        float(known["rate"]),
        processed=step,
        **kept,
    )
    return result.assign_coords(time=("time", np.asarray(dataset["time"].values, dtype=np.float64), {"units": "s"}))


def _choose_content(path: Path, content: str | None, **options: Any) -> str:
    """Return what the file shall hold, or say why suffix and options do not fit."""
    suffix = "" if path.is_dir() else path.suffix.lower()
    possible = _BY_SUFFIX.get(suffix)
    if possible is None:
        raise InputError(
            f"{path}: expected a file that ends in one of {', '.join(filter(None, _BY_SUFFIX))}, "
            "or a name without an ending for a folder of OBJ files"
        )
    if content is None:
        if options["step"] is not None:
            content = "markers"
        elif options["tiers"] or options["authors"]:
            content = "tiers"
        else:
            content = possible[0]
    if content not in CONTENTS:
        raise InputError(f"expected one of {', '.join(CONTENTS)}, but got {content!r}")
    suffixes = {
        "weights": WEIGHTS_SUFFIXES,
        "tiers": TIER_SUFFIXES,
        "markers": WRITTEN_SUFFIXES,
        "animation": ANIMATION_SUFFIXES,
    }[content]
    if suffix not in suffixes:
        listed = ", ".join(ending or "a folder" for ending in suffixes)
        raise InputError(f"{path}: {content} are written to {listed}, not to {suffix or 'a folder'}")
    for option, owners in _BELONGS.items():
        if options[option] is not None and options[option] != [] and content not in owners:
            raise InputError(f"{path}: {option} chooses among {owners[0]}, but the file is for {content}")
    return content


def _code(value: Any) -> str | None:
    return str(value) if isinstance(value, str) and value else None
