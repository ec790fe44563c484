"""Adaptation to the rig and weights, for all takes of a corpus (Reverdy 2019, 5.2.2, 5.2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ...corpus import Corpus
from ...corpus.provenance import describe_step
from ...corpus.view import CorpusView
from ...errors import InputError, NotFoundError, RigError
from ...synthesis import MorphMap, Rig, WeightPrior, WeightSolver, estimate_noise
from ...synthesis.alignment import align_points
from ...synthesis.marker_map import check_marker_map
from ...synthesis.marker_space import check_size
from ..progress import Reporter
from ..scratch import Scratch
from .stabilising import Session, choose_neutral, group_sessions, prepare_session, read_tracked, stabilise_take

DEFAULT_METHOD = "map"
PRIOR_PROTOCOL = "ROM"
"""Protocol code of range-of-motion takes, from which a signer's prior is learned where there are any."""

PRIOR_LEAST = 50
"""Fewest frames that a prior is learned from."""

PRIOR_SAMPLES = 2000
"""Frames that a signer's prior is learned from, spread evenly over the takes."""


@dataclass(frozen=True)
class SolveOptions:
    """What a person can choose of a solve.

    Parameters
    ----------
    rig
        Name; may be left out where there is one.
    marker_map
        Name of the rig's marker map.
    method
        See :class:`mimique.synthesis.WeightSolver`.
    alpha
        Share of the thin-shell energy; the method's default if left out.
    form
        Of the thin-shell energy, ``energy`` or ``residual``; the method's default if left out.
    kernel
        Of the morph map.
    name
        Of the solve; ``<rig>-<method>`` if left out.
    head_markers
        In place of those named at ingest.
    """

    rig: str | None = None
    marker_map: str = "default"
    method: str = DEFAULT_METHOD
    alpha: float | None = None
    form: str | None = None
    kernel: str = "triharmonic"
    name: str | None = None
    head_markers: tuple[str, ...] = ()

    def solve_name(self, rig: str) -> str:
        """Return the name that the solve is stored under."""
        return self.name or f"{rig}-{self.method}"

    def parameters(self) -> dict[str, Any]:
        """Return what the weights depend on."""
        return {
            "method": self.method,
            "alpha": self.alpha,
            "form": self.form,
            "kernel": self.kernel,
            "map": self.marker_map,
        }


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
            solver: _SessionSolver | None = None
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
                        solver = _SessionSolver(corpus, rig, table, session, options)
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
            assert arrays is not None
            weights = _put_results(edit, name, arrays, rig, rig_name, solve_name, provenance, attributes)
            rows.append(_row(name, "solved", weights))
        for name in unchanged:
            edit.set_current_solve(name, solve_name)
    scratch.clear()
    columns = ["take", "outcome", "frames", "unsolved", "residual"]
    return pd.DataFrame(rows, columns=columns).sort_values("take", ignore_index=True)


class _SessionSolver:
    """Solver and morph map of one signer's session on one rig."""

    def __init__(
        self, corpus: CorpusView, rig: Rig, table: pd.DataFrame, session: Session, options: SolveOptions
    ) -> None:
        self._corpus, self._session, self._options = corpus, session, options
        self.vertices = check_marker_map(rig, table, session.markers)
        self.mapped = [session.markers.index(str(name)) for name in table["marker"]]
        self._rest = rig.neutral[self.vertices]
        self._rig = rig
        self.learned_from: list[str] = []
        prior, noise = self._learn_prior() if options.method == "map" else (None, None)
        without_prior = options.method == "map" and prior is None
        self._solver = WeightSolver(
            rig,
            self.vertices,
            method="bounded" if without_prior else options.method,
            alpha=options.alpha,
            form=options.form,
            prior=prior,
            noise=noise,
        )

    def solve_take(self, name: str) -> dict[str, NDArray]:
        """Return everything that is stored of a take."""
        tracked = read_tracked(self._corpus, name, self._options.head_markers)
        calm = stabilise_take(tracked, self._session.reference, name)
        neutral, source = choose_neutral(tracked, calm, self._session, name)
        adapted = self._adapt(calm.positions, neutral, name)
        try:
            weights = self._solver.solve(adapted, rate=tracked.rate)
            residuals = self._solver.residuals(adapted, weights)
        except RigError as error:
            raise RigError(f"take {name!r}: {error}") from error
        return {
            "stabilised": calm.positions,
            "rotation": calm.rotation,
            "translation": calm.translation,
            "head_rmse": calm.rmse,
            "neutral": neutral,
            "neutral_source": np.asarray(source),
            "markers": np.asarray(tracked.markers),
            "adapted": adapted,
            "mapped": np.asarray([tracked.markers[i] for i in self.mapped]),
            "weights": weights,
            "residual": _root_mean_square(np.asarray(residuals)),
            "prior": np.asarray(", ".join(self.learned_from) or "none"),
        }

    def _adapt(self, calm: NDArray, neutral: NDArray, name: str) -> NDArray:
        """Bring stabilised markers to the rig: rigid alignment of the neutral, then the morph map (5.18-5.20)."""
        own = neutral[self.mapped]
        known = np.asarray(np.isfinite(own).all(axis=1))
        names = [self._session.markers[i] for i in self.mapped]
        try:
            check_size(own[known], self._rest[known])
            fit = align_points(own[known], self._rest[known])
            morph = MorphMap.fit(
                fit.apply(own[known]),
                self._rest[known],
                kernel=self._options.kernel,
                names=[n for n, seen in zip(names, known, strict=True) if seen],
            )
        except RigError as error:
            raise RigError(f"take {name!r}: {error}") from error
        adapted = morph(fit.apply(calm[:, self.mapped]))
        adapted[:, ~known] = np.nan  # without a neutral position nothing says how far such a marker has moved
        return adapted

    def _learn_prior(self) -> tuple[WeightPrior | None, float | None]:
        """Learn the signer's own prior, and the markers' noise in mm, from a first solve without a prior.

        It comes from the signer's range-of-motion takes, else from all of the signer's takes with these markers; where
        these show too little motion to learn from there is none.
        """
        takes = self._corpus.takes().set_index("take")
        own = [n for n in self._session.takes if takes.loc[n, "protocol"] == PRIOR_PROTOCOL] or list(
            self._session.takes
        )
        first = WeightSolver(self._rig, self.vertices, method="bounded")
        per_take = max(PRIOR_SAMPLES // len(own), 20)
        weights, residuals = [], []
        for name in own:
            tracked = read_tracked(self._corpus, name, self._options.head_markers)
            calm = stabilise_take(tracked, self._session.reference, name)
            neutral, _ = choose_neutral(tracked, calm, self._session, name)
            chosen = np.unique(np.linspace(0, len(calm.positions) - 1, per_take).round().astype(int))
            adapted = self._adapt(calm.positions[chosen], neutral, name)
            found = first.solve(adapted)
            solved = np.isfinite(found).all(axis=1)
            weights.append(found[solved])
            residuals.append(first.residuals(adapted[solved], found[solved]))
        every, left = np.concatenate(weights), np.concatenate(residuals)
        moves = len(every) >= PRIOR_LEAST and np.ptp(every, axis=0).any()
        if not moves or not np.nanmedian(left) > 0:
            return None, None
        self.learned_from = own
        return WeightPrior.fit(every), estimate_noise(left, self._rig.n_shapes)


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


def _root_mean_square(residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n_frames, n_markers) distances to (n_frames,), over the markers that are seen; NaN where none is."""
    seen = np.isfinite(residuals)
    count = seen.sum(axis=1)
    total = np.where(seen, residuals, 0.0) ** 2
    return np.where(count > 0, np.sqrt(total.sum(axis=1) / np.maximum(count, 1)), np.nan)
