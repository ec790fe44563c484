"""Takes drawn for double coding: by a seed, in balance, stable when takes are added."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mimique.errors import InputError
from mimique.workbench.review.coding.drawing import count_wanted, draw_takes

CODERS = ("ab", "cd", "ef", "gh")
TAKES = {f"{signer}_{number}": signer for signer in ("s1", "s2", "s3") for number in range(10)}


def draw(takes=TAKES, coders=CODERS, share=0.4, coders_per_take=2, seed=3, **further):
    return draw_takes(takes, coders, share=share, coders_per_take=coders_per_take, seed=seed, **further)


@given(st.integers(0, 2**53 - 1), st.sampled_from([0.1, 0.2, 0.5, 0.9, 1.0]), st.integers(2, 4))
def test_every_coder_and_every_signer_has_about_the_same(seed, share, coders_per_take):
    drawn = draw(seed=seed, share=share, coders_per_take=coders_per_take)
    assert len(drawn) == round(share * 30)
    assert all(len(set(some)) == coders_per_take for some in drawn.values())
    loads = [sum(coder in some for some in drawn.values()) for coder in CODERS]
    assert max(loads) - min(loads) <= 1
    signers = [sum(TAKES[take] == signer for take in drawn) for signer in ("s1", "s2", "s3")]
    assert max(signers) - min(signers) <= 1


def test_the_seed_decides_and_nothing_else():
    assert draw() == draw() == draw(takes=dict(reversed(TAKES.items())))
    assert any(draw(seed=seed) != draw() for seed in range(5))


def test_a_signer_with_more_takes_has_more_drawn():
    takes = {f"a{n}": "a" for n in range(40)} | {f"b{n}": "b" for n in range(10)} | {"c0": None}
    drawn = draw(takes=takes, share=0.2)
    assert sum(take.startswith("a") for take in drawn) == 8
    assert sum(take.startswith("b") for take in drawn) == 2


@given(st.integers(0, 1000), st.integers(1, 20))
def test_what_was_drawn_stays_when_takes_are_added(seed, n_more):
    before = draw(seed=seed)
    more = TAKES | {f"s4_{n}": "s4" for n in range(n_more)}
    after = draw(takes=more, seed=seed, kept=before)
    assert {take: after[take] for take in before} == before
    assert len(after) == max(round(0.4 * len(more)), len(before))


def test_closed_takes_are_not_drawn():
    closed = [take for take in TAKES if take.endswith(("1", "2", "3", "4", "5"))]
    assert not set(draw(closed=closed)) & set(closed)


def test_too_few_takes_or_coders_are_refused():
    with pytest.raises(InputError, match=r"0\.4 of 30 takes are 12, but only 10 can be drawn"):
        draw(closed=list(TAKES)[:20])
    with pytest.raises(InputError, match="expected at least 3 different people, but got ab, cd"):
        draw(coders=("ab", "cd"), coders_per_take=3)
    with pytest.raises(InputError, match="at least 2 different people, but got ab, ab"):
        draw(coders=("ab", "ab"))
    assert draw(share=0, coders=()) == {}


def test_a_share_above_none_is_at_least_one_take():
    assert [count_wanted(share, n) for share, n in ((0, 10), (0.01, 10), (0.5, 10), (1, 3), (0.5, 0))] == [
        0,
        1,
        5,
        3,
        0,
    ]
