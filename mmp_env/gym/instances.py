"""Instances by seed, the same as those of `env.reset(seed=...)`, for programs without an environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from mmp_env.argument_checks import known_keywords, whole
from mmp_env.errors import MmpError
from mmp_env.model.arm import Arm
from mmp_env.model.cell import Cell, given_cell
from mmp_env.model.goals import Goal, as_goal
from mmp_env.model.keep import GivenKeep
from mmp_env.model.margins import Margins
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem
from mmp_env.model.task import Asked, State, Task
from mmp_env.plugins import TASKS
from mmp_env.problems.making import make_problem

DEFAULT_TASK = "reach"


def draw(cell: Cell, task: Task, rng: np.random.Generator) -> tuple[Asked, Asked, Cell]:
    """Returns start, goal and cell that a task draws. Raises `MmpError` if it finds none, or breaks its contract."""
    sample = task.sample(given_cell(cell), rng)
    whose = f"task {type(task).__name__}"
    if not (isinstance(sample, tuple) and len(sample) in (2, 3)):
        kind = type(sample).__name__
        raise MmpError(f"{whose} gives a {kind}; sample must give (start, goal) or (start, goal, cell)")
    start, goal, *changed = sample
    meant = changed[0] if changed else cell
    if not isinstance(meant, Cell) or meant.arm_names != cell.arm_names:
        raise MmpError(f"{whose} has drawn another cell without the arms of '{cell.name}'; they must stay as they are")
    for which, asked in (("start", start), ("goal", goal)):
        for arm in cell.arms:
            _check_asked(arm, asked.get(arm.name, ()), f"{whose} has drawn a {which}")
    return start, goal, meant


def are_configurations(asked: Asked) -> bool:
    """Returns whether every arm is asked for a configuration, and not for another goal."""
    return not any(isinstance(each, Goal | str | Mapping) for each in asked.values())


def _check_asked(arm: Arm, asked: Any, drawn: str) -> None:
    """Raises `MmpError` unless an arm is asked for a goal, or for a configuration of all its joints."""
    if isinstance(asked, Goal | str | Mapping):
        as_goal(asked, f"{drawn}: arm '{arm.name}'")
    elif np.shape(asked) != (arm.dof,) or not np.isfinite(asked).all():
        raise MmpError(f"{drawn} that is not {arm.dof} finite numbers for arm '{arm.name}'")


@known_keywords
def draw_problem(
    cell: Cell,
    task: str | Task = DEFAULT_TASK,
    seed: int = 0,
    *,
    max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
    margin: float | Mapping[str, float] | Margins | None = None,
    name: str = "",
    keep: GivenKeep | None = None,
) -> Problem:
    """Returns the problem of `env.reset(seed=seed)` in an environment of this cell, with the objects of the task.

    Start and goal are the same for every `margin` and `max_velocity`.

    Args:
        cell: the cell without the objects of any task.
        task: the task that draws, or its name.
        seed: a whole number from 0.
        max_velocity: for all joints, or arm name -> a number or [dof] [rad/s].
        margin: metres between arms and to obstacles; or a mapping with any of `arms`, `obstacles`, `self`.
        name: name of the problem.
        keep: bounds of tool axes, as in `make_problem`. The task does not know them.

    Raises:
        MmpError: for an unknown task or a bad value, or if the task finds no instance.
        InvalidInstanceError: if start or goal is closer than a margin that was asked for, or breaks the bound of a tool
            axis.
    """
    start, goal, changed = draw(cell, find_task(task), _generator(seed))
    return make_problem(changed, start, goal, max_velocity=max_velocity, margin=margin, name=name, keep=keep)


def draw_instance(cell: Cell, task: str | Task = DEFAULT_TASK, seed: int = 0) -> tuple[State, State]:
    """Returns start and goal of `env.reset(seed=seed)` in an environment of this cell, arm name -> [dof] [rad].

    Args:
        cell: the cell without the objects of any task.
        task: the task that draws, or its name. If it changes the cell or draws tool poses, use `draw_problem`.
        seed: a whole number from 0.

    Raises:
        MmpError: for an unknown task, a bad seed, or a task that changes the cell, draws poses or finds no instance.
    """
    start, goal, changed = draw(cell, find_task(task), _generator(seed))
    if changed is not cell:
        raise MmpError(f"task '{task}' puts objects into cell '{cell.name}'; draw_problem gives start, goal and cell")
    if not (are_configurations(start) and are_configurations(goal)):
        raise MmpError(f"task '{task}' draws goals that are no configurations; draw_problem gives the problem")
    return cast(State, start), cast(State, goal)


def _generator(seed: int) -> np.random.Generator:
    checked = whole("seed", seed, 0)
    from gymnasium.utils.seeding import np_random

    return np_random(checked)[0]


def find_task(task: str | Task) -> Task:
    """Returns the task of that name with its default options, or the task itself.

    Raises `UnknownNameError` for an unknown name, and `MmpError` for anything that is neither a name nor a task.
    """
    if isinstance(task, str):
        task = TASKS.load(task)()
    if isinstance(task, type) or not isinstance(task, Task):
        raise MmpError(f"task is {task!r}; it must be a name (`mmp list`) or an object with a method sample(cell, rng)")
    return task
