"""Training of a network: windows, loss, early stopping, checkpoints. One loop, to be read from top to bottom.

The loss of a window is the mean cross entropy of its labelled frames, plus a penalty on what flickers (Farha and Gall
2019, eq. 7-10): the mean over frames and classes of ``min(|log p_t − log p_{t−1}|, 4)²``.

References
----------
.. [1] Y. A. Farha, J. Gall, "MS-TCN: multi-stage temporal convolutional network for action segmentation", CVPR 2019.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import GAP
from .checkpoints import load_state, make_state
from .networks import import_torch, make_network

__all__ = ["Epoch", "NetworkPlan", "Trained", "score_sequences", "train_network"]

LARGEST_BATCH = 64
STEEPEST = 4.0


@dataclass(frozen=True)
class NetworkPlan:
    """What a network looks like, and how it is trained; lengths are counted in samples at the working rate."""

    kind: str
    n_features: int
    n_classes: int
    n_hidden: int
    n_layers: int
    dropout: float
    window: int
    batch: int
    learning_rate: float
    weight_decay: float
    flicker: float
    gain: float
    noise: float
    max_epochs: int
    patience: int
    device: str

    def build(self) -> Any:
        """Return the network, untrained."""
        return make_network(
            self.kind,
            self.n_features,
            self.n_classes,
            n_hidden=self.n_hidden,
            n_layers=self.n_layers,
            dropout=self.dropout,
        )


@dataclass(frozen=True)
class Epoch:
    """What a callback is told after each pass over the training takes.

    ``arrays`` are the network's parameters where this epoch is the best so far, else ``None``. ``state()`` gives a
    checkpoint: all that :func:`train_network` needs to go on after this epoch, as plain arrays.
    """

    number: int
    max_epochs: int
    loss: float
    held_out_loss: float
    best: int
    arrays: dict[str, NDArray] | None = field(repr=False, default=None)
    state: Callable[[], dict[str, NDArray]] = field(repr=False, default=dict)


@dataclass(frozen=True)
class Trained:
    """Parameters of the best epoch, and the losses of all: rows of (training, held out)."""

    arrays: dict[str, NDArray]
    losses: NDArray[np.float64]
    best: int


def train_network(
    plan: NetworkPlan,
    train: Sequence[tuple[NDArray, NDArray]],
    held_out: Sequence[tuple[NDArray, NDArray]],
    *,
    rng: np.random.Generator,
    callback: Callable[[Epoch], None] | None = None,
    checkpoint: Mapping[str, NDArray] | None = None,
) -> Trained:
    """Train until the held-out loss has not fallen for ``plan.patience`` epochs.

    Parameters
    ----------
    plan
        Network and settings.
    train, held_out
        Sequences: standardised values ``(n_samples, n_features)`` and codes ``(n_samples,)``, -1 without a label. With
        nothing held out the training loss decides.
    rng
        Windows, order, distortions and the network's first parameters come from it.
    callback
        Called after each epoch.
    checkpoint
        ``Epoch.state()`` of an interrupted training of the same plan, sequences and seed; it goes on from there, and on
        a CPU comes out as if it had not been interrupted.

    Notes
    -----
    PyTorch's own generators and settings are left as they were found.
    """
    torch = import_torch()
    devices = [torch.device(plan.device)] if plan.device.startswith("cuda") else []
    with torch.random.fork_rng(devices=devices):
        torch.manual_seed(int(rng.integers(2**31)))
        network = plan.build().to(plan.device)
        optimiser = torch.optim.AdamW(network.parameters(), lr=plan.learning_rate, weight_decay=plan.weight_decay)
        best, least, arrays = 0, np.inf, _arrays_of(network)
        losses: list[tuple[float, float]] = []
        if checkpoint is not None:
            best, losses, arrays = load_state(checkpoint, network, optimiser, rng)
            least = losses[best - 1][1] if best else np.inf
        if len(losses) - best >= plan.patience:
            return Trained(arrays, np.array(losses), best)
        for number in range(len(losses) + 1, plan.max_epochs + 1):
            network.train()
            windows = [_distort(window, plan, rng) for window in _cut_windows(train, plan.window, rng)]
            total = n_labelled = 0.0
            for first in range(0, len(windows), plan.batch):
                x, codes, lengths = _pad(windows[first : first + plan.batch], plan.device)
                optimiser.zero_grad()
                loss = _loss(network(x, lengths), codes, lengths, plan.flicker)
                loss.backward()
                torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
                optimiser.step()
                n_known = float((codes != GAP).sum())
                total, n_labelled = total + float(loss.detach()) * n_known, n_labelled + n_known
            train_loss = total / n_labelled
            loss_now = _measure(network, held_out, plan) if held_out else train_loss
            losses.append((train_loss, loss_now))
            better = loss_now < least
            if better:
                best, least, arrays = number, loss_now, _arrays_of(network)
            if callback is not None:
                state = partial(make_state, network, optimiser, rng, arrays, losses, best)
                callback(Epoch(number, plan.max_epochs, train_loss, loss_now, best, arrays if better else None, state))
            if number - best >= plan.patience:
                break
    return Trained(arrays, np.array(losses), best)


def score_sequences(plan: NetworkPlan, arrays: dict[str, NDArray], sequences: Sequence[NDArray]) -> list[NDArray]:
    """Probabilities ``(n_samples, n_classes)`` of each sequence, by a network with these parameters."""
    torch = import_torch()
    with torch.random.fork_rng(devices=[]):  # building draws first parameters, which are replaced
        network = plan.build()
    network.load_state_dict({name: torch.from_numpy(np.array(values)) for name, values in arrays.items()})
    network.to(plan.device).eval()
    scores: list[NDArray] = [np.zeros((0, plan.n_classes))] * len(sequences)
    order = np.argsort([len(values) for values in sequences], kind="stable")
    with torch.inference_mode():
        for first in range(0, len(order), LARGEST_BATCH):
            chosen = order[first : first + LARGEST_BATCH]
            blank = [(sequences[i], np.zeros(len(sequences[i]), dtype=np.int64)) for i in chosen]
            x, _, lengths = _pad(blank, plan.device)
            likely = network(x, lengths).double().softmax(dim=-1).cpu().numpy()
            for row, i in enumerate(chosen):
                scores[i] = likely[row, : len(sequences[i])]
    return scores


def _cut_windows(
    sequences: Sequence[tuple[NDArray, NDArray]], window: int, rng: np.random.Generator
) -> list[tuple[NDArray, NDArray]]:
    """Cut each sequence into windows at random places, as many as would cover it, and shuffle them."""
    windows = []
    for values, codes in sequences:
        n_windows = -(-len(values) // window)
        for onset in rng.integers(0, max(len(values) - window, 0) + 1, size=n_windows):
            piece = slice(int(onset), int(onset) + window)
            if (codes[piece] != GAP).any():
                windows.append((values[piece], codes[piece]))
    return [windows[i] for i in rng.permutation(len(windows))]


def _distort(window: tuple[NDArray, NDArray], plan: NetworkPlan, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Return a window as another signer might have moved: all larger or smaller, and each curve by itself."""
    values, codes = window
    gain = np.exp(plan.gain * (rng.standard_normal() + rng.standard_normal(values.shape[1])))
    return values * gain + plan.noise * rng.standard_normal(values.shape), codes


def _pad(windows: Sequence[tuple[NDArray, NDArray]], device: str) -> tuple[Any, Any, Any]:
    torch = import_torch()
    lengths = np.array([len(codes) for _, codes in windows])
    x = np.zeros((len(windows), lengths.max(), windows[0][0].shape[1]), dtype=np.float32)
    known = np.full(x.shape[:2], GAP)
    for row, (values, codes) in enumerate(windows):
        x[row, : len(codes)], known[row, : len(codes)] = values, codes
    return tuple(torch.from_numpy(part).to(device) for part in (x, known, lengths))


def _loss(scores: Any, codes: Any, lengths: Any, flicker: float) -> Any:
    torch = import_torch()
    log_likely = scores.log_softmax(dim=-1)
    loss = torch.nn.functional.nll_loss(log_likely.flatten(0, 1), codes.flatten(), ignore_index=GAP)
    if flicker:
        # The frame before is held fixed: otherwise flat answers would be an easy way out.
        change = (log_likely[:, 1:] - log_likely[:, :-1].detach()).abs().clamp(max=STEEPEST) ** 2
        inside = torch.arange(1, scores.shape[1], device=scores.device) < lengths[:, None]
        loss = loss + flicker * change[inside].sum() / (inside.sum().clamp(min=1) * scores.shape[-1])
    return loss


def _measure(network: Any, sequences: Sequence[tuple[NDArray, NDArray]], plan: NetworkPlan) -> float:
    """Mean cross entropy of the labelled frames of whole sequences."""
    torch = import_torch()
    network.eval()
    total, n_labelled = 0.0, 0
    with torch.inference_mode():
        for first in range(0, len(sequences), LARGEST_BATCH):
            x, codes, lengths = _pad(sequences[first : first + LARGEST_BATCH], plan.device)
            n_known = int((codes != GAP).sum())
            if n_known:
                total += float(_loss(network(x, lengths), codes, lengths, 0.0)) * n_known
                n_labelled += n_known
    return total / n_labelled if n_labelled else float("inf")


def _arrays_of(network: Any) -> dict[str, NDArray]:
    return {name: values.detach().cpu().numpy().copy() for name, values in network.state_dict().items()}
