import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.models.layouts import kmeans_layout
from mimique.models.layouts.choice import choose_layout
from mimique.models.layouts.constraints import mirror_by_position
from mimique.synthesis import Rig, WeightPrior, WeightSolver


def grid_rig(seed=0, n_shapes=8, asymmetric=False):
    """A mirror symmetric sheet of 13 × 9 points, 10 mm apart, with smooth bumps as shapes."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(-6, 7) * 10.0, np.arange(-4, 5) * 10.0)
    neutral = np.column_stack([x.ravel(), y.ravel(), -0.01 * x.ravel() ** 2])
    if asymmetric:
        neutral = neutral + [0.0, 0.0, 5.0] * np.cos(neutral / 30.0 + rng.uniform(0, 6, 3))
    cells = [(r * 13 + c, r * 13 + c + 1, r * 13 + c + 13) for r in range(8) for c in range(12)]
    shapes = np.random.default_rng(3)
    deltas = []
    for centre in shapes.uniform([-60, -40], [60, 40], (n_shapes, 2)):
        bump = np.exp(-((neutral[:, :2] - centre) ** 2).sum(1) / (2 * 20.0**2))
        deltas.append(bump[:, None] * shapes.normal(0, 4, 3))
    return Rig(neutral, cells, deltas, [f"s{i}" for i in range(n_shapes)])


@pytest.fixture(scope="module")
def rig():
    return grid_rig()


@pytest.fixture(scope="module")
def performance():
    return np.random.default_rng(1).beta(0.5, 1.5, (80, 8))


@pytest.mark.parametrize("method", ["greedy", "qr"])
@settings(max_examples=6, deadline=None)
@given(
    n_markers=st.integers(1, 16), mirror=st.booleans(), distance=st.sampled_from([0.0, 10.5]), seed=st.integers(0, 9)
)
def test_every_layout_keeps_its_constraints(method, n_markers, mirror, distance, seed):
    rig, rng = grid_rig(), np.random.default_rng(seed)
    forbidden = rng.choice(rig.n_vertices, 10, replace=False)
    keep = np.setdiff1d(rng.choice(rig.n_vertices, 1), forbidden)
    made = choose_layout(
        rig,
        rng.beta(0.5, 1.5, (30, 8)),
        n_markers,
        method=method,
        mirror=mirror,
        forbidden=forbidden,
        keep=keep,
        min_distance=distance,
        n_candidates=60,
    )
    layout = made.vertices
    assert layout.dtype == np.int64 and len(layout) == n_markers and (np.diff(layout) > 0).all()
    assert not np.isin(layout, forbidden).any() and np.isin(keep, layout).all()
    gaps = np.linalg.norm(rig.neutral[layout][:, None] - rig.neutral[layout], axis=2) + np.eye(n_markers) * 1e9
    assert gaps.min() >= distance
    if mirror:
        free = np.setdiff1d(layout, keep)
        twins = mirror_by_position(rig)[free]
        assert set(twins) == set(free)


def test_markers_are_where_the_shapes_are_told_apart(performance):
    """Three shapes move three patches; three markers tell all, and any other choice would miss a shape."""
    neutral = np.column_stack([np.repeat([0.0, 50.0, 100.0], 10), np.tile(np.arange(10.0), 3), np.zeros(30)])
    deltas = np.zeros((3, 30, 3))
    for shape in range(3):
        deltas[shape, shape * 10 : shape * 10 + 10] = np.linspace(1, 5, 10)[:, None] * [0, 0, 1]
    rig = Rig(neutral, [[0, 1, 10]], deltas, list("abc"))
    for method in ("greedy", "qr"):
        chosen = choose_layout(rig, performance[:, :3], 3, method=method, mismatch=0.0, loss=0.0).vertices
        np.testing.assert_array_equal(chosen, [9, 19, 29])  # Where each patch moves most: least noise.


def test_greedy_beats_kmeans_with_the_real_solver(rig, performance):
    """On other faces and other frames than it was chosen on, by the default solver."""
    unseen, frames = grid_rig(11, asymmetric=True), np.random.default_rng(8).beta(0.5, 1.5, (60, 8))
    prior = WeightPrior.fit(performance)

    def error(layout):
        shown = rig.neutral[layout] + unseen.pose(frames, layout) - unseen.neutral[layout]
        shown = shown + np.random.default_rng(4).normal(0, 0.4, shown.shape)
        found = WeightSolver(rig, layout, prior=prior, minimum_markers=1).solve(shown)
        return np.linalg.norm(rig.pose(found) - rig.pose(frames), axis=2).mean()

    kmeans = np.median([error(kmeans_layout(rig, performance, 4, rng=np.random.default_rng(s))) for s in range(9)])
    greedy = error(choose_layout([rig, grid_rig(5, asymmetric=True)], performance, 4).vertices)
    assert greedy < kmeans


def test_the_curve_falls_and_ends_at_the_layout(rig, performance):
    made = choose_layout(rig, performance, 9, loss=0.0, mismatch=0.0, n_swaps=0)
    np.testing.assert_array_equal(made.curve[:, 0], np.arange(1, 10))
    assert (np.diff(made.curve[:, 1]) < 0).all()
    np.testing.assert_array_equal(np.sort(made.order), made.vertices)
    smaller = choose_layout(rig, performance, 4, loss=0.0, mismatch=0.0, n_swaps=0)
    np.testing.assert_array_equal(smaller.order, made.order[:4])


def test_the_same_seed_gives_the_same_layout(rig, performance):
    first, again = (
        choose_layout(rig, performance, 6, rng=np.random.default_rng(2)).vertices,
        choose_layout(rig, performance, 6, rng=np.random.default_rng(2)).vertices,
    )
    np.testing.assert_array_equal(first, again)


def test_the_order_of_the_shapes_does_not_matter(rig, performance):
    order = np.random.default_rng(0).permutation(8)
    other = Rig(rig.neutral, rig.triangles, rig.deltas[order], [rig.shapes[i] for i in order])
    one = choose_layout(rig, performance, 6).vertices
    np.testing.assert_array_equal(one, choose_layout(other, performance[:, order], 6).vertices)


def test_what_cannot_be_is_said(rig, performance):
    with pytest.raises(InputError, match="n_markers: expected 1 to"):
        choose_layout(rig, performance, 500)
    with pytest.raises(InputError, match="min_distance"):
        choose_layout(rig, performance, 40, min_distance=60.0)
    with pytest.raises(InputError, match="hardly moves"):
        choose_layout(rig, performance * 1e-4, 5)
    with pytest.raises(InputError, match="one topology at a time"):
        choose_layout([rig, grid_rig(n_shapes=7)], performance, 5)
    with pytest.raises(InputError, match="is also forbidden"):
        choose_layout(rig, performance, 5, keep=[50], forbidden=[50])
    with pytest.raises(InputError, match="2 markers must stay, but only 1"):
        choose_layout(rig, performance, 1, keep=[50, 60])
    with pytest.raises(InputError, match="expected greedy or qr"):
        choose_layout(rig, performance, 5, method="best")
    with pytest.raises(InputError, match="at least the rig"):
        choose_layout([], performance, 5)
    with pytest.raises(InputError, match="too few"):
        choose_layout(rig, performance, 5, forbidden=np.arange(rig.n_vertices - 2))
    with pytest.raises(InputError, match="loss"):
        choose_layout(rig, performance, 5, loss=2.0)
    with pytest.raises(InputError, match="mirrored vertex of each"):
        choose_layout(rig, performance, 5, mirror=[1, 2])
