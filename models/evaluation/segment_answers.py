"""What methods answer about the segments of signers that they were never shown, before and after calibration.

Signers are dealt into folds. For each fold a method learns from all other signers and answers for the fold's segments;
within those others the same is done once more, and from these inner answers comes the calibrator: neither saw anything
of the signers that are judged.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ...features.descriptors import mean_weights, sample_frames
from ..affect_classifiers import AffectModel, fit_affect_classifier
from ..confidence.calibration import align_columns, calibrate, segment_probabilities
from ..labelled_take import LabelledTake, find_covering_labels, find_transitions
from ..labellers import TRANSITION, FrameLabeller, label_frames, segments_of_labels, stack_takes

__all__ = ["ClassifierMethod", "LabellerMethod", "Method", "SegmentAnswers", "answer_across_signers"]

SEGMENTATIONS = ("manual", "automatic")
FLOOR = 1e-4


class Method(Protocol):
    """Learns from takes, and answers for the segments of one."""

    def learn(self, takes: Sequence[LabelledTake], seed: int) -> Any:
        """Return what `answer` needs."""
        ...

    def answer(
        self, learned: Any, take: LabelledTake, classes: Sequence[str]
    ) -> dict[str, tuple[pd.DataFrame, NDArray[np.float64]]]:
        """Return segments and their probabilities ``(n_segments, n_classes)``, by segmentation."""
        ...


@dataclass(frozen=True)
class ClassifierMethod:
    """One of the five classifiers on mean weights (Reverdy 2019, 4.6); ``automatic`` are the segments of each take."""

    name: str
    automatic: Mapping[str, pd.DataFrame]

    def learn(self, takes: Sequence[LabelledTake], seed: int) -> AffectModel:
        """Fit the classifier to ten frames a second of stable segments."""
        X, y = [], []
        for take in takes:
            stable = _stable(take.segments)
            samples, rows = sample_frames(_weights(take), stable, take.rate, 10.0)
            X.append(samples)
            y.append(stable["label"].astype(str).to_numpy()[rows])
        return fit_affect_classifier(self.name, np.concatenate(X), np.concatenate(y), rng=np.random.default_rng(seed))

    def answer(
        self, learned: AffectModel, take: LabelledTake, classes: Sequence[str]
    ) -> dict[str, tuple[pd.DataFrame, NDArray[np.float64]]]:
        """Answer for the annotator's and the automatic segments."""
        found = {"manual": _stable(take.segments)}
        if take.name in self.automatic:
            found["automatic"] = _stable(self.automatic[take.name])
        result = {}
        for kind, segments in found.items():
            means = mean_weights(_weights(take), segments)
            p = np.full((len(segments), len(classes)), np.nan)
            present = np.isfinite(means).all(axis=1)
            p[present] = align_columns(learned.predict_proba(means[present]), learned.classes, classes)
            result[kind] = (segments, p)
        return result


@dataclass(frozen=True)
class LabellerMethod:
    """A labeller of frames in time, whose own held segments are the automatic ones.

    Probabilities of a segment are the mean of those of its frames, without the part that says transition.
    """

    name: str
    make: Callable[[float, int], FrameLabeller]

    def learn(self, takes: Sequence[LabelledTake], seed: int) -> FrameLabeller:
        """Fit the labeller, transitions as one class; it holds out whole signers where it holds anything out."""
        stacked = stack_takes(takes)
        labeller = self.make(stacked.rate, seed)
        return labeller.fit(stacked.X, stacked.y, groups=stacked.groups, signers=stacked.signers)

    def answer(
        self, learned: FrameLabeller, take: LabelledTake, classes: Sequence[str]
    ) -> dict[str, tuple[pd.DataFrame, NDArray[np.float64]]]:
        """Answer for the annotator's segments and for the labeller's own."""
        if not np.isfinite(_weights(take)).all(axis=1).any():
            return {}
        labels, given = label_frames(learned, _weights(take))
        frames = align_columns(given, learned.classes_, [*classes, TRANSITION])[:, :-1] + FLOOR
        frames /= frames.sum(axis=1, keepdims=True)
        own = segments_of_labels(labels)
        found = {"manual": _stable(take.segments), "automatic": own[own["kind"] == "stable"].reset_index(drop=True)}
        return {kind: (segments, segment_probabilities(frames, segments)) for kind, segments in found.items()}


@dataclass(frozen=True)
class SegmentAnswers:
    """Answers about the segments of all signers.

    Parameters
    ----------
    classes
        Labels of the columns.
    rows
        ``segmentation, take, signer, protocol, reference, seconds``: one row a segment.
    raw, calibrated
        ``(n_rows, n_classes)`` probabilities before and after.
    corrections
        ``fold, segmentation, method, temperature``: how they were calibrated.
    left_out
        Automatic segments that cover mostly a transition, or nothing, of the reference.
    """

    classes: tuple[str, ...]
    rows: pd.DataFrame
    raw: NDArray[np.float64] = field(repr=False)
    calibrated: NDArray[np.float64] = field(repr=False)
    corrections: pd.DataFrame
    left_out: int


def answer_across_signers(
    takes: Sequence[LabelledTake],
    method: Method,
    *,
    rng: np.random.Generator,
    n_folds: int = 5,
    n_inner: int = 3,
    finished: Callable[[str], Any] | None = None,
) -> SegmentAnswers:
    """Let a method answer for every signer by what the others taught, calibrated on those others.

    Parameters
    ----------
    takes
        With weights, of at least four signers, so that two are left to calibrate by whatever fold is out.
    method
        See above.
    rng
        Deals the signers, and seeds the method.
    n_folds, n_inner
        Numbers of folds, at least 2; at most the signers there are.
    finished
        Called with a word after each learning.

    Raises
    ------
    InputError
        If there are too few signers or folds.
    """
    signers = sorted({take.signer for take in takes})
    if len(signers) < 4:
        raise InputError(f"takes: expected at least four signers to calibrate across them, but got {len(signers)}")
    if n_folds < 2 or n_inner < 2:
        raise InputError(f"folds: expected at least 2 and 2, but got {n_folds} and {n_inner}")
    classes = tuple(sorted({str(label) for take in takes for label in _stable(take.segments)["label"]}))
    seed = int(rng.integers(2**31))
    tell = finished or (lambda word: None)
    parts: list[pd.DataFrame] = []
    raw: list[NDArray] = []
    calibrated: list[NDArray] = []
    corrections: list[dict[str, Any]] = []
    left_out = 0
    for number, held in enumerate(_deal(signers, n_folds, rng)):
        taught = [take for take in takes if take.signer not in held]
        inner = []
        for fold in _deal(sorted(set(signers) - held), n_inner, rng):
            learned = method.learn([take for take in taught if take.signer not in fold], seed)
            inner.append(_answer(method, learned, [take for take in taught if take.signer in fold], classes))
            tell(f"fold {number + 1}, inner")
        learned = method.learn(taught, seed)
        tell(f"fold {number + 1}")
        rows, given, out = _answer(method, learned, [take for take in takes if take.signer in held], classes)
        left_out += out
        known, judged = pd.concat([part[0] for part in inner], ignore_index=True), np.concatenate([p[1] for p in inner])
        corrected = np.full(given.shape, np.nan)
        for kind in sorted(set(rows["segmentation"])):
            own, other = (known["segmentation"] == kind).to_numpy(), (rows["segmentation"] == kind).to_numpy()
            fitted = calibrate(
                judged[own],
                known["reference"].to_numpy(dtype=object)[own],
                known["signer"].to_numpy(dtype=object)[own],
                classes=classes,
            )
            corrected[other] = fitted.apply(given[other])
            facts = {"method": fitted.method, "temperature": fitted.temperature}
            corrections.append({"fold": number + 1, "segmentation": kind, **facts})
        parts.append(rows)
        raw.append(given)
        calibrated.append(corrected)
    return SegmentAnswers(
        classes,
        pd.concat(parts, ignore_index=True),
        np.concatenate(raw),
        np.concatenate(calibrated),
        pd.DataFrame(corrections),
        left_out,
    )


def _deal(signers: Sequence[str], n_folds: int, rng: np.random.Generator) -> list[set[str]]:
    order = [signers[i] for i in rng.permutation(len(signers))]
    number = min(n_folds, len(signers))
    return [set(order[k::number]) for k in range(number)]


def _answer(
    method: Method, learned: Any, takes: Sequence[LabelledTake], classes: tuple[str, ...]
) -> tuple[pd.DataFrame, NDArray[np.float64], int]:
    """Answers for takes, where there is a reference and an answer."""
    tables, given, left_out = [], [np.zeros((0, len(classes)))], 0
    for take in takes:
        for kind, (segments, p) in method.answer(learned, take, classes).items():
            labels, moves, _ = find_covering_labels(segments["onset"], segments["offset"], take)
            fits = np.array([label is not None for label in labels], dtype=bool) & ~moves
            left_out += int((~fits).sum())
            kept = fits & np.isfinite(p).all(axis=1)
            seconds = (segments["offset"] - segments["onset"]).to_numpy() / take.rate
            tables.append(
                pd.DataFrame({"reference": [str(label) for label in labels[kept]], "seconds": seconds[kept]}).assign(
                    segmentation=kind, take=take.name, signer=take.signer, protocol=take.protocol
                )
            )
            given.append(p[kept])
    columns = ["segmentation", "take", "signer", "protocol", "reference", "seconds"]
    rows = pd.concat(tables, ignore_index=True)[columns] if tables else pd.DataFrame(columns=columns)
    return rows, np.concatenate(given), left_out


def _stable(segments: pd.DataFrame) -> pd.DataFrame:
    return segments[~find_transitions(segments)].reset_index(drop=True)


def _weights(take: LabelledTake) -> NDArray[np.float64]:
    if take.weights is None:
        raise InputError(f"take {take.name}: expected weights, but it has none; solve first")
    return take.weights
