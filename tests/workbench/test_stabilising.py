"""One reference and one neutral for all takes of a signer."""

import numpy as np
import pytest
from mimique.corpus import Corpus
from mimique.corpus.take import make_take
from mimique.errors import InputError
from mimique.workbench.pipeline.stabilising import group_sessions, prepare_session, read_tracked, stabilise_take

from .small_face import HEAD, RATE, SHAPES, make_rig, make_weights, marker_vertices

JOY, SURPRISE = {"mouthSmile_L": 0.9, "mouthSmile_R": 0.9}, {"browUp": 1.0, "jawOpen": 0.8}


def add_take(corpus, name, weights, *, signer, rng, shift=0.0):
    rig = make_rig()
    markers = marker_vertices(rig)
    points = rig.pose(weights, list(markers.values())) + rng.normal(0, 0.05, (len(weights), len(markers), 3)) + shift
    take = make_take(points, list(markers), RATE, signer=signer, protocol="IE", head_markers=list(HEAD))
    with corpus.transaction(f"Add {name}") as edit:
        edit.put_take(name, take)


@pytest.fixture
def corpus(tmp_path, rng):
    corpus = Corpus.create(tmp_path / "corpus")
    # Each take holds its own expression nearly all the time: alone, none of them would show what neutral is.
    add_take(corpus, "joy", make_weights([(6.0, JOY)]), signer="a", rng=rng)
    add_take(corpus, "surprise", make_weights([(6.0, SURPRISE)]), signer="a", rng=rng, shift=40.0)
    add_take(corpus, "calm", make_weights([(0.3, JOY), (9.0, {}), (0.3, SURPRISE)]), signer="a", rng=rng)
    add_take(corpus, "other", make_weights([(1.0, JOY)]), signer="b", rng=rng)
    add_take(corpus, "unknown", make_weights([(1.0, JOY)]), signer=None, rng=rng)
    return corpus


def test_takes_are_grouped_by_signer_and_markers(corpus):
    assert sorted(map(sorted, group_sessions(corpus))) == [["calm", "joy", "surprise"], ["other"], ["unknown"]]
    renamed = corpus.take("joy").assign_coords(marker=[f"x{m}" for m in corpus.take("joy")["marker"].values])
    renamed.attrs["head_markers"] = [f"x{m}" for m in HEAD]
    with corpus.transaction("Another marker set") as edit:
        edit.put_take("joy2", renamed)
    assert ["joy2"] in group_sessions(corpus)


def test_the_neutral_of_a_signer_is_neutral(corpus):
    session = prepare_session(corpus, ["calm", "joy", "surprise"])
    rig = make_rig()
    rest = rig.neutral[list(marker_vertices(rig).values())]
    offset = np.median(session.neutral - rest, axis=0)
    assert np.abs(session.neutral - rest - offset).max() < 0.1  # the smile alone moves markers by 9 mm


def test_all_takes_of_a_signer_stand_in_one_place(corpus):
    session = prepare_session(corpus, ["calm", "joy", "surprise"])
    for name in session.takes:
        calm = stabilise_take(read_tracked(corpus, name), session.reference, name)
        head = calm.positions[:, [session.markers.index(m) for m in HEAD]]
        assert np.abs(head - session.reference).max() < 0.4
    assert len(SHAPES) == 4


def test_a_take_without_head_markers_says_what_to_do(corpus):
    bare = corpus.take("other")
    del bare.attrs["head_markers"]
    with corpus.transaction("Forget the head markers") as edit:
        edit.put_take("bare", bare)
    with pytest.raises(InputError, match=r"'bare'.*--head-markers"):
        read_tracked(corpus, "bare")
    assert read_tracked(corpus, "bare", HEAD).head_markers == HEAD
