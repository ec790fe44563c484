import numpy as np
import pandas as pd
import pytest
from mimique.errors import NotFoundError
from mimique.synthesis import ARKIT_NAMES, ShapeMapping, read_rig
from mimique.synthesis.shape_tables import SHAPE_TABLES, fit_table, read_named_table


@pytest.mark.parametrize("name", SHAPE_TABLES)
def test_tables_are_whole(name):
    table = read_named_table(name)
    assert table.columns.tolist() == ["from", "to", "gain"] and set(table["from"]) <= set(ARKIT_NAMES)
    assert not table.duplicated(["from", "to"]).any()
    np.testing.assert_allclose(table.groupby("to")["gain"].sum(), 1)


def test_makehuman_moves_as_the_table_says(shared_data):
    rig = read_rig(shared_data / "makehuman" / "rig.npz", unit="dm")
    ict = read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")
    table = read_named_table("arkit-to-makehuman")
    assert set(table["to"]) <= set(rig.shapes)
    for source in (ARKIT_NAMES, ict.shapes, [name[0].upper() + name[1:] for name in ARKIT_NAMES]):
        mapping = ShapeMapping.fit(source, rig.shapes, fit_table(table, source, rig.shapes))
        weights = np.zeros((2, len(source)))
        smiles = [i for i, name in enumerate(source) if name.lower().startswith("mouthsmile")]
        brows = [i for i, name in enumerate(source) if name.lower().startswith("browinnerup")]
        weights[0, smiles[0]], weights[1, brows] = 0.8, 0.6
        found = mapping.apply(weights)
        assert found[0, rig.index("mouth-corner-puller")] == pytest.approx(0.4) and found[0].sum() == pytest.approx(0.4)
        assert found[1, rig.index("eyebrows-left-inner-up")] == pytest.approx(0.6)
        assert found[1, rig.index("eyebrows-right-inner-up")] == pytest.approx(0.6)


def test_rows_of_absent_shapes_are_left_out():
    table = pd.DataFrame({"from": ["jawOpen", "tongueOut"], "to": ["mouth-open", "mouth-open"], "gain": [0.7, 1.0]})
    assert fit_table(table, ["JawOpen"], ["mouth-open"]).to_dict("list") == {
        "from": ["JawOpen"],
        "to": ["mouth-open"],
        "gain": [0.7],
    }
    assert fit_table(table, ["JawOpen"], ["other"]).empty
    with pytest.raises(NotFoundError, match="no table 'x' comes with mimique"):
        read_named_table("x")
