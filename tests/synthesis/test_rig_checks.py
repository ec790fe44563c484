import numpy as np
import pytest
from mimique.errors import RigError
from mimique.synthesis import Rig, read_rig
from mimique.synthesis.rig_checks import describe_markers, describe_rig


def small_rig():
    rng = np.random.default_rng(0)
    neutral = rng.normal(size=(60, 3)) * 50
    deltas = rng.normal(size=(5, 60, 3))
    deltas[1] = -deltas[0] + 0.1 * rng.normal(size=(60, 3))
    deltas[2, :50] = 0  # Moves the last ten vertices only.
    deltas[4] = 0
    triangles = np.arange(60).reshape(20, 3)
    return Rig(neutral, triangles, deltas, ["left", "right", "ear", "jaw", "pupil"])


def test_what_is_odd_about_a_rig_is_said():
    first, second = describe_rig(small_rig())
    assert first == "pupil moves no vertex"
    assert second.startswith("left nearly cancels right (cosine -0.9") or second.startswith(
        "left nearly cancels right (cosine -1.0"
    )


def test_what_the_markers_do_not_see_is_said():
    assert [s[:20] for s in describe_markers(small_rig(), np.arange(40))] == ["no marker sees ear: "]
    assert describe_markers(small_rig(), np.arange(30, 60)) == []
    few = describe_markers(small_rig(), [55])
    assert few[0] == "1 markers have 3 coordinates for 5 shapes: too few"
    with pytest.raises(RigError, match="used twice"):
        describe_markers(small_rig(), [1, 1])


def test_known_pairs_of_a_real_rig(shared_data):
    sentences = " | ".join(describe_rig(read_rig(shared_data / "ict_facekit" / "rig.npz", unit="cm")))
    for pair in ("jawLeft nearly cancels jawRight", "eyeLookIn_L nearly cancels eyeLookOut_L"):
        assert pair in sentences
    assert "eyeLookUp_R nearly repeats eyeWide_R" in sentences and "mouthSmile_L nearly" not in sentences
