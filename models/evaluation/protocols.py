"""Evaluation of automatic labels: the thesis's protocol (Reverdy 2019, 4.4.3, 4.5, Figure 4.4), and across signers.

``reverdy2019``: for each signer by themselves, train on the frames of the stable manual segments of the isolated
expressions (IE) and the sequences of expressions (SE); test on segments of the expressive utterances (EU), each
represented by its mean weights (4.6), cut by hand and cut automatically. An automatic segment's reference is the manual
label that covers most of its frames. Where that is a transition, or no label, the segment is left out, and counted; so
are segments that are all gaps.

``across-signers``: the same test, but each signer's models have learned from the other signers' IE and SE takes only.

Accuracy per segment rewards cutting what is easy into many pieces, so it stands beside the accuracy weighted by
duration and the number of segments, and all stand beside the best constant answer ("majority") and chance. Intervals
are bootstrapped over test takes; they say nothing about signers who were not recorded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ...features.descriptors import sample_frames
from ..affect_classifiers import CLASSIFIERS, AffectModel, fit_affect_classifier
from ..labelled_take import LabelledTake, find_transitions
from .intervals import score_answers
from .tested_segments import SEGMENTATIONS, TestedSegments, collect_tested_segments, cut_takes

__all__ = [
    "PROTOCOLS",
    "Evaluation",
    "collect_training_samples",
    "evaluate_across_signers",
    "evaluate_reverdy2019",
    "score_model",
]

PROTOCOLS = ("reverdy2019", "across-signers")
N_DRAWS = 1000


@dataclass(frozen=True)
class Evaluation:
    """Outcome of :func:`evaluate_reverdy2019` and :func:`evaluate_across_signers`.

    Parameters
    ----------
    table
        One row per signer (and ``"all"``, the answers of all signers' models together), classifier and segmentation:
        ``signer, classifier, segmentation, n_train, n_takes, n_segments, seconds, accuracy, accuracy_duration,
        macro_f1, balanced_accuracy, kappa, majority, majority_duration, chance, left_out_transition,
        left_out_unlabelled, left_out_missing``. ``n_train`` counts training samples, ``seconds`` is the duration of the
        tested segments. The first three scores have ``…_low`` and ``…_high``, a 95 % bootstrap interval over takes; NaN
        where there is one take only.
    answers
        One row per tested segment and classifier: ``take, signer, segmentation, classifier, onset, offset, seconds,
        reference, share, label, confidence``; ``share`` is the part of the segment that its reference covers.
    confusions
        ``(signer, classifier, segmentation)`` to a table of counts, one row a reference class.
    classes
        One row per signer (and ``"all"``) and label: ``n_train`` samples, and ``n_manual`` and ``n_automatic`` tested
        segments.
    """

    table: pd.DataFrame
    answers: pd.DataFrame = field(repr=False)
    confusions: dict[tuple[str, str, str], pd.DataFrame] = field(repr=False)
    classes: pd.DataFrame = field(repr=False, default_factory=pd.DataFrame)


def evaluate_reverdy2019(
    takes: Sequence[LabelledTake],
    *,
    rng: np.random.Generator,
    automatic: Mapping[str, pd.DataFrame] | None = None,
    classifiers: Sequence[str] = CLASSIFIERS,
    train_protocols: Sequence[str] = ("IE", "SE"),
    test_protocols: Sequence[str] = ("EU",),
    per_second: float | None = 10.0,
    strict: bool = True,
    n_draws: int = N_DRAWS,
) -> Evaluation:
    """Train and test per signer as the thesis does.

    Parameters
    ----------
    takes
        Takes with weights and their manual tier; those of other protocols are not used.
    rng
        Seeds the random forests, and, apart from them, the bootstrap.
    automatic
        Automatic segments (``onset, offset``) by take name; takes that are not in it, or all if it is ``None``, are cut
        by :func:`mimique.features.segment` as it stands, with one restlessness for all takes of the signer.
    classifiers
        Names among :data:`mimique.models.affect_classifiers.CLASSIFIERS`.
    train_protocols, test_protocols
        Codes of the takes to train and to test on; none may be in both.
    per_second
        Training frames per second, see :func:`mimique.features.sample_frames`; ``None`` takes all, as the thesis did.
    strict
        Whether a class that is in the training samples or in the manual test segments only is refused. A class that was
        never learned cannot be right, and one that is never tested has no score: the mean over classes is another one.
    n_draws
        Of the bootstrap.

    Raises
    ------
    InputError
        If a signer has nothing to train on, fewer than two segments to test on, only one class to train on, or (where
        strict) a class on one side only.
    """
    return _evaluate(
        takes,
        False,
        rng=rng,
        automatic=automatic,
        classifiers=classifiers,
        train_protocols=train_protocols,
        test_protocols=test_protocols,
        per_second=per_second,
        strict=strict,
        n_draws=n_draws,
    )


def evaluate_across_signers(
    takes: Sequence[LabelledTake],
    *,
    rng: np.random.Generator,
    automatic: Mapping[str, pd.DataFrame] | None = None,
    classifiers: Sequence[str] = CLASSIFIERS,
    train_protocols: Sequence[str] = ("IE", "SE"),
    test_protocols: Sequence[str] = ("EU",),
    per_second: float | None = 10.0,
    strict: bool = True,
    n_draws: int = N_DRAWS,
) -> Evaluation:
    """Test on each signer what was learned from all others (leave one signer out).

    The test segments, their references and the scores are those of :func:`evaluate_reverdy2019`, so that the two tables
    can be compared row by row; parameters and errors are the same, and fewer than two signers are refused.
    """
    if len({take.signer for take in takes}) == 1:
        raise InputError(
            f"across signers: expected takes of at least two signers, but all are of {takes[0].signer}; "
            "record more people, or evaluate per signer"
        )
    return _evaluate(
        takes,
        True,
        rng=rng,
        automatic=automatic,
        classifiers=classifiers,
        train_protocols=train_protocols,
        test_protocols=test_protocols,
        per_second=per_second,
        strict=strict,
        n_draws=n_draws,
    )


def _evaluate(
    takes: Sequence[LabelledTake],
    from_others: bool,
    *,
    rng: np.random.Generator,
    automatic: Mapping[str, pd.DataFrame] | None,
    classifiers: Sequence[str],
    train_protocols: Sequence[str],
    test_protocols: Sequence[str],
    per_second: float | None,
    strict: bool,
    n_draws: int,
) -> Evaluation:
    both = sorted(set(train_protocols) & set(test_protocols))
    if both:
        raise InputError(f"protocols: expected others to test on than to train on, but {', '.join(both)} is in both")
    if not classifiers:
        raise InputError(f"classifiers: expected some of {', '.join(CLASSIFIERS)}, but got none")
    signers = sorted({take.signer for take in takes})
    if not signers:
        raise InputError("evaluation: expected labelled takes, but got none")
    _check_weights(takes, {*train_protocols, *test_protocols})
    draws = rng.spawn(1)[0]  # the forests' seeds do not depend on the bootstrap
    rows: list[dict] = []
    answers: list[pd.DataFrame] = []
    counted: list[tuple[str, Sequence[str], dict[str, TestedSegments]]] = []
    for signer in signers:
        own = [take for take in takes if take.signer == signer]
        teachers = [take for take in takes if (take.signer != signer) == from_others]
        samples, labels = collect_training_samples([t for t in teachers if t.protocol in train_protocols], per_second)
        tested = [take for take in own if take.protocol in test_protocols]
        given = automatic or {}
        cut = {**cut_takes([take for take in tested if take.name not in given], own), **given}
        tests = {name: collect_tested_segments(tested, name, cut) for name in SEGMENTATIONS}
        whose = f"signer {signer}, learned from the others" if from_others else f"signer {signer}"
        _check_split(whose, labels, tests["manual"].segments, train_protocols, test_protocols, strict=strict)
        counted.append((signer, labels.tolist(), tests))
        for classifier in classifiers:
            model = fit_affect_classifier(classifier, samples, labels, rng=rng)
            for name, test in tests.items():
                answers.append(_answer(model, test).assign(signer=signer, segmentation=name, classifier=classifier))
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
    table, confusions = score_answers(pd.DataFrame(rows), everything, rng=draws, n_draws=n_draws)
    return Evaluation(table, everything, confusions, _count_classes(counted))


def score_model(
    model: AffectModel,
    takes: Sequence[LabelledTake],
    *,
    rng: np.random.Generator,
    automatic: Mapping[str, pd.DataFrame] | None = None,
    n_draws: int = N_DRAWS,
) -> pd.DataFrame:
    """Score a fitted model on takes that it has not learned from, as :func:`evaluate_reverdy2019` does.

    Returns
    -------
    One row per segmentation, with the columns of :class:`Evaluation`'s table from ``segmentation`` on; none where no
    segment of the takes can be tested. Classes that the takes lack are not refused.
    """
    _check_weights(takes, {take.protocol for take in takes})
    cut = {**cut_takes([take for take in takes if take.name not in (automatic or {})], takes), **(automatic or {})}
    answers, rows = [], []
    for name in SEGMENTATIONS:
        test = collect_tested_segments(takes, name, cut)
        if len(test.segments):
            answers.append(_answer(model, test).assign(signer="model", segmentation=name, classifier=model.name))
            facts = {"signer": "model", "classifier": model.name, "segmentation": name, "n_train": len(model.samples)}
            rows.append({**facts, "chance": 1 / len(model.classes), **test.left_out})
    if not rows:
        return pd.DataFrame()
    table, _ = score_answers(pd.DataFrame(rows), pd.concat(answers, ignore_index=True), rng=rng, n_draws=n_draws)
    return table[table["signer"] == "model"].drop(columns=["signer", "classifier"]).reset_index(drop=True)


def _answer(model: AffectModel, test: TestedSegments) -> pd.DataFrame:
    scores = model.predict_proba(test.means)
    labels = np.array(model.classes)[scores.argmax(axis=1)]
    return test.segments.assign(label=labels, confidence=scores.max(axis=1))


def _check_split(
    whose: str,
    labels: Sequence[str] | NDArray,
    tested: pd.DataFrame,
    train_protocols: Sequence[str],
    test_protocols: Sequence[str],
    *,
    strict: bool,
) -> None:
    """Refuse a split that has nothing to say: nothing or one class to learn, one segment to test, unequal classes."""
    learned_from, tested_on = " or ".join(train_protocols), " or ".join(test_protocols)
    if not len(labels):
        raise InputError(
            f"{whose}: expected stable labelled segments in {learned_from} takes to train on, but found none"
        )
    if len(set(labels)) < 2:
        raise InputError(f"{whose}: expected at least two classes to train on, but got only {labels[0]!r}")
    if not len(tested):
        raise InputError(f"{whose}: expected stable labelled segments in {tested_on} takes to test on, but found none")
    if len(tested) < 2:
        raise InputError(
            f"{whose}: expected at least two segments to test on, but {tested_on} takes hold one only "
            f"({tested['reference'].iloc[0]!r}); annotate more"
        )
    if not strict:
        return
    learned, asked = set(labels), set(tested["reference"])
    for names, here, there in (
        (asked - learned, f"tested ({tested_on})", f"trained on ({learned_from})"),
        (learned - asked, f"trained on ({learned_from})", f"tested ({tested_on})"),
    ):
        if names:
            raise InputError(
                f"{whose}: {', '.join(map(repr, sorted(names)))} is {here} but never {there}; annotate takes with it, "
                "or score what there is with --lenient (strict=False)"
            )


def _count_classes(counted: Sequence[tuple[str, Sequence[str], dict[str, TestedSegments]]]) -> pd.DataFrame:
    rows = []
    for signer, labels, tests in counted:
        learned = Counter(labels)
        tested = {name: Counter(test.segments.get("reference", [])) for name, test in tests.items()}
        for label in sorted(set(learned).union(*tested.values())):
            numbers = {f"n_{name}": tested[name][label] for name in SEGMENTATIONS}
            rows.append({"signer": signer, "label": str(label), "n_train": learned[label], **numbers})
    table = pd.DataFrame(rows)
    pooled = table.drop(columns="signer").groupby("label", as_index=False).sum()
    return pd.concat([table, pooled.assign(signer="all")[list(table.columns)]], ignore_index=True)


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
    empty = [t.name for t in used if t.weights is not None and not np.isfinite(t.weights).all(axis=1).any()]
    if empty:
        raise InputError(f"take {empty[0]}: expected weights, but all its frames are NaN; check it, and solve it again")
    widths = {take.weights.shape[1]: take.name for take in used if take.weights is not None}
    if len(widths) > 1:
        (n, first), (m, second) = list(widths.items())[:2]
        raise InputError(f"takes: expected the same shapes everywhere, but {first} has {n} and {second} has {m}")
