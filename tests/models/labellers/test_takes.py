import numpy as np
import pytest
from mimique.errors import InputError
from mimique.models.labellers.takes import check_no_take_is_split, find_takes, hold_out_takes, split_takes, take_splits


def test_a_take_on_both_sides_is_named():
    with pytest.raises(InputError, match="b has frames to train on and frames to test on"):
        check_no_take_is_split(["a", "a", "b"], ["b", "c"])
    check_no_take_is_split(["a", "a"], ["b", "c"])


def test_takes_are_found_in_order():
    assert find_takes(["b", "b", "a"], 3) == [("b", slice(0, 2)), ("a", slice(2, 3))]
    assert find_takes(None, 4) == [(0, slice(0, 4))]


@pytest.mark.parametrize(("groups", "words"), [(["a", "b", "a"], "comes again at frame 2"), (["a"], "each of the 3")])
def test_bad_groups(groups, words):
    with pytest.raises(InputError, match=words):
        find_takes(groups, 3)


def test_groups_are_held_out_whole():
    groups = ["s1", "s2", "s1", "s3", "s2", "s4"]
    train, out = hold_out_takes(groups, 0.3, np.random.default_rng(0))
    assert sorted([*train, *out]) == list(range(6))
    assert not {groups[i] for i in train} & {groups[i] for i in out}
    assert len({groups[i] for i in out}) == 1


def test_one_group_is_never_held_out():
    train, out = hold_out_takes(["a", "a"], 0.5, np.random.default_rng(0))
    assert list(train) == [0, 1] and not len(out)
    assert split_takes(["a", "a"], 3, np.random.default_rng(0)) == []


def test_every_sequence_is_tested_once():
    groups = list("aabbccdde")
    splits = split_takes(groups, 3, np.random.default_rng(2))
    assert sorted(np.concatenate([test for _, test in splits])) == list(range(9))
    assert len(splits) == 3


def test_splits_of_frames():
    groups = np.repeat(["t1", "t2", "t3", "t4"], [3, 2, 4, 1])
    signers = np.repeat(["s1", "s1", "s2", "s3"], [3, 2, 4, 1])
    splits = take_splits(groups, 2, np.random.default_rng(0))
    assert sorted(np.concatenate([test for _, test in splits])) == list(range(10))
    for train, test in splits:
        assert not set(groups[train]) & set(groups[test])
        assert sorted([*train, *test]) == list(range(10))
    for train, test in take_splits(groups, 3, np.random.default_rng(0), signers=signers):
        assert not set(signers[train]) & set(signers[test])
    with pytest.raises(InputError, match=r"signers \(3\), but got 4"):
        take_splits(groups, 4, np.random.default_rng(0), signers=signers)
    with pytest.raises(InputError, match="one per frame"):
        take_splits(groups, 2, np.random.default_rng(0), signers=signers[:3])
