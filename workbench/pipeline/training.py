"""Models learned from an annotator's tier: one per signer (Reverdy 2019, 4.4.3), from all others, or from all."""

from __future__ import annotations

import importlib.metadata
import json
import platform
from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
import pandas as pd
import scipy
import sklearn

from ... import __version__
from ...corpus import Corpus
from ...corpus.annotations.vocabulary_change import declared_vocabulary
from ...corpus.store.provenance import describe_step
from ...corpus.store.view import CorpusView
from ...errors import InputError, MimiqueError
from ...models import CLASSIFIERS, LabelledTake
from ...models.evaluation.protocols import score_model
from ...models.labellers import frame_labels
from ...models.labellers.networks import NETWORKS, choose_device
from ...models.labellers.take_scores import score_takes
from ...models.model_learning import METHODS, FitPart, learn_model, measure_confidence
from ...models.stored_models import SegmentModel, StoredModel, model_from_arrays
from ..progress import Reporter
from ..scratch import Scratch
from .labelled_takes import AFFECT_TIER, choose_author, read_labelled_takes, refuse_unlabelled_signers
from .segmenting import MACHINE, SEGMENT_TIER, read_segments
from .shape_weights import read_shape_weights
from .training_parts import TrainingParts

TRAIN_PROTOCOLS = ("IE", "SE")
HELD_OUT_PROTOCOLS = ("EU",)
DEFAULT_CLASSIFIER = "random-forest"
OWN, ACROSS, ALL = "train", "train across signers", "train on all signers"
"""Names of the steps that learn from one signer, from all but one, and from all."""
EVERYBODY = "all signers"


def train(
    corpus: Corpus,
    *,
    classifier: str = DEFAULT_CLASSIFIER,
    annotator: str | None = None,
    protocols: Sequence[str] = TRAIN_PROTOCOLS,
    signers: Sequence[str] | None = None,
    cross_signers: bool = False,
    all_signers: bool = False,
    name: str | None = None,
    seed: int = 0,
    device: str = "auto",
    author: str | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Learn one model per signer, or one from all, and store it, in one commit.

    With the model go its training snapshot, split, parameters and library versions, its calibration on takes held out
    in turn, and its scores on the signer's annotated takes of EU, where there are such and EU was not learned from.
    An interrupted training of labellers goes on where it was when it is run again with the same corpus and parameters.

    Parameters
    ----------
    corpus
        With weights and annotated takes.
    classifier
        One of :data:`mimique.models.model_learning.METHODS`: a classifier of segments, or a labeller in time.
    annotator
        Whose tier is learned from; the one who annotated most if left out.
    protocols
        Codes of the takes to learn from.
    signers
        Only models of these; all if left out.
    cross_signers
        Learn the model of each signer from all other signers of the corpus instead: what a new signer can expect.
    all_signers
        Learn one model from all signers instead, for signers that are yet to come.
    name
        Of the model; ``<signer>-<classifier>`` if left out, ``without-<signer>-<classifier>`` across signers,
        ``all-signers-<classifier>`` from all. Only for one model.
    seed
        Of what is random.
    device
        Where networks are trained: ``auto``, ``cpu``, ``cuda`` …

    Returns
    -------
    DataFrame
        One row a model: ``model, signer, outcome`` (trained, unchanged), ``takes, samples, classes, accuracy`` (on
        held-out manual segments, of labellers in time on held-out frames; NaN where there are none), ``calibration``
        (the method, or why there is none).

    Raises
    ------
    MimiqueError
        If there is nothing to learn from; nothing is changed then.
    """
    reporter = reporter or Reporter()
    if classifier not in METHODS:
        raise InputError(f"classifier: expected one of {', '.join(METHODS)}, but got {classifier!r}")
    if cross_signers and all_signers:
        raise InputError("--cross-signers leaves one signer out and --all-signers none; choose one of them")
    if all_signers and signers:
        raise InputError("--all-signers learns from all of them; leave out --signer")
    chosen_device = choose_device(device) if classifier in NETWORKS else "cpu"
    whose = choose_author(corpus, author=annotator)
    takes = read_labelled_takes(corpus, whose, signers=None if cross_signers else signers, protocols=protocols)
    tested, not_tested = _read_held_out(corpus, whose, signers, protocols)
    everybody = sorted({take.signer for take in takes})
    if signers:
        refuse_unlabelled_signers(corpus, takes, whose, protocols, signers)
    if not everybody:
        raise InputError(f"{whose} has labelled no take of the protocols {', '.join(protocols)}; choose others")
    if (cross_signers or all_signers) and len(everybody) < 2:
        option = "cross" if cross_signers else "all"
        raise InputError(f"--{option}-signers: expected takes of at least two signers, but all are of {everybody[0]}")
    people = [signer for signer in everybody if not signers or signer in signers]
    people = [EVERYBODY] if all_signers else people
    if name is not None and len(people) > 1:
        raise InputError(f"--name: expected one signer, but got {', '.join(people)}; choose one with --signer")
    step = ALL if all_signers else ACROSS if cross_signers else OWN
    rows: list[dict[str, Any]] = []
    parameters = {"classifier": classifier, "annotator": whose, "protocols": list(protocols), "seed": seed}
    who = f"{'each of ' if cross_signers else ''}{', '.join(people)}{' from the others' if cross_signers else ''}"
    message = f"Train {classifier} for {who}"
    scratch, kept = Scratch(corpus.path), list[str]()
    together = reporter.stage("Training", len(people)) if classifier in CLASSIFIERS else nullcontext(_say_nothing)
    with corpus.transaction(message, command="train", parameters=parameters, author=author) as edit, together as done:
        for signer in people:
            taught = [take for take in takes if all_signers or (take.signer != signer) == cross_signers]
            model_name = name or name_model(signer, classifier, step)
            provenance = describe_step(
                step, inputs=find_inputs(corpus, taught, whose), parameters={**parameters, "calibrated": True}
            )
            row = {"model": model_name, "signer": signer, "outcome": "unchanged", "takes": len(taught)}
            if corpus.is_done(provenance, None, "model", model_name):
                facts = corpus.model_metadata(model_name)
            else:
                held_out = [take for take in tested if all_signers or take.signer == signer]
                parts = TrainingParts(scratch, provenance["fingerprint"], reporter, f"{classifier} for {signer}")
                model, calibration = learn(
                    corpus, taught, classifier, seed, signer, device=chosen_device, fit_part=parts
                )
                kept += parts.keys
                arrays, metadata = model.to_arrays()
                facts = {
                    **metadata,
                    **_describe(corpus, model, calibration, taught, held_out, signer, step, seed),
                    "device": chosen_device,
                    "not_tested": "" if held_out else not_tested or "no annotated take was held out",
                    **parameters,
                }
                edit.put_model(model_name, arrays, facts, provenance=provenance)
                row["outcome"] = "trained"
            rows.append({**row, **_summarise(facts)})
            done(signer)
    scratch.drop(kept)
    return pd.DataFrame(rows)


def _say_nothing(name: str, amount: float = 1) -> None:
    """Stand in for a stage: labellers tell of their parts themselves."""


def name_model(signer: str, classifier: str, step: str) -> str:
    """Return the name that a model has unless a person gave it one."""
    if step == ALL:
        return f"all-signers-{classifier}"
    return f"{'without-' if step == ACROSS else ''}{signer}-{classifier}"


def find_inputs(corpus: CorpusView, taught: Sequence[LabelledTake], whose: str) -> dict[str, str]:
    """Return the fingerprints of all that a model is learned from: weights, labels, and the automatic segments."""
    solves = {take.name: corpus.current_solve(take.name) for take in taught}
    inputs = {f"weights of {name}": corpus.fingerprint(name, "weights", solve) for name, solve in solves.items()}
    inputs |= {f"labels of {t.name}": corpus.fingerprint(t.name, "tier", AFFECT_TIER, whose) for t in taught}
    for take in taught:
        listed = corpus.tiers(take.name)
        if ((listed["tier"] == SEGMENT_TIER) & (listed["author"] == MACHINE)).any():
            inputs[f"segments of {take.name}"] = corpus.fingerprint(take.name, "tier", SEGMENT_TIER, MACHINE)
    return inputs


def learn(
    corpus: CorpusView,
    taught: Sequence[LabelledTake],
    classifier: str,
    seed: int,
    signer: str,
    *,
    calibrated: bool = True,
    device: str = "cpu",
    fit_part: FitPart | None = None,
) -> tuple[StoredModel, dict[str, Any]]:
    """Learn a model from takes of a corpus, and calibrate it; see :func:`mimique.models.model_learning.learn_model`."""
    shapes = {take.name: [str(s) for s in read_shape_weights(corpus, take.name)["shape"].values] for take in taught}
    first = taught[0].name
    other = next((take for take, names in shapes.items() if names != shapes[first]), None)
    if other is not None:
        raise InputError(
            f"signer {signer}: expected weights of the same shapes, but those of {first} and {other} differ"
        )
    segments = {take.name: read_segments(corpus, take.name) for take in taught}
    try:
        return learn_model(
            classifier,
            taught,
            seed=seed,
            shapes=shapes[first],
            automatic={name: table for name, table in segments.items() if table is not None},
            calibrated=calibrated,
            parameters={"device": device} if classifier in NETWORKS else None,
            fit_part=fit_part,
        )
    except InputError as error:
        raise InputError(f"signer {signer}: {error}") from error


def _read_held_out(
    corpus: Corpus, whose: str, signers: Sequence[str] | None, protocols: Sequence[str]
) -> tuple[list[LabelledTake], str]:
    """Return the takes to test on, or why there are none: what cannot be tested can be learned all the same."""
    held_out = [protocol for protocol in HELD_OUT_PROTOCOLS if protocol not in protocols]
    if not held_out:
        return [], f"it learned from {', '.join(HELD_OUT_PROTOCOLS)} too"
    try:
        return read_labelled_takes(corpus, whose, signers=signers, protocols=held_out), ""
    except MimiqueError as error:
        return [], str(error)


def _test(
    corpus: Corpus, model: StoredModel, held_out: Sequence[LabelledTake], rng: np.random.Generator
) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Return the scores on takes that were not learned from, and how right the confidence is on them."""
    if not held_out:
        return pd.DataFrame(), {}
    automatic = {take.name: read_segments(corpus, take.name) for take in held_out}
    given = {name: segments for name, segments in automatic.items() if segments is not None}
    if isinstance(model, SegmentModel):
        scores = score_model(model.classifier, held_out, automatic=given, rng=rng)
    else:
        scores = score_takes(model.labeller, held_out, rng=rng)
    return scores, measure_confidence(model, held_out, given)


def _describe(
    corpus: Corpus,
    model: StoredModel,
    calibration: dict[str, Any],
    taught: Sequence[LabelledTake],
    held_out: Sequence[LabelledTake],
    signer: str,
    step: str,
    seed: int,
) -> dict[str, Any]:
    """Return what is known of a model besides its parameters: from what, tested on what, made with what."""
    metrics, tested = _test(corpus, model, held_out, np.random.default_rng(seed))
    if isinstance(model, SegmentModel):
        samples = np.array(model.classes)[model.classifier.codes]
    else:
        frames = np.concatenate([frame_labels(take) for take in taught])
        samples = frames[np.array([label is not None for label in frames], dtype=bool)].astype(str)
    labels, counts = np.unique(samples, return_counts=True)
    libraries = {"numpy": np.__version__, "scipy": scipy.__version__, "scikit-learn": sklearn.__version__}
    if getattr(model, "name", "") in NETWORKS:
        libraries["torch"] = importlib.metadata.version("torch")
    return {
        "signer": signer if step == OWN else None,
        "held_out_signer": signer if step == ACROSS else None,
        "signers": sorted({take.signer for take in taught}),
        "takes": [take.name for take in taught],
        "tested_takes": [take.name for take in held_out],
        "snapshot": corpus.snapshot,
        "simulated": any(bool(corpus.take_attributes(take.name).get("simulated")) for take in [*taught, *held_out]),
        "vocabulary": _current_labels(corpus),
        "class_counts": {str(label): int(count) for label, count in zip(labels, counts, strict=True)},
        "calibration": {**calibration, "tested": tested},
        "metrics": json.loads(metrics.to_json(orient="records")),
        "versions": {"mimique": __version__, "python": platform.python_version(), **libraries},
    }


def _summarise(facts: dict[str, Any]) -> dict[str, Any]:
    counts = facts.get("class_counts", {})
    told = [row for row in facts.get("metrics", []) if row["segmentation"] in ("manual", "own")]
    calibration = facts.get("calibration") or {}
    return {
        "samples": sum(counts.values()) if counts else np.nan,
        "classes": len(facts["classes"]),
        "accuracy": told[0]["accuracy"] if told and told[0]["accuracy"] is not None else np.nan,
        "calibration": calibration.get("method") or f"none: {calibration.get('why', 'not known')}",
    }


def load_model(corpus: CorpusView, name: str) -> tuple[StoredModel, dict[str, Any]]:
    """Return a stored model, ready to label, and what is known of it."""
    arrays, metadata = corpus.model(name)
    try:
        return model_from_arrays(arrays, metadata), metadata
    except InputError as error:
        raise InputError(f"model {name!r}: {error}") from error


def check_vocabulary(corpus: CorpusView, name: str, metadata: dict[str, Any]) -> None:
    """Refuse a model whose labels are no longer those of the corpus.

    A label that was added since is one that the model can never give; one that is gone is one that it still gives.

    Raises
    ------
    InputError
        If the vocabulary of the tier ``affect`` has other labels than when the model was trained.
    """
    then, now = metadata.get("vocabulary"), _current_labels(corpus)
    if then is None or now is None or set(then) == set(now):
        return
    gone, new = sorted(set(then) - set(now)), sorted(set(now) - set(then))
    changes = [f"{', '.join(names)} {word}" for names, word in ((gone, "gone"), (new, "new")) if names]
    raise InputError(
        f"model {name!r}: the vocabulary {AFFECT_TIER!r} has changed since it was trained ({'; '.join(changes)}); "
        "train it again"
    )


def _current_labels(corpus: CorpusView) -> list[str]:
    return list(declared_vocabulary(corpus, AFFECT_TIER).labels)
