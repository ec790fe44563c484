"""Which takes are coded by several people, and by whom: drawn by a seed, balanced over signers and coders.

Every take has a place in line that follows from the seed and its name alone (SHA-256), so the same seed draws the same
takes of the same corpus, and takes that are added later do not reshuffle the others.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Mapping, Sequence

from ....errors import InputError

__all__ = ["count_wanted", "draw_takes", "place_in_line"]


def draw_takes(
    takes: Mapping[str, str | None],
    coders: Sequence[str],
    *,
    share: float,
    coders_per_take: int,
    seed: int,
    kept: Mapping[str, Collection[str]] | None = None,
    closed: Collection[str] = (),
) -> dict[str, tuple[str, ...]]:
    """Draw takes and give each its coders.

    Takes are drawn one by one, each from the signer of whom the smallest part is drawn so far, so that every signer has
    about the share; each goes to the coders who have the fewest takes so far, then to those who have fewest of this
    signer.

    Parameters
    ----------
    takes
        Every take with its signer.
    coders
        At least ``coders_per_take``, each once.
    share
        Of the takes, from 0 to 1; rounded to whole takes, at least one where it is above 0.
    coders_per_take
        At least 2.
    seed
        Any whole number.
    kept
        Takes that stay as they are, with their coders; they count for the share.
    closed
        Takes that cannot be drawn.

    Returns
    -------
    The coders of each drawn take, in the order of ``coders``; kept takes as they were.

    Raises
    ------
    InputError
        If there are too few coders, or too few takes that can be drawn.
    """
    drawn = {take: tuple(some) for take, some in (kept or {}).items()}
    if share > 0 and (len(coders) < coders_per_take or len(set(coders)) != len(coders) or coders_per_take < 2):
        raise InputError(
            f"coders: expected at least {max(coders_per_take, 2)} different people, "
            f"but got {', '.join(coders) or 'nobody'}"
        )
    wanted = count_wanted(share, len(takes))
    free = {take: signer for take, signer in takes.items() if take not in drawn and take not in set(closed)}
    if wanted - len(drawn) > len(free):
        raise InputError(
            f"share: {share:g} of {len(takes)} takes are {wanted}, but only {len(free) + len(drawn)} can be drawn: "
            "in the others somebody has worked or looked already; choose a smaller share"
        )
    lines: dict[str | None, list[str]] = {}
    for take in sorted(free, key=lambda name: (place_in_line(seed, name), name)):
        lines.setdefault(free[take], []).append(take)
    of_signer = _count(takes.values())
    drawn_of = _count(takes[take] for take in drawn if take in takes)
    loads = {coder: sum(coder in some for some in drawn.values()) for coder in coders}
    with_signer = {
        (coder, signer): sum(coder in some and takes.get(take) == signer for take, some in drawn.items())
        for coder in coders
        for signer in of_signer
    }
    while len(drawn) < wanted:
        signer = min(
            (one for one, line in lines.items() if line),
            key=lambda one: ((drawn_of.get(one, 0) + 0.5) / of_signer[one], place_in_line(seed, lines[one][0])),
        )
        take = lines[signer].pop(0)
        by_load = sorted(coders, key=lambda one: (loads[one], with_signer[one, signer], place_in_line(seed, take, one)))
        chosen = set(by_load[:coders_per_take])
        drawn[take] = tuple(coder for coder in coders if coder in chosen)
        drawn_of[signer] = drawn_of.get(signer, 0) + 1
        for coder in chosen:
            loads[coder] += 1
            with_signer[coder, signer] += 1
    return drawn


def count_wanted(share: float, n_takes: int) -> int:
    """Return how many takes a share is: rounded, at least one where it is above 0."""
    return max(round(share * n_takes), 1 if share > 0 and n_takes else 0)


def place_in_line(seed: int, *names: str) -> bytes:
    """Return what sorts takes in the order in which a seed draws them."""
    text = "\0".join((str(seed), *(f"{len(name)}:{name}" for name in names)))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()


def _count(values: Iterable[str | None]) -> dict[str | None, int]:
    counts: dict[str | None, int] = {}
    for value in values:
        counts[value] = counts.get(value, 0) + 1
    return counts
