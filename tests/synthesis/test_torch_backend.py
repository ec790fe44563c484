import csv
import sys

import numpy as np
import pytest
from mimique.errors import InputError
from mimique.synthesis import Rig, WeightPrior, WeightSolver, arkit_name, read_rig, torch_backend
from mimique.synthesis.bounded import Bounded
from mimique.synthesis.least_squares import LeastSquares
from mimique.synthesis.lsts import LSTS
from mimique.synthesis.maximum_posterior import maximum_posterior
from mimique.synthesis.nnls import NonNegativeLeastSquares
from mimique.synthesis.weight_methods import make_method
from scipy.optimize import lsq_linear

torch = pytest.importorskip("torch", reason="PyTorch is not installed (mimique[gpu])")
from mimique.synthesis import torch_solvers  # noqa: E402
from mimique.synthesis.torch_backend import (  # noqa: E402
    TorchMethod,
    choose_device,
    describe_device,
    has_torch,
    on_torch,
    solve_with_torch,
)

DEVICES = ["cpu", *(["cuda"] if torch.cuda.is_available() else [])]
DEVICE = pytest.mark.parametrize("device", DEVICES)
NAMES = ("lsts", "bounded", "map", "nnls", "least-squares")


def matrices(n=12, rows=45, seed=0):
    rng = np.random.default_rng(seed)
    E = rng.normal(size=(n, n))
    return rng.normal(size=(rows, n)) * rng.uniform(0.1, 1.5, n), E @ E.T / n


def observed(B, n_frames=150, spread=0.6, seed=1):
    rng = np.random.default_rng(seed)
    return rng.normal(0.3, spread, (n_frames, B.shape[1])) @ B.T + rng.normal(0, 0.2, (n_frames, len(B)))


def small_rig(n=9, n_vertices=60):
    rng = np.random.default_rng(5)
    x, y = np.meshgrid(np.linspace(-60, 60, 10), np.linspace(-60, 60, 6), indexing="ij")
    v = np.stack([x, y, 15 * np.cos(x / 50)], -1).reshape(-1, 3)
    i = (np.arange(9)[:, None] * 6 + np.arange(5)).ravel()
    f = np.concatenate([np.stack([i, i + 6, i + 7], 1), np.stack([i, i + 7, i + 1], 1)])
    centre, width = rng.uniform(-50, 50, (n, 1, 2)), rng.uniform(20, 40, (n, 1))
    bump = np.exp(-((v[None, :, :2] - centre) ** 2).sum(2) / (2 * width**2))
    return Rig(v, f, bump[:, :, None] * rng.normal(0, 8, (n, 1, 3)), [f"s{k}" for k in range(n)])


RIG = small_rig()
PRIOR = WeightPrior.fit(np.random.default_rng(3).beta(0.5, 2, (300, RIG.n_shapes)))


@pytest.fixture(autouse=True)
def one_thread():
    """Threads that wait for each other on busy cores would only make the tests slow."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def solve_both(solver, positions, device):
    """Weights from NumPy, then from the same solver with its frames solved on PyTorch, and how often that prepared."""
    expected, accelerated, calls = solver.solve(positions), on_torch(solver._method, device), []

    def counted(basis):
        calls.append(basis.shape)
        return accelerated.prepare(basis)

    solver._method.prepare = counted
    return expected, solver.solve(positions), len(calls)


@DEVICE
@pytest.mark.parametrize("name", NAMES)
def test_the_solver_finds_the_same_weights(name, device):
    rng = np.random.default_rng(6)
    vertices = rng.choice(60, 16, replace=False)
    positions = RIG.pose(rng.beta(0.4, 1.5, (80, RIG.n_shapes)), vertices) + rng.normal(0, 0.3, (80, 16, 3))
    positions[20:50, 3] = np.nan  # Other visibility patterns are other calls of prepare.
    positions[40:60, [7, 9]] = np.nan
    positions[70] = np.nan
    solver = WeightSolver(RIG, vertices, name, prior=PRIOR if name == "map" else None)
    expected, found, calls = solve_both(solver, positions, device)
    assert calls == 4 and np.isnan(found[70]).all()
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)
    np.testing.assert_allclose(solver.objective(positions, found), solver.objective(positions, expected), rtol=1e-9)


@DEVICE
@pytest.mark.parametrize(("alpha", "s"), [(0.0, 0.1), (0.3, 0.1), (0.7, 0.05), (1.0, 0.1)])
@pytest.mark.parametrize("spread", [0.6, 2.0])
def test_lsts_gradient_vanishes(alpha, s, spread, device):
    B, E = matrices()
    method = LSTS(E, alpha, s, -0.1, 1.1)
    d = observed(B, spread=spread)
    c = solve_with_torch(method, B, d, device)
    low, high = np.exp((-0.1 - c) / s), np.exp((c - 1.1) / s)
    force = (1 - alpha) * s * (high - low)
    gradient = 2 * (c @ B.T - d) @ B + 2 * alpha * c @ E + force
    curvature = 2 * (B**2).sum(0) + 2 * alpha * np.diag(E) + (1 - alpha) * (low + high)
    assert np.abs(gradient / curvature).max() < 1e-6


@DEVICE
def test_box_against_scipy_and_its_conditions(device):
    B, E = matrices()
    Q, linear = 0.05 * E + 0.03 * np.eye(12), 0.02
    d = observed(B, spread=1.5)
    c = solve_with_torch(Bounded(Q, linear), B, d, device)
    assert c.min() >= 0 and c.max() <= 1
    gradient = 2 * ((c @ B.T - d) @ B + c @ Q) + linear
    inside = (c > 1e-12) & (c < 1 - 1e-12)
    assert inside.any() and (c == 0).any() and (c > 1 - 1e-12).any()
    assert np.abs(gradient[inside]).max() < 1e-8
    assert gradient[c <= 1e-12].min() > -1e-8 and gradient[c >= 1 - 1e-12].max() < 1e-8
    L = np.linalg.cholesky(B.T @ B + Q)
    for f in range(3):
        best = lsq_linear(L.T, np.linalg.solve(L, B.T @ d[f] - 0.5 * linear), (0, 1), tol=1e-14)
        np.testing.assert_allclose(c[f], best.x, atol=1e-6)


@DEVICE
def test_every_stage_of_the_box_solver_reaches_the_minimum(device):
    B, _ = matrices(seed=2)
    H = torch.tensor(B.T @ B, device=device)
    g = torch.tensor(observed(B, spread=2.0) @ B, device=device)
    program = torch_solvers.BoxProgram(torch, H, 0.0, 1.0)
    expected = program.solve(g)
    assert program._definite
    scaled = g * program._scale
    by_newton = program._finish(scaled, torch.zeros_like(scaled)) * program._scale
    assert float((by_newton - expected).abs().max()) < 1e-9
    program._definite, program._near = False, program._H + torch_solvers.PROXIMITY * torch.eye(12, device=device)
    assert float((program.solve(g) - expected).abs().max()) < 1e-9


def test_newton_finishes_what_conjugate_gradients_leave(monkeypatch):
    B, E = matrices()
    method, d = LSTS(E, 0.3, 0.1, -0.1, 1.1), observed(B, spread=1.0)
    expected = method.prepare(B)(d)
    monkeypatch.setattr(torch_solvers, "GRADIENT_STEPS", 1)
    np.testing.assert_allclose(solve_with_torch(method, B, d, "cpu"), expected, rtol=0, atol=1e-7)


@DEVICE
def test_nnls_where_weights_are_not_unique(device):
    """Shapes that are zero, cancel each other or repeat: the fit is the best, whichever weights make it."""
    B, _ = matrices(8, 30)
    B[:, 3], B[:, 5], B[:, 7] = -B[:, 2], 0.0, B[:, 6]
    d = np.random.default_rng(1).normal(size=(60, 30))
    expected = NonNegativeLeastSquares().prepare(B)(d)
    found = solve_with_torch(NonNegativeLeastSquares(), B, d, device)
    assert found.min() >= 0 and (found[:, 5] == 0).all()
    np.testing.assert_allclose(found @ B.T, expected @ B.T, atol=1e-7)
    np.testing.assert_allclose(found[:, :5], expected[:, :5], atol=1e-7)


@pytest.mark.parametrize("name", ["lsts", "bounded", "nnls"])
def test_blocks_do_not_matter(name, monkeypatch):
    B, E = matrices()
    d = observed(B, 130)
    method = {"lsts": LSTS(E, 0.3, 0.1, -0.1, 1.1), "bounded": Bounded(E), "nnls": NonNegativeLeastSquares()}[name]
    whole = solve_with_torch(method, B, d, "cpu")
    monkeypatch.setattr(torch_backend, "BLOCK_CPU", 7)
    np.testing.assert_allclose(solve_with_torch(method, B, d, "cpu"), whole, rtol=0, atol=1e-7)


def test_one_frame_and_none():
    B, E = matrices()
    solve = on_torch(LSTS(E, 0.3, 0.1, -0.1, 1.1), "cpu").prepare(B)
    d = observed(B, 5)
    np.testing.assert_allclose(solve(d[2:3]), solve(d)[2:3], atol=1e-7)
    assert solve(d[:0]).shape == (0, 12)
    assert on_torch(Bounded(E), "cpu").prepare(B)(np.zeros((2, 45))).tolist() == [[0.0] * 12] * 2


def test_nothing_global_changes():
    before = torch.get_default_dtype(), torch.get_num_threads(), torch.get_rng_state().tolist()
    B, E = matrices()
    found = solve_with_torch(Bounded(E), B, observed(B), "cpu")
    assert isinstance(found, np.ndarray) and found.dtype == np.float64
    assert before == (torch.get_default_dtype(), torch.get_num_threads(), torch.get_rng_state().tolist())


@DEVICE
def test_a_real_performance(shared_data, device):
    rig = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    with (shared_data / "arkit_recordings" / "livelinkface" / "alex_rom_3.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    names = [arkit_name(n) for n in head]
    columns = [names.index(arkit_name(s)) for s in rig.shapes]
    truth = np.clip([[float(row[k]) for k in columns] for row in rows[::40] if len(row) > 53], 0, 1)
    moving = np.flatnonzero(np.linalg.norm(rig.deltas[:, :9409], axis=2).max(0) > 1.0)
    rng = np.random.default_rng(0)
    vertices = rng.choice(moving, 40, replace=False)
    solver = WeightSolver(rig, vertices, "lsts")
    lsts, unit = solver._method, solver.unit
    B = rig.deltas[:, vertices].reshape(rig.n_shapes, -1).T / unit
    d = truth @ B.T + rng.normal(0, 0.2 / unit, (len(truth), len(B)))
    methods = {
        "lsts": lsts,
        "bounded": Bounded(0.001 * lsts.energy + 0.03 * np.eye(rig.n_shapes), 0.002),
        "map": maximum_posterior(WeightPrior.fit(truth), lsts.energy, 0.001, 0.28 / unit),
        "nnls": NonNegativeLeastSquares(),
        "least-squares": LeastSquares(),
    }
    assert len(d) > 90
    for name, method in methods.items():
        expected = method.prepare(B)(d)
        np.testing.assert_allclose(solve_with_torch(method, B, d, device), expected, rtol=0, atol=1e-5, err_msg=name)


def test_methods_that_only_numpy_solves_are_refused():
    published = make_method(WeightSolver(RIG, np.arange(12), "lsts-published").options, RIG, np.arange(12))[0]
    with pytest.raises(InputError, match="PublishedLSTS; use backend='numpy'"):
        on_torch(published)

    class Other(Bounded):
        pass

    with pytest.raises(InputError, match="got Other"):
        on_torch(Other(np.eye(3)))


@pytest.mark.parametrize("device", ["nowhere", "cuda:99", "meta:x"])
def test_devices_that_do_not_exist_are_refused(device):
    with pytest.raises(InputError, match=f"device: .*{device}"):
        choose_device(device)


def test_devices():
    assert choose_device() == ("cuda" if torch.cuda.is_available() else "cpu")
    assert choose_device("cpu") == "cpu" and "cpu" in describe_device("cpu")
    assert TorchMethod(Bounded(np.eye(2)), "cpu").device == "cpu"


def test_counts_that_disagree():
    B, E = matrices()
    with pytest.raises(InputError, match="displacements: expected shape"):
        solve_with_torch(Bounded(E), B, np.zeros((3, 44)), "cpu")
    with pytest.raises(InputError, match="basis: expected finite"):
        solve_with_torch(Bounded(E), B * np.nan, np.zeros((3, 45)), "cpu")


def test_without_torch_one_line_says_what_to_install(monkeypatch):
    assert has_torch()
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(InputError, match=r"install mimique\[gpu\]") as caught:
        on_torch(Bounded(np.eye(3)))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("method", NAMES)
def test_a_solver_gives_the_same_weights_on_torch(method, rng):
    rig = small_rig()
    vertices = np.arange(0, rig.n_vertices, 4)
    prior = WeightPrior.fit(rng.uniform(0, 1, (60, rig.n_shapes))) if method == "map" else None
    seen = rig.pose(rng.uniform(0, 1, (40, rig.n_shapes)), vertices) + rng.normal(0, 0.1, (40, len(vertices), 3))
    seen[5, 2], seen[7:9, :3] = np.nan, np.nan
    numpy, on_device = (WeightSolver(rig, vertices, method, prior=prior, backend=b) for b in ("numpy", "torch"))
    np.testing.assert_allclose(on_device.solve(seen), numpy.solve(seen), atol=1e-5)


def test_an_unknown_backend_is_refused():
    with pytest.raises(InputError, match="numpy or torch"):
        WeightSolver(small_rig(), [0, 9, 20, 31], backend="jax")
