"""The list of takes that a person chooses from, and what stands in the way of reviewing them."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ....corpus import Corpus
from ....corpus.privacy.consent import explain_refusal
from ....corpus.store.locking import lock_corpus
from ....errors import CorpusError
from ..coding.modes import modes_of
from ..context import Review
from ..people.person import Person
from ..queueing.queue import count_takes
from .messages import CorpusMessage, Problem, TakeRow

__all__ = ["list_corpus"]


@dataclass(frozen=True)
class _Listing:
    """What a snapshot says of its takes, the same for everybody."""

    snapshot: str
    name: str
    takes: tuple[dict[str, Any], ...]
    rigs: tuple[str, ...]
    problems: tuple[Problem, ...]


def list_corpus(review: Review, person: Person) -> CorpusMessage:
    """Return the corpus as one person sees it.

    Parameters
    ----------
    review
        The review.
    person
        For whom: modes and counts are theirs alone. Segments are counted as the queue does, transitions left out.
    """
    listing = _read_listing(review)
    modes, done = modes_of(review, person.name), _list_done(review, person.name)
    unpublished, held = review.drafts.unpublished(person.name), count_takes(review, person.name)
    rows = []
    for take in listing.takes:
        name = take["take"]
        # A take that others are coding blind says nothing of what a machine or anybody found in it.
        proposed, reviewed = held.get(name, (0, 0))
        rows.append(
            TakeRow(
                **take,
                mode=modes.get(name, "review"),
                proposed=proposed,
                reviewed=reviewed,
                unpublished=unpublished.get(name, 0),
                done=name in done,
            )
        )
    return CorpusMessage(
        name=listing.name,
        snapshot=listing.snapshot,
        takes=rows,
        rigs=list(listing.rigs),
        problems=[_without_places(review, problem) for problem in (*listing.problems, *_find_lock(review))],
    )


def _without_places(review: Review, problem: Problem) -> Problem:
    command = problem.command
    return Problem(
        message=review.without_places(problem.message),
        command=None if command is None else review.without_places(command),
    )


def _read_listing(review: Review) -> _Listing:
    corpus = review.corpus()
    kept: dict[str, _Listing] = review.part("corpus listing", dict)
    listing = kept.get("newest")
    if listing is None or listing.snapshot != corpus.snapshot:
        listing = kept["newest"] = _list_takes(corpus)
    return listing


def _list_takes(corpus: Corpus) -> _Listing:
    takes: list[dict[str, Any]] = []
    refusals: dict[str | None, str | None] = {}
    for row in corpus.takes().itertuples():
        signer = row.signer
        if signer not in refusals:
            refusals[signer] = explain_refusal(corpus, signer, "project")
        takes.append(
            {
                "take": row.take,
                "signer": signer,
                "protocol": row.protocol,
                "rate": float(row.rate),
                "frames": int(row.frames),
                "seconds": float(row.seconds),
                "simulated": bool(corpus.take_attributes(row.take).get("simulated", False)),
                "solve": row.solve,
                "refusal": refusals[signer],
            }
        )
    rigs = tuple(corpus.rigs())
    return _Listing(corpus.snapshot, corpus.name, tuple(takes), rigs, tuple(_find_problems(corpus, takes, rigs)))


def _find_problems(corpus: Corpus, takes: list[dict[str, Any]], rigs: tuple[str, ...]) -> list[Problem]:
    place = shlex.quote(str(corpus.path))
    if not takes:
        return [Problem(message="The corpus has no takes yet.", command=f"mimique ingest {place} FILES")]
    problems = []
    if all(take["solve"] is None for take in takes):
        if not rigs:
            command = f"mimique rig add {place} RIG"
            problems.append(Problem(message="The corpus has no rig, so there is no face to show.", command=command))
        command = f"mimique solve {place}"
        problems.append(Problem(message="No take has weights yet, so no face moves.", command=command))
    elif missing := sum(take["solve"] is None for take in takes):
        message = f"{missing} of {len(takes)} takes have no weights yet."
        problems.append(Problem(message=message, command=f"mimique solve {place}"))
    if refused := [take for take in takes if take["refusal"]]:
        message = f"{len(refused)} of {len(takes)} takes are not shown: {refused[0]['refusal']}."
        problems.append(Problem(message=message, command=None))
    return problems


def _find_lock(review: Review) -> list[Problem]:
    """Return why nothing can be published right now; edits are kept all the same."""
    if not isinstance(review.location, Path):
        return []
    try:
        with lock_corpus(review.location, timeout=0, purpose="look whether it is locked"):
            return []
    except CorpusError as error:
        return [Problem(message=f"Edits are kept, but cannot be published now: {error}", command=None)]


def _list_done(review: Review, person: str) -> set[str]:
    with review.database.read() as connection:
        return {row[0] for row in connection.execute("SELECT take FROM coding WHERE person = ? AND done", (person,))}
