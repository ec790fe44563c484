"""The takes of a corpus as the learners see them: weights, and one annotator's tier."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from ...corpus.view import CorpusView
from ...corpus.vocabulary import add_transitions
from ...errors import InputError, NotFoundError
from ...models import LabelledTake

AFFECT_TIER = "affect"


def choose_author(corpus: CorpusView, tier: str = AFFECT_TIER, author: str | None = None) -> str:
    """Return whose tier to take for the reference.

    Parameters
    ----------
    corpus, tier
        Where to look.
    author
        A person; if left out, the one who annotated most takes, the first by name of equals. What a model labelled
        never is the reference.

    Raises
    ------
    NotFoundError
        If nobody has such a tier.
    """
    counts: dict[str, int] = {}
    for take in corpus.takes()["take"]:
        for row in corpus.tiers(take).itertuples():
            if row.tier == tier and not _is_machine_made(corpus, str(take), tier, str(row.author)):
                counts[str(row.author)] = counts.get(str(row.author), 0) + 1
    if author is not None and author in counts:
        return author
    people = ", ".join(sorted(counts)) or "nobody"
    if author is not None:
        raise NotFoundError(f"no tier {tier!r} by {author!r}; annotators of it are: {people}")
    if not counts:
        raise NotFoundError(f"nobody has annotated a tier {tier!r} yet; ingest annotation files with one")
    return min(counts, key=lambda name: (-counts[name], name))


def read_labelled_takes(
    corpus: CorpusView,
    author: str,
    *,
    tier: str = AFFECT_TIER,
    solve: str | None = None,
    signers: Sequence[str] | None = None,
    protocols: Sequence[str] | None = None,
    with_weights: bool = True,
) -> list[LabelledTake]:
    """Read the takes that an annotator labelled.

    Parameters
    ----------
    corpus
        The corpus.
    author, tier
        Whose tier is the reference.
    solve
        Which weights; each take's current ones if left out.
    signers, protocols
        Only takes of these; all if left out.
    with_weights
        Whether weights are read; without them, takes need not be solved.

    Raises
    ------
    InputError
        If a take has no signer or protocol.
    NotFoundError
        If weights are wanted and a take has none.
    """
    found = []
    for row in corpus.takes().itertuples():
        listed = corpus.tiers(str(row.take))
        if not ((listed["tier"] == tier) & (listed["author"] == author)).any():
            continue
        if row.signer is None or row.protocol is None:
            raise InputError(
                f"take {row.take!r}: expected a signer and a protocol; ingest it with --signer and --protocol"
            )
        if (signers and row.signer not in signers) or (protocols and row.protocol not in protocols):
            continue
        weights = corpus.weights(str(row.take), solve)["weights"].values if with_weights else None
        found.append(
            LabelledTake(
                name=str(row.take),
                signer=str(row.signer),
                protocol=str(row.protocol),
                rate=float(row.rate),
                segments=name_affects(corpus.tier(str(row.take), tier, author=author)),
                weights=weights,
                n_frames=int(row.frames),
            )
        )
    return found


def name_affects(segments: pd.DataFrame) -> pd.DataFrame:
    """Return a tier with affects by their English names, whatever code the annotator used, and transitions told."""
    named = add_transitions(segments)
    steady = (named["from_label"] != "") & (named["from_label"] == named["to_label"])
    return named.assign(label=named["label"].where(~steady, named["from_label"]))


def _is_machine_made(corpus: CorpusView, take: str, tier: str, author: str) -> bool:
    """Whether a model labelled a tier: here, or before it came in as a file."""
    if corpus.provenance(take, "tier", tier, author):
        return True
    table = corpus.tier(take, tier, author=author)
    return bool(len(table)) and bool((table["origin"] == "model").all())
