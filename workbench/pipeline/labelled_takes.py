"""The takes of a corpus as the learners see them: weights, and one annotator's tier."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from ...corpus.annotations.vocabulary import add_transitions
from ...corpus.annotations.vocabulary_change import declared_vocabulary
from ...corpus.store.view import CorpusView
from ...errors import InputError, NotFoundError
from ...models import LabelledTake
from .shape_weights import read_shape_weights
from .tier_makers import came_by_review, is_machine_made

AFFECT_TIER = "affect"

FROM_SCRATCH, WITH_PROPOSALS, ADJUDICATED = "from scratch", "with proposals", "adjudicated"
"""How a person's tier came about, see :func:`tell_reading`."""


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
    counts = count_annotators(corpus, tier)
    if author is not None and author in counts:
        return author
    people = ", ".join(sorted(counts)) or "nobody"
    if author is not None:
        raise NotFoundError(f"no tier {tier!r} by {author!r}; annotators of it are: {people}")
    if corpus.takes().empty:
        raise NotFoundError("the corpus has no takes yet; run: mimique ingest CORPUS FILES")
    if not counts:
        raise NotFoundError(f"nobody has annotated a tier {tier!r} yet; ingest annotation files with one")
    return min(counts, key=lambda name: (-counts[name], name))


def count_annotators(corpus: CorpusView, tier: str = AFFECT_TIER) -> dict[str, int]:
    """Return how many takes each person annotated; what a model labelled is not counted."""
    counts: dict[str, int] = {}
    for take in corpus.takes()["take"]:
        for row in corpus.tiers(take).itertuples():
            if row.tier == tier and not _is_machine_made(corpus, str(take), tier, str(row.author)):
                counts[str(row.author)] = counts.get(str(row.author), 0) + 1
    return counts


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
        If a take has no signer or protocol; if weights are wanted and a label is not in the corpus's vocabulary
        (without them, times are counted, and an unknown label has a time too).
    NotFoundError
        If weights are wanted and a take has none.
    """
    found = []
    known = known_labels(corpus, tier) if with_weights else None
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
        segments = name_affects(corpus.tier(str(row.take), tier, author=author))
        if came_by_review(corpus.provenance(str(row.take), "tier", tier, author)):
            segments = leave_out_proposals(segments)
        if known is not None:
            _refuse_unknown(segments, known, f"take {row.take!r}, tier {tier!r} of {author}", tier)
        weights = read_shape_weights(corpus, str(row.take), solve)["weights"].values if with_weights else None
        found.append(
            LabelledTake(
                name=str(row.take),
                signer=str(row.signer),
                protocol=str(row.protocol),
                rate=float(row.rate),
                segments=segments,
                weights=weights,
                n_frames=int(row.frames),
            )
        )
    return found


def refuse_unlabelled_signers(
    corpus: CorpusView,
    takes: Sequence[LabelledTake],
    author: str,
    protocols: Sequence[str],
    signers: Sequence[str] | None,
) -> None:
    """Refuse signers of whom there are takes of the protocols, but none that the annotator labelled."""
    table = corpus.takes()
    recorded = table[table["protocol"].isin(list(protocols))]["signer"].dropna().astype(str)
    wanted = sorted(set(signers if signers else recorded))
    without = [signer for signer in wanted if signer not in {take.signer for take in takes}]
    if not without:
        return
    if without[0] not in set(recorded):
        raise NotFoundError(f"signer {without[0]!r}: no take of the protocols {', '.join(protocols)} is of this signer")
    raise InputError(
        f"signer {without[0]}: expected a tier {AFFECT_TIER!r} by {author!r} in their {', '.join(protocols)} takes, "
        "but there is none; annotate them, or choose other signers with --signer"
    )


def tell_reading(table: pd.DataFrame) -> str:
    """Return how a person's tier came about: adjudicated, with a machine's proposals, or from scratch.

    Adjudicated segments are the outcome of a comparison, and no reading of their own; a segment whose origin is a model
    was proposed, whoever reviewed it. A proposal that a person changed counts as theirs by then, so a tier in which
    every single one was changed is told as from scratch.
    """
    if (table["status"] == "adjudicated").any():
        return ADJUDICATED
    return WITH_PROPOSALS if (table["origin"] == "model").any() else FROM_SCRATCH


def known_labels(corpus: CorpusView, tier: str = AFFECT_TIER) -> set[str] | None:
    """Return the labels that a tier may hold, affects by their English names; None where none are declared."""
    try:
        vocabulary = declared_vocabulary(corpus, tier)
    except NotFoundError:
        return None
    names = pd.DataFrame({"label": pd.Series([*vocabulary.labels, *vocabulary.retired], dtype="str")})
    return {*names["label"], *name_affects(names)["label"]}


def leave_out_proposals(segments: pd.DataFrame) -> pd.DataFrame:
    """Return a reviewed tier without what a model proposed and nobody looked at: that time is not annotated yet.

    A transition follows from what it lies between, and nobody is asked about it: a proposed one stays where it touches
    a segment that stays on both sides.

    Parameters
    ----------
    segments
        With ``from_label`` and ``to_label``, in order of onset.
    """
    kept = ~((segments["status"] == "proposed") & (segments["origin"] == "model"))
    moving = segments["from_label"] != segments["to_label"]
    onset, offset = segments["onset"], segments["offset"]
    between = (
        (kept & ~moving).shift(1, fill_value=False)
        & (kept & ~moving).shift(-1, fill_value=False)
        & (offset.shift(1) == onset)
        & (onset.shift(-1) == offset)
    )
    return segments[kept | (moving & between)].reset_index(drop=True)


def _refuse_unknown(segments: pd.DataFrame, known: set[str], where: str, tier: str) -> None:
    """Refuse labels that are neither known nor a transition between known ones."""
    moving = (segments["from_label"] != "") & (segments["from_label"] != segments["to_label"])
    wrong = segments[~moving & ~segments["label"].isin(known)]
    if len(wrong):
        label, onset = str(wrong["label"].iloc[0]), int(wrong["onset"].iloc[0])
        raise InputError(
            f"{where}: the label {label!r} at frame {onset} is not in the vocabulary {tier!r}; correct it, or add it "
            f"with: mimique vocabulary CORPUS add {label or 'LABEL'}"
        )


def name_affects(segments: pd.DataFrame) -> pd.DataFrame:
    """Return a tier with affects by their English names, whatever code the annotator used, and transitions told."""
    named = add_transitions(segments)
    steady = (named["from_label"] != "") & (named["from_label"] == named["to_label"])
    return named.assign(label=named["label"].where(~steady, named["from_label"]))


def _is_machine_made(corpus: CorpusView, take: str, tier: str, author: str) -> bool:
    provenance = corpus.provenance(take, "tier", tier, author)
    if provenance and not came_by_review(provenance):
        return True
    return is_machine_made(provenance, corpus.tier(take, tier, author=author))
