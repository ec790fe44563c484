"""A take as the page is told of it before it asks for numbers."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np

from ....corpus import Corpus
from ....errors import InputError, NotFoundError
from .curves import CURVE_UNITS, list_curves
from .made_files import MadeFiles
from .messages import Curve, Problem, Residual, Scene
from .residual import find_stretches, find_threshold
from .shown_markers import open_markers
from .shown_weights import ShownWeights, open_weights
from .strongest_shapes import find_strongest
from .videos import list_videos

__all__ = ["corpus_folder", "describe_scene"]


def describe_scene(files: MadeFiles, corpus: Corpus, take: str, solve: str | None = None) -> Scene:
    """Describe a take.

    Parameters
    ----------
    files
        Where what takes long to find is kept.
    corpus, take
        What to describe.
    solve
        Which weights; the take's current ones if left out.

    Returns
    -------
    The scene. Where nothing moves a face its ``problem`` says why, and how to mend it; tiers can be edited all the
    same.

    Raises
    ------
    NotFoundError
        If the take is not there, or the named solve.
    """
    facts = corpus.take_attributes(take)
    rate = float(facts["rate"])
    n_frames = int(corpus.take(take).sizes["time"])
    solves = corpus.solves(take)
    scene = Scene(
        take=take,
        signer=_text(facts.get("signer")),
        protocol=_text(facts.get("protocol")),
        simulated=bool(facts.get("simulated")),
        rate=rate,
        frames=n_frames,
        seconds=n_frames / rate,
        solve=None,
        solves=solves,
        rig=None,
        shapes=[],
        strongest=[],
        markers=[],
        curves=[],
        residual=Residual(threshold=None, stretches=[]),
        videos=list_videos(corpus, take, corpus_folder(corpus)),
        problem=None,
    )
    if solve is not None and solve not in solves:
        raise NotFoundError(f"take {take!r}: no solve {solve!r}; it has {', '.join(solves) or 'none'}")
    if solve is None and corpus.current_solve(take) is None:
        scene.problem = _explain_no_weights(corpus, take)
        return scene
    try:
        weights = open_weights(corpus, take, solve)
    except (NotFoundError, InputError) as error:  # its rig was removed, or is another
        scene.problem = Problem(message=str(error), command=None)
        return scene
    return scene.model_copy(update=_describe_weights(files, corpus, weights))


def corpus_folder(corpus: Corpus) -> Path | None:
    """Return the folder of a corpus, None where it is in S3."""
    return corpus.path if isinstance(corpus.path, Path) else None


def _describe_weights(files: MadeFiles, corpus: Corpus, weights: ShownWeights) -> dict[str, object]:
    markers = open_markers(corpus, weights)
    residual = weights.read_residual()
    if residual is None:
        residual = np.full(0, np.nan)
    threshold = find_threshold(residual)
    return {
        "solve": weights.solve,
        "rig": weights.rig,
        "shapes": list(weights.shapes),
        "strongest": find_strongest(files, weights),
        "markers": [] if markers is None else list(markers.names),
        "curves": [Curve(name=name, unit=CURVE_UNITS[name]) for name in list_curves(weights)],
        "residual": Residual(threshold=threshold, stretches=find_stretches(residual, threshold, weights.rate)),
    }


def _explain_no_weights(corpus: Corpus, take: str) -> Problem:
    place = shlex.quote(str(corpus.path))
    if not corpus.rigs():
        return Problem(
            message=f"take {take!r} has no weights yet, and the corpus no rig to solve them on",
            command=f"mimique rig add {place} NAME FILE",
        )
    return Problem(message=f"take {take!r} has no weights yet", command=f"mimique solve {place}")


def _text(value: object) -> str | None:
    return None if value is None else str(value)
