"""Who performs what on which face: the actors of a layout study, read from a corpus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError, MimiqueError, NotFoundError
from ...models.layouts import Actor
from ...synthesis import Rig
from .rig_weights import read_rig_weights
from .session_solver import PRIOR_PROTOCOL

SPLIT = 0.6
"""Share of a lone take that stands for the range of motion; the rest is tested on."""


@dataclass(frozen=True)
class Cast:
    """The actors of a study.

    Parameters
    ----------
    rig_name, base
        The rig on which weights are solved.
    training, unseen
        Actors.
    face_of
        Name of each signer's face, where it is one face.
    inputs
        Fingerprints of all that was read.
    notes
        What a reader should know.
    """

    rig_name: str
    base: Rig
    training: tuple[Actor, ...]
    unseen: tuple[Actor, ...]
    face_of: dict[str, Rig]
    inputs: dict[str, str]
    notes: tuple[str, ...]


@dataclass
class _Performances:
    """Weights on the base rig by signer and take, and which are ranges of motion."""

    by_signer: dict[str, dict[str, NDArray[np.float64]]] = field(default_factory=dict)
    protocols: dict[str, str | None] = field(default_factory=dict)
    rate: float = 30.0


def gather_cast(
    corpus: CorpusView,
    *,
    rig: str | None = None,
    faces: Sequence[str] | None = None,
    range_of_motion: Sequence[str] | None = None,
    unseen: Sequence[str] | None = None,
) -> Cast:
    """Read rigs and weights, and deal signers and faces into actors.

    One signer and several faces: every face performs all takes. Several signers and one face: each performs the own
    takes on it. Several of both: signers are dealt to faces in turn.

    Parameters
    ----------
    corpus
        With a rig, and takes with weights.
    rig
        The base rig; the corpus's first if left out.
    faces
        Rigs of the same mesh; all there are if left out.
    range_of_motion
        Takes; by default those of the protocol ``ROM``, else each signer's longest.
    unseen
        Actors (or their signers or faces) that nothing is learned from; the last third by default.

    Raises
    ------
    MimiqueError
        If there is no rig, no weights, a name is not known, or a named face has another mesh.
    """
    names = corpus.rigs()
    if not names:
        raise NotFoundError("the corpus has no rig yet; run: mimique rig add CORPUS NAME PATH")
    if rig is not None and rig not in names:
        raise NotFoundError(f"no rig {rig!r}; the corpus has {', '.join(names)}")
    rig_name = rig or names[0]
    base = Rig.from_dataset(corpus.rig(rig_name))
    inputs = {f"rig {rig_name}": corpus.fingerprint(None, "rig", rig_name)}
    notes: list[str] = []
    found = _read_faces(corpus, rig_name, base, faces, notes)
    inputs |= {f"rig {name}": corpus.fingerprint(None, "rig", name) for name in found}
    shown = _read_performances(corpus, rig_name, base, inputs, notes)
    cast: list[Actor] = []
    signers = list(shown.by_signer)
    face_names = list(found)
    pairs = [(s, f) for s in signers for f in face_names]
    if len(signers) > 1 and len(face_names) > 1:
        pairs = [(signer, face_names[k % len(face_names)]) for k, signer in enumerate(signers)]
        notes.append("signers were dealt to faces in turn: " + ", ".join(f"{s} on {f}" for s, f in pairs))
    for signer, face in pairs:
        name = face if len(signers) == 1 else signer if len(face_names) == 1 else f"{signer} on {face}"
        wanted = tuple(range_of_motion or ())
        rom, tests = _choose_range_of_motion(shown, signer, wanted, notes)
        cast.append(Actor(name, found[face], rom, tests, shown.rate))
    _refuse_unknown(range_of_motion, shown)
    apart = _choose_unseen(cast, pairs, unseen)
    return Cast(
        rig_name,
        base,
        tuple(a for a in cast if a.name not in apart),
        tuple(a for a in cast if a.name in apart),
        {s: found[f] for s, f in pairs if len(face_names) == 1 or len(signers) > 1},
        inputs,
        tuple(dict.fromkeys(notes)),
    )


def _read_faces(
    corpus: CorpusView, rig_name: str, base: Rig, wanted: Sequence[str] | None, notes: list[str]
) -> dict[str, Rig]:
    names = corpus.rigs()
    for name in wanted or ():
        if name not in names:
            raise NotFoundError(f"no rig {name!r} for a face; the corpus has {', '.join(names)}")
    found = {}
    for name in dict.fromkeys(wanted or names):
        face = base if name == rig_name else Rig.from_dataset(corpus.rig(name))
        if not np.array_equal(face.triangles, base.triangles) or face.n_vertices != base.n_vertices:
            problem = (
                f"face {name!r}: its mesh ({face.n_vertices} vertices) is not that of the rig {rig_name!r} "
                f"({base.n_vertices} vertices)"
            )
        elif face.shapes != base.shapes:
            problem = f"face {name!r}: its shapes are not those of the rig {rig_name!r}"
        else:
            found[name] = face
            continue
        if wanted:
            raise InputError(f"{problem}; name faces of the same mesh and shapes only")
        notes.append(f"{problem}, so it was left out")
    if wanted is None and len(found) > 2:
        found.pop(rig_name)
        notes.append(
            f"the rig {rig_name!r} is what faces are solved on, and no face itself; name it with --face to add it"
        )
    return found


def _read_performances(
    corpus: CorpusView, rig_name: str, base: Rig, inputs: dict[str, str], notes: list[str]
) -> _Performances:
    shown = _Performances()
    rates: dict[float, list[str]] = {}
    for row in corpus.takes().itertuples():
        take = str(row.take)
        solve = corpus.current_solve(take)
        if solve is None:
            continue
        try:
            weights = read_rig_weights(corpus, take, rig=rig_name)
        except MimiqueError as error:
            notes.append(f"take {take} was left out: {error}")
            continue
        whole = weights.weights[np.isfinite(weights.weights).all(axis=1)]
        if len(whole) < 2:
            notes.append(f"take {take} was left out: it has no two frames with weights")
            continue
        if len(whole) < len(weights.weights):
            notes.append(f"take {take}: {len(weights.weights) - len(whole)} frames without weights were left out")
        signer = str(row.signer) if isinstance(row.signer, str) else "nobody"
        shown.by_signer.setdefault(signer, {})[take] = whole
        shown.protocols[take] = row.protocol if isinstance(row.protocol, str) else None
        rates.setdefault(weights.rate, []).append(take)
        inputs[f"weights {take}"] = corpus.fingerprint(take, "weights", solve)
    if not shown.by_signer:
        why = f" ({notes[-1]})" if notes else ""
        raise InputError(
            f"the corpus has no take with weights for the rig {rig_name!r}{why}; solve takes, or ingest weights"
        )
    shown.rate = max(rates, key=lambda rate: len(rates[rate]))
    return shown


def _choose_range_of_motion(
    shown: _Performances, signer: str, wanted: Sequence[str], notes: list[str]
) -> tuple[NDArray[Any], dict[str, NDArray[np.float64]]]:
    takes = shown.by_signer[signer]
    chosen = [t for t in takes if t in wanted] or [t for t in takes if shown.protocols[t] == PRIOR_PROTOCOL]
    if not chosen:
        chosen = [max(takes, key=lambda t: len(takes[t]))]
        if len(takes) > 1:
            notes.append(f"{signer}: no range-of-motion take is known, so the longest, {chosen[0]}, stands for it")
    rom = np.concatenate([takes[t] for t in chosen])
    tests = {t: w for t, w in takes.items() if t not in chosen}
    if not tests:
        cut = max(2, int(SPLIT * len(rom)))
        if len(rom) - cut < 2:
            raise InputError(f"signer {signer}: expected a take beside the range of motion, or a longer one")
        notes.append(
            f"{signer}: there is no take beside {', '.join(chosen)}; its first {SPLIT:.0%} stand for the range of "
            "motion, the rest is tested on"
        )
        rom, tests = rom[:cut], {f"{chosen[-1]}, end": rom[cut:]}
    return rom, tests


def _refuse_unknown(range_of_motion: Sequence[str] | None, shown: _Performances) -> None:
    for take in range_of_motion or ():
        if take not in shown.protocols:
            raise InputError(
                f"range of motion: no take {take!r} with weights; there are {', '.join(sorted(shown.protocols)[:12])}"
            )


def _choose_unseen(
    cast: Sequence[Actor], pairs: Sequence[tuple[str, str]], wanted: Sequence[str] | None
) -> frozenset[str]:
    """Return the names of the actors that nothing is learned from."""
    if wanted is None:
        count = max(1, len(cast) // 3) if len(cast) > 1 else 0
        return frozenset(actor.name for actor in cast[len(cast) - count :])
    apart: set[str] = set()
    for name in wanted:
        mine = {a.name for a, pair in zip(cast, pairs, strict=True) if name in (a.name, *pair)}
        if not mine:
            raise InputError(f"unseen: expected some of {', '.join(a.name for a in cast)}, but got {name!r}")
        apart |= mine
    if len(apart) == len(cast):
        raise InputError("unseen: expected at least one actor to be left to learn from, but all are named")
    return frozenset(apart)
