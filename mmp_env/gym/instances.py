"""Instances by seed: what `env.reset(seed=...)` draws, for programs that need no environment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mmp_env.argument_checks import known_keywords, whole
from mmp_env.brief import brief
from mmp_env.errors import MmpError
from mmp_env.model.cell import Cell, given_cell
from mmp_env.model.margins import Margins
from mmp_env.model.problem import DEFAULT_MAX_VELOCITY, Problem, make_problem
from mmp_env.model.task import State, Task
from mmp_env.plugins import TASKS
from mmp_env.wording import counted

DEFAULT_TASK = "reach"


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn:
    """Start and goal, arm name -> [dof] [rad], and the cell with what a task has put into it, or given arms to hold."""

    start: State
    goal: State
    cell: Cell

    @brief
    def __repr__(self) -> str:
        return f"start and goal of {counted(len(self.start), 'arm')} in cell {self.cell.name}"


def draw(cell: Cell, task: Task, rng: np.random.Generator) -> Drawn:
    """What a task draws in a cell. Raises `MmpError` for a cell without room, and a task that draws something else."""
    sample = task.sample(given_cell(cell), rng)
    whose = f"task {type(task).__name__}"
    if not (isinstance(sample, tuple) and len(sample) in (2, 3)):
        kind = type(sample).__name__
        raise MmpError(f"{whose} gives a {kind}; sample must give (start, goal) or (start, goal, cell)")
    start, goal, *changed = sample
    meant = changed[0] if changed else cell
    if not isinstance(meant, Cell) or meant.arm_names != cell.arm_names:
        raise MmpError(f"{whose} has drawn another cell without the arms of '{cell.name}'; they must stay as they are")
    for which, state in (("start", start), ("goal", goal)):
        for arm in cell.arms:
            q = state.get(arm.name, ())
            if np.shape(q) != (arm.dof,) or not np.isfinite(q).all():
                raise MmpError(f"{whose} has drawn a {which} that is not {arm.dof} finite numbers for arm '{arm.name}'")
    return Drawn(start=start, goal=goal, cell=meant)


@known_keywords
def draw_problem(
    cell: Cell,
    task: str | Task = DEFAULT_TASK,
    seed: int = 0,
    *,
    max_velocity: float | Mapping[str, ArrayLike] = DEFAULT_MAX_VELOCITY,
    margin: float | Mapping[str, float] | Margins | None = None,
    name: str = "",
) -> Problem:
    """The problem of `env.reset(seed=seed)` in an environment of this cell, with the objects of the task in it.

    Raises `MmpError` as `draw_instance` does, and `InvalidInstanceError` where a task is at fault.
    """
    drawn = draw(cell, find_task(task), _generator(seed))
    return make_problem(drawn.cell, drawn.start, drawn.goal, max_velocity=max_velocity, margin=margin, name=name)


def draw_instance(cell: Cell, task: str | Task = DEFAULT_TASK, seed: int = 0) -> tuple[State, State]:
    """Start and goal, arm name -> [dof] [rad]: the instance of `env.reset(seed=seed)` in an environment of this cell.

    Raises `MmpError` for an unknown task, a seed that is not a whole number from 0, a cell without room, or a task that
    changes the cell, for which start and goal alone say too little.
    """
    drawn = draw(cell, find_task(task), _generator(seed))
    if drawn.cell is not cell:
        raise MmpError(f"task '{task}' puts objects into cell '{cell.name}'; draw_problem gives start, goal and cell")
    return drawn.start, drawn.goal


def _generator(seed: int) -> np.random.Generator:
    checked = whole("seed", seed, 0)
    from gymnasium.utils.seeding import np_random

    return np_random(checked)[0]


def find_task(task: str | Task) -> Task:
    """The task of that name with its default options, or the given one itself.

    Raises `UnknownNameError`, and `MmpError` for what is neither a name nor a task.
    """
    if isinstance(task, str):
        task = TASKS.load(task)()
    if isinstance(task, type) or not isinstance(task, Task):
        raise MmpError(f"task is {task!r}; it must be a name (`mmp list`) or an object with a method sample(cell, rng)")
    return task
