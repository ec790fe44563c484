"""Scatter and mistakes drawn from known distributions must be told apart; witnesses weighed by their variances."""

import numpy as np
import pytest
from mimique import InputError
from mimique.models.mistakes.odd_borders import combine_witnesses, probability_of_mistake, score_by_cut


def test_planted_mistakes_are_told_from_scatter(rng: np.random.Generator) -> None:
    usual = rng.uniform(0.02, 0.06, 1000)
    away = usual * rng.standard_normal(1000)
    wrong = np.arange(1000) < 30
    away[wrong] = rng.uniform(0.3, 0.7, 30) * rng.choice([-1, 1], 30)
    p = probability_of_mistake(away, usual)
    assert p[wrong].min() > 0.5
    assert (p[~wrong] > 0.5).sum() <= 2
    assert (p[np.abs(away) < 0.1] == 0).all()


def test_scatter_alone_has_no_mistakes(rng: np.random.Generator) -> None:
    p = probability_of_mistake(0.05 * rng.standard_normal(800), np.full(800, 0.034))
    assert p.max() < 0.5


def test_groups_are_fitted_apart(rng: np.random.Generator) -> None:
    groups = np.repeat(["still", "restless"], 400)
    away = np.where(groups == "still", 0.03, 0.3) * rng.standard_normal(800)
    away[0] = 0.4
    usual = np.full(800, 0.05)
    apart, together = probability_of_mistake(away, usual, groups), probability_of_mistake(away, usual)
    assert apart[0] > 0.9 > together[0]
    assert (apart[400:] > 0.5).mean() < 0.03


def test_cut_is_where_the_expected_f1_is_greatest() -> None:
    p = np.array([0.9, 0.8, 0.45, 0.3, 0.05, np.nan])
    known = p[:-1]
    best = max(range(1, 6), key=lambda k: 2 * known[:k].sum() / (k + known.sum()))
    scores = score_by_cut(p)
    assert (scores[:-1] >= 0.5 - 1e-12).sum() == best
    assert np.isnan(scores[-1])
    assert np.array_equal(np.argsort(scores[:-1]), np.argsort(known))


def test_the_surer_witness_counts_for_more(rng: np.random.Generator) -> None:
    truth = rng.uniform(0, 100, 3000)
    given, machine, other = (truth + spread * rng.standard_normal(3000) for spread in (0.06, 0.03, 0.09))
    usual = np.full(3000, np.median(np.abs(given - machine)))
    found = combine_witnesses(given, machine, usual, other)
    error = (found.fitted - truth).std()
    assert error < (machine - truth).std()
    assert error == pytest.approx(1 / np.sqrt(1 / 0.03**2 + 1 / 0.09**2), rel=0.1)


def test_who_is_silent_is_no_witness() -> None:
    machine, usual = np.array([1.0, 2.0]), np.array([0.1, 0.1])
    found = combine_witnesses([1.0, 2.0], machine, usual, [np.nan, np.nan])
    assert np.array_equal(found.fitted, machine)
    assert np.isnan(probability_of_mistake([0.5, 0.0], usual)).all()
    with pytest.raises(InputError, match="above 0"):
        probability_of_mistake([0.5], [0.0])
