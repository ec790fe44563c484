"""Who may see what of a take: proposals and others' work, nothing but their own, or nothing at all.

A take that was drawn for double coding is blind to its coders, and closed to everybody else, until each of its coders
has said that they are done. From then on it is a take like any other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["Mode", "find_hidden", "mode_of", "modes_of"]

Mode = Literal["review", "blind", "none"]


def mode_of(review: Review, person: str, take: str) -> Mode:
    """Return how a person works on a take.

    Parameters
    ----------
    review
        The review; only its database is read.
    person, take
        Any names; a take that was not drawn is ``review``, whether or not it is there.

    Returns
    -------
    ``review`` with proposals and others' tiers, ``blind`` with an empty tier of one's own, ``none``: not this person's
    (a take that others are coding blind).
    """
    with review.database.read() as connection:
        rows = connection.execute("SELECT person, done FROM coding WHERE take = ?", (take,)).fetchall()
    return _choose(person, {str(row[0]): bool(row[1]) for row in rows})


def modes_of(review: Review, person: str) -> dict[str, Mode]:
    """Return the mode of every take that was drawn, by one look at the database; all others are ``review``."""
    takes: dict[str, dict[str, bool]] = {}
    with review.database.read() as connection:
        for row in connection.execute("SELECT take, person, done FROM coding"):
            takes.setdefault(str(row[0]), {})[str(row[1])] = bool(row[2])
    return {take: _choose(person, coders) for take, coders in takes.items()}


def find_hidden(review: Review) -> frozenset[str]:
    """Return the takes that are still coded blind: nothing of what is said in them may be told, be it in a number."""
    with review.database.read() as connection:
        rows = connection.execute("SELECT take FROM coding GROUP BY take HAVING MIN(done) = 0").fetchall()
    return frozenset(str(row[0]) for row in rows)


def _choose(person: str, coders: dict[str, bool]) -> Mode:
    if not coders or all(coders.values()):
        return "review"
    return "blind" if person in coders else "none"
