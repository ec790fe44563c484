"""Adaptation to the rig and weights, for all takes of a corpus (Reverdy 2019, 5.2.2, 5.2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ...corpus import Corpus
from ...corpus.provenance import describe_step
from ...corpus.view import CorpusView
from ...errors import CorpusError, InputError, NotFoundError
from ...synthesis import Rig
from ..progress import Reporter
from ..scratch import Scratch
from .session_solver import SessionSolver, SolveOptions
from .stabilising import Session, group_sessions, prepare_session


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
        Names; all takes if left out.

    Returns
    -------
    DataFrame
        One row a take: ``take, outcome`` (solved, unchanged), ``frames, unsolved`` (frames without weights),
        ``residual`` (median over frames of the markers' root mean square distance, mm).

    Raises
    ------
    MimiqueError
        If a take, the rig or the map cannot be used; nothing is changed then.
    """
    reporter = reporter or Reporter()
    options = options or SolveOptions()
    rig_name = choose_rig(corpus, options.rig)
    rig = Rig.from_dataset(corpus.rig(rig_name))
    table = corpus.marker_map(rig_name, options.marker_map)
    everything = corpus.takes()["take"].tolist()
    if not everything:
        raise InputError("the corpus has no takes; ingest some first")
    wanted = set(everything if takes is None else takes)
    for name in wanted - set(everything):
        corpus.take(name)  # says which takes there are

    scratch = Scratch(corpus.path)
    solve_name = options.solve_name(rig_name)
    rows: list[dict[str, Any]] = []
    unchanged: list[str] = []
    pending: list[tuple[str, dict[str, Any], dict[str, Any]]] = []
    groups = [group for group in group_sessions(corpus, options.head_markers) if wanted & set(group)]
    with reporter.stage("Solving", len(wanted)) as finished:
        for group in groups:
            provenances = _describe_group(corpus, group, rig_name, options)
            session: Session | None = None
            solver: SessionSolver | None = None
            for name in (n for n in group if n in wanted):
                provenance = provenances[name]
                if corpus.is_done(provenance, name, "weights", solve_name):
                    rows.append(_row(name, "unchanged", corpus.weights(name, solve_name)))
                    unchanged.append(name)
                    finished(name)
                    continue
                if scratch.get(provenance["fingerprint"]) is None:
                    if session is None:
                        session = prepare_session(corpus, group, options.head_markers)
                        solver = SessionSolver(corpus, rig, table, session, options)
                    assert solver is not None
                    scratch.put(provenance["fingerprint"], solver.solve_take(name))
                pending.append((name, provenance, {"rig": rig_name, "method": options.method}))
                finished(name)

    what = f"{len(pending)} takes" if len(pending) != 1 else pending[0][0]
    message = f"Solve {what} on {rig_name} with {options.method}" if pending else f"Make {solve_name} the current solve"
    parameters = {"rig": rig_name, "solve": solve_name, **options.parameters()}
    with corpus.transaction(message, command="solve", parameters=parameters, author=author) as edit:
        for name, provenance, attributes in pending:
            arrays = scratch.get(provenance["fingerprint"])
            if arrays is None:
                raise CorpusError(
                    f"{scratch.folder}: finished takes vanished from it while they were written; run again"
                )
            weights = _put_results(edit, name, arrays, rig, rig_name, solve_name, provenance, attributes)
            rows.append(_row(name, "solved", weights))
        for name in unchanged:
            edit.set_current_solve(name, solve_name)
    scratch.drop(provenance["fingerprint"] for _, provenance, _ in pending)
    columns = ["take", "outcome", "frames", "unsolved", "residual"]
    return pd.DataFrame(rows, columns=columns).sort_values("take", ignore_index=True)


def _describe_group(
    corpus: CorpusView, group: Sequence[str], rig: str, options: SolveOptions
) -> dict[str, dict[str, Any]]:
    """Describe how each take of a group is solved; all of the signer's takes count, since they share the neutral."""
    recordings = {name: corpus.fingerprint(name) for name in group}
    facts = {name: corpus.take_attributes(name) for name in group}
    head = [list(options.head_markers or facts[name].get("head_markers") or ()) for name in group]
    protocols = {name: facts[name].get("protocol") for name in group} if options.method == "map" else {}
    shared = {"rig": corpus.fingerprint(None, "rig", rig)}
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


def _put_results(
    edit: Any,
    name: str,
    arrays: dict[str, NDArray],
    rig: Rig,
    rig_name: str,
    solve_name: str,
    provenance: dict[str, Any],
    attributes: dict[str, Any],
) -> xr.Dataset:
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
        {"rig": rig_name},
    )
    weights = xr.Dataset(
        {"weights": (("time", "shape"), arrays["weights"]), "residual": (("time",), arrays["residual"])},
        {"shape": list(rig.shapes)},
        {**attributes, "neutral": source, "prior": str(arrays["prior"])},
    )
    edit.put_processed(name, "stabilised", stabilised, provenance=provenance)
    edit.put_processed(name, f"adapted-{solve_name}", adapted, provenance=provenance)
    edit.put_weights(name, weights, solve=solve_name, provenance=provenance)
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
    }
