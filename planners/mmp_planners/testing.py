"""The contract that every planner keeps, as a test for anybody's planner.

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
from mmp_env.model.problem import Problem, make_problem
from mmp_env.model.rings import ring_cell
from mmp_planners import registry
from mmp_planners.contract import RULES, BrokenError, Rule, Subject

__all__ = ["RULES", "ContractError", "check_planner", "example_problems"]


class ContractError(AssertionError):
    """A planner breaks its contract: `broken` has a sentence for each rule that it breaks."""

    def __init__(self, planner: str, broken: Mapping[str, str]) -> None:
        lines = "".join(f"\n- {rule}: {sentence}" for rule, sentence in broken.items())
        super().__init__(f"planner '{planner}' breaks its contract{lines}")
        self.planner, self.broken = planner, dict(broken)


def example_problems() -> tuple[Problem, ...]:
    """What planners are tested with: two UR5e that turn a little, two in each other's way, and four."""
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
    """Puts a planner, by name, class or as an object, through every rule of `RULES`, or through some.

    The first of `problems` must be one that it is sure to solve, and soon; the others it may fail on, in `time_limit`
    [s] each. A run may overstep its time limit by `grace` [s], which leaves room for a busy machine. Raises
    `ContractError` with a sentence for each rule that is broken.
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
    """What breaks the rule first, if anything does."""
    try:
        return [sentence for _, sentence in zip(range(1), rule(subject), strict=False)]
    except BrokenError as error:
        return [str(error)]
