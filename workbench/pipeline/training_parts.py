"""The parts of a labeller's training: told as they go on, kept when they are finished, resumed when interrupted."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...models.labellers import Epoch, FrameLabeller, LabelledFrames, NetworkLabeller
from ...models.labellers.storage import labeller_from_arrays, labeller_to_arrays
from ...models.model_learning import WHOLE
from ..progress import Reporter
from ..scratch import Scratch

__all__ = ["TrainingParts"]


class TrainingParts:
    """Fits the parts (all takes, and each fold of the calibration) of one model's training.

    Call it as :data:`mimique.models.model_learning.FitPart`. Finished parts and, of a network, the state after each
    epoch go to the scratch folder, under the fingerprint of all that the model is learned from.

    Parameters
    ----------
    scratch, fingerprint
        Where parts are kept, and the name they go by.
    reporter
        A stage is entered for each part that takes time; a network's has one step an epoch.
    title
        Of the stages.

    Attributes
    ----------
    keys : list of str
        What was kept in the scratch folder; to be dropped once the model is stored.
    """

    def __init__(self, scratch: Scratch, fingerprint: str, reporter: Reporter, title: str) -> None:
        self._scratch = scratch
        self._fingerprint = fingerprint
        self._reporter = reporter
        self._title = title
        self.keys: list[str] = []

    def __call__(self, part: str, labeller: FrameLabeller, frames: LabelledFrames) -> FrameLabeller:
        """Return the labeller fitted: from the scratch folder where it was finished before, else learned now."""
        key = f"{self._fingerprint}-{part.replace(' ', '-')}"
        self.keys += [key, f"{key}-epochs"]
        kept = self._scratch.get(key)
        if kept is not None:
            metadata = json.loads(kept.pop("metadata").tobytes())
            return labeller_from_arrays(kept, metadata)
        title = f"Training {self._title}" + ("" if part == WHOLE else f", {part}")
        if isinstance(labeller, NetworkLabeller):
            with self._reporter.stage(title, labeller.max_epochs, "epochs at most") as finished:
                self._fit_network(labeller, frames, f"{key}-epochs", finished)
        else:
            with self._reporter.stage(title, 1, "labeller") as finished:
                _fit(labeller, frames)
                finished(part)
        arrays, metadata = labeller_to_arrays(labeller)
        text = np.frombuffer(json.dumps(metadata).encode(), dtype=np.uint8)
        self._scratch.put(key, {**arrays, "metadata": text})
        self._scratch.drop([f"{key}-epochs"])
        return labeller

    def _fit_network(self, labeller: NetworkLabeller, frames: LabelledFrames, key: str, finished: Any) -> None:
        state: Mapping[str, NDArray] | None = self._scratch.get(key)
        if state is not None:
            finished("resumed", len(state["losses"]))

        def tell(epoch: Epoch) -> None:
            finished(f"held-out loss {epoch.held_out_loss:.3f}, best {epoch.best}")
            self._scratch.put(key, epoch.state())

        labeller.set_params(callback=tell, checkpoint=state)
        try:
            _fit(labeller, frames)
        except InputError as error:
            if state is None or not str(error).startswith("checkpoint"):
                raise
            labeller.set_params(checkpoint=None)  # of another version of PyTorch, say: begin again
            _fit(labeller, frames)
        finally:
            labeller.set_params(callback=None, checkpoint=None)


def _fit(labeller: FrameLabeller, frames: LabelledFrames) -> None:
    several = len(set(frames.signers)) > 1
    labeller.fit(frames.X, frames.y, frames.groups, signers=frames.signers if several else None)
