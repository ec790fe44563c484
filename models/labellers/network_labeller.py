"""Labels from a network that sees the sequence: LSTM, GRU or temporal convolution."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import check_random_state

from ...errors import InputError
from .base import GAP, FrameLabeller
from .durations import best_segmentation
from .network_training import Epoch, NetworkPlan, score_sequences, train_network
from .networks import NETWORKS, choose_device
from .per_frame import LEAST_PROBABILITY, describe_samples
from .takes import hold_out_takes

__all__ = ["NetworkLabeller"]


class NetworkLabeller(FrameLabeller):
    """A network over time, trained with early stopping on takes (or signers) that it does not learn from.

    Parameters
    ----------
    rate
        Of the recording, Hz.
    network
        ``"lstm"``, ``"gru"`` or ``"tcn"``, see :mod:`.networks`.
    n_hidden, n_layers, dropout
        Size of the network; the convolution of n layers looks 2ⁿ − 1 samples to each side.
    velocity
        Spans in seconds of the velocities that stand beside the weights.
    window
        Seconds of a training window, above 0; labelling takes whole takes.
    batch, learning_rate, weight_decay, max_epochs
        Of AdamW.
    flicker
        Weight of the penalty on answers that change from sample to sample.
    gain, noise
        Distortion of the training windows: spread of the logarithm of their gain, and of noise in units of each
        descriptor's deviation.
    held_out
        Share of the takes, or of the signers where `fit` is given them, that decides when to stop.
    patience
        Epochs without a lower held-out loss after which training stops.
    min_duration, change
        The answer is the best segmentation under the network's probabilities with segments of at least
        `min_duration` seconds and a price of `change` on each change of label, see :mod:`.durations`; 0 and 0 for the
        likeliest label of each frame.
    device
        ``"auto"`` (a graphics processor where there is one), ``"cpu"``, ``"cuda"`` …
    callback
        Called with an :class:`~mimique.models.labellers.Epoch` after each epoch, for progress and checkpoints.
    checkpoint
        ``Epoch.state()`` of an interrupted training on the same takes with the same parameters, to go on from.
    work_rate
        Rate at which the network runs, Hz.
    single_take
        Whether ``fit`` and ``score`` may take `X` without groups for the frames of one take.
    random_state
        Seed. On a CPU, with one number of threads, the same seed gives the same network.

    Attributes
    ----------
    arrays_ : dict of ndarray
        Parameters of the best epoch; plain arrays, no PyTorch objects.
    losses_ : ndarray
        ``(n_epochs, 2)`` loss on training windows and on held-out takes.
    best_epoch_ : int
        Counted from 1.
    """

    def __init__(
        self,
        rate: float = 200.0,
        *,
        network: str = "gru",
        n_hidden: int = 48,
        n_layers: int = 1,
        dropout: float = 0.3,
        velocity: Sequence[float] = (0.2,),
        window: float = 8.0,
        batch: int = 16,
        learning_rate: float = 3e-3,
        weight_decay: float = 1e-2,
        flicker: float = 0.15,
        gain: float = 0.15,
        noise: float = 0.1,
        held_out: float = 0.15,
        max_epochs: int = 60,
        patience: int = 10,
        min_duration: float = 0.2,
        change: float = 2.0,
        device: str = "auto",
        callback: Callable[[Epoch], None] | None = None,
        checkpoint: Mapping[str, NDArray] | None = None,
        work_rate: float = 25.0,
        single_take: bool = False,
        random_state: int | None = None,
    ) -> None:
        self.rate = rate
        self.network = network
        self.n_hidden = n_hidden
        self.n_layers = n_layers
        self.dropout = dropout
        self.velocity = velocity
        self.window = window
        self.batch = batch
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.flicker = flicker
        self.gain = gain
        self.noise = noise
        self.held_out = held_out
        self.max_epochs = max_epochs
        self.patience = patience
        self.min_duration = min_duration
        self.change = change
        self.device = device
        self.callback = callback
        self.checkpoint = checkpoint
        self.work_rate = work_rate
        self.single_take = single_take
        self.random_state = random_state

    def _fit_samples(self, samples: list[NDArray], codes: list[NDArray], units: list[Any]) -> None:
        self._check_parameters()
        device = choose_device(self.device)
        rng = np.random.default_rng(int(check_random_state(self.random_state).randint(2**31 - 1)))
        described = [describe_samples(part, self.work_rate, self.velocity) for part in samples]
        train, out = hold_out_takes(units, self.held_out, rng)
        if not any((codes[i] != GAP).any() for i in train):
            raise InputError(
                "labels: expected labelled frames in the takes to train on, but those held out have them all"
            )
        learned = np.concatenate([described[i] for i in train])
        self.mean_ = learned.mean(axis=0)
        spread = learned.std(axis=0)
        # A curve that never moves in training has no scale of its own.
        self.spread_ = np.where(spread > 1e-6 * spread.max(initial=1e-300), spread, 1.0)
        sequences = [(self._standardise(part), own) for part, own in zip(described, codes, strict=True)]
        self.plan_ = self._make_plan(described[0].shape[1], device)
        trained = train_network(
            self.plan_,
            [sequences[i] for i in train],
            [sequences[i] for i in out if (codes[i] != GAP).any()],
            rng=rng,
            callback=self.callback,
            checkpoint=self.checkpoint,
        )
        self.arrays_, self.losses_, self.best_epoch_ = trained.arrays, trained.losses, trained.best

    def _make_plan(self, n_features: int, device: str) -> NetworkPlan:
        return NetworkPlan(
            kind=self.network,
            n_features=n_features,
            n_classes=len(self.classes_),
            n_hidden=self.n_hidden,
            n_layers=self.n_layers,
            dropout=self.dropout,
            window=max(2, round(self.window * self.work_rate)),
            batch=self.batch,
            learning_rate=self.learning_rate,
            weight_decay=self.weight_decay,
            flicker=self.flicker,
            gain=self.gain,
            noise=self.noise,
            max_epochs=self.max_epochs,
            patience=self.patience,
            device=device,
        )

    def _score_samples(self, samples: list[NDArray]) -> list[NDArray]:
        plan = replace(self.plan_, device=choose_device(self.device))  # labelling may happen on another machine
        described = [self._standardise(describe_samples(part, self.work_rate, self.velocity)) for part in samples]
        return score_sequences(plan, self.arrays_, described)

    def _decode(self, samples: list[NDArray]) -> list[NDArray]:
        return self._answer(samples)[1]

    def _answer(self, samples: list[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
        scores = self._score_samples(samples)
        return scores, self._merge(scores)

    def _merge(self, scores: list[NDArray]) -> list[NDArray]:
        n_least = max(1, int(np.ceil(self.min_duration * self.work_rate - 1e-9)))
        if n_least == 1 and not self.change:
            return scores
        return [best_segmentation(np.log(np.maximum(part, LEAST_PROBABILITY)), n_least, self.change) for part in scores]

    def _standardise(self, described: NDArray) -> NDArray[np.float32]:
        return ((described - self.mean_) / self.spread_).astype(np.float32)

    def _check_parameters(self) -> None:
        if self.network not in NETWORKS:
            raise InputError(f"network: expected one of {', '.join(NETWORKS)}, but got {self.network!r}")
        for name in ("n_hidden", "n_layers", "batch", "max_epochs", "patience"):
            if int(getattr(self, name)) < 1:
                raise InputError(f"{name}: expected at least 1, but got {getattr(self, name)}")
        for name in ("flicker", "gain", "noise", "weight_decay", "min_duration", "change"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"{name}: expected a number of at least 0, but got {getattr(self, name)}")
        for name in ("window", "learning_rate"):
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(f"{name}: expected a number above 0, but got {getattr(self, name)}")
        if not 0 <= self.dropout < 1:
            raise InputError(f"dropout: expected a share from 0 to below 1, but got {self.dropout}")
