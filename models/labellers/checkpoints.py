"""The state of a training between two epochs, as plain arrays that any file can hold."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .networks import import_torch

__all__ = ["load_state", "make_state"]


def make_state(
    network: Any,
    optimiser: Any,
    rng: np.random.Generator,
    best_arrays: Mapping[str, NDArray],
    losses: list[tuple[float, float]],
    best: int,
) -> dict[str, NDArray]:
    """Return parameters, the optimiser's moments, both random generators, and what the epochs so far gave."""
    torch = import_torch()
    state = {f"network.{name}": _to_array(values) for name, values in network.state_dict().items()}
    state |= {f"best.{name}": np.array(values) for name, values in best_arrays.items()}
    for place, moments in optimiser.state_dict()["state"].items():
        state |= {f"optimiser.{place}.{name}": _to_array(values) for name, values in moments.items()}
    state["losses"] = np.array(losses, dtype=np.float64).reshape(-1, 2)
    state["best"] = np.array(best)
    state["numpy_random"] = np.frombuffer(json.dumps(rng.bit_generator.state).encode(), dtype=np.uint8)
    state["torch_random"] = _to_array(torch.random.get_rng_state())
    device = next(network.parameters()).device
    if device.type == "cuda":
        state["cuda_random"] = _to_array(torch.cuda.get_rng_state(device))
    return state


def load_state(
    state: Mapping[str, NDArray], network: Any, optimiser: Any, rng: np.random.Generator
) -> tuple[int, list[tuple[float, float]], dict[str, NDArray]]:
    """Put network, optimiser and random generators back to where they were.

    Returns
    -------
    The best epoch, the losses of all epochs, and the parameters of the best one.

    Raises
    ------
    InputError
        If the state is of another network or another kind of random generator.
    """
    torch = import_torch()
    parts: dict[str, dict[str, NDArray]] = {"network": {}, "best": {}, "optimiser": {}}
    for key, values in state.items():
        part, _, name = key.partition(".")
        if name and part in parts:
            parts[part][name] = values
    moments: dict[int, dict[str, Any]] = {}
    for key, values in parts["optimiser"].items():
        place, _, name = key.partition(".")
        moments.setdefault(int(place), {})[name] = torch.from_numpy(np.array(values))
    try:
        network.load_state_dict({name: torch.from_numpy(np.array(values)) for name, values in parts["network"].items()})
        optimiser.load_state_dict({"state": moments, "param_groups": optimiser.state_dict()["param_groups"]})
        rng.bit_generator.state = json.loads(np.asarray(state["numpy_random"]).tobytes().decode())
        torch.random.set_rng_state(torch.from_numpy(np.array(state["torch_random"])))
        device = next(network.parameters()).device
        if device.type == "cuda" and "cuda_random" in state:
            torch.cuda.set_rng_state(torch.from_numpy(np.array(state["cuda_random"])), device)
        losses = [(float(train), float(held_out)) for train, held_out in state["losses"]]
        return int(state["best"]), losses, parts["best"]
    except (RuntimeError, KeyError, ValueError) as error:
        line = str(error).splitlines()[0]
        raise InputError(
            f"checkpoint: expected one of the same network and settings, but it does not fit ({line})"
        ) from error


def _to_array(values: Any) -> NDArray:
    return np.array(values.detach().cpu().numpy())
