"""The thesis's evaluation of automatic labels (Reverdy 2019, 4.4.3 and 4.5; its Figure 4.4).

For each signer by themselves: train on the frames of the stable manual segments of the isolated expressions (IE) and
the sequences of expressions (SE); test on segments of the expressive utterances (EU), each represented by its mean
weights (4.6), cut by hand and cut automatically. An automatic segment's reference is the manual label that covers most
of its frames. Where that is a transition, or no label, the segment is left out, and counted; so are segments that are
all gaps.

Accuracy per segment rewards cutting what is easy into many pieces, so it stands beside the accuracy weighted by
duration and the number of segments, and all stand beside the best constant answer ("majority") and chance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..errors import InputError
from ..features.descriptors import mean_weights, sample_frames
from ..features.energies import motion_energy
from ..features.segmentation import measure_restlessness, segment
from .affect_classifiers import CLASSIFIERS, fit_affect_classifier
from .labelled_take import LabelledTake, find_covering_labels, find_transitions
from .metrics import LabelScores, score_labels

__all__ = ["Evaluation", "collect_training_samples", "evaluate_reverdy2019"]

SEGMENTATIONS = ("manual", "automatic")


@dataclass(frozen=True)
class Evaluation:
    """Outcome of :func:`evaluate_reverdy2019`.

    Parameters
    ----------
    table
        One row per signer (and ``"all"``, the answers of all signers' models together), classifier and segmentation:
        ``signer, classifier, segmentation, n_train, n_segments, seconds, accuracy, accuracy_duration,
        balanced_accuracy, macro_f1, majority, majority_duration, chance, left_out_transition, left_out_unlabelled,
        left_out_missing``. ``n_train`` counts training samples, ``seconds`` is the duration of the tested segments.
    answers
        One row per tested segment and classifier: ``take, signer, segmentation, classifier, onset, offset, seconds,
        reference, share, label, confidence``; ``share`` is the part of the segment that its reference covers.
    confusions
        ``(signer, classifier, segmentation)`` to a table of counts, one row a reference class.
    """

    table: pd.DataFrame
    answers: pd.DataFrame = field(repr=False)
    confusions: dict[tuple[str, str, str], pd.DataFrame] = field(repr=False)


@dataclass(frozen=True)
class _TestSet:
    """Segments of one signer to be labelled, and how many were left out."""

    segments: pd.DataFrame
    means: NDArray[np.float64]
    left_out: dict[str, int]


def evaluate_reverdy2019(
    takes: Sequence[LabelledTake],
    *,
    rng: np.random.Generator,
    automatic: Mapping[str, pd.DataFrame] | None = None,
    classifiers: Sequence[str] = CLASSIFIERS,
    train_protocols: Sequence[str] = ("IE", "SE"),
    test_protocols: Sequence[str] = ("EU",),
    per_second: float | None = 10.0,
) -> Evaluation:
    """Train and test per signer as the thesis does.

    Parameters
    ----------
    takes
        Takes with weights and their manual tier; those of other protocols are not used.
    rng
        Seeds the random forests.
    automatic
        Automatic segments (``onset, offset``) by take name; takes that are not in it, or all if it is ``None``, are cut
        by :func:`mimique.features.segment` as it stands, with one restlessness for all takes of the signer.
    classifiers
        Names among :data:`mimique.models.affect_classifiers.CLASSIFIERS`.
    train_protocols, test_protocols
        Codes of the takes to train and to test on; none may be in both.
    per_second
        Training frames per second, see :func:`mimique.features.sample_frames`; ``None`` takes all, as the thesis did.

    Raises
    ------
    InputError
        If a signer has nothing to train or to test on, or only one class to train on.
    """
    both = sorted(set(train_protocols) & set(test_protocols))
    if both:
        raise InputError(f"protocols: expected others to test on than to train on, but {', '.join(both)} is in both")
    signers = sorted({take.signer for take in takes})
    if not signers:
        raise InputError("evaluation: expected labelled takes, but got none")
    _check_weights(takes, {*train_protocols, *test_protocols})
    rows: list[dict] = []
    answers: list[pd.DataFrame] = []
    for signer in signers:
        own = [take for take in takes if take.signer == signer]
        samples, labels = collect_training_samples([t for t in own if t.protocol in train_protocols], per_second)
        if not len(samples):
            raise InputError(
                f"signer {signer}: expected stable labelled segments in {' or '.join(train_protocols)} takes "
                "to train on, but found none"
            )
        if len(set(labels)) < 2:
            raise InputError(f"signer {signer}: expected at least two classes to train on, but got only {labels[0]!r}")
        tested = [take for take in own if take.protocol in test_protocols]
        given = automatic or {}
        cut = {**_segment_takes([take for take in tested if take.name not in given], own), **given}
        tests = {name: _collect_test_set(tested, name, cut) for name in SEGMENTATIONS}
        if not len(tests["manual"].segments):
            raise InputError(
                f"signer {signer}: expected stable labelled segments in {' or '.join(test_protocols)} takes "
                "to test on, but found none"
            )
        for classifier in classifiers:
            model = fit_affect_classifier(classifier, samples, labels, rng=rng)
            for name, test in tests.items():
                scores = model.predict_proba(test.means)
                answers.append(
                    test.segments.assign(
                        signer=signer,
                        segmentation=name,
                        classifier=classifier,
                        label=np.array(model.classes)[scores.argmax(axis=1)],
                        confidence=scores.max(axis=1),
                    )
                )
                rows.append(
                    {
                        "signer": signer,
                        "classifier": classifier,
                        "segmentation": name,
                        "n_train": len(samples),
                        "chance": 1 / len(model.classes),
                        **test.left_out,
                    }
                )
    order = ["take", "signer", "segmentation", "classifier", "onset", "offset", "seconds"]
    everything = pd.concat(answers, ignore_index=True)[[*order, "reference", "share", "label", "confidence"]]
    table, confusions = _score(pd.DataFrame(rows), everything)
    return Evaluation(table, everything, confusions)


def collect_training_samples(
    takes: Sequence[LabelledTake], per_second: float | None = 10.0
) -> tuple[NDArray[np.float64], NDArray[np.object_]]:
    """Frames of the stable segments of some takes, with their labels.

    Returns
    -------
    samples
        ``(n_samples, n_shapes)`` without NaN; ``(0, 0)`` where no take is given.
    labels
        ``(n_samples,)``.
    """
    _check_weights(takes, {take.protocol for take in takes})
    parts: list[NDArray[np.float64]] = []
    names: list[NDArray[np.object_]] = []
    for take in takes:
        stable = take.segments[~find_transitions(take.segments)].reset_index(drop=True)
        samples, rows = sample_frames(take.weights, stable, take.rate, per_second)  # type: ignore[arg-type]
        parts.append(samples)
        names.append(stable["label"].astype(str).to_numpy(dtype=object)[rows])
    if not parts:
        return np.zeros((0, 0)), np.zeros(0, dtype=object)
    return np.concatenate(parts), np.concatenate(names)


def _check_weights(takes: Sequence[LabelledTake], protocols: set[str]) -> None:
    """Refuse takes without weights, or with different numbers of them."""
    used = [take for take in takes if take.protocol in protocols]
    bare = [take.name for take in used if take.weights is None]
    if bare:
        raise InputError(f"takes: expected weights, but {', '.join(bare[:5])} has none; solve first")
    widths = {take.weights.shape[1]: take.name for take in used if take.weights is not None}
    if len(widths) > 1:
        (n, first), (m, second) = list(widths.items())[:2]
        raise InputError(f"takes: expected the same shapes everywhere, but {first} has {n} and {second} has {m}")


def _segment_takes(takes: Sequence[LabelledTake], own: Sequence[LabelledTake]) -> dict[str, pd.DataFrame]:
    """Cut takes by their motion, with the restlessness that all of the signer's own takes show together."""
    if not takes:
        return {}
    levels = [motion_energy(take.weights, take.rate).level for take in own if take.weights is not None]
    restlessness = measure_restlessness(np.concatenate(levels))
    return {take.name: segment(take.weights, take.rate, restlessness=restlessness) for take in takes}  # type: ignore[arg-type]


def _collect_test_set(
    takes: Sequence[LabelledTake], segmentation: str, automatic: Mapping[str, pd.DataFrame]
) -> _TestSet:
    """Segments with a stable reference and their mean weights."""
    tables: list[pd.DataFrame] = []
    means: list[NDArray[np.float64]] = []
    left_out = {"left_out_transition": 0, "left_out_unlabelled": 0, "left_out_missing": 0}
    for take in takes:
        if segmentation == "manual":
            pieces = take.segments[["onset", "offset"]]
            labels = take.segments["label"].astype(str).to_numpy(dtype=object)
            moving = find_transitions(take.segments)
            shares = np.ones(len(pieces))
        else:
            pieces = automatic[take.name][["onset", "offset"]].reset_index(drop=True)
            labels, moving, shares = find_covering_labels(pieces["onset"], pieces["offset"], take)
        described = mean_weights(take.weights, pieces)  # type: ignore[arg-type]
        unlabelled = np.array([label is None for label in labels], dtype=bool)
        missing = ~np.isfinite(described).all(axis=1) & ~moving & ~unlabelled
        left_out["left_out_transition"] += int(moving.sum())
        left_out["left_out_unlabelled"] += int(unlabelled.sum())
        left_out["left_out_missing"] += int(missing.sum())
        kept = ~(moving | unlabelled | missing)
        tables.append(
            pieces[kept].assign(
                take=take.name,
                seconds=(pieces["offset"] - pieces["onset"])[kept] / take.rate,
                reference=labels[kept],
                share=shares[kept],
            )
        )
        means.append(described[kept])
    if not tables:
        return _TestSet(pd.DataFrame(), np.zeros((0, 0)), left_out)
    return _TestSet(pd.concat(tables, ignore_index=True), np.concatenate(means), left_out)


def _score(rows: pd.DataFrame, answers: pd.DataFrame) -> tuple[pd.DataFrame, dict[tuple[str, str, str], pd.DataFrame]]:
    """Complete the rows with scores, and add those of all signers together."""
    counted = ["n_train", "left_out_transition", "left_out_unlabelled", "left_out_missing"]
    pooled = rows.groupby(["classifier", "segmentation"], sort=False).agg(
        {**dict.fromkeys(counted, "sum"), "chance": "min"}
    )
    rows = pd.concat([rows, pooled.reset_index().assign(signer="all")], ignore_index=True)
    classes = sorted({*answers["reference"], *answers["label"]})
    confusions: dict[tuple[str, str, str], pd.DataFrame] = {}
    scored = []
    for row in rows.to_dict("records"):
        chosen = (answers["classifier"] == row["classifier"]) & (answers["segmentation"] == row["segmentation"])
        if row["signer"] != "all":
            chosen &= answers["signer"] == row["signer"]
        some = answers[chosen]
        reference, given = some["reference"].to_numpy(), some["label"].to_numpy()
        each = score_labels(reference, given, classes=classes)
        timed: LabelScores = score_labels(reference, given, weights=some["seconds"].to_numpy(), classes=classes)
        confusions[row["signer"], row["classifier"], row["segmentation"]] = each.confusion.astype(int)
        scored.append(
            {
                **{key: row[key] for key in ("signer", "classifier", "segmentation", "n_train")},
                "n_segments": each.n_items,
                "seconds": float(some["seconds"].sum()),
                "accuracy": each.accuracy,
                "accuracy_duration": timed.accuracy,
                "balanced_accuracy": each.balanced_accuracy,
                "macro_f1": each.macro_f1,
                "majority": each.majority,
                "majority_duration": timed.majority,
                "chance": row["chance"],
                **{key: int(row[key]) for key in counted[1:]},
            }
        )
    return pd.DataFrame(scored), confusions
