import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.rigid import fit_rigid
from scipy.spatial.transform import Rotation


def turn(rng, *shape):
    return Rotation.random(int(np.prod(shape)) if shape else None, random_state=rng).as_matrix().reshape(*shape, 3, 3)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6), st.integers(3, 12), st.floats(0.1, 20))
def test_it_finds_a_planted_motion(seed, n_points, factor):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(5, n_points, 3)) * 50
    rotation, shift = turn(rng, 5), rng.normal(size=(5, 3)) * 100
    image = factor * points @ rotation.swapaxes(1, 2) + shift[:, None]
    fit = fit_rigid(points, image, scale=True)
    if fit.valid.all():
        np.testing.assert_allclose(fit.rotation, rotation, atol=1e-6)
        np.testing.assert_allclose(fit.scale, factor, rtol=1e-6)
        np.testing.assert_allclose(fit.apply(points), image, atol=1e-5 * factor)
        np.testing.assert_allclose(fit.inverse().apply(image), points, atol=1e-4)
    assert (n_points < 4) or fit.valid.all()


def test_agrees_with_scipy_on_noisy_weighted_points():
    rng = np.random.default_rng(0)
    p, q = rng.normal(size=(2, 9, 3))
    w = rng.uniform(0.1, 2, 9)
    a, b = p - np.average(p, 0, w), q - np.average(q, 0, w)
    expected, _ = Rotation.align_vectors(b, a, weights=w)
    np.testing.assert_allclose(fit_rigid(p, q, weights=w).rotation, expected.as_matrix(), atol=1e-9)


def test_no_reflection_even_for_a_mirrored_set():
    p = np.random.default_rng(1).normal(size=(8, 3))
    fit = fit_rigid(p, p * [-1, 1, 1])
    assert np.linalg.det(fit.rotation) == pytest.approx(1)
    assert fit.rms > 0.1


def test_missing_points_are_left_out_and_counted():
    rng = np.random.default_rng(2)
    p = rng.normal(size=(3, 6, 3))
    r = turn(rng)
    q = p @ r.T + 5
    q[0, 2] = np.nan
    q[0, 3, 1] = np.nan
    p[1, :4] = np.nan
    fit = fit_rigid(p, q)
    assert fit.n_points.tolist() == [4, 2, 6]
    assert fit.valid.tolist() == [True, False, True]
    np.testing.assert_allclose(fit.rotation[0], r, atol=1e-9)
    assert np.isnan(fit.rotation[1]).all() and np.isnan(fit.apply(p)[1]).all()


def test_points_on_a_line_or_in_one_place_have_no_fit():
    line = np.outer(np.arange(5.0), [1, 2, 3])
    assert not fit_rigid(line, line).valid
    assert not fit_rigid(np.ones((4, 3)), np.ones((4, 3))).valid
    plane = np.random.default_rng(3).normal(size=(5, 3)) * [1, 1, 0]
    assert fit_rigid(plane, plane).valid


def test_one_source_serves_a_batch_of_targets():
    rng = np.random.default_rng(4)
    p, r = rng.normal(size=(5, 3)), turn(rng, 7)
    np.testing.assert_allclose(fit_rigid(p, p @ r.swapaxes(1, 2)).rotation, r, atol=1e-9)


@pytest.mark.parametrize(
    ("source", "target", "weights"),
    [
        (np.zeros((4, 3)), np.zeros((5, 3)), None),
        (np.zeros((4, 2)), np.zeros((4, 2)), None),
        (np.zeros((2, 4, 3)), np.zeros((3, 4, 3)), None),
        (np.zeros((4, 3)), np.zeros((4, 3)), [1, 1, 1, -1]),
        (np.zeros((4, 3)), np.zeros((4, 3)), [1, 1]),
    ],
)
def test_arrays_that_do_not_fit_are_refused(source, target, weights):
    with pytest.raises(InputError):
        fit_rigid(source, target, weights=weights)
