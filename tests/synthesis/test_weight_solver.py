import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import InputError, MimiqueError, RigError
from mimique.synthesis import Rig, WeightPrior, WeightSolver
from mimique.synthesis.mesh_operators import cotangent_weights, thin_shell_operator, vertex_areas
from scipy.optimize import lsq_linear, minimize, nnls

N = 9


def bumpy_rig(scale=1.0, n=22):
    """A curved sheet of 150 mm with nine overlapping bumps; the last shape is far from every marker."""
    x, y = np.meshgrid(np.linspace(-75, 75, n), np.linspace(-75, 75, n), indexing="ij")
    v = np.stack([x, y, 20 * np.cos(x / 60) * np.cos(y / 70)], -1).reshape(-1, 3)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    f = np.concatenate([np.stack([i, i + n, i + n + 1], 1), np.stack([i, i + n + 1, i + 1], 1)])
    rng = np.random.default_rng(1)
    deltas = np.zeros((N, len(v), 3))
    for k in range(N - 1):
        centre, width = rng.uniform(-50, 50, 2), rng.uniform(15, 35)
        bump = np.exp(-((v[:, :2] - centre) ** 2).sum(1) / (2 * width**2))
        deltas[k] = bump[:, None] * rng.normal(0, 8, 3)
    deltas[N - 1, v[:, 0] > 72] = [0, 0, 3]
    return Rig(v * scale, f, deltas * scale, [f"s{k}" for k in range(N)])


RIG = bumpy_rig()
MARKERS = np.random.default_rng(2).choice(np.flatnonzero(RIG.neutral[:, 0] < 60), 15, replace=False)
PRIOR = WeightPrior.fit(np.random.default_rng(3).beta(0.5, 2, (300, N)))


def solver(method, **options):
    rig, vertices = options.pop("rig", RIG), options.pop("vertices", MARKERS)
    return WeightSolver(rig, vertices, method, prior=PRIOR if method == "map" else None, **options)


def observed(n_frames=40, noise=0.3, seed=4, rig=RIG):
    rng = np.random.default_rng(seed)
    truth = rng.beta(0.5, 1.5, (n_frames, N))
    return rig.pose(truth, MARKERS) + rng.normal(0, noise, (n_frames, len(MARKERS), 3)), truth


EVERY = pytest.mark.parametrize("method", ["lsts", "lsts-published", "bounded", "map", "nnls", "least-squares"])
REGULAR = pytest.mark.parametrize(
    ("method", "options"), [("lsts", {}), ("lsts", {"form": "residual", "alpha": 0.7}), ("bounded", {}), ("map", {})]
)


@pytest.mark.parametrize("method", ["lsts", "bounded", "map", "nnls"])
def test_known_weights_are_found(method):
    positions, truth = observed(noise=0.05)
    found = solver(method).solve(positions)
    assert np.abs(found - truth)[:, : N - 1].mean() < {"lsts": 0.15}.get(method, 0.06)


@REGULAR
@pytest.mark.parametrize("gap", [False, True])
def test_no_other_minimiser_does_better(method, options, gap):
    positions, _ = observed(3)
    if gap:
        positions[:, [2, 7]] = np.nan
    s = solver(method, **options)
    found = s.solve(positions)
    box = None if method == "lsts" else [(0, 1)] * N
    for f, w in enumerate(found):

        def fun(c, f=f):
            return float(s.objective(positions[f : f + 1], np.clip(c, 0, 1)[None] if box else c[None])[0])

        best = minimize(fun, np.full(N, 0.3), bounds=box, method="L-BFGS-B", options={"maxfun": 20000, "ftol": 1e-15})
        assert fun(w) <= best.fun + 1e-8 * abs(best.fun)


def test_lsts_objective_by_its_formula():
    """Every term written out anew, from the mesh."""
    positions, _ = observed(3)
    s = solver("lsts", alpha=0.4, k_s=0.5, k_b=2.0, s=0.2, l_inf=-0.05, l_sup=1.2)
    c = np.random.default_rng(0).uniform(-0.2, 1.2, (3, N))
    W, M = cotangent_weights(RIG.neutral, RIG.triangles).toarray(), vertex_areas(RIG.neutral, RIG.triangles)
    B = RIG.deltas[:, MARKERS].reshape(N, -1)
    stretch = np.array([sum(-(d[:, a] @ W @ d[:, a]) for a in range(3)) for d in RIG.deltas])
    bend = np.array([sum(((W @ d[:, a]) ** 2 / M).sum() for a in range(3)) for d in RIG.deltas])
    K = -0.5 * W + 2.0 * np.median(stretch / bend) * W @ (W / M[:, None])
    seen = (B**2).sum(1) > 1e-8 * (B**2).sum(1).max()
    E = np.einsum("kva,vw,lwa->kl", RIG.deltas, K, RIG.deltas)
    delta2 = np.median((B**2).sum(1)[seen])
    kappa = np.median((B**2).sum(1)[seen] / np.diag(E)[seen])
    for f in range(3):
        r = (positions[f] - RIG.pose(c[f], MARKERS)).ravel()
        bounds = (np.exp((-0.05 - c[f]) / 0.2) + np.exp((c[f] - 1.2) / 0.2)).sum()
        expected = r @ r / delta2 + 0.4 * kappa * c[f] @ E @ c[f] / delta2 + 0.6 * 0.2**2 * bounds
        assert s.objective(positions, c)[f] == pytest.approx(expected)


@pytest.mark.parametrize("unit", [1.0, 10.0])
def test_published_objective_by_its_formula_and_at_its_minimum(unit):
    positions, _ = observed(3)
    s = solver("lsts-published", alpha=0.3, unit=unit)
    found = s.solve(positions)
    v, d = RIG.neutral / unit, RIG.deltas / unit
    A = thin_shell_operator(cotangent_weights(v, RIG.triangles), vertex_areas(v, RIG.triangles)).toarray()
    A = np.delete(A, MARKERS, axis=0)

    def published(c, f):
        r = (positions[f] - RIG.pose(c, MARKERS)) / unit
        bounds = (np.exp((-0.1 - c) / 0.1) + np.exp((c - 1.1) / 0.1)).sum()
        shell = ((A @ np.tensordot(c, d, 1)) ** 2).sum()
        return np.sqrt((r**2).sum()) + 0.3 * shell + 3 * RIG.n_vertices * 0.7 * bounds

    for f, w in enumerate(found):
        assert s.objective(positions, found)[f] == pytest.approx(published(w, f))
        best = minimize(published, w, (f,), method="L-BFGS-B", options={"maxfun": 20000})
        assert published(w, f) <= best.fun * (1 + 1e-9)


def test_bounded_agrees_with_scipy():
    positions, _ = observed(8)
    s = solver("bounded", alpha=0.0, ridge=1e-4, sparsity=0.0)
    B = RIG.deltas[:, MARKERS].reshape(N, -1).T / s.unit
    for w, d in zip(s.solve(positions), (positions - RIG.neutral[MARKERS]).reshape(8, -1) / s.unit, strict=True):
        rows, right = np.vstack([B, 0.01 * np.eye(N)]), np.r_[d, np.zeros(N)]
        np.testing.assert_allclose(w, lsq_linear(rows, right, (0, 1), tol=1e-14, method="bvls").x, atol=1e-8)


def test_map_without_bounds_in_reach_is_the_gaussian_posterior_mean():
    s = solver("map", alpha=0.0, noise=0.5)
    B = RIG.deltas[:, MARKERS].reshape(N, -1).T
    truth = np.full(N, 0.5)
    truth[-1] = PRIOR.mean[-1]
    positions = RIG.pose(truth[None], MARKERS)
    P = np.linalg.inv(PRIOR.covariance)
    d = (positions[0] - RIG.neutral[MARKERS]).ravel()
    expected = np.linalg.solve(B.T @ B / 0.25 + P, B.T @ d / 0.25 + P @ PRIOR.mean)
    assert expected.min() > 0 and expected.max() < 1
    np.testing.assert_allclose(s.solve(positions)[0], expected, atol=1e-9)


def test_baselines_agree_with_numpy_and_scipy():
    positions, _ = observed(5)
    d = (positions - RIG.neutral[MARKERS]).reshape(5, -1)
    B = RIG.deltas[:, MARKERS].reshape(N, -1).T
    np.testing.assert_allclose(
        solver("least-squares").solve(positions), np.linalg.lstsq(B, d.T, rcond=1e-12)[0].T, atol=1e-8
    )
    np.testing.assert_allclose(solver("nnls").solve(positions), [nnls(B, x)[0] for x in d], atol=1e-8)


@EVERY
def test_missing_markers_are_left_out_of_their_frame_only(method):
    positions, _ = observed(12)
    whole = solver(method).solve(positions)
    holes = positions.copy()
    holes[3, [0, 4, 5]] = np.nan
    holes[4, 1, 2] = np.nan
    holes[5, 4:] = np.nan
    holes[6] = np.nan
    found = solver(method).solve(holes)
    assert np.isnan(found[6]).all() and np.isfinite(found[5]).all()
    assert np.isnan(solver(method, minimum_markers=5).solve(holes)[5]).all()
    for f, lost in ((3, [0, 4, 5]), (4, [1])):
        fewer = solver(method, vertices=np.delete(MARKERS, lost)) if method == "nnls" else None
        if fewer is not None:
            np.testing.assert_allclose(found[f], fewer.solve(np.delete(holes[f], lost, 0)[None])[0], atol=1e-8)
        assert np.abs(found[f] - whole[f])[: N - 1].max() > 1e-6
    rest = [0, 1, 2, 7, 8, 9, 10, 11]
    np.testing.assert_allclose(found[rest], whole[rest], atol=1e-8)


@pytest.mark.parametrize("method", ["lsts", "bounded", "map", "nnls", "least-squares"])
@pytest.mark.parametrize("scale", [0.1, 1e-3])
def test_the_unit_of_the_scene_does_not_matter(method, scale):
    positions, _ = observed(20)
    small = bumpy_rig(scale)
    np.testing.assert_allclose(
        solver(method, rig=small).solve(positions * scale), solver(method).solve(positions), atol=1e-6
    )


@settings(deadline=None, max_examples=8)
@given(st.sampled_from(["lsts", "bounded", "map"]), st.integers(1, 400), st.integers(0, 10**6))
def test_neither_blocks_nor_the_order_of_frames_matter(method, block_size, seed):
    rng = np.random.default_rng(seed)
    positions, _ = observed(300, seed=seed)
    positions[rng.uniform(size=positions.shape[:2]) < 0.001] = np.nan
    whole = solver(method).solve(positions)
    order = rng.permutation(300)
    np.testing.assert_allclose(solver(method, block_size=block_size).solve(positions[order]), whole[order], atol=1e-7)


def test_intensity_falls_with_alpha_and_stays_within_soft_bounds():
    positions, _ = observed(30)
    sums = [np.abs(solver("lsts", alpha=a).solve(positions)).sum() for a in (0.1, 0.3, 0.5, 0.7)]
    assert sums == sorted(sums, reverse=True)
    assert solver("lsts").solve(positions).max() < 1.5


def test_what_neutral_frames_become():
    rest = np.broadcast_to(RIG.neutral[MARKERS], (2, len(MARKERS), 3))
    np.testing.assert_allclose(solver("bounded").solve(rest), 0, atol=1e-12)
    np.testing.assert_allclose(solver("nnls").solve(rest), 0, atol=1e-12)
    lifted = solver("lsts").solve(rest)
    assert 0 < lifted.max() < 0.1  # The exponential bounds push up at 0, a little.


def test_shapes_that_no_marker_sees_stay_at_zero():
    positions, _ = observed()
    assert solver("bounded").solve(positions)[:, -1].max() == 0


def test_residuals_are_distances_from_the_posed_vertices():
    positions, truth = observed(4)
    positions[1, 3] = np.nan
    expected = np.linalg.norm(positions - RIG.pose(truth, MARKERS), axis=2)
    np.testing.assert_allclose(solver("bounded").residuals(positions, truth), expected, atol=1e-9)


def test_the_default_method_follows_from_the_prior():
    assert WeightSolver(RIG, MARKERS).options.method == "bounded"
    assert WeightSolver(RIG, MARKERS, prior=PRIOR).options.method == "map"


def test_an_empty_take_gives_no_weights():
    assert solver("bounded").solve(np.empty((0, len(MARKERS), 3))).shape == (0, N)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p / 1000, "seem to be in metres"),
        (lambda p: p / 10, "seem to be in centimetres"),
        (lambda p: p * 25, "span 2[45]"),
        (lambda p: p + np.array([0, 0, 900]), "mm from their vertices in a typical frame"),
        (lambda p: p[:, :-1], r"expected shape \(any, 15, 3\)"),
        (lambda p: np.where(np.isnan(p), 0, np.inf), "infinity"),
    ],
)
@EVERY
def test_positions_in_another_space_are_refused(method, change, words):
    with pytest.raises(InputError, match=words):
        solver(method).solve(change(observed(30)[0]))


@pytest.mark.parametrize(
    ("arguments", "options", "words"),
    [
        ((RIG, [1, 2, 999]), {}, "vertex 999 at place 2 does not exist"),
        ((RIG, [1, 2, -1]), {}, "vertex -1"),
        ((RIG, [5, 2, 5]), {}, "vertex 5 is used twice"),
        ((RIG, []), {}, "one a marker"),
        ((RIG, [1.5, 2]), {}, "whole numbers"),
        ((RIG, MARKERS), {"alpha": 1.2}, "alpha: expected a number from 0 to 1, but got 1.2"),
        ((RIG, MARKERS), {"alpha": float("nan")}, "alpha"),
        ((RIG, MARKERS), {"method": "lstsq"}, "expected one of lsts, "),
        ((RIG, MARKERS), {"method": "map"}, "needs a prior"),
        ((RIG, MARKERS), {"method": "nnls", "prior": PRIOR}, "only method='map'"),
        (
            (RIG, MARKERS),
            {"prior": WeightPrior(np.zeros(2), np.eye(2))},
            "expected 9 shapes, as the rig has, but got 2",
        ),
        ((RIG, MARKERS), {"form": "bending"}, "residual or energy"),
        ((RIG, MARKERS), {"method": "lsts-published", "form": "energy"}, "knows 'residual' only"),
        ((RIG, MARKERS), {"k_b": -1.0}, "k_b"),
        ((RIG, MARKERS), {"s": 0.0}, "s: expected a number above 0"),
        ((RIG, MARKERS), {"l_inf": 2.0}, "l_inf below l_sup"),
        ((RIG, MARKERS), {"minimum_markers": 0}, "1 or more"),
        ((Rig(RIG.neutral, RIG.triangles, 0 * RIG.deltas, RIG.shapes), MARKERS), {}, "no shape of the rig moves"),
    ],
)
def test_bad_input_gets_one_line(arguments, options, words):
    with pytest.raises(MimiqueError, match=words) as error:
        WeightSolver(*arguments, **options)
    assert "\n" not in str(error.value)
    assert isinstance(error.value, RigError if "vert" in words or "moves" in words else InputError)
