"""Finished results beside the corpus."""

import numpy as np
from mimique.workbench.scratch import Scratch


def test_what_is_kept_comes_back_and_is_dropped(tmp_path):
    scratch = Scratch(tmp_path / "corpus")
    arrays = {"weights": np.arange(6.0).reshape(2, 3), "note": np.asarray("none")}
    assert scratch.get("a") is None
    scratch.put("a", arrays)
    scratch.put("b", arrays)
    found = scratch.get("a")
    np.testing.assert_array_equal(found["weights"], arrays["weights"])
    assert str(found["note"]) == "none"
    scratch.drop(["a"])
    assert scratch.get("a") is None
    assert scratch.get("b") is not None  # another process may be about to write it
    scratch.drop(["b"])
    assert not scratch.folder.exists()


def test_a_result_that_a_crash_cut_off_is_computed_again(tmp_path):
    scratch = Scratch(tmp_path / "corpus")
    scratch.put("a", {"x": np.ones(1000)})
    path = scratch.folder / "a.npz"
    path.write_bytes(path.read_bytes()[:200])
    assert scratch.get("a") is None
    assert not path.exists()
