import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.synthesis import ARKIT_NAMES, ShapeMapping, arkit_name, read_rig


def test_own_names_come_first():
    mapping = ShapeMapping.fit(["mouthSmileLeft", "mouthSmile_L"], ["mouthSmile_L", "mouthSmileLeft"])
    np.testing.assert_array_equal(mapping.apply([[1, 2]]), [[2, 1]])


def test_a_whole_drives_both_halves_and_halves_drive_the_whole_by_their_mean():
    split = ShapeMapping.fit(["browInnerUp"], ["browInnerUp_L", "browInnerUp_R"])
    np.testing.assert_array_equal(split.apply([[0.4]]), [[0.4, 0.4]])
    joined = ShapeMapping.fit(["browInnerUp_L", "browInnerUp_R"], ["browInnerUp"])
    np.testing.assert_allclose(joined.apply([[0.2, 0.6]]), [[0.4]])


def test_halves_drive_their_own_side():
    mapping = ShapeMapping.fit(["cheekPuff_L", "cheekPuff_R"], ["CheekPuffRight", "CheekPuffLeft"])
    np.testing.assert_array_equal(mapping.apply([[0.1, 0.9]]), [[0.9, 0.1]])


def test_one_half_alone_drives_only_its_half():
    mapping = ShapeMapping.fit(["cheekPuff_L", "jawOpen"], ["cheekPuff.R", "jawOpen"])
    assert mapping.still == ("cheekPuff.R",)
    assert mapping.unused == ("cheekPuff_L",)


def test_a_table_overrides_and_adds():
    table = pd.DataFrame({"from": ["jawOpen", "mouthFunnel"], "to": ["mouth-open", "mouth-open"], "gain": [0.5, 0.25]})
    mapping = ShapeMapping.fit(["jawOpen", "mouthFunnel"], ["mouth-open", "jawOpen"], table)
    np.testing.assert_allclose(mapping.apply([[1.0, 0.4]]), [[0.6, 1.0]])
    assert mapping.unused == ()


def test_gaps_stay_gaps_where_they_matter():
    mapping = ShapeMapping.fit(["jawOpen", "mouthLeft"], ["jawOpen", "own"])
    found = mapping.apply([[0.5, np.nan], [np.nan, 0.5], [np.nan, np.nan]])
    np.testing.assert_array_equal(found, [[0.5, 0], [np.nan, 0], [np.nan, np.nan]])


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (pd.DataFrame({"from": ["jawOpen"]}), "to is not there"),
        (pd.DataFrame({"from": ["jaw"], "to": ["open"]}), "line 2: the shape 'jaw' in the column 'from'"),
        (pd.DataFrame({"from": ["jawOpen"], "to": ["x"]}), "line 2: the shape 'x' in the column 'to'"),
        (pd.DataFrame({"from": ["jawOpen"], "to": ["open"], "gain": ["much"]}), "line 2: expected a number"),
        (None, "none of jawOpen"),
    ],
)
def test_refusals(table, message):
    with pytest.raises(InputError, match=message):
        ShapeMapping.fit(["jawOpen"], ["open"], table)


@given(st.lists(st.sampled_from(ARKIT_NAMES), min_size=1, max_size=20, unique=True), st.randoms())
def test_the_same_shapes_in_another_order_are_a_permutation(names, random):
    other = list(names)
    random.shuffle(other)
    mapping = ShapeMapping.fit(names, other)
    weights = np.arange(2.0 * len(names)).reshape(2, -1)
    np.testing.assert_array_equal(ShapeMapping.fit(other, names).apply(mapping.apply(weights)), weights)


def test_arkit_drives_the_whole_of_a_real_rig(shared_data):
    rig = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    mapping = ShapeMapping.fit(ARKIT_NAMES, rig.shapes)
    assert mapping.still == ()
    assert mapping.unused == ("tongueOut",)
    back = ShapeMapping.fit(rig.shapes, ARKIT_NAMES)
    values = np.random.default_rng(0).random((3, 52))
    there_and_back = back.apply(mapping.apply(values))
    kept = [name != "tongueOut" for name in ARKIT_NAMES]
    np.testing.assert_allclose(there_and_back[:, kept], values[:, kept])
    assert all(arkit_name(shape) for shape in rig.shapes)
