"""One take as something to watch: the face, the adapted markers, the tiers, the energy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError
from ...features import motion_energy
from ...synthesis import Rig
from ...synthesis.performance import Performance
from ..progress import Reporter
from .exporting import read_all_tiers
from .rig_weights import read_rig_weights
from .segmenting import SEGMENT_TIER

SHOWN_TIERS = 3


def prepare_performance(
    corpus: CorpusView,
    take: str,
    *,
    solve: str | None = None,
    rig: str | None = None,
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
    tiers
        Names of the tiers to show, ``tier`` or ``tier@author``; if left out those of affects, people's first.

    Raises
    ------
    NotFoundError
        If the take, its weights or a tier are not there.
    """
    found = read_rig_weights(corpus, take, solve=solve, rig=rig)
    attributes = corpus.take_attributes(take)
    step = f"adapted-{found.solve}"
    own = found.rig_name == corpus.weights(take, found.solve).attrs.get("rig")
    markers = corpus.processed(take, step)["position"].values if own and step in corpus.steps(take) else None
    notes = ["simulated"] if attributes.get("simulated") else []
    notes += [str(attributes[key]) for key in ("signer", "protocol") if key in attributes]
    return Performance(
        rig=found.rig,
        weights=found.weights,
        rate=found.rate,
        title=take,
        note=", ".join([*notes, found.solve]),
        markers=None if markers is None else np.asarray(markers, dtype=np.float64),
        tiers=choose_tiers(corpus, take, tiers),
        energy=motion_energy(found.weights, found.rate).level,
        vertex_colours=_colours(found.rig),
    )


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
    tiers: Sequence[str] | None = None,
    start: float = 0.0,
    seconds: float | None = None,
    fps: float = 25.0,
    size: tuple[int, int] = (960, 540),
    reporter: Reporter | None = None,
) -> str:
    """Render a take to an MP4 file, without a screen.

    Parameters
    ----------
    start, seconds
        The part to show; all of it if left out.
    fps, size
        Pictures per second; width and height in pixels.

    Returns
    -------
    A line that says what was written.

    Raises
    ------
    MimiqueError
        If there is nothing to show, no encoder, or no way to draw.
    """
    from ...synthesis.movie import choose_movie_frames, write_movie

    reporter = reporter or Reporter()
    performance = prepare_performance(corpus, take, solve=solve, rig=rig, tiers=tiers)
    first = min(round(start * performance.rate), performance.n_frames - 1)
    last = (
        performance.n_frames
        if seconds is None
        else min(first + round(seconds * performance.rate), performance.n_frames)
    )
    total = len(choose_movie_frames(performance.n_frames, performance.rate, fps, first, last))
    with reporter.stage(f"Filming {take}", total) as finished:
        write_movie(
            performance,
            path,
            fps=fps,
            size=size,
            start=first,
            stop=last,
            progress=lambda done, of: finished(""),
        )
    return f"{path}: {total / fps:.1f} s at {fps:g} pictures per second"


def _is_machine(table: pd.DataFrame) -> bool:
    return bool(len(table)) and bool((table["origin"] == "model").all())


def _colours(rig: Rig) -> NDArray[np.float64] | None:
    """Return the avatar's own colours where the rig is the avatar, whatever its name in the corpus."""
    from ...synthesis.avatar import SHAPES, build_avatar, vertex_colours

    if tuple(SHAPES) != rig.shapes or rig.n_vertices != build_avatar().n_vertices:
        return None
    return vertex_colours()


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
