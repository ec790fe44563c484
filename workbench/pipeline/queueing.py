"""What to review first: a model's proposed segments in order of expected usefulness."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...corpus.store.view import CorpusView
from ...errors import InputError, NotFoundError
from ...models.confidence.review_queue import PREFIX, expected_gains, order_for_review, probability_columns
from ...models.labelled_take import find_transitions
from ...models.labellers import TRANSITION
from ..progress import Reporter
from .labelled_takes import AFFECT_TIER
from .shape_weights import read_shape_weights
from .training import load_model

__all__ = ["COLUMNS", "judge_by_model", "queue_for_review"]

COLUMNS = ["take", "onset", "offset", "seconds", "label", "confidence", "second", "gain", "model"]
FLOOR = 1e-4


def queue_for_review(
    corpus: CorpusView,
    *,
    takes: Sequence[str] | None = None,
    signers: Sequence[str] | None = None,
    model: str | None = None,
    limit: int | None = None,
    reporter: Reporter | None = None,
) -> pd.DataFrame:
    """Return the proposed held segments of models' tiers ``affect``, most useful to look at first.

    Their probabilities are computed again by the stored model; where that cannot be done, the tier's confidence stands
    for the label, and the rest is shared by the other labels. Transitions follow from what they lie between, and are
    not asked about. The corpus is only read.

    Parameters
    ----------
    takes, signers
        Only these; all if left out.
    model
        Only this model's proposals.
    limit
        At most so many rows, at least 1; all if left out.

    Returns
    -------
    ``take, onset, offset`` (frames), ``seconds`` (duration), ``label``, ``confidence``, ``second`` (the likeliest other
    label), ``gain`` (expected gain in macro F1 of putting it right) and ``model``. Segments about which nothing is
    known come first and have no gain.

    Raises
    ------
    MimiqueError
        If a take or model is not there, or there is nothing to review.
    """
    if limit is not None and limit < 1:
        raise InputError(f"--limit: expected at least 1, but got {limit}")
    reporter = reporter or Reporter()
    known = corpus.models()
    if model is not None and model not in known:
        raise NotFoundError(f"there is no model {model!r}; models are: {', '.join(known) or 'none'}")
    chosen = _choose_takes(corpus, takes, signers)
    loaded: dict[str, Any] = {}
    parts: list[pd.DataFrame] = []
    with reporter.stage("Reading proposals", len(chosen)) as finished:
        for row in chosen.itertuples():
            name = str(row.take)
            listed = corpus.tiers(name)
            authors = listed[(listed["tier"] == AFFECT_TIER)]["author"].astype(str)
            for author in authors:
                if author not in known or (model is not None and author != model):
                    continue
                proposed = _read_proposals(corpus, name, author)
                if len(proposed):
                    if author not in loaded:
                        loaded[author] = _load(corpus, author)
                    p = _judge(corpus, name, loaded[author], proposed)
                    seconds = (proposed["offset"] - proposed["onset"]) / float(row.rate)
                    parts.append(p.assign(take=name, model=author, seconds=seconds, **_places(proposed)))
            finished(name)
    if not parts:
        raise NotFoundError("no model has proposed segments to review there; run: mimique label CORPUS")
    return _order(pd.concat(parts, ignore_index=True), limit)


def _choose_takes(corpus: CorpusView, takes: Sequence[str] | None, signers: Sequence[str] | None) -> pd.DataFrame:
    table = corpus.takes()
    missing = sorted(set(takes or ()) - set(table["take"]))
    if missing:
        raise NotFoundError(f"there is no take {missing[0]!r}")
    chosen = table[table["take"].isin(list(takes))] if takes else table
    return chosen[chosen["signer"].isin(list(signers))] if signers else chosen


def _read_proposals(corpus: CorpusView, take: str, author: str) -> pd.DataFrame:
    """Return the held segments that nobody has reviewed yet."""
    tier = corpus.tier(take, AFFECT_TIER, author=author)
    held = ~find_transitions(tier) & (tier["status"] == "proposed").to_numpy() & (tier["origin"] == "model").to_numpy()
    return tier[held].reset_index(drop=True)


def _load(corpus: CorpusView, name: str) -> Any:
    """Return the fitted model, or None where it cannot be had any more."""
    try:
        return load_model(corpus, name)[0]
    except (InputError, NotFoundError) as error:
        warnings.warn(f"{error}; the confidences of its tiers stand for it", stacklevel=2)
        return None


def _judge(corpus: CorpusView, take: str, model: Any, proposed: pd.DataFrame) -> pd.DataFrame:
    """Probabilities as columns ``p_<class>``, by the model, or by the tier's confidence."""
    found = None
    if model is not None:
        try:
            found = judge_by_model(corpus, take, model, proposed)
        except (InputError, NotFoundError) as error:
            warnings.warn(f"take {take!r}: {error}; the confidences of its tier stand for the model", stacklevel=2)
    if found is not None and set(proposed["label"]) <= set(found[1]):
        return probability_columns(*found)
    classes = sorted({str(label) for label in proposed["label"]} | set(found[1] if found is not None else ()))
    if len(classes) < 2:
        classes = [*classes, "other"]
    sure = proposed["confidence"].to_numpy(dtype=float)[:, None]
    own = proposed["label"].astype(str).to_numpy()[:, None] == np.array(classes)[None, :]
    return probability_columns(np.where(own, sure, (1.0 - sure) / (len(classes) - 1)), classes)


def judge_by_model(
    corpus: CorpusView, take: str, model: Any, proposed: pd.DataFrame
) -> tuple[NDArray[np.float64], list[str]]:
    """Return what a stored model holds of segments, given that none of them is a transition.

    Parameters
    ----------
    corpus, take
        Whose current weights it judges by.
    model
        A classifier of segments or a labeller of frames, as :func:`.training.load_model` returns it.
    proposed
        ``(n_segments,)`` rows with ``onset`` and ``offset`` (half-open, frames).

    Returns
    -------
    probabilities
        ``(n_segments, n_classes)``, above 0; rows add up to 1.
    classes
        Labels of the columns.

    Raises
    ------
    InputError
        If the weights are not of the shapes or the rate that the model knows.
    NotFoundError
        If the take, or its weights, are not there.
    """
    weights = read_shape_weights(corpus, take)
    model.check_fit([str(shape) for shape in weights["shape"].values], float(weights.attrs["rate"]))
    p = model.segment_probabilities(weights["weights"].values, proposed)
    names = [str(label) for label in (model.calibrator.classes if model.calibrator is not None else model.classes)]
    held = [k for k, label in enumerate(names) if label != TRANSITION]
    p = p[:, held] + FLOOR
    return p / p.sum(axis=1, keepdims=True), [names[k] for k in held]


def _places(proposed: pd.DataFrame) -> dict[str, Any]:
    return {"onset": proposed["onset"], "offset": proposed["offset"], "label": proposed["label"].astype(str)}


def _order(table: pd.DataFrame, limit: int | None) -> pd.DataFrame:
    """Order all segments together, and say how sure each is."""
    columns = [column for column in table.columns if column.startswith(PREFIX)]
    classes = [column[len(PREFIX) :] for column in columns]
    # A model that does not know a class of another gives it nothing; a row of all NaN stays unknown.
    p = table[columns].to_numpy(dtype=float)
    unknown = np.isnan(p).all(axis=1) | np.isnan(p[:, :]).any(axis=1) & (np.nansum(p, axis=1) < 0.999)
    p = np.where(unknown[:, None], np.nan, np.nan_to_num(p))
    table = table.assign(**dict(zip(columns, p.T, strict=True)))
    place = {name: k for k, name in enumerate(classes)}
    own = np.array([place[label] for label in table["label"]], dtype=np.int64)
    rows = np.arange(len(table))
    others = p.copy()
    others[rows, own] = -1.0
    best = np.where(unknown, "", np.array(classes, dtype=object)[np.nan_to_num(others, nan=-1.0).argmax(axis=1)])
    labels = table["label"].to_numpy(dtype=object)
    ordered = table.assign(
        confidence=p[rows, own], second=pd.Series(best, dtype="str"), gain=expected_gains(p, classes, labels=labels)
    )
    positions = order_for_review(table[[*columns, "label"]])
    result = ordered.iloc[positions].reset_index(drop=True)[COLUMNS]
    return result if limit is None else result.head(limit)
