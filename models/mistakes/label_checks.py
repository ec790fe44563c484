"""Likely mistakes in the tiers that people made, ranked, each with a reason in words.

| problem | found by |
|---|---|
| ``swapped label`` | models of the other takes are sure that the segment shows something else |
| ``shifted boundary`` | the border fits the face at least 0.1 s away, too far for the scatter of such borders |
| ``missing segment`` | a hole between annotations; or a stretch of a segment that surely shows something else |
| ``doubled segment`` | neighbours of one label that touch, overlap, or leave less than 0.1 s between them |
| ``short segment`` | less than 0.1 s: shorter than a person can mean or see |
| ``wrong transition`` | a transition that is named otherwise than the segments beside it (Reverdy 2019, 4.3.2) |

Breaches of the rules come in as a table, made by whoever knows the vocabulary. A mistake often breaks several rules at
once; what another finding explains is not told again. Where a second person annotated a take, their labels and borders
are witnesses beside the models (:mod:`.second_annotator`, :mod:`.odd_borders`); elsewhere a border is judged by how
much better it fits the face where it would be moved to (:mod:`.border_fitting`).

Every finding has a score: 1 is certain by the tier alone; of what a model suspects, 0.5 is as sure as the thresholds
below ask for. They were chosen on simulated signers, and say nothing about how often people err.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...errors import InputError
from ...features.derivatives import find_runs
from ..labelled_take import find_transitions
from .border_fitting import fit_borders
from .label_evidence import LabelEvidence
from .odd_borders import combine_witnesses, probability_of_mistake, score_by_cut
from .second_annotator import SecondReader, match_borders

__all__ = ["COLUMNS", "PROBLEMS", "check_structure", "find_label_mistakes", "find_overlooked", "find_swapped"]

PROBLEMS = (
    "swapped label",
    "shifted boundary",
    "missing segment",
    "doubled segment",
    "short segment",
    "wrong transition",
)
COLUMNS = ["take", "problem", "onset", "offset", "label", "suggestion", "score", "reason"]

SHORTEST = 0.1
"""s: of a segment, of a hole, and of a shift that counts."""
DOUBT = 0.01
"""A label is doubted when another is more than 1/0.01 times as probable."""
LEAST_STRETCH = 0.5
"""s that an overlooked expression lasts; brows that ask a question and mouths that speak look like one for less."""
STRETCH_DOUBT = 0.03
"""As DOUBT, of the typical frame of an overlooked stretch."""
USUAL = 0.97
"""A border is doubted when moving it gains more than it does for this part of the borders in takes of its kind."""
LEAST_GAIN = 8.0
"""Log likelihood that moving a border gains at least."""

_Row = dict[str, Any]


def find_label_mistakes(
    takes: Sequence[Any],
    evidence: Mapping[str, LabelEvidence],
    *,
    rules: Mapping[str, pd.DataFrame] | None = None,
    second: Mapping[str, pd.DataFrame] | None = None,
    least_score: float = 0.5,
) -> pd.DataFrame:
    """Return likely mistakes of all takes, the surest first.

    Parameters
    ----------
    takes
        :class:`~mimique.models.LabelledTake`, or anything with ``name, protocol, rate, segments`` where segments may
        overlap.
    evidence
        By the take's name, see :func:`.collect_label_evidence`; a take without evidence is
        checked by its structure alone.
    rules
        By the take's name: breaches of rules, ``problem, onset, offset, label, what to do``.
    second
        By the take's name: the segments of a second person, who is believed no more than the first.
    least_score
        What to leave out below; 0 ranks everything that was suspected at all.

    Returns
    -------
    ``take, problem, onset, offset, label, suggestion, score, reason``; a shifted boundary is at [onset, onset + 1) and
    its suggestion is the frame where it fits. Of equal scores the earlier take and frame come first.
    """
    rows: list[_Row] = []
    fitted: list[_Row] = []
    borders: list[pd.DataFrame] = []
    reader = SecondReader([(take.segments, second[take.name]) for take in takes if second and take.name in second])
    for take in takes:
        segments = take.segments.sort_values("onset", kind="stable").reset_index(drop=True)
        own = check_structure(segments, take.rate).to_dict("records")
        known = evidence.get(take.name)
        if known is not None:
            _name_holes(own, known)
            if len(known.segments) != len(segments):
                n_segments, n_judged = len(segments), len(known.segments)
                raise InputError(
                    f"take {take.name}: expected evidence of its {n_segments} segments, but got {n_judged}"
                )
            touched = [(row["onset"], row["offset"]) for row in own]
            overlooked = find_overlooked(segments, known, take.rate).to_dict("records")
            inside = [(row["onset"], row["offset"]) for row in overlooked]
            beside = (second or {}).get(take.name)
            judged = known if beside is None else reader.weigh(known, segments, beside)
            swapped = [
                row for row in find_swapped(segments, judged).to_dict("records")
                if not any(row["onset"] <= a and b <= row["offset"] for a, b in inside)
            ]  # fmt: skip
            suspected = [row for row in overlooked + swapped if not _meets(row, touched)]
            own += suspected
            certain = touched + [(row["onset"], row["offset"]) for row in suspected if row["score"] >= 0.5]
            if beside is None:
                facts = {"take": take.name, "kind": take.protocol, "rate": take.rate}
                compared = _compare_borders(segments, known, take.rate)
                fitted += [{**row, **facts} for row in compared if not _meets(row, certain)]
            else:
                free = [not _meets({"onset": at, "offset": at + 1}, certain) for at in known.borders["onset"]]
                moved = known.borders[free]
                other = match_borders(moved, beside, take.rate)
                borders.append(moved.assign(take=take.name, group=take.protocol, rate=take.rate, other=other))
        own += _breaches((rules or {}).get(take.name), own)
        rows += [{**row, "take": take.name} for row in own]
    rows += _judge_fitted(fitted) + _judge_by_witnesses(borders)
    table = pd.DataFrame([row for row in rows if row["score"] >= least_score], columns=COLUMNS)
    types = {column: "int64" if column in ("onset", "offset") else "str" for column in COLUMNS}
    table = table.astype({**types, "score": "float64"})
    return table.sort_values(["score", "take", "onset"], ascending=[False, True, True], ignore_index=True)


def check_structure(segments: pd.DataFrame, rate: float) -> pd.DataFrame:
    """Return what a tier alone shows to be wrong: doubled and short segments, and holes.

    Parameters
    ----------
    segments
        ``onset, offset, label`` in order of onset; they may overlap.
    rate
        Frames per second.
    """
    rows: list[_Row] = []
    table = segments.sort_values("onset", kind="stable")
    parts = list(zip(table["onset"], table["offset"], table["label"].astype(str), strict=True))
    near = SHORTEST * rate
    for onset, offset, label in parts:
        if offset - onset < near - 1e-6:
            seconds = (offset - onset) / rate
            reason = f"{label!r} lasts {seconds:.3f} s, less than {SHORTEST:g} s: join it with a neighbour"
            rows.append(_finding("short segment", onset, offset, label, "", 1.0, reason))
    last = parts[0] if parts else (0, 0, "")
    for part in parts[1:]:
        hole = part[0] - last[1]
        if part[2] == last[2] and hole < near:
            how = "overlap" if hole < 0 else "touch" if hole == 0 else f"are {hole / rate:.3f} s apart"
            reason = f"two segments {part[2]!r} {how}: make them one"
            rows.append(_finding("doubled segment", last[0], max(part[1], last[1]), part[2], part[2], 1.0, reason))
        elif hole >= near:
            reason = f"nothing is annotated for {hole / rate:.2f} s between {last[2]!r} and {part[2]!r}"
            rows.append(_finding("missing segment", last[1], part[0], "", "", 0.95, reason))
        elif hole < 0:
            reason = f"{last[2]!r} and {part[2]!r} overlap for {-hole / rate:.3f} s: move a boundary"
            rows.append(_finding("shifted boundary", part[0], last[1], part[2], str(last[1]), 1.0, reason))
        last = part if part[1] >= last[1] else last
    return pd.DataFrame(rows, columns=COLUMNS[1:])


def find_swapped(segments: pd.DataFrame, evidence: LabelEvidence) -> pd.DataFrame:
    """Stable segments that surely show another class than their label says."""
    rows = []
    stable = ~find_transitions(segments)
    for i in np.flatnonzero(stable):
        p, label = evidence.segments[i], str(segments["label"].iloc[i])
        if label not in evidence.classes or not np.isfinite(p).all():
            continue
        own, best = float(p[evidence.classes.index(label)]), int(p.argmax())
        if evidence.classes[best] == label:
            continue
        other = evidence.classes[best]
        reason = f"labelled {label!r}, but models of other takes give {other!r} {p[best]:.0%}, {label!r} {own:.1%}"
        onset, offset = int(segments["onset"].iloc[i]), int(segments["offset"].iloc[i])
        rows.append(_finding("swapped label", onset, offset, label, other, _doubt_score(own, p[best], DOUBT), reason))
    return pd.DataFrame(rows, columns=COLUMNS[1:])


def find_overlooked(segments: pd.DataFrame, evidence: LabelEvidence, rate: float) -> pd.DataFrame:
    """Stretches inside stable segments that show another class than the rest of the segment.

    A stretch over the whole segment is a matter of its label, not of something missing: at least 0.1 s of the segment
    must show its own label.
    """
    rows = []
    stable = ~find_transitions(segments)
    least = LEAST_STRETCH * rate
    rest = SHORTEST * rate
    for i in np.flatnonzero(stable):
        label, onset, offset = (segments[column].iloc[i] for column in ("label", "onset", "offset"))
        p = evidence.frames[onset:offset]
        if str(label) not in evidence.classes or not len(p):
            continue
        code = evidence.classes.index(str(label))
        best = np.where(np.isfinite(p).all(axis=1), np.nan_to_num(p).argmax(axis=1), code)
        if (best == code).sum() < rest:
            continue
        found = None
        for start, end in find_runs(best != code):
            if end - start < least:
                continue
            mean = np.exp(np.log(np.clip(p[start:end], 1e-6, None)).mean(axis=0))
            other = int(mean.argmax())
            score = _doubt_score(float(mean[code]), float(mean[other]), STRETCH_DOUBT)
            if other != code and (found is None or score > found["score"]):
                name = evidence.classes[other]
                reason = f"{label!r}, but for {(end - start) / rate:.2f} s of it the face shows {name!r}"
                place = int(onset) + start, int(onset) + end
                found = _finding("missing segment", *place, str(label), name, score, reason)
        if found is not None:
            rows.append(found)
    return pd.DataFrame(rows, columns=COLUMNS[1:])


def _finding(problem: str, onset: int, offset: int, label: str, suggestion: str, score: float, reason: str) -> _Row:
    values = (problem, int(onset), int(offset), str(label), str(suggestion), float(score), reason)
    return dict(zip(COLUMNS[1:], values, strict=True))


def _doubt_score(own: float, best: float, doubt: float) -> float:
    """0.5 where the label is `doubt` times as probable as the best, towards 1 where it is less."""
    return best * doubt / (best * doubt + own) if best > 0 else 0.0


def _meets(row: _Row, places: Sequence[tuple[int, int]]) -> bool:
    """Whether a finding overlaps or touches one of the places."""
    return any(row["onset"] <= b and a <= row["offset"] for a, b in places)


def _name_holes(rows: list[_Row], evidence: LabelEvidence) -> None:
    """Say what the face shows in holes."""
    for row in rows:
        if row["problem"] == "missing segment":
            frames = evidence.frames[row["onset"] : row["offset"]]
            frames = frames[np.isfinite(frames).all(axis=1)]
            if len(frames):
                # The middle third: at its ends the face is on its way.
                middle = frames[len(frames) // 3 : 1 + 2 * len(frames) // 3].mean(axis=0)
                row["suggestion"] = evidence.classes[int(middle.argmax())]
                row["reason"] += f"; the face shows {row['suggestion']!r}"


def _compare_borders(segments: pd.DataFrame, evidence: LabelEvidence, rate: float) -> list[_Row]:
    """Where the borders of each run of touching segments would fit best."""
    rows: list[_Row] = []
    onsets, offsets = segments["onset"].to_numpy(), segments["offset"].to_numpy()
    labels, moving = segments["label"].astype(str).to_numpy(), find_transitions(segments)
    if not np.isfinite(evidence.moving).any() or not len(segments):
        return rows
    place = {name: k for k, name in enumerate(evidence.classes)}
    usable = np.array([m or label in place for m, label in zip(moving, labels, strict=True)])
    joined = np.append(False, (offsets[:-1] == onsets[1:]) & usable[1:] & usable[:-1])
    start = 0
    for end in [*np.flatnonzero(~joined)[1:].tolist(), len(segments)]:
        run = range(start, end)
        start = end
        if len(run) < 2:
            continue
        bounds = np.append(onsets[run], offsets[run[-1]])
        states = np.array([-1 if moving[i] else place[labels[i]] for i in run])
        fitted = fit_borders(bounds, states, evidence.frames, evidence.moving, rate)
        for b, (given, best, gain) in enumerate(zip(fitted.given, fitted.fitted, fitted.gain, strict=True)):
            side = f"{labels[run[b]]} | {labels[run[b + 1]]}"
            rows.append({"onset": int(given), "offset": int(given) + 1, "label": side, "to": int(best), "gain": gain})
    return rows


def _judge_fitted(borders: list[_Row]) -> list[_Row]:
    """Judge borders by the face alone: those much farther from where they fit than others of their kind of take."""
    rows: list[_Row] = []
    table = pd.DataFrame(borders)
    if not len(table):
        return rows
    table["away"] = (table["onset"] - table["to"]) / table["rate"]
    for _, some in table.groupby("kind"):
        away: NDArray = some["away"].to_numpy()
        centre = float(np.median(away))
        usual = float(np.quantile(np.abs(away - centre), 0.9))
        bar = max(LEAST_GAIN, float(np.quantile(some["gain"], USUAL)))
        for row, distance in zip(some.to_dict("records"), np.abs(away - centre), strict=True):
            if distance < max(SHORTEST, usual):
                continue
            when = "late" if row["away"] > 0 else "early"
            reason = (
                f"the border {row['label']} is {abs(row['away']):.2f} s {when}: the face changes at frame {row['to']}; "
                f"nine in ten borders of such takes are within {usual:.2f} s"
            )
            # 0.5 at the bar, towards 1 beyond it.
            score = row["gain"] / (row["gain"] + bar)
            found = _finding(
                "shifted boundary", row["onset"], row["offset"], row["label"], str(row["to"]), score, reason
            )
            rows.append({**found, "take": row["take"]})
    return rows


def _judge_by_witnesses(borders: Sequence[pd.DataFrame]) -> list[_Row]:
    """Find shifted ones among the borders of all takes."""
    filled = [table for table in borders if len(table)]
    if not filled:
        return []
    table = pd.concat(filled, ignore_index=True)
    rate = table["rate"].to_numpy(dtype=float)
    given, fitted = table["onset"].to_numpy() / rate, table["fitted"].to_numpy(dtype=float) / rate
    usual = table["expected"].to_numpy(dtype=float)
    witnesses = combine_witnesses(given, fitted, usual, table["other"].to_numpy(dtype=float) / rate)
    away = given - witnesses.fitted
    scores = score_by_cut(probability_of_mistake(away, witnesses.usual, table["group"].to_numpy()))
    rows: list[_Row] = []
    for i in np.flatnonzero(np.nan_to_num(scores) > 0):
        row, when = table.iloc[i], "late" if away[i] > 0 else "early"
        place, at = round(witnesses.fitted[i] * rate[i]), int(row["onset"])
        sides = f"{row['before']} | {row['after']}"
        also = "" if np.isnan(row["other"]) else f", and the second annotator's is at {int(row['other'])}"
        reason = (
            f"the border {sides} is {abs(away[i]):.2f} s {when}: it fits at frame {place}{also}; "
            f"such borders are usually within {witnesses.usual[i]:.2f} s"
        )
        found = _finding("shifted boundary", at, at + 1, sides, str(place), float(scores[i]), reason)
        rows.append({**found, "take": row["take"]})
    return rows


def _breaches(rules: pd.DataFrame | None, own: Sequence[_Row]) -> list[_Row]:
    """Breaches of rules that no other finding explains."""
    if rules is None:
        return []
    lacking = [
        column for column in ("problem", "onset", "offset", "label", "what to do") if column not in rules.columns
    ]
    if lacking:
        raise InputError(f"rules: expected the columns of check_tier, but {', '.join(lacking)} is missing")
    explained = [(row["onset"], row["offset"]) for row in own if row["score"] >= 0.9]
    rows: list[_Row] = []
    for row in rules.to_dict("records"):
        problem = "wrong transition" if str(row["problem"]).startswith("transition") else f"rule: {row['problem']}"
        place = int(row["onset"]), int(row["offset"])
        if _meets({"onset": place[0], "offset": place[1]}, explained):
            continue
        reason = f"{row['problem']}: {row['what to do']}"
        if rows and rows[-1]["problem"] == problem and (rows[-1]["onset"], rows[-1]["offset"]) == place:
            rows[-1]["reason"] += f"; {reason}"
        else:
            rows.append(_finding(problem, *place, str(row["label"]), "", 1.0, reason))
    return rows
