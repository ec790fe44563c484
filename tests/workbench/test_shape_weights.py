"""Angles that a tracker wrote beside the weights move no face: nothing that looks at weights counts them."""

import numpy as np
import pandas as pd
import xarray as xr
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.workbench.pipeline.labelled_takes import read_labelled_takes
from mimique.workbench.pipeline.segmenting import segment
from mimique.workbench.pipeline.shape_weights import read_shape_weights

SHAPES, ANGLES = ["JawOpen", "BrowInnerUp"], ["HeadYaw", "HeadPitch"]


def make_corpus(folder, *, angles):
    time = np.arange(600) / 60.0
    face = np.stack([(np.sin(1.1 * time) > 0.3) * 0.8, (np.sin(0.7 * time) > 0.5) * 0.6], axis=1)
    head = 0.6 * np.stack([np.sin(9 * time), np.cos(7 * time)], axis=1)
    values = np.hstack([face, head]) if angles else face
    names = SHAPES + (ANGLES if angles else [])
    weights = xr.Dataset(
        {"weights": (("time", "shape"), values)}, {"shape": names}, {"angles": ANGLES} if angles else {}
    )
    take = make_take(np.empty((600, 0, 3)), [], 60.0, without_markers=True, signer="s", protocol="IE")
    corpus = Corpus.create(folder)
    with corpus.transaction("Add") as edit:
        edit.put_take("t", take)
        edit.put_weights("t", weights, solve="live-link")
        table = pd.DataFrame({"onset": [0], "offset": [600], "label": ["N"], "origin": ["human"]})
        edit.put_tier("t", "affect", table, author="cr")
    return corpus


def test_segments_and_labelled_takes_are_those_without_angles(tmp_path):
    with_angles, without = (make_corpus(tmp_path / name, angles=name == "a") for name in ("a", "b"))
    found = []
    for corpus in (with_angles, without):
        segment(corpus)
        found.append(corpus.tiers("t")[["tier", "segments"]])
        (taken,) = read_labelled_takes(corpus, "cr")
        assert taken.weights.shape == (600, 2)
        assert list(read_shape_weights(corpus, "t")["shape"].values) == SHAPES
    pd.testing.assert_frame_equal(found[0], found[1])
    tier, author = "segments", str(without.tiers("t").set_index("tier").loc["segments", "author"])
    pd.testing.assert_frame_equal(
        with_angles.tier("t", tier, author)[["onset", "offset"]], without.tier("t", tier, author)[["onset", "offset"]]
    )
    assert len(without.tier("t", tier, author)) > 2
