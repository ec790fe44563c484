import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import InputError, RigError
from mimique.synthesis import MorphMap
from mimique.synthesis.morph_map import KERNELS
from scipy.interpolate import RBFInterpolator

EVERY = pytest.mark.parametrize("kernel", list(KERNELS))


def faces(seed=0, n=25):
    rng = np.random.default_rng(seed)
    source = rng.uniform(-1, 1, (n, 3)) * [70, 90, 40] + [10, 200, 1500]
    return source, source * [1.1, 0.9, 1.05] + rng.normal(0, 3, (n, 3)) - [10, 200, 1500]


@EVERY
@pytest.mark.parametrize("affine", [True, False])
def test_centres_go_exactly_to_their_targets(kernel, affine):
    source, target = faces()
    np.testing.assert_allclose(MorphMap.fit(source, target, kernel, affine)(source), target, atol=1e-5)


@pytest.mark.parametrize(
    ("kernel", "scipy_name"), [("triharmonic", "cubic"), ("biharmonic", "linear"), ("thin-plate", "thin_plate_spline")]
)
def test_agrees_with_scipy(kernel, scipy_name):
    source, target = faces(1)
    points = source.mean(0) + np.random.default_rng(2).normal(0, 40, (50, 3))
    oracle = RBFInterpolator(source, target, kernel=scipy_name, degree=1)
    np.testing.assert_allclose(MorphMap.fit(source, target, kernel)(points), oracle(points), rtol=1e-6, atol=1e-5)


@EVERY
def test_side_conditions(kernel):
    source, target = faces(3)
    u = MorphMap.fit(source, target, kernel).coefficients
    size = np.abs(u).sum()
    np.testing.assert_allclose(u.sum(0) / size, 0, atol=1e-9)
    np.testing.assert_allclose((source - source.mean(0)).T @ u / size, 0, atol=1e-6)


@EVERY
def test_an_affine_change_is_found_exactly_everywhere(kernel):
    source, _ = faces(4)
    matrix = np.array([[1.2, 0.1, 0], [-0.1, 0.9, 0.2], [0, 0.3, 1.1]])
    points = source.mean(0) + np.random.default_rng(5).normal(0, 200, (20, 3))
    morph = MorphMap.fit(source, source @ matrix.T + 7, kernel)
    np.testing.assert_allclose(morph(points), points @ matrix.T + 7, atol=1e-4)


@settings(deadline=None, max_examples=20)
@given(st.sampled_from(list(KERNELS)), st.sampled_from([1e-3, 0.1, 10.0]), st.booleans(), st.sampled_from([0.0, 0.01]))
def test_the_unit_does_not_matter(kernel, factor, affine, ridge):
    source, target = faces(6)
    points = source[:5] + 3.0
    mm = MorphMap.fit(source, target, kernel, affine, ridge)(points)
    other = MorphMap.fit(source * factor, target * factor, kernel, affine, ridge)(points * factor)
    np.testing.assert_allclose(other / factor, mm, atol=1e-5)


@EVERY
def test_ridge_trades_exactness_for_small_coefficients(kernel):
    source, target = faces(7)
    exact, loose, looser = (MorphMap.fit(source, target, kernel, ridge=r) for r in (0, 1e-3, 1.0))
    gaps = [np.abs(m(source) - target).max() for m in (exact, loose, looser)]
    sizes = [np.linalg.norm(m.coefficients) for m in (exact, loose, looser)]
    assert gaps[0] < 1e-5 < gaps[1] < gaps[2] and sizes[0] > sizes[1] > sizes[2]


def test_ridge_without_affine_is_dutreves_formula():
    source, target = faces(8)
    morph = MorphMap.fit(source, target, "multiquadric", affine=False, ridge=0.3)
    centres = (source - source.mean(0)) / np.sqrt(((source - source.mean(0)) ** 2).sum(1).mean())
    r = np.linalg.norm(centres[:, None] - centres, axis=2)
    sigma = np.sort(r, 1)[:, 1]
    H = np.sqrt(r**2 + sigma[None, :] ** 2)
    expected = np.linalg.solve(H.T @ H + 0.3 * np.eye(len(H)), H.T @ target)
    np.testing.assert_allclose(morph.coefficients, expected, rtol=1e-6, atol=1e-8)


def test_any_leading_shape_and_missing_points():
    source, target = faces()
    morph = MorphMap.fit(source, target)
    frames = source + np.random.default_rng(9).normal(0, 5, (4, 2, len(source), 3))
    frames[1, 0, 3, 2] = np.nan
    out = morph(frames)
    assert out.shape == frames.shape
    assert np.isnan(out[1, 0, 3]).all() and np.isnan(out).sum() == 3
    np.testing.assert_allclose(out[2, 1, 7], morph(frames[2, 1, 7]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: np.where(np.arange(len(s))[:, None] == 2, np.nan, s), "the neutral lacks chin2"),
        (lambda s: np.vstack([s[:1], s[:-1]]), "chin0 and chin1 coincide"),
        (lambda s: s * [1, 1, 0], "lie in one plane"),
        (lambda s: s[:, :2], r"expected shape \(any, 3\)"),
    ],
)
def test_neutrals_that_carry_no_map(change, words):
    source, target = faces()
    with pytest.raises(InputError, match=words):
        MorphMap.fit(change(source), target, names=[f"chin{i}" for i in range(len(source))])


def test_other_bad_input():
    source, target = faces()
    with pytest.raises(RigError, match="at least 4 markers, but got 3"):
        MorphMap.fit(source[:3], target[:3])
    with pytest.raises(InputError, match="expected a kernel out of"):
        MorphMap.fit(source, target, "cubic")
    with pytest.raises(InputError, match="ridge of 0 or more"):
        MorphMap.fit(source, target, ridge=-1)
    with pytest.raises(InputError, match="expected shape"):
        MorphMap.fit(source, target)(np.zeros((4, 2)))
    flat = source * [1, 1, 0]
    np.testing.assert_allclose(MorphMap.fit(flat, target, "linear", affine=False)(flat), target, atol=1e-6)
