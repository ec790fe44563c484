"""Colours, lines and signs of the layouts' curves, which are told apart without colour too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

__all__ = ["Look", "find_look"]


@dataclass(frozen=True)
class Look:
    """Colour (after Okabe and Ito), line and sign of a curve: line and sign differ wherever colours do."""

    colour: str
    line: Any
    sign: str
    width: float = 1.4
    size: float = 5.0

    def style(self) -> dict[str, Any]:
        """Return what :meth:`Axes.plot` needs."""
        hollow = self.sign in "sv<>D"
        return {
            "color": self.colour,
            "linestyle": self.line,
            "marker": self.sign,
            "linewidth": self.width,
            "markersize": self.size,
            "markerfacecolor": "white" if hollow else self.colour,
            "markeredgecolor": self.colour,
            "markeredgewidth": 1.1,
        }


_LOOKS = {
    "greedy + swaps": Look("#0072b2", "-", "o", 2.2, 6.0),
    "greedy": Look("#56b4e9", (0, (5, 2)), "s"),
    "pivoted QR": Look("#009e73", (0, (6, 2, 1, 2)), "^"),
    "k-means median": Look("#d55e00", "-", "D", 1.8),
    "k-means best inertia": Look("#e69f00", (0, (1, 1.5)), "v"),
    "k-means one actor": Look("#cc79a7", (0, (4, 1.5)), "<"),
    "k-means several actors": Look("#7a4a9e", "-", ">"),
    "k-means": Look("#d55e00", "-", "D", 1.8),
    "STAR": Look("#6b6b6b", "none", "*", 0.0, 10.0),
    "MAN": Look("#6b6b6b", (0, (8, 3)), "P", 1.2, 6.0),
}
_OTHERS = (Look("#8c564b", (0, (3, 1, 1, 1)), "X"), Look("#117733", (0, (2, 2)), "p"), Look("#332288", "-", "h"))


def find_look(name: str, number: int = 0) -> Look:
    """Return the look of a method, the same in every figure; ``number`` tells those without one of their own apart."""
    return _LOOKS.get(name) or _OTHERS[number % len(_OTHERS)]
