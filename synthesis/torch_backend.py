"""The weight solver's methods on PyTorch: the same problems, on a graphics processor where there is one.

``on_torch(method)`` stands in for a method of :mod:`.weight_methods` and solves for the CPU's weights, to 1e-5 or
better. All arithmetic is float64: full speed on data-centre cards, slower on consumer cards, where float64 runs at 1/32
or less of float32's rate. Global defaults of PyTorch (type, device, threads) are neither read nor changed.

Frames go to the device in blocks that are bounded by its free memory. ``nnls`` is solved through its normal equations:
where several weights are equally good, another choice than SciPy's may come out. Smoothness over time joins the frames
of a whole take and is solved on NumPy (:mod:`.smooth_runs`); so is ``lsts-published``.

Speed on a graphics processor has not been measured yet; ``benchmarks/bench_torch.py`` measures it where there is one.
On a CPU the NumPy solver is the faster one, ``nnls`` excepted; on busy cores PyTorch needs ``OMP_NUM_THREADS=1``.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import check_array
from ..errors import InputError
from .bounded import Bounded
from .least_squares import LeastSquares
from .lsts import LSTS
from .nnls import NonNegativeLeastSquares
from .torch_solvers import BoxProgram, SoftPotential, soft_minimiser
from .weight_methods import Method

Array = NDArray[np.floating[Any]]

BLOCK_CPU = 1024
BLOCK_DEVICE = 65536
MEMORY_SHARE = 0.25
"""Largest numbers of frames at a time, and the part of a graphics processor's free memory that a block may take."""


def has_torch() -> bool:
    """Return whether PyTorch is installed."""
    return importlib.util.find_spec("torch") is not None


def choose_device(device: str | None = None) -> str:
    """Return the name of the device to solve on.

    Parameters
    ----------
    device
        A PyTorch device such as ``cpu``, ``cuda`` or ``cuda:1``; by default ``cuda`` where there is one, else ``cpu``.

    Raises
    ------
    InputError
        If PyTorch is not installed, or the device does not exist here or cannot compute in float64.
    """
    torch = _import_torch()
    if device is None:
        return "cuda" if torch.cuda.is_available() else "cpu"
    try:
        torch.zeros(1, dtype=torch.float64, device=device)
    except (RuntimeError, TypeError, AssertionError, NotImplementedError) as error:
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(
            f"device: expected one on which PyTorch computes in float64, but got {device!r} ({reason})"
        ) from None
    return str(device)


def describe_device(device: str | None = None) -> str:
    """Return the device's name in words, for reports."""
    torch, name = _import_torch(), choose_device(device)
    return str(torch.cuda.get_device_name(name)) if name.startswith("cuda") else f"{name}, PyTorch {torch.__version__}"


class TorchMethod:
    """A method whose minimisation runs on PyTorch; its objective stays the method's own.

    Parameters
    ----------
    method
        ``lsts``, ``bounded``, ``map``, ``nnls`` or ``least-squares``, from :func:`.weight_methods.make_method`.
    device
        As :func:`choose_device` takes it.

    Attributes
    ----------
    block_size
        Frames that it is best to pass at a time, for callers that take a take in blocks.

    Raises
    ------
    InputError
        If PyTorch is not installed, the device does not exist, or the method is solved on NumPy only.
    """

    def __init__(self, method: Method, device: str | None = None) -> None:
        # A subclass may solve something else: exact types only.
        if type(method) not in (LSTS, Bounded, NonNegativeLeastSquares, LeastSquares):
            raise InputError(
                f"backend: the torch backend solves lsts, bounded, map, nnls and least-squares frame by frame, "
                f"but got {type(method).__name__}; use backend='numpy'"
            )
        self.method, self.device = method, choose_device(device)
        # Fewer frames at a time would leave a graphics processor waiting for its next operation.
        self.block_size = BLOCK_DEVICE if self.device.startswith("cuda") else 2 * BLOCK_CPU

    def prepare(self, basis: Array) -> Callable[[Array], Array]:
        """Return a function from (F, rows) displacements to (F, N) weights for a (rows, N) basis, NumPy arrays all."""
        torch, device = _import_torch(), self.device
        basis = check_array(basis, name="basis", shape=(None, None), finite=True)
        n_rows, n_shapes = basis.shape

        def tensor(values: Any) -> Any:
            return torch.tensor(values, dtype=torch.float64, device=device)

        minimise = _minimiser(torch, self.method, basis, tensor)

        def solve(displacements: Array) -> Array:
            displacements = check_array(displacements, name="displacements", shape=(None, n_rows))
            weights = np.empty((len(displacements), n_shapes))
            rows = _block_size(torch, device, n_shapes)
            for start in range(0, len(displacements), rows):
                block = tensor(np.ascontiguousarray(displacements[start : start + rows]))
                weights[start : start + rows] = minimise(block).cpu().numpy()
            return weights

        return solve

    def data_term(self, squared_residuals: Array) -> Array:
        """Return the method's data term."""
        return self.method.data_term(squared_residuals)

    def penalty(self, weights: Array) -> Array:
        """Return the method's penalties."""
        return self.method.penalty(weights)


def on_torch(method: Method, device: str | None = None) -> TorchMethod:
    """Return the method solved on PyTorch; see :class:`TorchMethod`."""
    return TorchMethod(method, device)


def solve_with_torch(method: Method, basis: Array, displacements: Array, device: str | None = None) -> Array:
    """Return (F, N) weights for one (rows, N) basis and (F, rows) displacements, in the solver's unit."""
    return TorchMethod(method, device).prepare(basis)(displacements)


def _minimiser(torch: Any, method: Method, basis: Array, tensor: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function from a tensor of displacements to one of weights; shared matrices are made here, once."""
    if isinstance(method, LeastSquares):
        # NumPy's inverse, such that both backends agree on which directions count as unseen.
        inverse = tensor(np.ascontiguousarray(np.linalg.pinv(basis).T))
        return lambda displacements: displacements @ inverse
    B = tensor(basis)
    if isinstance(method, LSTS):
        bounds = method.bounds
        potential = SoftPotential(bounds.weight, bounds.s, bounds.l_inf, bounds.l_sup)
        least = soft_minimiser(torch, tensor(2.0 * (basis.T @ basis + method.alpha * method.energy)), potential)
        return lambda displacements: least(2.0 * (displacements @ B))
    if isinstance(method, Bounded):
        program = BoxProgram(torch, tensor(basis.T @ basis + method.quadratic), 0.0, 1.0)
        offset = tensor(method.quadratic @ method.centre - 0.5 * method.linear)
        return lambda displacements: program.solve(displacements @ B + offset)
    program = BoxProgram(torch, tensor(basis.T @ basis), 0.0, float("inf"))
    return lambda displacements: program.solve(displacements @ B)


def _block_size(torch: Any, device: str, n_shapes: int) -> int:
    """Return how many frames to solve at a time: each may need its own factorised matrix and some copies of it."""
    if not device.startswith("cuda"):
        return BLOCK_CPU
    free, _ = torch.cuda.mem_get_info(device)
    per_frame = 8 * (5 * n_shapes**2 + 50 * n_shapes)
    return int(np.clip(MEMORY_SHARE * free / per_frame, 1024, BLOCK_DEVICE))


def _import_torch() -> Any:
    """Return PyTorch; imported by name, because type checkers must not need it."""
    try:
        return importlib.import_module("torch")
    except (ImportError, OSError) as error:  # OSError where one of its own libraries is missing.
        reason = str(error).partition("\n")[0]
        raise InputError(f"backend: torch cannot be imported ({reason}); install mimique[gpu]") from None
