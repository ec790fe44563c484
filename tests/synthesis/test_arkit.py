import pytest
from mimique.synthesis import ARKIT_NAMES, arkit_name, arkit_table, read_rig


def test_there_are_the_52_names():
    assert len(ARKIT_NAMES) == len(set(ARKIT_NAMES)) == 52
    assert {"mouthSmileLeft", "eyeLookInRight", "jawOpen", "tongueOut", "browInnerUp", "noseSneerLeft"} <= set(
        ARKIT_NAMES
    )
    assert sum(n.endswith("Left") for n in ARKIT_NAMES) == sum(n.endswith("Right") for n in ARKIT_NAMES) == 20
    assert all(arkit_name(n) == n for n in ARKIT_NAMES)


@pytest.mark.parametrize(
    ("shape", "name"),
    [
        ("mouthSmile_L", "mouthSmileLeft"),
        ("eyeLookIn_R", "eyeLookInRight"),
        ("browInnerUp_L", "browInnerUp"),
        ("cheekPuff_R", "cheekPuff"),
        ("JawOpen", "jawOpen"),
        ("jawLeft", "jawLeft"),
        ("mouth_smile", None),
        ("Head.mouthFunnel", "mouthFunnel"),
        ("cheekRaiser_L", None),
        ("", None),
    ],
)
def test_other_spellings(shape, name):
    assert arkit_name(shape) == name


def test_every_shape_of_a_real_rig_has_a_name(shared_data):
    table = arkit_table(read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm").shapes)
    assert list(table)[:2] == ["browDown_L", "browDown_R"]
    assert set(table.values()) == set(ARKIT_NAMES) - {"tongueOut"}
