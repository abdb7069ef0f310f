"""What a planner returned, looked at before it is believed: somebody else's may return anything."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from mmp_env.plan import Plan
from mmp_env.plan_file import plan_to_dict
from mmp_env.problem import Problem
from mmp_env.reading import shown
from mmp_env.writing import plain
from mmp_planners.planner import PlanResult, Status

COUNTS = ("expanded_nodes", "generated_nodes", "low_level_calls", "fast_track_tries", "fast_track_hits")
NUMBERS = (*COUNTS, "root_conflicts")
TRUTHS = ("bound_met", "deadline_hit")
"""The statistics that results.jsonl takes from the planner; what else there is may be anything."""


class WrongResultError(Exception):
    """A planner did not return what planners return; the message says what it did."""


def examined(returned: Any, problem: Problem) -> tuple[PlanResult, dict[str, Any] | None]:
    """The result, and its plan as plan.json has it. Raises `WrongResultError`. Whether it is safe the checker knows."""
    status, plan, stats = (getattr(returned, name, dataclasses.MISSING) for name in ("status", "plan", "stats"))
    if dataclasses.MISSING in (status, plan, stats):
        raise WrongResultError(f"plan() returned {_a(returned)}; it must return a PlanResult(status, plan, stats)")
    if not isinstance(status, str) or status not in list(Status):
        raise WrongResultError(f"the status is {shown(status)}; it must be one of {', '.join(Status)}")
    if (plan is not None) != (status == Status.SOLVED):
        raise WrongResultError(f"the status is {status} {'without' if plan is None else 'with'} a plan")
    result = PlanResult(status=Status(status), stats=_checked(stats))
    if plan is None:
        return result, None
    if not isinstance(plan, Plan):
        raise WrongResultError(f"the plan is {_a(plan)}; it must be a Plan")
    _check_shapes(plan, problem)
    # Of the problem that was set: what the planner makes of it is its own affair.
    plan = dataclasses.replace(plan, problem=problem)
    try:
        return dataclasses.replace(result, plan=plan), plan_to_dict(plan)
    except Exception as error:
        raise WrongResultError(f"the plan cannot be written: {type(error).__name__}: {error}") from error


def _checked(stats: Any) -> Mapping[str, Any]:
    if not isinstance(stats, Mapping):
        raise WrongResultError(f"the statistics are {_a(stats)}; they must be a mapping")
    for key in (*NUMBERS, *TRUTHS):
        try:
            value = plain(stats.get(key))
        except TypeError as error:
            raise WrongResultError(f"the statistics hold what is no number: {key} is {_a(stats[key])}") from error
        wanted = bool if key in TRUTHS else int | float
        if value is not None and (not isinstance(value, wanted) or (key in NUMBERS and isinstance(value, bool))):
            raise WrongResultError(f"{key} is {shown(value)}; it must be {'a number' if key in NUMBERS else 'a bool'}")
    return stats


def _check_shapes(plan: Plan, problem: Problem) -> None:
    times = _shape(plan.times)
    if len(times) != 1 or not times[0]:
        raise WrongResultError(f"the plan's times have the shape {list(times)}; they must be a list of seconds")
    for arm in problem.cell.arms:
        if not isinstance(plan.positions, Mapping) or arm.name not in plan.positions:
            raise WrongResultError(f"the plan has no positions of arm '{arm.name}'")
        shape, expected = _shape(plan.positions[arm.name]), (*times, arm.dof)
        if shape != expected:
            raise WrongResultError(
                f"the positions of arm '{arm.name}' have the shape {list(shape)}, not {list(expected)}"
            )


def _shape(numbers: Any) -> tuple[int, ...]:
    try:
        return np.asarray(numbers, dtype=float).shape
    except (TypeError, ValueError):
        raise WrongResultError(f"the plan holds {shown(numbers)} where numbers are wanted") from None


def _a(value: object) -> str:
    return "nothing (None)" if value is None else f"of type {type(value).__name__}"
