"""What the models hold of the segments that they proposed, computed in the background, once for each snapshot.

A stored model judges the segments of its own tiers again; that takes seconds, and a page does not wait for it. Segments
keep their ids in people's drafts, so a judgement is found by the id, whoever has the segment by now. What did not
change from one snapshot to the next is not judged again.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ....corpus.store.view import CorpusView
from ....corpus.versions.segment_rows import split_table
from ....errors import MimiqueError
from ...pipeline.queueing import judge_by_model
from ...pipeline.segmenting import SEGMENT_TIER
from ...pipeline.training import load_model
from .corpus_facts import CorpusFacts, collect_facts

if TYPE_CHECKING:
    from ....corpus import Corpus
    from ..context import Review

__all__ = ["Judged", "Judgements", "get_judgements", "judge_proposals"]

Place = tuple[str, str, str]
"""Take, tier, model."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Judged:
    """A model's tier: ``probabilities`` ``(n_segments, n_classes)``, and the row of each segment's id."""

    inputs: tuple[str, ...]
    """Fingerprints of what was judged, and by what."""
    rows: Mapping[int, int]
    probabilities: NDArray[np.float64]
    classes: tuple[str, ...]


class Judgements:
    """The newest judgements of a review, and the thread that finds them."""

    def __init__(self, closing: threading.Event) -> None:
        self._closing = closing
        self._lock = threading.Lock()
        self._judged: Mapping[Place, Judged] = {}
        self._done = ""
        self._wanted: Corpus | None = None
        self._running = False

    def get(self, corpus: Corpus) -> tuple[Mapping[Place, Judged], bool]:
        """Return what is known by now, and whether that is all for this snapshot; the rest is begun."""
        with self._lock:
            ready = self._done == corpus.snapshot
            if not ready and not self._closing.is_set():
                self._wanted = corpus
                if not self._running:
                    self._running = True
                    threading.Thread(target=self._work, name="review queue", daemon=True).start()
            return self._judged, ready

    def wait(self, corpus: Corpus, seconds: float) -> bool:
        """Wait until all is known of a snapshot, at most so long; return whether it is."""
        waited = threading.Event()
        for _ in range(max(int(seconds / 0.02), 1)):
            if self.get(corpus)[1]:
                return True
            waited.wait(0.02)
        return False

    def _work(self) -> None:
        while True:
            with self._lock:
                corpus, self._wanted = self._wanted, None
                if corpus is None or self._closing.is_set():
                    self._running = False
                    return
            try:
                self._judge(corpus)
            except Exception:  # whatever it is, people go on by the confidences
                _log.exception("the models' judgements of snapshot %s could not be found", corpus.snapshot)
            with self._lock:
                self._done = corpus.snapshot

    def _judge(self, corpus: Corpus) -> None:
        facts = collect_facts(corpus, corpus.snapshot)
        models = set(corpus.models())
        loaded: dict[str, Any] = {}
        found: dict[Place, Judged] = {}
        for take in facts.takes:
            for row in corpus.tiers(take).itertuples():
                place = (take, str(row.tier), str(row.author))
                if place[2] not in models or place[1] == SEGMENT_TIER:
                    continue
                if self._closing.is_set():
                    return
                inputs = _find_inputs(corpus, place)
                known = self._judged.get(place)
                judged = known if known and known.inputs == inputs else _judge(corpus, facts, place, inputs, loaded)
                if judged is not None:
                    found[place] = judged
            with self._lock:  # what is known already serves at once
                self._judged = {**self._judged, **found}
        with self._lock:
            self._judged = found


def get_judgements(review: Review) -> Judgements:
    """Return the judgements of a review."""
    return review.part("judgements", lambda: Judgements(review.closing))


def judge_proposals(corpus: CorpusView, facts: CorpusFacts, place: Place, model: Any) -> Judged | None:
    """Judge a model's proposed held segments; None where there are none.

    Raises
    ------
    MimiqueError
        If the model cannot judge this take.
    """
    take, tier, author = place
    table = corpus.tier(take, tier, author=author)
    _, rows = split_table(table)
    kept = [
        number
        for number, row in enumerate(rows)
        if row["status"] == "proposed" and row["origin"] == "model" and not facts.is_transition(tier, row)
    ]
    if not kept:
        return None
    p, classes = judge_by_model(corpus, take, model, table.iloc[kept].reset_index(drop=True))
    return Judged((), {int(rows[number]["id"]): n for n, number in enumerate(kept)}, p, tuple(classes))


def _judge(
    corpus: CorpusView, facts: CorpusFacts, place: Place, inputs: tuple[str, ...], loaded: dict[str, Any]
) -> Judged | None:
    try:
        if place[2] not in loaded:
            loaded[place[2]] = None
            loaded[place[2]] = load_model(corpus, place[2])[0]
        if loaded[place[2]] is None:
            return None
        judged = judge_proposals(corpus, facts, place, loaded[place[2]])
    except MimiqueError as error:
        _log.info("take %r: %s; the confidences of its tier stand for the model", place[0], error)
        return None
    return None if judged is None else Judged(inputs, judged.rows, judged.probabilities, judged.classes)


def _find_inputs(corpus: CorpusView, place: Place) -> tuple[str, ...]:
    take, tier, author = place
    solve = corpus.current_solve(take)
    return (
        corpus.fingerprint(take, "tier", tier, author),
        corpus.fingerprint(None, "model", author),
        corpus.fingerprint(take, "weights", solve) if solve else "",
    )
