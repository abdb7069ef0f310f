"""Options of planners, and the checks of arguments that every planner begins with."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from mmp_env.argument_checks import given, number, whole
from mmp_env.errors import MmpError, UnknownNameError
from mmp_env.model.problem import Problem
from mmp_env.wording import shown

GRID_STEP_S = 0.1
"""Default step of the time grid [s]."""
LARGEST_SEED = 2**63 - 1
"""Upper bound of seeds: 63 bits."""
LARGEST_NUMBER = 10**8
"""Upper bound of options. The native core refuses larger numbers, and its counters overflow."""
MOST_STEPS = 10_000
"""Upper bound of the grid steps of an arm's straight path. More means a mistake in the units."""
LONGEST_STEP_RAD = 1e4
"""Upper bound of a joint's move [rad or m] in a grid step. The native core refuses longer steps."""


def option(
    default: Any,
    doc: str,
    *,
    positive: bool = False,
    least: float | None = None,
    most: float = LARGEST_NUMBER,
    choices: tuple[str, ...] = (),
) -> Any:
    """Returns a dataclass field for a planner's option.

    Args:
        default: default value.
        doc: documentation, for `mmp list` and the docs.
        positive: whether the value must be positive.
        least: least value.
        most: largest value.
        choices: allowed values, for text.
    """
    positive = positive or (least is not None and least > 0)
    metadata = {"doc": doc, "positive": positive, "least": least, "most": most, "choices": choices}
    return dataclasses.field(default=default, metadata=metadata)


def check_options(planner: Any) -> None:
    """Raises `MmpError` if an option has a value that its field does not allow."""
    for f in dataclasses.fields(planner):
        value = getattr(planner, f.name)
        if f.metadata.get("choices") and value not in f.metadata["choices"]:
            raise UnknownNameError(f"value of option '{f.name}'", value, f.metadata["choices"])
        if f.metadata.get("positive") and not 0 < value < math.inf:
            raise MmpError(f"option '{f.name}' is {shown(value)}; it must be a positive number")
        most = f.metadata.get("most", LARGEST_NUMBER)
        if isinstance(value, int | float) and not value <= most:
            raise MmpError(f"option '{f.name}' is {shown(value)}; it must be {most} at most")
        least = f.metadata.get("least")
        if least is not None and not value >= least:
            raise MmpError(f"option '{f.name}' is {shown(value)}; it must be {least} at least")


def check_steps(problem: Problem, dt: float) -> None:
    """Raises `MmpError` if a straight path of an arm to a goal has more than `MOST_STEPS` steps of `dt` [s].

    A step longer than `LONGEST_STEP_RAD` is an error, too. The path counts as 1 rad at least, because an arm that
    hardly moves may have to avoid another one.
    """
    if problem.single_goals:  # all arms at once, which takes less time
        v_max, distance = problem.joint_max_velocity, np.abs(problem.joint_goal - problem.joint_start)
        if v_max.max() * dt <= LONGEST_STEP_RAD and (np.maximum(distance, 1.0) <= MOST_STEPS * dt * v_max).all():
            return
    for name, v_max in problem.max_velocity.items():
        distance = np.maximum(np.abs(problem.goals[name] - problem.start[name]).max(axis=0), 1.0)
        with np.errstate(over="ignore", divide="ignore"):  # a robot's own limit may be tiny
            steps = float((distance / (v_max * dt)).max())
        if steps > MOST_STEPS:
            raise MmpError(
                f"arm '{name}' needs {steps:.3g} steps of dt {dt} s to its goal, or for 1 rad; allowed: {MOST_STEPS}. "
                "dt is too short or max_velocity too low"
            )
        longest = float(np.max(v_max) * dt)
        if longest > LONGEST_STEP_RAD:
            raise MmpError(
                f"arm '{name}' moves {longest:.3g} rad in a step of dt {dt} s; allowed: {LONGEST_STEP_RAD:g}. "
                "dt is too long or max_velocity too high"
            )


def check_run(problem: Problem, seed: int, time_limit: float) -> tuple[int, float]:
    """Returns seed and time limit [s]. Raises `MmpError` for a wrong problem, seed or time limit."""
    given("problem", problem, Problem, "a Problem, such as make_problem, draw_problem or env.unwrapped.problem gives")
    allowed = "a number of seconds, 0 or more, inf for none"
    return whole("seed", seed, 0, LARGEST_SEED), number("time_limit", time_limit, allowed, zero=True, infinite=True)
