"""What is shown of a corpus under review: found once a snapshot, and kept while it is of use."""

from __future__ import annotations

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, TypeVar

from ....corpus import Corpus
from ....corpus.privacy.consent import explain_refusal
from ....errors import MimiqueError
from ..server.errors import Refusal
from .curves import TAU, WINDOW
from .made_files import MadeFiles, make_key
from .messages import Scene
from .rig_model import find_rig_model, model_key
from .scene import corpus_folder, describe_scene
from .shown_markers import ShownMarkers, open_markers
from .shown_weights import ShownWeights, open_weights
from .videos import list_videos

if TYPE_CHECKING:
    from ..context import Review

__all__ = ["Showing", "check_shown", "find_showing", "warm"]

Found = TypeVar("Found")

REMEMBERED = 64
"""Of each take that is open somewhere there are a scene, weights and markers, each a few kilobytes."""

_log = logging.getLogger(__name__)


class Showing:
    """Scenes, weights and markers of the takes that were asked for last, and the files of what was computed."""

    def __init__(self, files: MadeFiles) -> None:
        self.files = files
        self._lock = threading.Lock()
        self._known: OrderedDict[Hashable, object] = OrderedDict()

    def scene(self, corpus: Corpus, take: str, solve: str | None) -> Scene:
        """Return a take's scene; its videos are looked at anew, since files come and go."""
        scene = self._remember(
            ("scene", corpus.snapshot, take, solve), lambda: describe_scene(self.files, corpus, take, solve)
        )
        return scene.model_copy(update={"videos": list_videos(corpus, take, corpus_folder(corpus))})

    def weights(self, corpus: Corpus, take: str, solve: str | None) -> ShownWeights:
        """Return a take's weights on their rig, unread."""
        return self._remember(("weights", corpus.snapshot, take, solve), lambda: open_weights(corpus, take, solve))

    def markers(self, corpus: Corpus, take: str, solve: str | None) -> ShownMarkers | None:
        """Return a take's markers in the rig's space, unread; None where there are none."""
        weights = self.weights(corpus, take, solve)
        return self._remember(("markers", corpus.snapshot, take, solve), lambda: open_markers(corpus, weights))

    def _remember(self, key: Hashable, find: Callable[[], Found]) -> Found:
        with self._lock:
            if key in self._known:
                self._known.move_to_end(key)
                known: Found = self._known[key]  # type: ignore[assignment]
                return known
        # Found outside of the lock: two who ask at once find the same twice, but nobody waits for another take.
        found = find()
        with self._lock:
            self._known[key] = found
            while len(self._known) > REMEMBERED:
                self._known.popitem(last=False)
        return found


def find_showing(review: Review) -> Showing:
    """Return what the review keeps for showing."""
    return review.part("showing", lambda: Showing(MadeFiles(review.folder / "shown")))


def check_shown(corpus: Corpus, take: str, *, of: Corpus | None = None) -> None:
    """Refuse a take whose signer's consent does not cover showing it to the people of the project.

    Parameters
    ----------
    corpus
        Where consent is recorded: the newest.
    take
        Name.
    of
        Where the take is, if that is an earlier snapshot.

    Raises
    ------
    NotFoundError
        If there is no such take.
    Refusal
        403 with the reason.
    """
    signer = (of or corpus).take_attributes(take).get("signer")
    reason = explain_refusal(corpus, None if signer is None else str(signer))
    if reason is not None:
        raise Refusal(403, "forbidden", f"take {take!r} is not shown: {reason}")


def warm(review: Review) -> None:
    """Make the files of all rigs, and delete those of takes and rigs that the corpus has no longer.

    For a thread beside the server: what fails is left to the request that needs it, and to the log.
    """
    showing = find_showing(review)
    try:
        corpus = review.corpus()
        needed = set()
        for rig in corpus.rigs():
            if review.closing.is_set():
                return
            needed.add(model_key(corpus, rig))
            find_rig_model(showing.files, corpus, rig)
        for take in corpus.takes()["take"].tolist():
            for solve in corpus.solves(take):
                if review.closing.is_set():
                    return
                needed |= _keys_of_solve(corpus, take, solve)
        showing.files.drop_others(needed)
    except (MimiqueError, OSError) as error:
        _log.warning("the faces cannot be prepared: %s", error)


def _keys_of_solve(corpus: Corpus, take: str, solve: str) -> set[str]:
    try:
        key = open_weights(corpus, take, solve).key
    except MimiqueError:  # it shows nothing, so that there is nothing to keep
        return set()
    return {make_key(energies=key, tau=TAU, window=WINDOW), make_key(spread=key)}
