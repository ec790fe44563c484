"""Adaptation to the rig and weights, for all takes of a corpus (Reverdy 2019, 5.2.2, 5.2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ...corpus import Corpus
from ...corpus.store.provenance import describe_step
from ...corpus.store.transaction import Transaction
from ...corpus.store.view import CorpusView
from ...errors import CorpusError, InputError, NotFoundError
from ...synthesis import Rig
from ...synthesis.diagnosis import find_conspicuous_frames
from ..progress import Reporter, Step
from ..scratch import Scratch
from .session_solver import SessionSolver, SolveOptions
from .stabilising import fingerprint_tracked, group_sessions, prepare_session

PER_FRAME = ("residual", "cardinality", "roughness", "bound_violation")
"""What is stored of every frame beside its weights; see :mod:`mimique.synthesis.diagnosis`."""


def choose_rig(corpus: CorpusView, name: str | None) -> str:
    """Return the name of the rig to use.

    Raises
    ------
    NotFoundError
        If there is none, or none of that name.
    InputError
        If there are several and none is named.
    """
    names = corpus.rigs()
    if name is not None and name in names:
        return name
    if not names:
        raise NotFoundError(
            "the corpus has no rig; add one with: mimique rig add CORPUS NAME PATH --unit cm --markers MAP.csv"
        )
    if name is not None:
        raise NotFoundError(f"no rig {name!r}; the corpus has {', '.join(names)}")
    if len(names) > 1:
        raise InputError(f"the corpus has several rigs; choose one with --rig: {', '.join(names)}")
    return names[0]


def solve(
    corpus: Corpus,
    options: SolveOptions | None = None,
    *,
    takes: Sequence[str] | None = None,
    author: str | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Stabilise, adapt and solve takes, in one commit.

    Takes whose recording, neighbours, rig and parameters are unchanged are skipped. What an interrupted run has
    finished is used again.

    Parameters
    ----------
    corpus
        The corpus.
    options
        Method and parameters.
    takes
        Names; all takes that have markers if left out.

    Returns
    -------
    DataFrame
        One row a take: ``take, outcome`` (solved, unchanged), ``frames, unsolved`` (frames without weights),
        ``residual`` (median over frames of the markers' root mean square distance, mm), ``conspicuous`` (frames with a
        residual that stands out from the take's own).

    Raises
    ------
    MimiqueError
        If a take, the rig or the map cannot be used; nothing is changed then.
    """
    reporter = reporter or Reporter()
    options = options or SolveOptions()
    rig_name = choose_rig(corpus, options.rig)
    rig = Rig.from_dataset(corpus.rig(rig_name))
    listed = corpus.takes()
    everything = listed[listed["markers"] > 0]["take"].tolist()
    if not everything:
        what = "takes with markers" if len(listed) else "takes"
        raise InputError(f"the corpus has no {what}; ingest some first")
    wanted = set(everything if takes is None else takes)
    for name in sorted(wanted - set(everything)):
        corpus.take(name)  # says which takes there are
        raise InputError(f"take {name!r}: it has no markers to solve, only weights that came from elsewhere")

    plan = _Plan(options.solve_name(rig_name), rig_name, rig, options, Scratch(corpus.path))
    groups = [group for group in group_sessions(corpus, options.head_markers) if wanted & set(group)]
    with reporter.stage("Solving", len(wanted)) as finished:
        for group in groups:
            _solve_group(corpus, plan, group, wanted, finished)
    with corpus.transaction(
        plan.message(), command="solve", parameters={"rig": rig_name, **options.parameters()}, author=author
    ) as edit:
        rows = [_row(name, "solved", _put_results(edit, plan, name)) for name in plan.pending]
        for name in plan.unchanged:
            edit.set_current_solve(name, plan.solve)
            rows.append(_row(name, "unchanged", edit.weights(name, plan.solve)))
    plan.scratch.drop(provenance["fingerprint"] for provenance in plan.pending.values())
    columns = ["take", "outcome", "frames", "unsolved", "residual", "conspicuous"]
    return pd.DataFrame(rows, columns=columns).sort_values("take", ignore_index=True)


@dataclass
class _Plan:
    """What one run does: the takes to write, with where their weights come from, and those that stay as they are."""

    solve: str
    rig_name: str
    rig: Rig
    options: SolveOptions
    scratch: Scratch
    pending: dict[str, dict[str, Any]] = field(default_factory=dict)
    unchanged: list[str] = field(default_factory=list)

    def message(self) -> str:
        """Say what the commit does."""
        if not self.pending:
            return f"Make {self.solve} the current solve"
        what = f"{len(self.pending)} takes" if len(self.pending) > 1 else next(iter(self.pending))
        return f"Solve {what} on {self.rig_name} with {self.options.method}"


def _solve_group(corpus: CorpusView, plan: _Plan, group: Sequence[str], wanted: set[str], finished: Step) -> None:
    """Solve the wanted takes of a signer's session into the scratch folder; the session is prepared if any needs it."""
    solver: SessionSolver | None = None
    provenances = _describe_group(corpus, group, plan.rig_name, plan.options)
    for name in (n for n in group if n in wanted):
        provenance = provenances[name]
        if corpus.is_done(provenance, name, "weights", plan.solve):
            plan.unchanged.append(name)
        else:
            if plan.scratch.get(provenance["fingerprint"]) is None:
                solver = solver or _make_solver(corpus, plan, group)
                plan.scratch.put(provenance["fingerprint"], solver.solve_take(name))
            plan.pending[name] = provenance
        finished(name)


def _make_solver(corpus: CorpusView, plan: _Plan, group: Sequence[str]) -> SessionSolver:
    session = prepare_session(corpus, group, plan.options.head_markers)
    table = corpus.marker_map(plan.rig_name, plan.options.marker_map)
    return SessionSolver(corpus, plan.rig, table, session, plan.options)


def _describe_group(
    corpus: CorpusView, group: Sequence[str], rig: str, options: SolveOptions
) -> dict[str, dict[str, Any]]:
    """Describe how each take of a group is solved; all of the signer's takes count, since they share the neutral."""
    recordings = {name: fingerprint_tracked(corpus, name) for name in group}
    facts = {name: corpus.take_attributes(name) for name in group}
    head = [list(options.head_markers or facts[name].get("head_markers") or ()) for name in group]
    learns = options.method == "map" and options.prior is None
    protocols = {name: facts[name].get("protocol") for name in group} if learns else {}
    shared = {"rig": corpus.fingerprint(None, "rig", rig)}
    if options.prior is not None:
        shared["prior"] = corpus.fingerprint(None, "prior", options.prior)
    table = corpus.marker_map(rig, options.marker_map)
    parameters = {
        **options.parameters(),
        "marker_map": dict(zip(table["marker"].tolist(), table["vertex"].tolist(), strict=True)),
        "head_markers": head[0],
        "protocols": protocols,
        "session": recordings,
    }
    return {
        name: describe_step(
            "solve",
            inputs={"take": recordings[name], **shared},
            parameters={**parameters, "neutral_frame": facts[name].get("neutral_frame")},
        )
        for name in group
    }


def _put_results(edit: Transaction, plan: _Plan, name: str) -> xr.Dataset:
    """Store all that a solve gave for a take; return the weights."""
    provenance = plan.pending[name]
    arrays = plan.scratch.get(provenance["fingerprint"])
    if arrays is None:
        raise CorpusError(f"{plan.scratch.folder}: finished takes vanished while they were written; run again")
    space = ["x", "y", "z"]
    source = str(arrays["neutral_source"])
    stabilised = xr.Dataset(
        {
            "position": (("time", "marker", "space"), arrays["stabilised"]),
            "neutral": (("marker", "space"), arrays["neutral"]),
            "head_rotation": (("time", "row", "column"), arrays["rotation"]),
            "head_translation": (("time", "space"), arrays["translation"]),
            "head_rmse": (("time",), arrays["head_rmse"]),
        },
        {"marker": [str(m) for m in arrays["markers"]], "space": space},
        {"neutral": source},
    )
    adapted = xr.Dataset(
        {"position": (("time", "marker", "space"), arrays["adapted"])},
        {"marker": [str(m) for m in arrays["mapped"]], "space": space},
        {"rig": plan.rig_name},
    )
    weights = xr.Dataset(
        {
            "weights": (("time", "shape"), arrays["weights"]),
            **{name: (("time",), arrays[name]) for name in PER_FRAME},
        },
        {"shape": list(plan.rig.shapes)},
        {"rig": plan.rig_name, "method": str(arrays["method"]), "neutral": source, "prior": str(arrays["prior"])},
    )
    edit.put_processed(name, "stabilised", stabilised, provenance=provenance)
    edit.put_processed(name, f"adapted-{plan.solve}", adapted, provenance=provenance)
    edit.put_weights(name, weights, solve=plan.solve, provenance=provenance)
    return weights


def _row(name: str, outcome: str, weights: xr.Dataset) -> dict[str, Any]:
    residual = np.asarray(weights["residual"].values)
    solved = np.isfinite(weights["weights"].values).all(axis=1)
    return {
        "take": name,
        "outcome": outcome,
        "frames": len(residual),
        "unsolved": int((~solved).sum()),
        "residual": float(np.median(residual[solved])) if solved.any() else np.nan,
        "conspicuous": int(find_conspicuous_frames(residual).sum()),
    }
