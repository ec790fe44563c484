"""Three small networks that label each frame with a look at what is before and after it, in PyTorch.

``lstm`` (Hochreiter and Schmidhuber 1997) and ``gru`` (Cho et al. 2014) read the sequence in both directions; ``tcn``
is a stack of residual blocks of dilated convolutions over time (Bai, Kolter and Koltun 2018; Farha and Gall 2019), not
causal. All take ``(n_sequences, n_frames, n_features)`` with the length of each sequence, and give scores
``(n_sequences, n_frames, n_classes)``, whose softmax is the probability; what stands beyond a sequence's end changes
nothing before it. PyTorch is imported when a network is made, so that all else works without it.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

from ...errors import InputError

__all__ = ["NETWORKS", "choose_device", "has_torch", "import_torch", "make_network"]

NETWORKS = ("lstm", "gru", "tcn")


def has_torch() -> bool:
    """Return whether PyTorch is installed."""
    return importlib.util.find_spec("torch") is not None


def import_torch() -> Any:
    """Return PyTorch, or say how to get it."""
    try:
        return importlib.import_module("torch")
    except ImportError as error:
        raise InputError("PyTorch is not installed; install mimique[gpu], or choose a labeller without it") from error


def choose_device(device: str = "auto") -> str:
    """Return the device to train and label on: ``auto`` is a graphics processor where there is one, else the CPU."""
    torch = import_torch()
    if device == "auto":
        return "cuda" if torch.cuda.is_available() else "cpu"
    try:
        return str(torch.zeros(1, device=device).device)
    except (RuntimeError, AssertionError) as error:
        line = str(error).splitlines()[0]
        raise InputError(
            f"device: expected auto, cpu or a device of this machine, but got {device!r} ({line})"
        ) from error


def make_network(kind: str, n_features: int, n_classes: int, *, n_hidden: int, n_layers: int, dropout: float) -> Any:
    """Return a new network with random weights from PyTorch's generator.

    Parameters
    ----------
    kind
        ``lstm``, ``gru`` or ``tcn``.
    n_features, n_classes
        Width of what goes in and out.
    n_hidden
        Units per direction, or channels.
    n_layers
        Layers, or convolution blocks; block i looks 2**i frames to each side.
    dropout
        Share of the inputs and of each layer's outputs that is dropped in training.
    """
    if kind not in NETWORKS:
        raise InputError(f"network: expected one of {', '.join(NETWORKS)}, but got {kind!r}")
    torch = import_torch()
    nn = torch.nn
    module: Any = nn.Module

    class Recurrent(module):
        def __init__(self) -> None:
            super().__init__()
            layer = nn.LSTM if kind == "lstm" else nn.GRU
            self.enter = nn.Sequential(nn.Linear(n_features, n_hidden), nn.ReLU(), nn.Dropout(dropout))
            widths = [n_hidden] + [2 * n_hidden] * (n_layers - 1)
            self.forwards = nn.ModuleList(layer(width, n_hidden, batch_first=True) for width in widths)
            self.backwards = nn.ModuleList(layer(width, n_hidden, batch_first=True) for width in widths)
            self.between = nn.Dropout(dropout)
            self.leave = nn.Sequential(nn.Dropout(dropout), nn.Linear(2 * n_hidden, n_classes))

        def forward(self, x: Any, lengths: Any) -> Any:  # (S, F, n_features) -> (S, F, n_classes)
            # Each sequence is turned round within its own length, so that padding always comes last. Packed sequences
            # would do the same, and take several times as long to train on a CPU.
            places = torch.arange(x.shape[1], device=x.device).expand(x.shape[:2])
            turned = torch.where(places < lengths[:, None], lengths[:, None] - 1 - places, places)[:, :, None]
            x = self.enter(x)
            for number, (ahead, back) in enumerate(zip(self.forwards, self.backwards, strict=True)):
                x = self.between(x) if number else x
                read = back(x.gather(1, turned.expand_as(x)))[0]
                x = torch.cat((ahead(x)[0], read.gather(1, turned.expand_as(read))), dim=-1)
            return self.leave(x)

    class Block(module):
        def __init__(self, reach: int) -> None:
            super().__init__()
            self.look = nn.Conv1d(n_hidden, n_hidden, 3, padding=reach, dilation=reach)
            self.mix = nn.Conv1d(n_hidden, n_hidden, 1)
            self.drop = nn.Dropout(dropout)

        def forward(self, x: Any, inside: Any) -> Any:  # (S, n_hidden, F), the same out
            return (x + self.drop(self.mix(self.look(x).relu()))) * inside

    class Convolutional(module):
        def __init__(self) -> None:
            super().__init__()
            self.enter = nn.Sequential(nn.Conv1d(n_features, n_hidden, 1), nn.Dropout(dropout))
            self.blocks = nn.ModuleList(Block(2**i) for i in range(n_layers))
            self.leave = nn.Conv1d(n_hidden, n_classes, 1)

        def forward(self, x: Any, lengths: Any) -> Any:  # (S, F, n_features) -> (S, F, n_classes)
            inside = (torch.arange(x.shape[1], device=x.device) < lengths[:, None])[:, None].to(x.dtype)
            x = self.enter(x.transpose(1, 2)) * inside
            for block in self.blocks:
                x = block(x, inside)
            return self.leave(x).transpose(1, 2)

    return Convolutional() if kind == "tcn" else Recurrent()
