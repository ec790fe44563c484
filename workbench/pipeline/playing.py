"""One take as something to watch: the face, the adapted markers, the tiers, the energy."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError, MimiqueError
from ...features import motion_energy
from ...synthesis.alignment import align_points
from ...synthesis.performance import Performance, count_clock_frames
from ...synthesis.view import View
from ..progress import Reporter
from .animating import choose_weights
from .exporting import read_all_tiers
from .rig_colours import find_colours
from .rig_weights import RigWeights
from .segmenting import SEGMENT_TIER

SHOWN_TIERS = 3


def prepare_performance(
    corpus: CorpusView,
    take: str,
    *,
    solve: str | None = None,
    rig: str | None = None,
    shapes: str | None = None,
    tiers: Sequence[str] | None = None,
) -> Performance:
    """Gather what a window or a film shows of a take.

    Parameters
    ----------
    corpus, take
        What to show.
    solve
        Which weights; the take's current ones if left out.
    rig
        The face that makes them; see :func:`.rig_weights.read_rig_weights`.
    shapes
        A CSV table ``from,to,gain``, or the name of one that comes with mimique, where the rig's names are others.
    tiers
        Names of the tiers to show, ``tier`` or ``tier@author``; if left out those of affects, people's first.

    Raises
    ------
    NotFoundError
        If the take, its weights or a tier are not there.
    """
    found = choose_weights(corpus, take, solve=solve, rig=rig, shapes=shapes)
    attributes = corpus.take_attributes(take)
    notes = ["simulated"] if attributes.get("simulated") else []
    notes += [str(attributes[key]) for key in ("signer", "protocol") if key in attributes]
    return Performance(
        rig=found.rig,
        weights=found.weights,
        rate=found.rate,
        title=take,
        note=", ".join([*notes, found.solve]),
        tiers=choose_tiers(corpus, take, tiers),
        energy=motion_energy(found.weights, found.rate).level,
        vertex_colours=find_colours(found.rig),
        **_read_markers(corpus, take, found),
    )


def prepare_beside(
    corpus: CorpusView, take: str, beside: str, *, rig: str | None = None, shapes: str | None = None
) -> Performance:
    """Gather what is shown beside a take.

    Parameters
    ----------
    corpus, take
        What is shown already.
    beside
        ``TAKE``, ``TAKE:SOLVE``, or ``:SOLVE`` for another solve of the same take.
    rig, shapes
        The face that both play on, and the table of shapes if its names are others.

    Raises
    ------
    NotFoundError
        If take, solve or rig are not there.
    """
    other, _, solve = beside.partition(":")
    return prepare_performance(corpus, other or take, solve=solve or None, rig=rig, shapes=shapes)


def _read_markers(corpus: CorpusView, take: str, found: RigWeights) -> dict[str, NDArray[Any]]:
    """Return the markers, the vertices that they sit on, and the raw markers: what there is of them on this rig."""
    step = f"adapted-{found.solve}"
    steps = corpus.steps(take)
    if found.rig_name != corpus.weights(take, found.solve).attrs.get("rig") or step not in steps:
        return {}
    adapted = corpus.processed(take, step)
    made: dict[str, NDArray[Any]] = {"markers": np.asarray(adapted["position"].values, dtype=np.float64)}
    table = corpus.provenance(take, "weights", found.solve).get("parameters", {}).get("marker_map", {})
    names = [str(name) for name in adapted["marker"].values]
    if not names or not all(name in table for name in names):
        return made
    vertices = np.array([int(table[name]) for name in names])
    made["marker_vertices"] = vertices
    if "stabilised" not in steps:
        return made
    stabilised = corpus.processed(take, "stabilised")
    places = {str(name): place for place, name in enumerate(stabilised["marker"].values)}
    if "neutral" not in stabilised or not all(name in places for name in names):
        return made
    neutral = np.asarray(stabilised["neutral"].values, dtype=np.float64)[[places[name] for name in names]]
    try:
        fit = align_points(neutral, found.rig.neutral[vertices])
    except MimiqueError:  # too few markers to say how the signer's head stands in the rig
        return made
    return made | {"raw_markers": fit.apply(np.asarray(stabilised["position"].values, dtype=np.float64))}


def choose_tiers(corpus: CorpusView, take: str, names: Sequence[str] | None) -> dict[str, pd.DataFrame]:
    """Return the tiers to show, in order.

    Raises
    ------
    NotFoundError
        If a named tier is not there.
    """
    if names is not None:
        chosen = {}
        for name in names:
            tier, _, author = name.partition("@")
            chosen[name] = corpus.tier(take, tier, author=author or None)
        return chosen
    everything = read_all_tiers(corpus, take)
    affects = {n: t for n, t in everything.items() if n.partition("@")[0] == "affect"}
    shown = affects or {n: t for n, t in everything.items() if n.partition("@")[0] != SEGMENT_TIER} or everything
    by_people_first = sorted(shown, key=lambda n: (_is_machine(shown[n]), n))
    return {name: shown[name] for name in by_people_first[:SHOWN_TIERS]}


def render_movie(
    corpus: CorpusView,
    take: str,
    path: Path,
    *,
    solve: str | None = None,
    rig: str | None = None,
    shapes: str | None = None,
    tiers: Sequence[str] | None = None,
    start: float = 0.0,
    seconds: float | None = None,
    fps: float = 25.0,
    size: tuple[int, int] = (960, 540),
    view: View | None = None,
    beside: str | None = None,
    reporter: Reporter | None = None,
) -> str:
    """Render a take to an MP4 or GIF file, without a screen.

    Parameters
    ----------
    start, seconds
        The part to show; all of it if left out.
    fps, size
        Pictures per second; width and height in pixels.
    view
        What is shown, and from where.
    beside
        Shown beside it; see :func:`prepare_beside`.

    Returns
    -------
    A line that says what was written.

    Raises
    ------
    MimiqueError
        If there is nothing to show, no encoder, or no way to draw.
    """
    from ...synthesis.gif_writing import LARGEST_GIF_FPS
    from ...synthesis.movie import check_film_path, choose_movie_frames, write_movie

    if check_film_path(path).suffix.lower() == ".gif":
        fps = min(fps, LARGEST_GIF_FPS)
    reporter = reporter or Reporter()
    performance = prepare_performance(corpus, take, solve=solve, rig=rig, shapes=shapes, tiers=tiers)
    other = None if beside is None else prepare_beside(corpus, take, beside, rig=rig, shapes=shapes)
    n_frames = count_clock_frames(performance, other)
    first = min(round(start * performance.rate), n_frames - 1)
    last = n_frames if seconds is None else min(first + round(seconds * performance.rate), n_frames)
    total = len(choose_movie_frames(n_frames, performance.rate, fps, first, last))
    begin = time.perf_counter()
    with reporter.stage(f"Filming {take}", total, "pictures") as finished:
        written = write_movie(
            performance,
            path,
            fps=fps,
            size=size,
            start=first,
            stop=last,
            progress=lambda done, of: finished(f"{done / (time.perf_counter() - begin):.0f} a second"),
            view=view,
            beside=other,
        )
    return f"{written}: {(last - first) / performance.rate:.1f} s at {fps:g} pictures per second"


def render_sheet(
    corpus: CorpusView,
    take: str,
    path: Path,
    *,
    solve: str | None = None,
    rig: str | None = None,
    shapes: str | None = None,
    tiers: Sequence[str] | None = None,
    every: float = 1.0,
    view: View | None = None,
    beside: str | None = None,
    reporter: Reporter | None = None,
) -> str:
    """Draw a contact sheet of a take as a PNG file, without a screen; parameters as of :func:`render_movie`.

    Parameters
    ----------
    every
        Seconds from one face to the next.

    Returns
    -------
    A line that says what was written.

    Raises
    ------
    MimiqueError
        If there is nothing to show, too much for a page, or no way to draw.
    """
    from ...synthesis.contact_sheet import choose_sheet_frames, write_sheet

    reporter = reporter or Reporter()
    performance = prepare_performance(corpus, take, solve=solve, rig=rig, shapes=shapes, tiers=tiers)
    other = None if beside is None else prepare_beside(corpus, take, beside, rig=rig, shapes=shapes)
    total = len(choose_sheet_frames(count_clock_frames(performance, other), performance.rate, every))
    with reporter.stage(f"Drawing {take}", total, "faces") as finished:
        written = write_sheet(
            performance, path, every=every, view=view, beside=other, progress=lambda done, of: finished("")
        )
    return f"{written}: {total} faces, one every {every:g} s"


def _is_machine(table: pd.DataFrame) -> bool:
    return bool(len(table)) and bool((table["origin"] == "model").all())


def parse_size(text: str) -> tuple[int, int]:
    """Return width and height in pixels from a text such as ``960x540``.

    Raises
    ------
    InputError
        If it is no such text, or no size to draw.
    """
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit()) or not (64 <= int(width) <= 7680 and 64 <= int(height) <= 4320):
        raise InputError(f"size: expected WIDTHxHEIGHT in pixels from 64x64 to 7680x4320, but got {text!r}")
    return int(width), int(height)
