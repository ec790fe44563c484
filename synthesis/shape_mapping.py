"""Weights of one rig's shapes as weights of another's: which shape drives which, and how strongly.

A target shape is driven by the source shape of its own name; else by those with the same ARKit name (see
:mod:`.arkit`). Where one of the two splits what ARKit does not (``browInnerUp_L`` and ``_R``), one source drives both
halves, and two halves drive the whole by their mean. A table says the rest: rows ``from, to, gain``, of which several
for one target are added. A target that stands in the table is driven by its rows alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..arrays import check_array
from ..errors import InputError
from .arkit import arkit_name, arkit_side

__all__ = ["ShapeMapping"]


@dataclass(frozen=True)
class ShapeMapping:
    """How weights of ``source`` shapes become weights of ``target`` shapes; make one with :meth:`fit`.

    Parameters
    ----------
    source, target
        Names of N and M shapes.
    gains
        (N, M): target weights are source weights times this.
    """

    source: tuple[str, ...]
    target: tuple[str, ...]
    gains: NDArray[np.float64]

    @classmethod
    def fit(cls, source: Sequence[str], target: Sequence[str], table: pd.DataFrame | None = None) -> ShapeMapping:
        """Find what drives each target shape.

        Parameters
        ----------
        source, target
            Names of shapes.
        table
            Columns ``from``, ``to`` and, where it is not 1 everywhere, ``gain``.

        Raises
        ------
        InputError
            If the table names a shape that is not there, or a gain is no number, or the two have nothing in common.
        """
        source, target = tuple(map(str, source)), tuple(map(str, target))
        gains = np.zeros((len(source), len(target)))
        by_hand = _read_table(table, source, target)
        for place, shape in enumerate(target):
            if shape in by_hand:
                for driver, gain in by_hand[shape]:
                    gains[driver, place] += gain
                continue
            drivers = _find_drivers(shape, source)
            gains[drivers, place] = 1.0 / max(len(drivers), 1)
        if not gains.any():
            raise InputError(
                f"shapes: none of {', '.join(source[:3])} … drives any of {', '.join(target[:3])} …; give a table with "
                "the columns from,to,gain"
            )
        return cls(source, target, gains)

    @property
    def unused(self) -> tuple[str, ...]:
        """Source shapes that drive nothing."""
        return tuple(name for name, row in zip(self.source, self.gains, strict=True) if not row.any())

    @property
    def still(self) -> tuple[str, ...]:
        """Target shapes that nothing drives; their weight is 0."""
        return tuple(name for name, column in zip(self.target, self.gains.T, strict=True) if not column.any())

    def apply(self, weights: ArrayLike) -> NDArray[np.float64]:
        """Turn (n_frames, N) weights into (n_frames, M); a target is NaN where something that drives it is."""
        values = check_array(weights, name="weights", shape=(None, len(self.source)))
        missing = ~np.isfinite(values)
        found = np.where(missing, 0.0, values) @ self.gains
        if missing.any():
            found[missing.astype(float) @ (self.gains != 0) > 0] = np.nan
            found[missing.all(axis=1)] = np.nan  # a lost frame shows no face at all, not one that is half at rest
        return found


def _find_drivers(shape: str, source: tuple[str, ...]) -> list[int]:
    if shape in source:
        return [source.index(shape)]
    name, side = arkit_name(shape), arkit_side(shape)
    if name is None:
        return []
    alike = [place for place, other in enumerate(source) if arkit_name(other) == name]
    exact = [place for place in alike if arkit_side(source[place]) == side]
    whole = [place for place in alike if arkit_side(source[place]) is None]
    return exact[:1] or whole[:1] or (alike if side is None else [])


def _read_table(
    table: pd.DataFrame | None, source: tuple[str, ...], target: tuple[str, ...]
) -> dict[str, list[tuple[int, float]]]:
    if table is None:
        return {}
    missing = [name for name in ("from", "to") if name not in table.columns]
    if missing:
        raise InputError(f"shape table: expected the columns from,to,gain, but {', '.join(missing)} is not there")
    found: dict[str, list[tuple[int, float]]] = {}
    gains = table["gain"] if "gain" in table.columns else [1.0] * len(table)
    for line, (driver, driven, gain) in enumerate(zip(table["from"], table["to"], gains, strict=True), start=2):
        for what, name, known in (("from", driver, source), ("to", driven, target)):
            if str(name) not in known:
                raise InputError(
                    f"shape table, line {line}: the shape {name!r} in the column {what!r} is not among {_some(known)}"
                )
        try:
            number = float(gain)
        except (TypeError, ValueError):
            number = np.nan
        if not np.isfinite(number):
            raise InputError(f"shape table, line {line}: expected a number in the column 'gain', but got {gain!r}")
        found.setdefault(str(driven), []).append((source.index(str(driver)), number))
    return found


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
