"""Test of the contract test: a sound planner passes it, and each rule finds the planners that break it."""

import dataclasses

import pytest
from support import contract_breakers as breakers
from support import two_arms

from mmp_env.model.problem import Problem
from mmp_planners import make
from mmp_planners.testing import RULES, ContractError, check_planner, example_problems

CALLABLE = "it can be called as every planner is"
EASY, VALID, SAME, WATCHED, STOPPED, IN_TIME, HONEST, UNCHANGED, SEEDS, PICKLES = RULES

BREAKERS = {
    breakers.OtherArguments: (CALLABLE, "has plan(self, problem, seed, time_limit), not plan(self, problem, *, seed=0"),
    breakers.GivesUp: (EASY, "'turning' ended with 'exhausted'"),
    breakers.CannotWaitForEver: (EASY, "plan() raised OverflowError"),
    breakers.TooFast: (VALID, "the checker refutes the plan of 'turning': speed"),
    breakers.ElsewhereAtTheEnd: (VALID, "the checker refutes the plan of 'turning': start"),
    breakers.ReturnsWords: (VALID, "the plan is of type str; it must be a Plan"),
    breakers.Moody: (SAME, "seed 0 again gives another plan of 'turning': times, positions differ"),
    breakers.WritesDownTheTime: (SAME, "seed 0 again gives another plan of 'turning': stats differ"),
    breakers.LikesToBeWatched: (WATCHED, "being watched gives another plan of 'turning': times, positions differ"),
    breakers.TellsInWords: (WATCHED, "its watcher gets a str, which is no Event"),
    breakers.LetsThrough: (STOPPED, "plan() lets StopPlanning through; it must return the best so far"),
    breakers.HasTheLastWord: (STOPPED, "its watcher gets a NodeExpanded after it raised StopPlanning"),
    breakers.Forgets: (STOPPED, "stopped after it had emitted a plan, it ended with 'timeout' and none"),
    breakers.Late: (IN_TIME, "s longer than its 0.0 s; allowed: 0.1 s"),
    breakers.FailsWithoutTime: (IN_TIME, "plan() raised ZeroDivisionError"),
    breakers.Cheap: (HONEST, "cost_rad is 0.1, but that of 'turning' is 0.4"),
    breakers.CountsDown: (HONEST, "low_level_calls is -1; it must be a count"),
    breakers.CountsHalves: (HONEST, "root_conflicts is 1.5; it must be a count"),
    breakers.ProvesTooMuch: (HONEST, "min_clearance_m is 1.0, but 'turning' comes as close as"),
    breakers.HasAPlanOfItsOwn: (HONEST, "the statistics cannot be written: a value of type HasAPlanOfItsOwn"),
    breakers.Meddles: (UNCHANGED, "planning changed 'turning'"),
    breakers.TakesAnySeed: (SEEDS, "seed -1 is taken"),
    breakers.FailsAtSeeds: (SEEDS, "seed -1 raised KeyError: -1"),
    breakers.Unpicklable: (PICKLES, "it does not go through pickle"),
    breakers.ForgetsItselfInPickle: (PICKLES, "going through pickle gives another plan of 'turning'"),
}
"""Planner -> the rule that it breaks, and the sentence about it."""


def problems() -> tuple[Problem, ...]:
    """Returns two problems that straight lines solve. The second one reveals state kept between runs."""
    easy = two_arms.one_moves()
    return dataclasses.replace(easy, start=dict(easy.start)), two_arms.turning((1.5, 1.2), (1.0, 1.1))


def test_a_sound_planner_passes_as_a_class_and_as_an_object():
    check_planner(breakers.Sound, problems=problems())
    check_planner(breakers.Sound(), problems=problems())


def test_a_planner_is_tested_by_its_name_with_the_default_problems():
    check_planner("ecbs")
    check_planner(make("ecbs", w=1.2), rules=[SAME])


@pytest.mark.parametrize("kind", BREAKERS, ids=lambda kind: kind.__name__)
def test_a_broken_rule_is_found_and_said_in_one_sentence(kind):
    rule, words = BREAKERS[kind]
    with pytest.raises(ContractError, match=f"planner '{kind.__name__}' breaks its contract") as found:
        check_planner(kind, problems=problems(), grace=0.1 if kind is breakers.Late else 5.0)
    assert words in found.value.broken[rule]
    assert "\n" not in found.value.broken[rule]
    assert f"- {rule}: " in str(found.value)


def test_every_rule_has_a_planner_that_breaks_it():
    assert {rule for rule, _ in BREAKERS.values()} == {CALLABLE, *RULES}


@pytest.mark.parametrize("rule", RULES)
def test_a_planner_that_breaks_one_rule_keeps_the_others(rule):
    breaker = {SAME: breakers.LikesToBeWatched}.get(rule, breakers.TakesAnySeed if rule != SEEDS else breakers.Cheap)
    check_planner(breaker, problems=problems(), rules=[rule])


def test_an_unknown_planner_is_refused_as_unknown():
    with pytest.raises(ContractError, match="unknown planner 'no-such-planner'"):
        check_planner("no-such-planner")


def test_the_default_problems_begin_with_an_easy_one_and_grow():
    easy, pair, four = example_problems()
    assert easy.cost_lower_bound_rad == pytest.approx(0.8)
    assert (len(pair.cell.arms), len(four.cell.arms)) == (2, 4)
