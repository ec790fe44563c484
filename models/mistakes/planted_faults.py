"""Mistakes put into good tiers on purpose, to measure what finds them.

| problem | what is done |
|---|---|
| ``swapped label`` | a stable segment gets another label, and the transitions beside it the name that follows |
| ``shifted boundary`` | the border of two touching segments moves |
| ``missing segment`` | a stable segment and its transitions go: half leave a hole, half join what surrounds them |
| ``doubled segment`` | a segment becomes two of its label, touching or with a few frames between |
| ``short segment`` | a sliver of a stable label appears at a border |
| ``wrong transition`` | a transition is named for two other labels than those beside it |

Faults stay at least one segment apart, so that each is found or missed by itself. Detectors are given the tier alone:
neither these parameters nor the seed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ...errors import InputError
from ..labelled_take import check_segments, find_transitions

__all__ = ["AFFECT_CODES", "FAULTS", "FaultSettings", "plant_faults"]

FAULTS = (
    "swapped label",
    "shifted boundary",
    "missing segment",
    "doubled segment",
    "short segment",
    "wrong transition",
)
AFFECT_CODES = {
    "neutral": "N",
    "anger": "A",
    "disgust": "D",
    "fear": "F",
    "joy": "J",
    "sadness": "Sa",
    "surprise": "Su",
}
"""Of which the names of transitions are made."""

COLUMNS = ["problem", "variant", "onset", "offset", "label", "true_label", "true_onset", "true_offset"]
_Row = dict[str, Any]


@dataclass(frozen=True)
class FaultSettings:
    """How many faults, and how gross.

    Parameters
    ----------
    share
        Chance of each segment to be the place of each kind of fault, 0 to 1.
    shift
        Least and greatest shift of a boundary in seconds, either way.
    sliver
        Least and greatest duration of a short segment in seconds.
    pause
        Greatest hole between the halves of a doubled segment in seconds.
    least
        Seconds that a shift or a split leaves of each segment at least.
    """

    share: float = 0.02
    shift: tuple[float, float] = (0.1, 0.5)
    sliver: tuple[float, float] = (0.02, 0.08)
    pause: float = 0.05
    least: float = 0.15

    def __post_init__(self) -> None:
        if not 0 <= self.share <= 1:
            raise InputError(f"share: expected 0 to 1, but got {self.share}")
        for name, (low, high) in (("shift", self.shift), ("sliver", self.sliver)):
            if not 0 < low <= high:
                raise InputError(f"{name}: expected two rising durations in seconds, but got {low} and {high}")


def plant_faults(
    segments: pd.DataFrame,
    rate: float,
    *,
    rng: np.random.Generator,
    kinds: Sequence[str] = FAULTS,
    settings: FaultSettings | None = None,
    labels: Sequence[str] = tuple(AFFECT_CODES),
    codes: Mapping[str, str] = AFFECT_CODES,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return a tier with faults, and the list of them.

    Parameters
    ----------
    segments
        ``onset, offset, label`` and, for transitions, ``from_label`` and ``to_label``; without overlap.
    rate
        Frames per second.
    kinds
        Among :data:`FAULTS`; where two fall on one segment the first drawn stays.
    settings
        How many and how gross.
    labels
        What stable segments can be labelled.
    codes
        Names of transitions are made of these; a label without one stands for itself.

    Returns
    -------
    tier
        ``onset, offset, label, from_label, to_label``.
    faults
        ``problem, variant, onset, offset, label, true_label, true_onset, true_offset``: where to look in the faulty
        tier, what is there, and what was there. For a shifted boundary onset is where it is, true_onset where it was.
    """
    chosen = settings or FaultSettings()
    unknown = sorted(set(kinds) - set(FAULTS))
    if unknown:
        raise InputError(f"kinds: expected some of {', '.join(FAULTS)}, but got {', '.join(unknown)}")
    end = int(segments["offset"].max()) if len(segments) else 0
    rows = _to_rows(check_segments(segments, end))
    work = _Planter(rows, rate, chosen, tuple(labels), codes, rng)
    free = np.ones(len(rows), dtype=bool)
    plan: list[tuple[int, str]] = []
    for kind in rng.permutation(list(kinds)):
        for place in rng.permutation(len(rows)):
            around = slice(max(int(place) - 2, 0), int(place) + 3)
            if rng.random() < chosen.share and free[around].all() and work.can(str(kind), int(place)):
                plan.append((int(place), str(kind)))
                free[max(int(place) - 3, 0) : int(place) + 4] = False
    # From the end backwards, rows before a fault keep their places.
    faults = [work.plant(kind, place) for place, kind in sorted(plan, reverse=True)]
    tier = pd.DataFrame(work.rows, columns=["onset", "offset", "label", "from_label", "to_label"])
    types = {"onset": "int64", "offset": "int64", "label": "str", "from_label": "str", "to_label": "str"}
    listed = pd.DataFrame(faults[::-1], columns=COLUMNS)
    whole = {c: "int64" if c.endswith("set") else "str" for c in COLUMNS}
    return tier.astype(types), listed.astype(whole)


def _to_rows(table: pd.DataFrame) -> list[_Row]:
    moving = find_transitions(table)
    has_pair = {"from_label", "to_label"} <= set(table.columns)
    rows: list[_Row] = []
    for row, is_transition in zip(table.to_dict("records"), moving, strict=True):
        pair = (str(row["from_label"]), str(row["to_label"])) if is_transition and has_pair else ("", "")
        rows.append(
            {
                "onset": int(row["onset"]),
                "offset": int(row["offset"]),
                "label": str(row["label"]),
                "from_label": pair[0],
                "to_label": pair[1],
            }
        )
    return rows


class _Planter:
    def __init__(
        self,
        rows: list[_Row],
        rate: float,
        settings: FaultSettings,
        labels: tuple[str, ...],
        codes: Mapping[str, str],
        rng: np.random.Generator,
    ) -> None:
        self.rows, self.rate, self.settings, self.labels, self.codes, self.rng = (
            rows,
            rate,
            settings,
            labels,
            codes,
            rng,
        )
        self.least = max(round(settings.least * rate), 1)

    def can(self, kind: str, i: int) -> bool:
        """Whether a fault fits at a row."""
        row = self.rows[i]
        stable = not row["from_label"]
        length = row["offset"] - row["onset"]
        if kind == "swapped label":
            return stable and bool(self._others(i))
        if kind == "shifted boundary":
            return any(self._ranges(i))
        if kind == "missing segment":
            inside = 2 <= i < len(self.rows) - 2
            return (
                stable
                and inside
                and self._touch(i - 2, i + 2)
                and bool(self.rows[i - 1]["from_label"] and self.rows[i + 1]["from_label"])
            )
        if kind == "doubled segment":
            return stable and length > 2 * self.least + self.settings.pause * self.rate
        if kind == "short segment":
            return i > 0 and self._touch(i - 1, i) and length - self.settings.sliver[1] * self.rate > self.least
        return bool(row["from_label"])

    def plant(self, kind: str, i: int) -> tuple:
        """Change the rows, and return what was done."""
        plant: dict[str, Callable[[int], tuple]] = {
            "swapped label": self._swap,
            "shifted boundary": self._shift,
            "missing segment": self._drop,
            "doubled segment": self._double,
            "short segment": self._sliver,
            "wrong transition": self._misname,
        }
        return (kind, *plant[kind](i))

    def _swap(self, i: int) -> tuple:
        row, was = self.rows[i], self.rows[i]["label"]
        row["label"] = str(self.rng.choice(self._others(i)))
        if i > 0 and self._touch(i - 1, i) and self.rows[i - 1]["from_label"]:
            self._name(self.rows[i - 1], self.rows[i - 1]["from_label"], row["label"])
        if i + 1 < len(self.rows) and self._touch(i, i + 1) and self.rows[i + 1]["from_label"]:
            self._name(self.rows[i + 1], row["label"], self.rows[i + 1]["to_label"])
        return "", row["onset"], row["offset"], row["label"], was, row["onset"], row["offset"]

    def _shift(self, i: int) -> tuple:
        left, right = self._ranges(i)
        draws = [side for side in (left, right) if side]
        low, high = draws[int(self.rng.integers(len(draws)))]
        amount = int(self.rng.integers(low, high + 1))
        before, row = self.rows[i - 1], self.rows[i]
        was = row["onset"]
        before["offset"] = row["onset"] = was + amount
        variant = "late" if amount > 0 else "early"
        return variant, was + amount, was + amount + 1, row["label"], row["label"], was, was + 1

    def _drop(self, i: int) -> tuple:
        before, row, after = self.rows[i - 2], self.rows[i], self.rows[i + 2]
        onset, offset = before["offset"], after["onset"]
        if before["label"] == after["label"] and self.rng.random() < 0.5:
            before["offset"] = after["offset"]
            del self.rows[i - 1 : i + 3]
            return "overlooked", onset, offset, before["label"], row["label"], row["onset"], row["offset"]
        del self.rows[i - 1 : i + 2]
        return "hole", onset, offset, "", row["label"], row["onset"], row["offset"]

    def _double(self, i: int) -> tuple:
        row = self.rows[i]
        onset, offset = row["onset"], row["offset"]
        pause = int(self.rng.integers(0, int(self.settings.pause * self.rate) + 1))
        cut = int(self.rng.integers(onset + self.least, offset - self.least - pause + 1))
        self.rows[i : i + 1] = [{**row, "offset": cut}, {**row, "onset": cut + pause}]
        return "apart" if pause else "touching", onset, offset, row["label"], row["label"], onset, offset

    def _sliver(self, i: int) -> tuple:
        row, onset = self.rows[i], self.rows[i]["onset"]
        low, high = (max(round(x * self.rate), 1) for x in self.settings.sliver)
        offset = onset + int(self.rng.integers(low, high + 1))
        taken = {row["label"], self.rows[i - 1]["label"]}
        label = str(self.rng.choice([name for name in self.labels if name not in taken]))
        row["onset"] = offset
        self.rows.insert(i, {"onset": onset, "offset": offset, "label": label, "from_label": "", "to_label": ""})
        return "", onset, offset, label, row["label"], onset, row["offset"]

    def _misname(self, i: int) -> tuple:
        row, was = self.rows[i], self.rows[i]["label"]
        pairs = [
            (a, b)
            for a in self.labels
            for b in self.labels
            if a != b and (a, b) != (row["from_label"], row["to_label"])
        ]
        self._name(row, *pairs[int(self.rng.integers(len(pairs)))])
        return "", row["onset"], row["offset"], row["label"], was, row["onset"], row["offset"]

    def _others(self, i: int) -> list[str]:
        """Labels that a segment could be mistaken for without being equal to what its transitions lead to."""
        taken = {self.rows[i]["label"]}
        if i > 0:
            taken |= {self.rows[i - 1]["from_label"], self.rows[i - 1]["label"]}
        if i + 1 < len(self.rows):
            taken |= {self.rows[i + 1]["to_label"], self.rows[i + 1]["label"]}
        return [name for name in self.labels if name not in taken]

    def _ranges(self, i: int) -> tuple[tuple[int, int] | None, tuple[int, int] | None]:
        """Frames by which the onset of a row may move to the left, and to the right."""
        if i == 0 or not self._touch(i - 1, i):
            return None, None
        low, high = (round(x * self.rate) for x in self.settings.shift)
        low = max(low, 1)
        to_left = min(high, self.rows[i - 1]["offset"] - self.rows[i - 1]["onset"] - self.least)
        to_right = min(high, self.rows[i]["offset"] - self.rows[i]["onset"] - self.least)
        return (-to_left, -low) if to_left >= low else None, (low, to_right) if to_right >= low else None

    def _touch(self, first: int, last: int) -> bool:
        return all(self.rows[j]["offset"] == self.rows[j + 1]["onset"] for j in range(first, last))

    def _name(self, row: _Row, before: str, after: str) -> None:
        row["from_label"], row["to_label"] = before, after
        row["label"] = self.codes.get(before, before) + self.codes.get(after, after)
