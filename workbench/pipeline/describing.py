"""What a corpus and a take hold, for people."""

from __future__ import annotations

from typing import Any

from ...corpus import Corpus


def describe_corpus(corpus: Corpus) -> dict[str, Any]:
    """Return the facts that head the list of takes."""
    takes = corpus.takes()
    rigs = [f"{name} ({', '.join(corpus.marker_maps(name)) or 'no marker map'})" for name in corpus.rigs()]
    return {
        "corpus": corpus.name,
        "snapshot": corpus.snapshot,
        "takes": f"{len(takes)}, {takes['seconds'].sum():.1f} s",
        "signers": ", ".join(sorted({str(s) for s in takes["signer"].dropna()})) or "none",
        "rigs": ", ".join(rigs) or "none",
        "models": ", ".join(corpus.models()) or "none",
        "tags": ", ".join(sorted(corpus.tags())) or "none",
    }


def describe_take(corpus: Corpus, take: str) -> dict[str, Any]:
    """Return what is known of a take, its processing steps, solves and tiers."""
    facts = corpus.takes().set_index("take")
    dataset = corpus.take(take)
    row = facts.loc[take]
    record: dict[str, Any] = {
        "take": take,
        "frames": int(row["frames"]),
        "rate": float(row["rate"]),
        "seconds": float(row["seconds"]),
        "markers": int(row["markers"]),
    }
    record.update({key: value for key, value in dataset.attrs.items() if key not in record})
    record["steps"] = corpus.steps(take)
    record["solves"] = corpus.solves(take)
    record["current solve"] = corpus.current_solve(take)
    record["tiers"] = [f"{r.tier} by {r.author}: {r.segments} segments" for r in corpus.tiers(take).itertuples()]
    return record
