"""Affect classifiers learned from an annotator's tier, one per signer (Reverdy 2019, 4.4.3)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from ...corpus import Corpus
from ...corpus.provenance import describe_step
from ...errors import InputError
from ...models import AffectModel, collect_training_samples, fit_affect_classifier
from ..progress import Reporter
from .labelled_takes import AFFECT_TIER, choose_author, read_labelled_takes

TRAIN_PROTOCOLS = ("IE", "SE")
DEFAULT_CLASSIFIER = "random-forest"


def train(
    corpus: Corpus,
    *,
    classifier: str = DEFAULT_CLASSIFIER,
    annotator: str | None = None,
    protocols: Sequence[str] = TRAIN_PROTOCOLS,
    signers: Sequence[str] | None = None,
    name: str | None = None,
    seed: int = 0,
    author: str | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Learn one model per signer and store it, in one commit.

    Parameters
    ----------
    corpus
        With weights and annotated takes.
    classifier
        One of :data:`mimique.models.CLASSIFIERS`.
    annotator
        Whose tier is learned from; the one who annotated most if left out.
    protocols
        Codes of the takes to learn from.
    signers
        Only these; all if left out.
    name
        Of the model; ``<signer>-<classifier>`` if left out. Only for one signer.
    seed
        Of the forest's randomness.

    Returns
    -------
    DataFrame
        One row a model: ``model, signer, outcome`` (trained, unchanged), ``takes, samples, classes``.

    Raises
    ------
    MimiqueError
        If there is nothing to learn from; nothing is changed then.
    """
    reporter = reporter or Reporter()
    whose = choose_author(corpus, author=annotator)
    takes = read_labelled_takes(corpus, whose, signers=signers, protocols=protocols)
    people = sorted({take.signer for take in takes})
    if not people:
        raise InputError(f"{whose} has labelled no take of the protocols {', '.join(protocols)}; choose others")
    if name is not None and len(people) > 1:
        raise InputError(f"--name: expected one signer, but got {', '.join(people)}; choose one with --signer")
    rows: list[dict[str, Any]] = []
    parameters = {"classifier": classifier, "annotator": whose, "protocols": list(protocols), "seed": seed}
    message = f"Train {classifier} for {', '.join(people)}"
    with corpus.transaction(message, command="train", parameters=parameters, author=author) as edit:
        with reporter.stage("Training", len(people)) as finished:
            for signer in people:
                own = [take for take in takes if take.signer == signer]
                model_name = name or f"{signer}-{classifier}"
                inputs = {
                    f"weights of {t.name}": corpus.fingerprint(t.name, "weights", corpus.current_solve(t.name))
                    for t in own
                }
                inputs |= {f"labels of {t.name}": corpus.fingerprint(t.name, "tier", AFFECT_TIER, whose) for t in own}
                provenance = describe_step("train", inputs=inputs, parameters=parameters)
                samples, labels = collect_training_samples(own)
                row = {"model": model_name, "signer": signer, "outcome": "unchanged", "takes": len(own)}
                if not corpus.is_done(provenance, None, "model", model_name):
                    shapes = [str(s) for s in corpus.weights(own[0].name)["shape"].values]
                    try:
                        model = fit_affect_classifier(
                            classifier, samples, list(labels), rng=np.random.default_rng(seed), shapes=shapes
                        )
                    except InputError as error:
                        raise InputError(f"signer {signer}: {error}") from error
                    arrays, metadata = model.to_arrays()
                    facts = {
                        "signer": signer,
                        "takes": [t.name for t in own],
                        "snapshot": corpus.snapshot,
                        **parameters,
                    }
                    edit.put_model(model_name, arrays, {**metadata, **facts}, provenance=provenance)
                    row["outcome"] = "trained"
                rows.append({**row, "samples": len(samples), "classes": len(set(labels))})
                finished(signer)
    return pd.DataFrame(rows)


def load_model(corpus: Corpus, name: str) -> tuple[AffectModel, dict[str, Any]]:
    """Fit a stored model again; also return what is known of it."""
    arrays, metadata = corpus.model(name)
    return AffectModel.from_arrays(arrays, metadata), metadata
