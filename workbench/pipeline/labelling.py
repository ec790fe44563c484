"""Labels of models for takes: for segments cut before (Reverdy 2019, 4.4.3), or found by a labeller in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ...corpus import Corpus
from ...corpus.annotations.vocabulary import Transition, format_label
from ...corpus.store.provenance import describe_step
from ...corpus.store.view import CorpusView
from ...errors import InputError, NotFoundError
from ...models.stored_models import StoredModel
from ..progress import Reporter
from .labelled_takes import AFFECT_TIER
from .segmenting import MACHINE, SEGMENT_TIER, read_segments
from .shape_weights import read_shape_weights
from .training import check_vocabulary, load_model


def label(
    corpus: Corpus,
    *,
    model: str | None = None,
    takes: Sequence[str] | None = None,
    author: str | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Label takes by a model and store the segments as its own tier ``affect``, in one commit.

    The tier's author is the model's name, its origin ``model``, its status ``proposed``: a person's tier is never
    touched. Neighbours with the same label become one segment.

    Parameters
    ----------
    corpus
        With weights and models; models that name segments need those too (a labeller in time finds its own).
    model
        Name; each signer's own model if left out, else the one that learned from all signers but this one, else the one
        that learned from all.
    takes
        Names; all takes that have what their model needs if left out.

    Returns
    -------
    DataFrame
        One row a take: ``take, model, outcome`` (labelled, unchanged), ``segments, transitions, confidence`` (mean).

    Raises
    ------
    MimiqueError
        If a model, weights or segments are missing, several models would do, or a model was trained with other shapes,
        another vocabulary or (labellers in time) another rate; nothing is changed then.
    """
    reporter = reporter or Reporter()
    models = {model: corpus.model_metadata(model)} if model else {n: corpus.model_metadata(n) for n in corpus.models()}
    chosen = _choose_models(corpus, models, takes, model)
    solves = {name: corpus.current_solve(name) for name in chosen}
    fingerprints = {used: corpus.fingerprint(None, "model", used) for used in set(chosen.values())}
    fitted: dict[str, StoredModel] = {}
    rows: list[dict[str, Any]] = []
    what = f"{len(chosen)} takes" if len(chosen) > 1 else next(iter(chosen))
    message = f"Label {what} with {model or 'the models of their signers'}"
    with corpus.transaction(message, command="label", parameters={"model": model}, author=author) as edit:
        with reporter.stage("Labelling", len(chosen)) as finished:
            for name, used in chosen.items():
                inputs = {"weights": corpus.fingerprint(name, "weights", solves[name])}
                if needs_segments(models[used]):
                    inputs["segments"] = corpus.fingerprint(name, "tier", SEGMENT_TIER, MACHINE)
                inputs["model"] = fingerprints[used]
                provenance = describe_step("label", inputs=inputs, parameters={"model": used, "solve": solves[name]})
                outcome = "unchanged"
                if corpus.is_done(provenance, name, "tier", AFFECT_TIER, used):
                    table = corpus.tier(name, AFFECT_TIER, author=used)
                else:
                    if used not in fitted:
                        check_vocabulary(corpus, used, models[used])
                        fitted[used], _ = load_model(corpus, used)
                    table = label_take(corpus, name, fitted[used])
                    edit.put_tier(name, AFFECT_TIER, table, author=used, provenance=provenance)
                    outcome = "labelled"
                rows.append(
                    {
                        "take": name,
                        "model": used,
                        "outcome": outcome,
                        "segments": int((table["from_label"] == table["to_label"]).sum()),
                        "transitions": int((table["from_label"] != table["to_label"]).sum()),
                        "confidence": float(table["confidence"].mean()),
                    }
                )
                finished(name)
    return pd.DataFrame(rows).sort_values("take", ignore_index=True)


def needs_segments(metadata: Mapping[str, Any]) -> bool:
    """Whether a stored model names segments that were cut before, rather than find them itself."""
    return "labeller" not in metadata


def _choose_models(
    corpus: Corpus, models: Mapping[str, dict[str, Any]], takes: Sequence[str] | None, model: str | None
) -> dict[str, str]:
    """Return the model of each take to label; takes that lack what their model needs are left out unless named."""
    table = corpus.takes().set_index("take")
    names = table.index.tolist() if takes is None else list(takes)
    strangers = sorted(set(names) - set(table.index))
    if strangers:
        corpus.take_attributes(strangers[0])  # says which takes there are
    by_signer = {} if model else _models_by_signer(models)
    chosen: dict[str, str] = {}
    lacking: dict[str, str] = {}
    unserved: list[str] = []
    for name in names:
        signer = str(table.loc[name, "signer"])
        if model is None and takes is None and signer not in by_signer and None not in by_signer:
            unserved.append(name)
            continue
        used = model or _choose_model(by_signer, name, signer)
        if not needs_segments(models[used]):
            lack = "" if corpus.current_solve(name) else "solve"
        else:
            lack = "" if has_segments(corpus, name) else "segment"
        if lack:
            lacking[name] = lack
        else:
            chosen[name] = used
    segmented = [name for name in unserved if has_segments(corpus, name)]
    if segmented:  # a take that is ready and that no model serves is told, not passed over
        _choose_model(by_signer, segmented[0], str(table.loc[segmented[0], "signer"]))
    if takes is not None and lacking:
        name = min(lacking)
        what = "segments" if lacking[name] == "segment" else "weights"
        raise NotFoundError(f"take {name!r}: it has no {what} yet; run: mimique {lacking[name]} CORPUS --take {name}")
    if not chosen:
        lack = "solve" if set(lacking.values()) == {"solve"} else "segment"
        what = "segments" if lack == "segment" else "weights"
        raise NotFoundError(f"no take has {what} yet; run: mimique {lack} CORPUS")
    return chosen


def has_segments(corpus: CorpusView, take: str) -> bool:
    """Whether a take was cut by its motion."""
    listed = corpus.tiers(take)
    return bool(((listed["tier"] == SEGMENT_TIER) & (listed["author"] == MACHINE)).any())


def _models_by_signer(models: Mapping[str, dict[str, Any]]) -> dict[str | None, list[str]]:
    """Return the models of each signer: their own, else those that held them out; under None those of all signers."""
    own: dict[str | None, list[str]] = {}
    others: dict[str | None, list[str]] = {}
    for name, facts in models.items():
        if facts.get("signer"):
            own.setdefault(str(facts["signer"]), []).append(name)
        elif facts.get("held_out_signer"):
            others.setdefault(str(facts["held_out_signer"]), []).append(name)
        elif facts.get("signers"):
            others.setdefault(None, []).append(name)
    return {**others, **own}


def _choose_model(by_signer: dict[str | None, list[str]], take: str, signer: str) -> str:
    names = by_signer.get(signer) or by_signer.get(None, [])
    if not names:
        raise NotFoundError(f"take {take!r}: no model of signer {signer}; train one, or choose one with --model")
    if len(names) > 1:
        raise InputError(
            f"take {take!r}: several models of signer {signer}: choose one of {', '.join(names)} with --model"
        )
    return names[0]


def label_take(corpus: CorpusView, name: str, model: StoredModel) -> pd.DataFrame:
    """Return the tier that a model gives a take.

    Raises
    ------
    MimiqueError
        If the take's weights are of other shapes or another rate than the model knows, or all NaN, or the segments that
        the model needs are not there.
    """
    weights = read_shape_weights(corpus, name)
    try:
        model.check_fit([str(s) for s in weights["shape"].values], float(weights.attrs["rate"]))
    except InputError as error:
        raise InputError(f"take {name!r}: {error}; train again on this solve, or solve on the model's rig") from error
    values = weights["weights"].values
    if not np.isfinite(values).all(axis=1).any():
        raise InputError(f"take {name!r}: expected weights, but all its frames are NaN; check it, and solve it again")
    segments = read_segments(corpus, name) if model.needs_segments else None
    if segments is None and model.needs_segments:
        raise NotFoundError(f"take {name!r}: it has no segments yet; run: mimique segment CORPUS --take {name}")
    labelled = model.label(values, segments)
    labelled = labelled[labelled["label"] != ""].reset_index(drop=True)
    return join_equal_neighbours(labelled).assign(origin="model", status="proposed")


def join_equal_neighbours(labelled: pd.DataFrame) -> pd.DataFrame:
    """Turn labelled segments into a tier: held expressions, and transitions between different ones (4.3.2).

    A movement between two segments of one label is part of that expression; touching segments of one label are one.
    A transition is named after the two that it lies between. Confidence is the mean over frames.

    Parameters
    ----------
    labelled
        Columns ``onset, offset, kind, label, confidence, from_label, to_label``, in order of time.
    """
    records = labelled.to_dict("records")
    rows: list[dict[str, Any]] = []
    for index, row in enumerate(records):
        between = row["kind"] == "transition" and bool(row["from_label"])
        held = _held_through(records, index) if row["kind"] == "transition" and not between else None
        label = held or row["label"]
        before, after = (row["from_label"], row["to_label"]) if between else (label, label)
        entry = {
            "onset": row["onset"],
            "offset": row["offset"],
            "label": format_label(Transition(before, after)) if between else label,
            "confidence": row["confidence"],
            "from_label": before,
            "to_label": after,
        }
        last = rows[-1] if rows else None
        if last is not None and _continues(last, entry):
            lengths = last["offset"] - last["onset"], entry["offset"] - entry["onset"]
            total = last["confidence"] * lengths[0] + entry["confidence"] * lengths[1]
            last.update(offset=entry["offset"], confidence=total / sum(lengths))
        else:
            rows.append(entry)
    columns = ["onset", "offset", "label", "confidence", "from_label", "to_label"]
    return pd.DataFrame(rows, columns=columns)


def _held_through(records: list[dict[str, Any]], index: int) -> str | None:
    """Return the one label of the segments that touch a movement on both sides, if it is one."""
    if not 0 < index < len(records) - 1:
        return None
    before, row, after = records[index - 1 : index + 2]
    touching = before["offset"] == row["onset"] and row["offset"] == after["onset"]
    return before["label"] if touching and before["label"] == after["label"] else None


def _continues(last: dict[str, Any], entry: dict[str, Any]) -> bool:
    touching = last["offset"] == entry["onset"]
    return touching and entry["from_label"] == entry["to_label"] and last["label"] == entry["label"]
