"""The contract of planners as a test for planners of any package.

from mmp_planners.testing import check_planner

def test_my_planner_keeps_the_contract():
    check_planner("my-planner")
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mmp_env.errors import MmpError
from mmp_env.gym.instances import draw_instance
from mmp_env.model.problem import Problem
from mmp_env.model.rings import ring_cell
from mmp_env.problems.making import make_problem
from mmp_planners import registry
from mmp_planners.contract import RULES, BrokenError, Rule, Subject

__all__ = ["RULES", "ContractError", "check_planner", "example_problems"]


class ContractError(AssertionError):
    """Raised if a planner breaks its contract: `broken` has a sentence for each broken rule."""

    def __init__(self, planner: str, broken: Mapping[str, str]) -> None:
        lines = "".join(f"\n- {rule}: {sentence}" for rule, sentence in broken.items())
        super().__init__(f"planner '{planner}' breaks its contract{lines}")
        self.planner, self.broken = planner, dict(broken)


def example_problems() -> tuple[Problem, ...]:
    """Returns the default problems: two UR5e that turn a little, two that cross, and four."""
    pair, four = ring_cell(2), ring_cell(4)
    tucked = {arm.name: arm.robot.tucked for arm in pair.arms}
    turned = {name: q + np.eye(len(q))[0] * 0.4 for name, q in tucked.items()}
    easy = make_problem(pair, tucked, turned, name="two arms that turn a little")
    crossing = make_problem(pair, *draw_instance(pair, seed=3), name="MultiArmCell-2/3")
    return easy, crossing, make_problem(four, *draw_instance(four, seed=2), name="MultiArmCell-4/2")


def check_planner(
    planner: Any,
    *,
    problems: Iterable[Problem] | None = None,
    time_limit: float = 10.0,
    grace: float = 5.0,
    rules: Iterable[str] | None = None,
) -> None:
    """Tests whether a planner keeps the rules of `RULES`.

    Args:
        planner: name, class or object of the planner.
        problems: problems to plan. The planner must solve the first one soon; it may fail on the others.
        time_limit: time limit of a run [s].
        grace: time by which a run may exceed its limit [s]; it leaves room for a busy machine.
        rules: names of the rules to test; all by default.

    Raises:
        ContractError: if the planner breaks a rule, with a sentence for each broken rule.
    """
    name = planner if isinstance(planner, str) else (planner if isinstance(planner, type) else type(planner)).__name__
    try:
        made = registry.make(planner) if isinstance(planner, str) else planner
        fault = registry.signature_fault(made if isinstance(made, type) else type(made))
    except MmpError as error:
        fault, made = str(error), None
    if fault:
        raise ContractError(name, {"it can be called as every planner is": fault})
    make = made if isinstance(made, type) else lambda: registry.make(planner) if isinstance(planner, str) else planner
    chosen = example_problems() if problems is None else tuple(problems)
    subject = Subject(make=make, problems=chosen, time_limit=time_limit, grace=grace)
    broken = {rule: fault for rule in rules or RULES for fault in _first(RULES[rule], subject)}
    if broken:
        raise ContractError(name, broken)


def _first(rule: Rule, subject: Subject) -> list[str]:
    """Returns the first violation of a rule, if there is one."""
    try:
        return [sentence for _, sentence in zip(range(1), rule(subject), strict=False)]
    except BrokenError as error:
        return [str(error)]
