"""What goes out of a corpus: weights as CSV, tiers as annotation files, takes as recordings."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ...corpus import write_take, write_tiers
from ...corpus.recordings import RECORDING_SUFFIXES
from ...corpus.tiers import TIER_SUFFIXES
from ...corpus.view import CorpusView
from ...errors import InputError
from ..text_files import write_text


def export(corpus: CorpusView, take: str, path: Path, *, solve: str | None = None) -> str:
    """Write one take's weights, tiers or markers; the suffix of the file says which.

    Parameters
    ----------
    corpus, take
        What to write.
    path
        ``.csv`` for weights (``time`` in s and one column a shape), ``.eaf`` or ``.TextGrid`` for all tiers,
        ``.c3d`` or ``.trc`` for the markers as recorded.
    solve
        Which weights; the take's current ones if left out.

    Returns
    -------
    A line that says what was written.

    Raises
    ------
    MimiqueError
        If the take or its weights are not there, the suffix is another, or the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        return _export_weights(corpus, take, path, solve)
    if suffix in TIER_SUFFIXES:
        tiers = read_all_tiers(corpus, take)
        write_tiers(path, tiers, rate=float(corpus.take(take).attrs["rate"]))
        return f"{path}: {len(tiers)} tiers, {sum(map(len, tiers.values()))} segments"
    if suffix in RECORDING_SUFFIXES:
        dataset = corpus.take(take)
        write_take(path, dataset)
        return f"{path}: {dataset.sizes['time']} frames, {dataset.sizes['marker']} markers"
    known = [".csv", *TIER_SUFFIXES, *RECORDING_SUFFIXES]
    raise InputError(f"{path}: expected a file that ends in one of {', '.join(known)}")


def read_all_tiers(corpus: CorpusView, take: str) -> dict[str, pd.DataFrame]:
    """Return every tier of a take; where several authors have a tier of one name, the name says whose it is."""
    listed = corpus.tiers(take)
    shared = listed["tier"].duplicated(keep=False)
    tiers = {}
    for row, several in zip(listed.itertuples(), shared, strict=True):
        name = f"{row.tier}@{row.author}" if several else str(row.tier)
        table = corpus.tier(take, str(row.tier), author=str(row.author))
        table.attrs["author"] = str(row.author)
        tiers[name] = table
    return tiers


def _export_weights(corpus: CorpusView, take: str, path: Path, solve: str | None) -> str:
    weights = corpus.weights(take, solve)
    frame = pd.DataFrame(weights["weights"].values, columns=[str(s) for s in weights["shape"].values])
    frame.insert(0, "time", weights["time"].values)
    write_text(path, frame.to_csv(index=False, float_format="%.7g", lineterminator="\n"))
    return f"{path}: {len(frame)} frames, {frame.shape[1] - 1} shapes"
