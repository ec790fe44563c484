import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.layouts.errors import measure_vertex_errors, measure_weight_errors
from mimique.synthesis import Rig


@pytest.fixture
def pair(rng):
    true = rng.normal(0, 50, (7, 5, 3))
    return true, true + rng.normal(0, 2, (7, 5, 3))


def test_by_hand():
    true, made = np.zeros((2, 2, 3)), np.zeros((2, 2, 3))
    made[0, 0] = [3, 4, 0]  # 5 mm off, once in two frames of two vertices.
    found = measure_vertex_errors(true, made)["all"]
    assert found.rmse_published == pytest.approx(np.sqrt(25 / 2))
    assert found.rmse_mm == pytest.approx(np.sqrt(25 / 4))
    assert found.mean_mm == pytest.approx(5 / 4)
    assert (found.n_frames, found.n_left_out, found.n_vertices) == (2, 0, 2)


def test_regions_by_slow_loops(pair):
    true, made = pair
    numbers = np.array([20, 3, 7, 11, 40])
    found = measure_vertex_errors(true, made, vertices=numbers, regions={"brows": [7, 20, 99], "lips": [40]})
    assert list(found) == ["all", "brows", "lips"]
    for name, columns in (("all", range(5)), ("brows", (0, 2)), ("lips", (4,))):
        lengths = [np.sqrt(sum((made[n, p] - true[n, p]) ** 2)) for n in range(7) for p in columns]
        published = np.sqrt(sum(e**2 for e in lengths) / 7)  # (3.5): N frames, no P
        assert found[name].rmse_published == pytest.approx(published)
        assert found[name].rmse_mm == pytest.approx(published / np.sqrt(len(columns)))
        assert found[name].mean_mm == pytest.approx(np.mean(lengths))
        assert found[name].n_vertices == len(columns)


def test_weights_are_measured_as_their_meshes_are(rng, monkeypatch):
    rig = Rig(rng.normal(size=(30, 3)), [[0, 1, 2]], rng.normal(size=(4, 30, 3)), list("abcd"))
    true, made = rng.uniform(size=(2, 50, 4))
    made[13] = np.nan
    chosen, regions = np.arange(4, 28, 3), {"nose": [4, 5, 7], "chin": np.arange(20, 30)}
    expected = measure_vertex_errors(
        rig.pose(true, chosen),
        np.where(np.isnan(made).any(1)[:, None, None], np.nan, rig.pose(np.nan_to_num(made), chosen)),
        vertices=chosen,
        regions=regions,
    )
    monkeypatch.setattr("mimique.models.layouts.errors.BLOCK", 7 * 3 * len(chosen))
    found = measure_weight_errors(rig, true, made, vertices=chosen, regions=regions)
    for name, one in expected.items():
        for field in ("n_frames", "n_left_out", "n_vertices", "rmse_published", "rmse_mm", "mean_mm"):
            assert getattr(found[name], field) == pytest.approx(getattr(one, field), rel=1e-9)
    assert (found["all"].n_frames, found["all"].n_left_out) == (49, 1)
    assert measure_weight_errors(rig, true, made)["all"].n_vertices == 30


def test_nothing_measured_is_nan(pair):
    true, made = pair
    empty = measure_vertex_errors(true, made, regions={"chin": [77]})["chin"]
    assert (empty.n_vertices, empty.n_frames) == (0, 7)
    assert np.isnan([empty.rmse_published, empty.rmse_mm, empty.mean_mm]).all()
    none = measure_vertex_errors(true, np.full_like(made, np.nan))["all"]
    assert (none.n_frames, none.n_left_out) == (0, 7)
    assert np.isnan([none.rmse_published, none.rmse_mm, none.mean_mm]).all()


def test_impossible_input_is_refused(pair, rng):
    true, made = pair
    with pytest.raises(InputError, match="made positions"):
        measure_vertex_errors(true, made[:, :4])
    with pytest.raises(InputError, match="some repeat"):
        measure_vertex_errors(true, made, vertices=[0, 1, 2, 3, 3])
    with pytest.raises(InputError, match="expected 5"):
        measure_vertex_errors(true, made, vertices=[0, 1, 2])
    with pytest.raises(InputError, match="name of the whole"):
        measure_vertex_errors(true, made, regions={"all": [1]})
    rig = Rig(rng.normal(size=(5, 3)), [[0, 1, 2]], rng.normal(size=(2, 5, 3)), list("ab"))
    with pytest.raises(InputError, match="from 0 to 4"):
        measure_weight_errors(rig, np.ones((2, 2)), np.ones((2, 2)), vertices=[5])
