"""Validates and copies what a planner returned, because planners of other packages may return anything."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from mmp_env.errors import in_words
from mmp_env.files.plan_file import plan_to_dict
from mmp_env.files.writing import plain
from mmp_env.model.plan import Plan
from mmp_env.model.problem import Problem
from mmp_env.model.robot import frozen_array
from mmp_env.wording import shown
from mmp_planners.goal_choice import ending_at
from mmp_planners.planner import PlanResult, Status, StopPlanning

COUNTS = ("expanded_nodes", "generated_nodes", "low_level_calls", "fast_track_tries", "fast_track_hits")
NUMBERS = (*COUNTS, "root_conflicts")
TRUTHS = ("bound_met", "deadline_hit")
"""Statistics that results.jsonl takes from the planner: counts, numbers and truth values. Others may be anything."""


class WrongResultError(Exception):
    """Raised if a planner did not return a valid result; the message says what is wrong."""


def validate_result(returned: Any, problem: Problem) -> tuple[PlanResult, dict[str, Any] | None]:
    """Validates the form of a result. The checker, not this function, tells whether the plan is safe.

    Returns:
        The result with a copy of the plan, for `problem`, and the plan as plan.json has it, if there is a plan.

    Raises:
        WrongResultError: if the planner returned something else.
    """
    try:
        return _validate_result(returned, problem)
    except (WrongResultError, StopPlanning, KeyboardInterrupt):
        raise
    except BaseException as error:  # another package's properties, mappings and arrays may raise anything
        raise WrongResultError(f"what plan() returned cannot be read: {in_words(error)}") from error


def _validate_result(returned: Any, problem: Problem) -> tuple[PlanResult, dict[str, Any] | None]:
    status, plan, stats = (getattr(returned, name, dataclasses.MISSING) for name in ("status", "plan", "stats"))
    if dataclasses.MISSING in (status, plan, stats):
        raise WrongResultError(f"plan() returned {_a(returned)}; it must return a PlanResult(status, plan, stats)")
    if not isinstance(status, str) or status not in list(Status):
        raise WrongResultError(f"the status is {shown(status)}; it must be one of {', '.join(Status)}")
    if (plan is not None) != (status == Status.SOLVED):
        raise WrongResultError(f"the status is {status} {'without' if plan is None else 'with'} a plan")
    result = PlanResult(status=Status(status), stats=dict(_checked(stats)))
    if plan is None:
        return result, None
    if not isinstance(plan, Plan):
        raise WrongResultError(f"the plan is {_a(plan)}; it must be a Plan")
    plan = _snapshot(plan, problem)
    try:
        return dataclasses.replace(result, plan=plan), plan_to_dict(plan)
    except Exception as error:
        raise WrongResultError(f"the plan cannot be written: {in_words(error)}") from error


def _snapshot(plan: Plan, problem: Problem) -> Plan:
    """Returns a copy of the plan for the problem. Raises `WrongResultError`."""
    times = _numbers(plan.times)
    if times.ndim != 1 or not len(times):
        raise WrongResultError(f"the plan's times have the shape {list(times.shape)}; they must be a list of seconds")
    positions = _by_arm(plan.positions) or {}
    for arm in problem.cell.arms:
        if arm.name not in positions:
            raise WrongResultError(f"the plan has no positions of arm '{arm.name}'")
        shape, expected = positions[arm.name].shape, (*times.shape, arm.dof)
        if shape != expected:
            raise WrongResultError(
                f"the positions of arm '{arm.name}' have the shape {list(shape)}, not {list(expected)}"
            )
    return Plan(
        problem=ending_at(problem, positions),
        times=times,
        positions=positions,
        planner=_signature(plan.planner),
        stats=_words("the statistics of the plan", plan.stats),
        velocities=_by_arm(plan.velocities),
        accelerations=_by_arm(plan.accelerations),
        max_acceleration=_by_arm(plan.max_acceleration),
        max_jerk=_by_arm(plan.max_jerk),
    )


def _signature(planner: Any) -> dict[str, Any]:
    """Returns a copy of the plan's name, options and seed of its planner. Raises `WrongResultError`."""
    out = _words("the planner of the plan", planner)
    if not isinstance(out.get("name", ""), str):
        raise WrongResultError(f"the planner of the plan has the name {shown(out['name'])}; it must be text")
    if not isinstance(out.get("options", {}), dict):
        raise WrongResultError(
            f"the planner of the plan has the options {shown(out['options'])}; they must be a mapping"
        )
    return out


def _words(what: str, value: Any) -> dict[str, Any]:
    """Returns a mapping as JSON values. Raises `WrongResultError`."""
    if not isinstance(value, Mapping):
        raise WrongResultError(f"{what} is {_a(value)}; it must be a mapping")
    try:
        return plain(value)
    except TypeError as error:
        raise WrongResultError(f"the plan cannot be written: {what} holds {error}") from error


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


def _by_arm(values: Any) -> dict[str, np.ndarray] | None:
    """Returns a copy of arm -> numbers; None stays None. Raises `WrongResultError`."""
    if values is None:
        return None
    if not isinstance(values, Mapping):
        raise WrongResultError(f"the plan's numbers are {_a(values)}; they must be a mapping, arm -> numbers")
    return {str(name): _numbers(rows) for name, rows in values.items()}


def _numbers(given: Any) -> np.ndarray:
    """Returns the finite numbers as a read-only array of floats. Raises `WrongResultError`, for the text '0.5' too."""
    try:
        array = np.asarray(given)
    except ValueError:  # rows of different lengths
        array = None
    if array is None or array.dtype.kind not in "iuf":
        raise WrongResultError(f"the plan holds {shown(given)} where numbers are wanted")
    if not np.isfinite(array).all():
        raise WrongResultError(f"the plan holds {array[~np.isfinite(array)][0]} where finite numbers are wanted")
    return frozen_array(array)


def _a(value: object) -> str:
    return "nothing (None)" if value is None else f"of type {type(value).__name__}"
