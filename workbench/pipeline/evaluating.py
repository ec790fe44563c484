"""The thesis's evaluation on a corpus: train on IE and SE, test on EU, per signer (Reverdy 2019, 4.5)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...corpus.view import CorpusView
from ...errors import InputError
from ...models import CLASSIFIERS, Evaluation, evaluate_reverdy2019
from .labelled_takes import choose_author, read_labelled_takes
from .segmenting import read_segments
from .training import TRAIN_PROTOCOLS

TEST_PROTOCOLS = ("EU",)


def evaluate(
    corpus: CorpusView,
    *,
    annotator: str | None = None,
    signers: Sequence[str] | None = None,
    classifiers: Sequence[str] = CLASSIFIERS,
    train_protocols: Sequence[str] = TRAIN_PROTOCOLS,
    test_protocols: Sequence[str] = TEST_PROTOCOLS,
    seed: int = 0,
) -> Evaluation:
    """Score classifiers on manual and on automatic segments; the corpus is only read.

    Parameters
    ----------
    corpus
        With weights and an annotated tier ``affect``; stored automatic segments are used where there are any.
    annotator
        Whose tier is the reference; the one who annotated most if left out.
    signers, classifiers, train_protocols, test_protocols, seed
        See :func:`mimique.models.evaluate_reverdy2019`.

    Raises
    ------
    MimiqueError
        If there is nothing to train or to test on.
    """
    whose = choose_author(corpus, author=annotator)
    takes = read_labelled_takes(
        corpus, whose, signers=signers, protocols=[*train_protocols, *test_protocols], with_weights=True
    )
    if not takes:
        raise InputError(
            f"{whose} has labelled no take of the protocols {', '.join([*train_protocols, *test_protocols])}"
        )
    automatic = {}
    for take in takes:
        segments = read_segments(corpus, take.name)
        if segments is not None:
            automatic[take.name] = segments
    return evaluate_reverdy2019(
        takes,
        rng=np.random.default_rng(seed),
        automatic=automatic,
        classifiers=classifiers,
        train_protocols=train_protocols,
        test_protocols=test_protocols,
    )
