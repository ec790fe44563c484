"""Deriving again what a corpus holds, to see that the same comes out, bit for bit.

Nothing is written: a result goes into a store in memory, in the form in which the corpus would keep it, and the
fingerprints are compared. Inputs are those that were recorded; where the corpus shows others by now, the snapshot that
the result was written in is read, or the one that this began from.
"""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable
from typing import Any

import pandas as pd
from numpy.typing import NDArray
from zarr.storage import MemoryStore

from ... import __version__
from ...corpus import Corpus
from ...corpus.checks.node_history import NodeHistory
from ...corpus.store.layout import decode_name, processed_path, take_path, weights_path
from ...corpus.store.location import Location
from ...corpus.store.nodes import copy_node, list_children, read_attributes, write_group
from ...corpus.store.tables import complete_table, fingerprint_table
from ...corpus.store.transaction import Transaction
from ...corpus.take import select_markers
from ...errors import MimiqueError, NotFoundError
from ...models import LabelledTake
from ...models.labellers.networks import NETWORKS
from ...synthesis import Rig
from ..scratch import Scratch
from .labelled_takes import AFFECT_TIER, read_labelled_takes
from .labelling import label_take
from .repairing import _to_dataset, apply_operations
from .segmenting import MACHINE, SEGMENT_TIER, segment_again
from .session_solver import SessionSolver, SolveOptions
from .solving import _describe_group, _make_solver, _Plan, _put_results
from .stabilising import REPAIRED, group_sessions
from .training import ACROSS, ALL, OWN, find_inputs, learn, load_model

NOT_COMPARED = ("id", "revision")
"""Columns of a tier that differ from run to run: ids are random."""

NO_INPUTS = "not derived again: no version at hand has all that it was derived from"

Outcome = tuple[str, str] | None
"""Severity and text; None where the same came out."""

CHOICES = ("method", "alpha", "form", "kernel", "ridge", "smoothness", "prior")
"""Parameters of a solve that a person chose."""


class Regenerator:
    """Derives units of a corpus again; call it with a unit's path.

    Parameters
    ----------
    corpus
        At the version whose units are derived again.
    """

    def __init__(self, corpus: Corpus) -> None:
        self._corpus = corpus
        self._history = NodeHistory(corpus._repository, corpus.snapshot)
        self._solved: dict[tuple[str, str], dict[str, str]] = {}
        self._solvers: dict[tuple[str, str | None, tuple[str, ...]], SessionSolver] = {}
        self._recipes: dict[str, Callable[[str, dict[str, Any]], Outcome]] = {
            "solve": self._compare_solve,
            "segment": self._compare_segments,
            "label": self._compare_labels,
            "repair": self._compare_repair,
            **dict.fromkeys((OWN, ACROSS, ALL), self._compare_model),
        }

    def __call__(self, unit: str) -> Outcome:
        """Derive a unit again and compare; None where the same came out.

        A difference is a problem where the version of mimique is the same, else a note.
        """
        provenance = self._facts(unit)["provenance"]
        recipe = self._recipes.get(str(provenance.get("step")))
        if recipe is None:
            return "note", f"not derived again: nothing here knows how to {provenance.get('step')!r}"
        outcome = recipe(unit, provenance)
        made_by = provenance.get("code")
        if outcome is not None and outcome[0] == "problem" and made_by != __version__:
            return "note", f"{outcome[1]} (made by mimique {made_by}, this is {__version__})"
        return outcome

    def _facts(self, unit: str) -> dict[str, Any]:
        facts = read_attributes(self._corpus._store, unit)
        if facts is None:
            raise NotFoundError(f"{unit}: it is not there")
        return facts

    def _versions(self, unit: str) -> list[Corpus]:
        """Return the corpus as shown, as it was when the unit was written, and as it was when that began."""
        written = self._history.written(unit)
        names = [] if written is None else [written.commit.snapshot]
        if written is not None:
            base = self._corpus.describe(at=written.commit.snapshot).get("base")
            names += [str(base)] if base else []
        versions = [self._corpus]
        for name in names:
            try:
                versions.append(Corpus.open(self._corpus.path, at=name))
            except MimiqueError:  # the base of a commit that was made again is not always there
                continue
        return versions

    def _compare_solve(self, unit: str, provenance: dict[str, Any]) -> Outcome:
        take = decode_name(unit.split("/")[1])
        key = (take, str(provenance["fingerprint"]))
        if key not in self._solved:
            self._solved[key] = self._solve(unit, take, provenance)
        again = self._solved[key]
        if not again:
            return "note", NO_INPUTS
        return _judge(again.get(unit), self._facts(unit)["fingerprint"])

    def _solve(self, unit: str, take: str, provenance: dict[str, Any]) -> dict[str, str]:
        """Solve a take again; return the fingerprint of every unit that this gives, none if its inputs are gone."""
        versions = self._versions(unit)
        names = [_find_solve(version, take, str(provenance["fingerprint"])) for version in versions]
        solve = next((name for name in names if name is not None), None)
        for version in versions if solve is not None else ():
            found = self._find_run(version, take, solve, provenance)
            if found is None:
                continue
            plan, group, described = found
            key = (version.snapshot, solve, tuple(group))
            if key not in self._solvers:
                self._solvers[key] = _make_solver(version, plan, group)
            plan.scratch.put(described["fingerprint"], self._solvers[key].solve_take(take))
            plan.pending[take] = described
            edit = _rehearse(version, take)
            _put_results(edit, plan, take)
            written = [("processed", step) for step in edit.steps(take)] + [("weights", plan.solve)]
            return {_path(take, kind, name): edit.fingerprint(take, kind, name) for kind, name in written}
        return {}

    def _find_run(
        self, version: Corpus, take: str, solve: str | None, provenance: dict[str, Any]
    ) -> tuple[_Plan, list[str], dict[str, Any]] | None:
        """Return the run that would do in this version what was recorded, if there is one."""
        parameters = provenance["parameters"]
        for rig_name in version.rigs():
            if not version.has_take(take) or parameters["map"] not in version.marker_maps(rig_name):
                continue
            choices = {key: value for key, value in parameters.items() if key in CHOICES}
            head = tuple(parameters["head_markers"])
            named = tuple(version.take_attributes(take).get("head_markers") or ())
            options = SolveOptions(
                rig=rig_name,
                marker_map=parameters["map"],
                name=solve,
                head_markers=() if head == named else head,
                **choices,
            )
            group = next(group for group in group_sessions(version, options.head_markers) if take in group)
            described = _describe_group(version, group, rig_name, options)[take]
            if _essence(described) == _essence(provenance):
                rig = Rig.from_dataset(version.rig(rig_name))
                return _Plan(str(solve), rig_name, rig, options, _InMemory(version.path)), group, described
        return None

    def _compare_segments(self, unit: str, provenance: dict[str, Any]) -> Outcome:
        take, parameters = decode_name(unit.split("/")[1]), provenance["parameters"]
        solve = str(parameters["solve"])
        for version in self._versions(unit):
            if _holds(version, take, "weights", solve, None, provenance["inputs"]["weights"]):
                return self._judge_tier(unit, segment_again(version, take, parameters))
        return "note", NO_INPUTS

    def _compare_labels(self, unit: str, provenance: dict[str, Any]) -> Outcome:
        take, parameters, inputs = decode_name(unit.split("/")[1]), provenance["parameters"], provenance["inputs"]
        solve, model = str(parameters["solve"]), str(parameters["model"])
        for version in self._versions(unit):
            if (
                _holds(version, take, "weights", solve, None, inputs["weights"])
                and version.current_solve(take) == solve
                and (
                    "segments" not in inputs or _holds(version, take, "tier", SEGMENT_TIER, MACHINE, inputs["segments"])
                )
                and _holds(version, None, "model", model, None, inputs["model"])
            ):
                return self._judge_tier(unit, label_take(version, take, load_model(version, model)[0]))
        return "note", NO_INPUTS

    def _compare_repair(self, unit: str, provenance: dict[str, Any]) -> Outcome:
        take = decode_name(unit.split("/")[1])
        for version in self._versions(unit):
            if _holds(version, take, "take", None, None, provenance["inputs"]["take"]):
                recorded = select_markers(version.take(take))
                markers = [str(name) for name in recorded["marker"].values]
                rate = float(recorded.attrs["rate"])
                position = recorded["position"].transpose("time", "marker", "space").values
                repaired = apply_operations(position, markers, rate, provenance["parameters"]["operations"])
                edit = _rehearse(version, take)
                edit.put_processed(take, REPAIRED, _to_dataset(repaired, markers, rate))
                return _judge(edit.fingerprint(take, "processed", REPAIRED), self._facts(unit)["fingerprint"])
        return "note", NO_INPUTS

    def _compare_model(self, unit: str, provenance: dict[str, Any]) -> Outcome:
        facts, name = self._facts(unit), decode_name(unit.split("/")[1])
        metadata, parameters = facts["metadata"], provenance["parameters"]
        whose = str(parameters["annotator"])
        kinds = {
            key.partition(" of ")[0] for key in provenance["inputs"]
        }  # older models were not calibrated on segments
        for version in self._versions(unit):
            takes = self._read_taught(version, metadata["takes"], whose, parameters["protocols"])
            if takes is None:
                continue
            inputs = {k: v for k, v in find_inputs(version, takes, whose).items() if k.partition(" of ")[0] in kinds}
            if inputs != provenance["inputs"]:
                continue
            model, _ = learn(
                version,
                takes,
                parameters["classifier"],
                parameters["seed"],
                str(metadata.get("signer") or metadata.get("held_out_signer") or "all"),
                calibrated=bool(parameters.get("calibrated")),
            )
            edit = _rehearse(version, None)
            edit.put_model(name, model.to_arrays()[0], {})
            outcome = _judge(edit.fingerprint(None, "model", name), facts["fingerprint"])
            if outcome is not None and (elsewhere := _say_elsewhere(metadata)):
                return "note", f"{outcome[1]}, as it may: it was made {elsewhere}"
            return outcome
        return "note", NO_INPUTS

    def _read_taught(
        self, version: Corpus, names: list[str], whose: str, protocols: list[str]
    ) -> list[LabelledTake] | None:
        """Return the takes that a model was learned from, in order; None where this version has not all of them."""
        for take in names:
            current = version.current_solve(take) if version.has_take(take) else None
            if current is None:
                return None
            listed = version.tiers(take)
            if not ((listed["tier"] == AFFECT_TIER) & (listed["author"] == whose)).any():
                return None
        takes = read_labelled_takes(version, whose, protocols=tuple(protocols))
        chosen = [take for take in takes if take.name in set(names)]
        return chosen if [take.name for take in chosen] == list(names) else None

    def _judge_tier(self, unit: str, table: pd.DataFrame) -> Outcome:
        take, author, tier = (decode_name(unit.split("/")[place]) for place in (1, 3, 4))
        stored = self._corpus.tier(take, tier, author)
        again = complete_table(table, where=unit)
        differing = [column for column in stored.columns if column not in NOT_COMPARED]
        if list(again.columns) != list(stored.columns):
            return "problem", "derived again it has other columns"
        return _judge(fingerprint_table(again[differing]), fingerprint_table(stored[differing]))


class _InMemory(Scratch):
    """Finished takes, kept in memory only."""

    def __init__(self, corpus: Location) -> None:
        self._kept: dict[str, dict[str, NDArray]] = {}

    def get(self, fingerprint: str) -> dict[str, NDArray] | None:
        return self._kept.get(fingerprint)

    def put(self, fingerprint: str, arrays: dict[str, NDArray]) -> None:
        self._kept[fingerprint] = arrays


def _rehearse(version: Corpus, take: str | None) -> Transaction:
    """Return an edit whose changes go to memory; it holds the recording of a take, so that steps can be put."""
    store = MemoryStore()
    write_group(store, "", {})
    if take is not None:
        group = take_path(take)
        facts = read_attributes(version._store, group) or {}
        write_group(store, group, {key: value for key, value in facts.items() if key != "solve"})
        for child in list_children(version._store, group):
            if child.partition(".")[0] == "markers":
                copy_node(version._store, store, f"{group}/{child}")
    return Transaction(store)


def _find_solve(version: Corpus, take: str, fingerprint: str) -> str | None:
    """Return the solve of a take that was made in a certain way."""
    if not version.has_take(take):
        return None
    made = {name: version.provenance(take, "weights", name).get("fingerprint") for name in version.solves(take)}
    return next((name for name, how in made.items() if how == fingerprint), None)


def _holds(version: Corpus, take: str | None, kind: str, name: str | None, author: str | None, wanted: str) -> bool:
    try:
        return version.fingerprint(take, kind, name, author) == wanted
    except NotFoundError:
        return False


def _essence(description: dict[str, Any]) -> dict[str, Any]:
    """Return what a step depends on, without the version of the code."""
    return {key: description.get(key) for key in ("step", "inputs", "parameters")}


def _say_elsewhere(metadata: dict[str, Any]) -> str:
    """Return where a network was trained, if not with what is here: rounding differs, and the training follows it."""
    if metadata.get("classifier") not in NETWORKS:
        return ""
    made, here = metadata.get("versions", {}).get("torch"), importlib.metadata.version("torch")
    if metadata.get("device", "cpu") != "cpu":
        return f"on the device {metadata['device']}, and is derived on the CPU"
    return "" if made == here else f"with PyTorch {made}, and this is {here}"


def _judge(again: str | None, stored: str) -> Outcome:
    return None if again == stored else ("problem", "derived again it comes out differently")


def _path(take: str, kind: str, name: str) -> str:
    return processed_path(take, name) if kind == "processed" else weights_path(take, name)
