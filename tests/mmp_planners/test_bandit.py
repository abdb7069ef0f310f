"""Dynamic Thompson Sampling: it draws the choice that pays, and forgets old outcomes."""

import numpy as np
import pytest

from mmp_planners.conflict_tree.bandit import DynamicThompsonSampling


def bandit(choices=3, seed=0, **options):
    return DynamicThompsonSampling(choices, np.random.default_rng(seed), **options)


def test_every_choice_begins_with_beta_one_two():
    made = bandit()
    assert (made.alpha.tolist(), made.beta.tolist()) == ([1, 1, 1], [2, 2, 2])
    assert {made.draw() for _ in range(50)} == {0, 1, 2}


def test_an_outcome_counts_for_its_choice_alone():
    made = bandit()
    made.learn(1, True)
    made.learn(2, False)
    assert (made.alpha.tolist(), made.beta.tolist()) == ([1, 2, 1], [2, 2, 3])


def test_from_ten_outcomes_on_the_old_ones_fade():
    made = bandit(choices=1)
    for _ in range(7):
        made.learn(0, True)
    assert (made.alpha[0], made.beta[0]) == (8, 2)
    made.learn(0, False)
    assert (made.alpha[0], made.beta[0]) == (pytest.approx(80 / 11), pytest.approx(30 / 11))
    for _ in range(100):
        made.learn(0, False)
        assert made.alpha[0] + made.beta[0] == pytest.approx(10)
    assert made.alpha[0] < 0.01


def test_the_paying_choice_is_drawn_most_and_changes_with_the_payoff():
    made = bandit()
    for paying in (1, 2):
        drawn = []
        for _ in range(300):
            choice = made.draw()
            drawn.append(choice)
            made.learn(choice, choice == paying)
        assert drawn[100:].count(paying) > 150


def test_the_same_seed_draws_the_same():
    draws = [[made.draw() for _ in range(20)] for made in (bandit(seed=1), bandit(seed=1), bandit(seed=2))]
    assert draws[0] == draws[1] != draws[2]
